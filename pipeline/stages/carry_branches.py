"""Branches carried across a sweep: solutions of neighbouring members are continued in the parameter that differs.

A detached branch of one member may be an ordinary branch of the next one. Branches are carried in rounds
(`CarryRounds`), at first all that a curve has, then those that it has got in the round before. Rounds are repeated
until no curve gets a new branch. The result depends neither on the order of the sweep nor on where and when its tasks
run. The curves as they were solved stay as they are: a curve with further branches is a result of its own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pipeline.executor.task import Progress, Task
from pipeline.scene.labels import member_label
from pipeline.scene.schema import Scene
from pipeline.stages.branch_births import Births
from pipeline.stages.cache_keys import carried_key, extension_key
from pipeline.stages.carry_rounds import CarryRounds, Turn
from pipeline.stages.curve_file import CURVE
from pipeline.stages.extend_curve import ExtensionFacts, LostBranch, Source, extend_curve
from pipeline.stages.respond import KIND as SOLVED
from pipeline.stages.respond import CurveJob, CurveResult, result_from_file
from pipeline.stages.sweep_neighbours import longest_way, neighbouring_curves, sweep_steps
from pipeline.store.content_store import Entry, Store

EXTENDED, CARRIED = "extension", "carried"  # kinds of results in the store
RESULT = "carried.json"
THERE_AND_BACK = 2  # rounds, in longest ways through the sweep, after which carrying is given up


@dataclass(frozen=True)
class CurveState:
    """A curve with the branches that it has got so far."""

    kind: str  # its place in the store
    key: str  # its place in the store
    file: Path  # its file
    ran: bool  # whether it was computed in this run
    seconds: float  # how long it was computed


@dataclass(frozen=True)
class Extension:
    """A curve to extend with the branches of neighbours, in one round."""

    key: str  # its key in the store
    job: CurveJob  # the curve
    round: int  # number of the round, from 1
    base: CurveState  # the curve with its branches so far
    sources: tuple[Source, ...]  # the neighbours
    offered_seconds: float  # how long the curves of the neighbours were computed: a measure of what is to be carried


@dataclass
class BranchCarrier:
    """Carries branches across the curves of a sweep."""

    store: Store  # where results are
    jobs: Sequence[CurveJob]  # the curves of all members
    problems: list[str] = field(default_factory=list)  # what could not be done, one line each

    def __post_init__(self) -> None:
        """Find the neighbours of every curve."""
        self._jobs = {item.key: item for item in reversed(self.jobs)}
        keys = {item.member.index: item.key for item in self.jobs}
        steps = sweep_steps([item.member for item in self.jobs if item.member.scene.response.detached])
        self._neighbours = neighbouring_curves(steps, keys)
        others = {key: list(dict.fromkeys(n.curve for n in found)) for key, found in self._neighbours.items()}
        self._rounds = CarryRounds(others, longest_way(steps) * THERE_AND_BACK)
        self._states: dict[str, dict[int, CurveState]] = {}  # of a curve, after the rounds that have changed it
        self._lost: dict[tuple[int, str], tuple[LostBranch, ...]] = {}
        self._failed: dict[tuple[int, str], str] = {}

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

    @property
    def waiting(self) -> int:
        """Number of curves that may still get branches in the first round."""
        return self._rounds.before_first

    def solved(self, key: str, curve: CurveResult) -> list[Extension]:
        """A curve has been solved, or could not be; returns the curves that can be extended now."""
        if curve.file is None or curve.facts is None or not curve.facts.points:
            return self._extensions(self._rounds.leave_out(key)) if key in self._neighbours else []
        self._states[key] = {0: CurveState(SOLVED, key, curve.file, curve.ran, curve.facts.seconds)}
        return self._extensions(self._rounds.finished(key, changed=True)) if key in self._neighbours else []

    def extended(self, item: Extension, entry: Entry | None, reason: str = "") -> list[Extension]:
        """A curve has been extended, or, for a reason, could not be; returns the curves that can be extended now."""
        curve, place = item.job.key, (item.round, item.job.key)
        if entry is None:
            self._failed[place] = f"branches of {member_label(item.job.member)}: {reason}"
            return self._extensions(self._rounds.finished(curve, changed=False))
        facts = ExtensionFacts.read(entry.folder)
        self._lost[place] = facts.lost
        if facts.added:
            file = entry.file(CURVE)
            self._states[curve][item.round] = CurveState(EXTENDED, item.key, file, entry.ran, entry.seconds)
        return self._extensions(self._rounds.finished(curve, changed=facts.added > 0))

    def results(self, solved: Mapping[str, CurveResult]) -> dict[str, CurveResult]:
        """The curves with the branches of their neighbours, by key; one that cannot be extended stays as it is."""
        results = dict(solved)
        if not self._neighbours:
            return results
        births = Births(self._neighbours)
        for (_, key), lost in sorted(self._lost.items()):
            births.note(key, lost)
        self.problems.extend(text for _, text in sorted(self._failed.items()))
        if self._rounds.are_cut_short:
            self.problems.append(
                f"branches: still new ones after {self._rounds.most} rounds across the sweep, where it was ended"
            )
        states = {key: found[max(found)] for key, found in self._states.items()}
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

    def _extensions(self, turns: Sequence[Turn]) -> list[Extension]:
        """The curves that are due, with the results that they depend on."""
        found = []
        for turn in turns:
            others = [other for other in self._neighbours[turn.curve] if other.curve in turn.sources]
            before = {other.curve: self._state_after(other.curve, turn.round - 1) for other in others}
            base = self._state_after(turn.curve, turn.round - 1)
            sources = tuple(Source(before[o.curve].file, self._jobs[o.curve].rom, o.label) for o in others)
            key = extension_key(base.key, [(before[other.curve].key, other.label) for other in others])
            seconds = sum(state.seconds for state in before.values())
            found.append(Extension(key, self._jobs[turn.curve], turn.round, base, sources, seconds))
        return found

    def _state_after(self, curve: str, number: int) -> CurveState:
        states = self._states[curve]
        return states[max(each for each in states if each <= number)]

    def _keep(self, states: Mapping[str, CurveState], born: Mapping[str, Mapping[str, Any]]) -> None:
        """Store which results the rounds have ended with, so that the next run does not repeat them."""
        curves = {key: {"kind": state.kind, "key": state.key, "births": born[key]} for key, state in states.items()}
        text = json.dumps(curves, sort_keys=True)

        def write(folder: Path) -> None:
            (folder / RESULT).write_text(text, encoding="utf-8")

        self.store.get(CARRIED, self._key, write)


def extension_task(item: Extension) -> Task:
    """The task that extends a curve; after all curves are solved, those with the costliest neighbours come first."""
    files = {"rom": item.job.rom, "base": item.base.file}
    for number, source in enumerate(item.sources):
        files |= {f"rom {number}": source.rom, f"source {number}": source.file}
    labels = tuple(source.label for source in item.sources)
    member, order = item.job.member, (1.0, float(item.round), -item.offered_seconds)
    return Task(member_label(member), _extend, files, (member.scene, labels), order)


def extension_line(entry: Entry) -> str:
    """What to say of a curve that has been extended."""
    added = ExtensionFacts.read(entry.folder).added
    return (f"{added} more" if added else "no more") + f", {entry.seconds:.2f} s"


def _extend(
    folder: Path,
    files: Mapping[str, Path],
    scene: Scene,
    labels: Sequence[str],
    progress: Progress | None = None,
) -> None:
    sources = [Source(files[f"source {k}"], files[f"rom {k}"], label) for k, label in enumerate(labels)]
    extend_curve(folder, files["rom"], scene, files["base"], sources, progress)
