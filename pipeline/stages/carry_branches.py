"""Branches carried across a sweep: solutions of neighbouring members are continued in the parameter that differs.

A detached branch of one member may be an ordinary branch of the next one. In each round every curve is offered the
branches that its neighbours have got in the round before, at first all that they have. Rounds are repeated until no
curve gets a new branch. The curves of a round do not depend on each other, so the result depends neither on the order
of the sweep nor on the number of processes. The curves as they were solved stay as they are: a curve with further
branches is a result of its own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pipeline.errors import reason_of
from pipeline.process.counted_calls import CountedCalls, Work
from pipeline.process.progress import Reporter
from pipeline.scene.labels import member_label
from pipeline.stages.branch_births import Births
from pipeline.stages.cache_keys import carried_key, extension_key
from pipeline.stages.curve_file import CURVE
from pipeline.stages.extend_curve import ExtensionFacts, Source, extend_curve
from pipeline.stages.respond import KIND as SOLVED
from pipeline.stages.respond import CurveJob, CurveResult, result_from_file
from pipeline.stages.solve_curve import Progress
from pipeline.stages.sweep_neighbours import longest_way, neighbouring_curves, sweep_steps
from pipeline.stages.worker_count import worker_count
from pipeline.store.content_store import Entry, Store
from pipeline.store.disk_errors import StorageError

EXTENDED, CARRIED = "extension", "carried"  # kinds of results in the store
RESULT = "carried.json"
THERE_AND_BACK = 2  # rounds, in longest ways through the sweep, after which carrying is given up


@dataclass(frozen=True)
class CurveState:
    """A curve with the branches that it has got so far.

    Attributes
    ----------
    kind, key : str
        Its place in the store.
    file : Path
        Its file.
    ran : bool
        Whether it was computed in this run.
    """

    kind: str
    key: str
    file: Path
    ran: bool


@dataclass(frozen=True)
class Extension:
    """A curve to extend with the branches of neighbours.

    Attributes
    ----------
    key : str
        Its key in the store.
    job : CurveJob
        The curve.
    base : Path
        File of the curve with its branches so far.
    sources : tuple of Source
        The neighbours.
    """

    key: str
    job: CurveJob
    base: Path
    sources: tuple[Source, ...]


@dataclass
class BranchCarrier:
    """Carries branches across the curves of a sweep.

    Attributes
    ----------
    store, reporter : Store, Reporter
        Where results are, and who reports on them.
    jobs : sequence of CurveJob
        The curves of all members.
    processes : int or None
        Number of processes; None: as many as the cores, where the work is worth it.
    problems : list of str
        What could not be done, one line each.
    """

    store: Store
    reporter: Reporter
    jobs: Sequence[CurveJob]
    processes: int | None = None
    problems: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Find the neighbours of every curve."""
        self._jobs = {item.key: item for item in reversed(self.jobs)}
        keys = {item.member.index: item.key for item in self.jobs}
        steps = sweep_steps([item.member for item in self.jobs if item.member.scene.response.detached])
        self._most_rounds = longest_way(steps) * THERE_AND_BACK
        self._neighbours = neighbouring_curves(steps, keys)

    @property
    def _key(self) -> str:
        """Key of the result of all rounds."""
        links = [(key, other.curve, other.label) for key, others in self._neighbours.items() for other in others]
        return carried_key(list(self._jobs), links)

    def stored(self) -> dict[str, CurveResult] | None:
        """The curves with all their branches, by key, where an earlier run has carried them; otherwise None."""
        if not self._neighbours:
            return None
        entry = self.store.find(CARRIED, self._key)
        if entry is None:
            return None
        results = {}
        for key, kept in json.loads(entry.file(RESULT).read_text(encoding="utf-8")).items():
            found = self.store.find(kept["kind"], kept["key"])
            if found is None:
                return None
            curve = result_from_file(self._jobs[key], found.file(CURVE))
            results[key] = self._completed(key, curve, kept["births"])
        return results

    def carried(self, solved: Mapping[str, CurveResult]) -> dict[str, CurveResult]:
        """The curves with the branches of their neighbours, by key; one that cannot be extended stays as it is.

        Parameters
        ----------
        solved : mapping of str to CurveResult
            The curves as they were solved.
        """
        results = dict(solved)
        if not self._neighbours:
            return results
        births = Births(self._neighbours)
        states = {
            key: CurveState(SOLVED, key, curve.file, curve.ran)
            for key, curve in solved.items()
            if curve.file is not None and curve.facts is not None and curve.facts.points
        }
        changed, rounds = set(states), 0
        while changed and rounds < self._most_rounds:
            rounds += 1
            entries = self._round(states, changed)
            changed = set()
            for key, entry in entries.items():
                facts = ExtensionFacts.read(entry.folder)
                births.note(key, facts.lost)
                if facts.added:
                    changed.add(key)
                    states[key] = CurveState(EXTENDED, entry.folder.name, entry.file(CURVE), entry.ran)
        if changed:
            self.problems.append(
                f"branches: still new ones after {rounds} rounds across the sweep, where it was ended"
            )
        born = {key: births.by_number(key, state.file) for key, state in states.items()}
        for key, state in states.items():
            if state.kind != SOLVED:
                results[key] = result_from_file(self._jobs[key], state.file, state.ran)
            results[key] = self._completed(key, results[key], born[key])
        if not self.problems and len(states) == len(self._jobs):
            self._keep(states, born)
        return results

    def _completed(self, key: str, curve: CurveResult, births: Mapping[str, Any]) -> CurveResult:
        """A curve that says from where branches were carried, and where its own ones, by number, are born."""
        labels = tuple(neighbour.label for neighbour in self._neighbours.get(key, ()))
        assert curve.facts is not None
        detached = tuple(
            item | {"born_between": births.get(str(number), [])}
            for number, item in enumerate(curve.facts.detached, start=1)
        )
        return replace(curve, facts=replace(curve.facts, detached=detached), carried_from=labels)

    def _round(self, states: Mapping[str, CurveState], changed: set[str]) -> dict[str, Entry]:
        """Extend every curve that has a changed neighbour; the results by the keys of the curves."""
        extensions = {}
        for key, state in states.items():
            others = [other for other in self._neighbours.get(key, ()) if other.curve in changed]
            if others:
                sources = tuple(Source(states[o.curve].file, self._jobs[o.curve].rom, o.label) for o in others)
                place = extension_key(state.key, [(states[other.curve].key, other.label) for other in others])
                extensions[key] = Extension(place, self._jobs[key], state.file, sources)
        found = {key: self.store.find(EXTENDED, item.key) for key, item in extensions.items()}
        missing = {key: item for key, item in extensions.items() if found[key] is None}
        if missing:
            reasons = self._extend(missing)
            for key, item in missing.items():
                entry = self.store.find(EXTENDED, item.key)
                found[key] = None if entry is None else replace(entry, ran=True)
                if entry is None:
                    why = reasons.get(key, "no result")
                    self.problems.append(f"branches of {member_label(item.job.member)}: {why}")
        return {key: entry for key, entry in found.items() if entry is not None}

    def _extend(self, missing: Mapping[str, Extension]) -> Mapping[str, str]:
        """Extend curves; the reason of each that raised an exception."""
        works = {
            key: Work(member_label(item.job.member), _extend_into, (self.store, item))
            for key, item in missing.items()
        }
        processes = worker_count(self.processes, [item.job.member.scene for item in missing.values()])

        def line(key: str) -> str:
            entry = self.store.find(EXTENDED, missing[key].key, thorough=False)
            added = 0 if entry is None else ExtensionFacts.read(entry.folder).added
            took = "" if entry is None else f", {entry.seconds:.2f} s"
            return (f"{added} more" if added else "no more") + took

        return CountedCalls(self.reporter, "branches", processes).run(works, line)

    def _keep(self, states: Mapping[str, CurveState], born: Mapping[str, Mapping[str, Any]]) -> None:
        """Store which results the rounds have ended with, so that the next run does not repeat them."""
        curves = {key: {"kind": state.kind, "key": state.key, "births": born[key]} for key, state in states.items()}
        text = json.dumps(curves, sort_keys=True)

        def write(folder: Path) -> None:
            (folder / RESULT).write_text(text, encoding="utf-8")

        self.store.get(CARRIED, self._key, write)


def _extend_into(store: Store, item: Extension, progress: Progress | None = None) -> str:
    """Extend one curve into the store; the reason if that was not possible, otherwise an empty text."""
    job = item.job
    try:
        store.get(
            EXTENDED,
            item.key,
            lambda folder: extend_curve(folder, job.rom, job.member.scene, item.base, item.sources, progress),
        )
    except StorageError:
        raise
    except Exception as error:  # the curve stands without further branches
        return reason_of(error)
    return ""
