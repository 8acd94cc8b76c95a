"""Solution of the curves of a sweep, here or in worker processes; each is stored as soon as it is solved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pipeline.errors import reason_of
from pipeline.process.counted_calls import CountedCalls, Work
from pipeline.process.progress import Reporter
from pipeline.scene.labels import member_label
from pipeline.scene.reading import Member
from pipeline.stages.curve_file import CURVE
from pipeline.stages.curve_summary import CurveSummary, kept_summary
from pipeline.stages.solve_curve import Progress, solve_curve
from pipeline.stages.worker_count import longest_first, worker_count
from pipeline.store.content_store import Store
from pipeline.store.disk_errors import StorageError

KIND = "curve"


@dataclass(frozen=True)
class CurveResult:
    """The curve of one member of a sweep.

    Attributes
    ----------
    member : Member
        The member.
    rom : Path or None
        File of its reduced model; None where that could not be made.
    file : Path or None
        File of the curve in the store; None where it could not be solved.
    facts : CurveSummary or None
        Its summary.
    reason : str
        How the curve ended, or why there is none.
    ran : bool
        Whether it was computed in this run.
    carried_from : tuple of str
        Neighbouring members of the sweep whose branches were carried to it, by their labels.
    """

    member: Member
    rom: Path | None
    file: Path | None
    facts: CurveSummary | None
    reason: str
    ran: bool = False
    carried_from: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether the whole frequency range was covered."""
        return self.facts is not None and self.facts.complete


@dataclass(frozen=True)
class CurveJob:
    """A curve to solve, or to find in the store.

    Attributes
    ----------
    member : Member
        The first member that asks for it.
    key : str
        Its key in the store.
    rom : Path
        File of its reduced model.
    """

    member: Member
    key: str
    rom: Path


@dataclass(frozen=True)
class CurveSolver:
    """Finds the curves of a sweep in the store or solves them, `jobs` at a time (see `worker_count`)."""

    store: Store
    reporter: Reporter
    jobs: int | None = None

    def solve(self, jobs: Sequence[CurveJob]) -> dict[str, CurveResult]:
        """The curve of every key; a curve that fails carries its reason and does not stop the others."""
        solved = {}
        for item in jobs:
            if item.key not in solved and (found := self._stored(item)) is not None:
                solved[item.key] = found
        missing = {item.key: item for item in jobs if item.key not in solved}
        reasons = self._run(list(missing.values()))
        for key, item in missing.items():
            found = self._stored(item) or CurveResult(
                item.member, item.rom, None, None, reasons.get(key, "no result")
            )
            solved[key] = replace(found, ran=True)
        return solved

    def _stored(self, item: CurveJob) -> CurveResult | None:
        entry = self.store.find(KIND, item.key)
        return None if entry is None else result_from_file(item, entry.file(CURVE))

    def _run(self, missing: list[CurveJob]) -> Mapping[str, str]:
        """Solve what is missing; returns the reason of every curve that raised an exception."""
        items = {item.key: item for item in sorted(missing, key=lambda item: longest_first(item.member.scene))}
        works = {key: Work(member_label(item.member), _solve_into, (self.store, item)) for key, item in items.items()}
        at_once = worker_count(self.jobs, [item.member.scene for item in missing])
        return CountedCalls(self.reporter, "curves", at_once).run(works, lambda key: self._line(items[key]))

    def _line(self, item: CurveJob) -> str:
        found = self._stored(item)
        if found is None or found.facts is None:
            return "lost"
        facts = found.facts
        peak = f"peak {facts.peak_frequency_hz:.6g} Hz {facts.peak_amplitude_m:.4g} m"
        return f"{peak}, {facts.points} points, {facts.seconds:.2f} s" + (
            "" if facts.complete else f" (incomplete: {facts.reason})"
        )


def result_from_file(item: CurveJob, file: Path, ran: bool = False) -> CurveResult:
    """The curve in a file of the store."""
    facts = kept_summary(file)
    return CurveResult(item.member, item.rom, file, facts, facts.reason, ran)


def _solve_into(store: Store, item: CurveJob, progress: Progress | None = None) -> str:
    """Solve one curve into the store; the reason if that was not possible, otherwise an empty text."""
    member = item.member
    try:
        store.get(
            KIND, item.key, lambda folder: solve_curve(folder, item.rom, member.scene, member.parameters, progress)
        )
    except StorageError:
        raise
    except Exception as error:  # whatever happens to one curve, the rest of the sweep goes on
        return reason_of(error)
    return ""
