"""The curve of one member of a sweep: found in the store, or solved by a task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.executor.task import Progress, Task
from pipeline.scene.labels import member_label
from pipeline.scene.reading import Member
from pipeline.scene.schema import Scene
from pipeline.stages.curve_file import CURVE
from pipeline.stages.curve_summary import CurveSummary, kept_summary
from pipeline.stages.solve_curve import solve_curve
from pipeline.stages.worker_count import longest_first
from pipeline.store.content_store import Store

KIND = "curve"


@dataclass(frozen=True)
class CurveResult:
    """The curve of one member of a sweep."""

    member: Member  # the member
    rom: Path | None  # file of its reduced model; None where that could not be made
    file: Path | None  # file of the curve in the store; None where it could not be solved
    facts: CurveSummary | None  # its summary
    reason: str  # how the curve ended, or why there is none
    ran: bool = False  # whether it was computed in this run
    # neighbouring members of the sweep whose branches were carried to it, by their labels
    carried_from: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether the whole frequency range was covered."""
        return self.facts is not None and self.facts.complete


@dataclass(frozen=True)
class CurveJob:
    """A curve to solve, or to find in the store."""

    member: Member  # the first member that asks for it
    key: str  # its key in the store
    rom: Path  # file of its reduced model


def stored_curve(store: Store, item: CurveJob) -> CurveResult | None:
    """The curve in the store; None where it is not there."""
    entry = store.find(KIND, item.key)
    return None if entry is None else result_from_file(item, entry.file(CURVE))


def result_from_file(item: CurveJob, file: Path, ran: bool = False) -> CurveResult:
    """The curve in a file of the store."""
    facts = kept_summary(file)
    return CurveResult(item.member, item.rom, file, facts, facts.reason, ran)


def curve_task(item: CurveJob) -> Task:
    """The task that solves a curve."""
    member, files = item.member, {"rom": item.rom}
    arguments = member.scene, dict(member.parameters)
    return Task(member_label(member), _solve, files, arguments, (0.0, *longest_first(member.scene)))


def curve_line(found: CurveResult) -> str:
    """What to say of a curve that has been solved."""
    facts = found.facts
    assert facts is not None
    name = "end of the range" if facts.peak_at_end else "peak"
    peak = f"{name} {facts.peak_frequency_hz:.6g} Hz {facts.peak_amplitude_m:.4g} m"
    return f"{peak}, {facts.points} points, {facts.seconds:.2f} s" + (
        "" if facts.complete else f" (incomplete: {facts.reason})"
    )


def _solve(
    folder: Path,
    files: Mapping[str, Path],
    scene: Scene,
    parameters: Mapping[str, Any],
    progress: Progress | None = None,
) -> None:
    solve_curve(folder, files["rom"], scene, parameters, progress)
