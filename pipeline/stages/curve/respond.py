"""The curve of one member of a sweep: found in the store, or solved by a task.

Worker processes are as many as the expected work is worth; curves that take longest begin first.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.executor.task import Progress, Task
from pipeline.scene.contact_section import mean_of
from pipeline.scene.labels import member_label, prefixed
from pipeline.scene.reading import Member
from pipeline.scene.schema import Scene
from pipeline.stages.curve.curve_file import CURVE
from pipeline.stages.curve.curve_summary import CurveSummary, kept_summary
from pipeline.stages.curve.solve_curve import solve_curve
from pipeline.store.content_store import Store

_WORTH = 1.0  # seconds of work above which processes pay, which start while the reduced model is built
_MOST = 16  # each needs some 200 MB
_AUTO = 7  # harmonics assumed for "auto"
_GAP = 5.0  # a gap so many times as large takes as long as an interference
_EXTRAS = 3.0  # times as long with stability, detached branches and the truncation error


def worker_count(jobs: int | None, scenes: Sequence[Scene]) -> int:
    """Processes for a curve of each scene: `jobs`, or with None one for each core if the work is worth it."""
    if jobs is None:
        worth_it = sum(_expected(scene) for scene in scenes) > _WORTH
        jobs = min(_cores(), _MOST) if worth_it else 1
    return max(1, min(jobs, len(scenes)))


def longest_first(scene: Scene) -> tuple[float, float]:
    """Sort key of curves: those that take longest come first, so that no process is left with one at the end.

    Contacts near the transition from gap to interference take longest: they stick, slip and open. Those with a gap
    open up to gaps as large as the vibration, those with an interference stick soon.
    """
    means = []
    for interference in (face.interference for face in scene.contacts.values()):
        values = interference if isinstance(interference, tuple) else (mean_of(interference),)
        means.append(sum(values) / len(values))
    mean = sum(means) / len(means)
    return -_expected(scene), mean if mean >= 0.0 else -mean / _GAP


def _expected(scene: Scene) -> float:
    """Estimated seconds for a curve of this scene, within a factor of about three."""
    response = scene.response
    number = _AUTO if isinstance(response.harmonics, str) else response.harmonics
    faces = scene.contact.interfaces or scene.interfaces or ("",)
    nodes = 9 if scene.mesh is None else math.prod(scene.mesh.contact_grid) * len(faces)
    extras = _EXTRAS if response.stability != "folds" or response.detached else 1.0
    return 0.07 * extras * number**1.7 * (nodes / 9.0) ** 2


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
    shorter: tuple[str, ...] = ()  # keys of the same curve with shorter searches for the worst motion, longest first
    base: Path | None = None  # file of the curve with a shorter search, in place of one of these


def stored_curve(store: Store, item: CurveJob) -> CurveResult | None:
    """The curve in the store; None where it is not there."""
    entry = store.find(KIND, item.key)
    return None if entry is None else result_from_file(item, entry.file(CURVE))


def result_from_file(item: CurveJob, file: Path, ran: bool = False) -> CurveResult:
    """The curve in a file of the store."""
    facts = kept_summary(file)
    return CurveResult(item.member, item.rom, file, facts, facts.reason, ran)


def curve_task(store: Store, item: CurveJob) -> Task:
    """The task that solves a curve, or searches on where the store has it with a shorter search."""
    member, files = item.member, {"rom": item.rom}
    entry = next(filter(None, (store.find(KIND, key) for key in item.shorter)), None)
    base = item.base if entry is None else entry.file(CURVE)
    files |= {} if base is None else {"base": base}
    arguments = member.scene, dict(member.parameters)
    return Task(member_label(member), _solve, files, arguments, (0.0, *longest_first(member.scene)))


def curve_line(found: CurveResult) -> str:
    """What to say of a curve that has been solved."""
    facts = found.facts
    assert facts is not None
    name = "end of the range" if facts.peak_at_end else "peak"
    factor, unit = prefixed(facts.peak_amplitude_m, "m")
    peak = f"{name} {facts.peak_amplitude_m * factor:.4g} {unit} at {facts.peak_frequency_hz:.6g} Hz"
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
    solve_curve(folder, files["rom"], scene, parameters, progress, files.get("base"))
