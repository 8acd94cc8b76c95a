"""Branches carried across a sweep: solutions of neighbouring members are continued in the parameter that differs.

Neighbouring members differ by one step of one parameter. A detached branch of one member may be an ordinary branch
of the next one. Branches are carried in rounds (`CarryRounds`), at first all that a curve has, then those that it
has got in the round before, until no curve gets a new branch. A curve takes part in a round as soon as it and its
neighbours have finished the round before; nothing waits for the rest of the sweep. The result depends neither on the
order of the sweep nor on where and when its tasks run. The curves as they were solved stay as they are: a curve with
further branches is a result of its own. In the end it is said between which values of a parameter each branch
begins.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from pipeline.executor.task import Progress, Task
from pipeline.scene.labels import member_label, value_label
from pipeline.scene.reading import Member
from pipeline.scene.schema import Scene, meaning_of
from pipeline.stages.cache_keys import carried_key, extension_key
from pipeline.stages.curve.curve_file import CURVE, branch_groups, branch_mark
from pipeline.stages.curve.extend_curve import ExtensionFacts, LostBranch, Source, extend_curve
from pipeline.stages.curve.respond import KIND as SOLVED
from pipeline.stages.curve.respond import CurveJob, CurveResult, result_from_file
from pipeline.store.content_store import Entry, Store

AUTO = ("response.harmonics", "auto")  # more harmonics than any number of them
NUMBER, LIST, MOST = "number", "list", "most"


@dataclass(frozen=True)
class Step:
    """One step of one swept parameter between two members."""

    parameter: str  # its dotted key
    members: tuple[Member, Member]  # the member with the lower value and that with the higher one

    def value(self, end: int) -> Any:
        """The value of the parameter at the lower end (0) or at the higher one (1)."""
        return self.members[end].parameters[self.parameter]


@dataclass(frozen=True)
class Neighbour:
    """A curve to which a step of the sweep leads."""

    curve: str  # key of that curve
    parameter: str  # dotted key of the parameter that differs
    # `there`, `here`: its value at that curve, and at the curve whose neighbour it is
    there: Any
    here: Any

    @property
    def label(self) -> str:
        """The parameter with its value there."""
        return value_label(self.parameter, self.there)


def neighbouring_curves(steps: Sequence[Step], keys: Mapping[int, str]) -> dict[str, list[Neighbour]]:
    """The neighbours of every curve that has any, in the order of their curves."""
    found: dict[str, dict[tuple[str, str], Neighbour]] = {}
    for step in steps:
        for here, there in ((0, 1), (1, 0)):
            curve, other = (keys[step.members[end].index] for end in (here, there))
            if curve != other:
                neighbour = Neighbour(other, step.parameter, step.value(there), step.value(here))
                found.setdefault(curve, {}).setdefault((other, neighbour.label), neighbour)
    return {key: [others[place] for place in sorted(others)] for key, others in found.items()}


def sweep_steps(members: Sequence[Member]) -> list[Step]:
    """Every step between neighbours.

    Two members are neighbours where they differ in one parameter only, and its values follow each other in the sorted
    list of those in the sweep. The parameter is a number or a list of numbers. No step leads between engine orders,
    numbers of blades, grids of contact nodes, or values that are words, such as the friction law; only the harmonics
    "auto" follow the largest number of harmonics.
    """
    return [step for parameter in _parameters(members) for step in _steps_along(parameter, members)]


def longest_way(steps: Sequence[Step]) -> int:
    """Most steps between two members, from one end of every parameter's values to the other."""
    values: dict[str, set[str]] = {}
    for step in steps:
        values.setdefault(step.parameter, set()).update(repr(step.value(end)) for end in (0, 1))
    return sum(len(found) - 1 for found in values.values())


def _parameters(members: Sequence[Member]) -> list[str]:
    return [key for key in (members[0].parameters if members else ()) if not meaning_of(key).discrete]


def _steps_along(parameter: str, members: Sequence[Member]) -> Iterator[Step]:
    """Steps of one parameter, the others being the same."""
    lines: dict[Any, dict[Any, Member]] = {}
    for member in members:
        value = member.parameters[parameter]
        kind = _kind(parameter, value)
        if kind:
            rest = repr([(key, other) for key, other in member.parameters.items() if key != parameter])
            place = (kind == MOST, 0 if kind == MOST else tuple(value) if kind == LIST else value)
            lines.setdefault((rest, kind == LIST), {}).setdefault(place, member)
    for line in lines.values():
        yield from (Step(parameter, pair) for pair in pairwise(line[place] for place in sorted(line)))


def _kind(parameter: str, value: Any) -> str:
    """Whether a value can be ordered among others: a number, a list of numbers, or the most harmonics; else ""."""
    if (parameter, value) == AUTO:
        return MOST
    if isinstance(value, list | tuple):
        return LIST if all(_is_number(item) for item in value) else ""
    return NUMBER if _is_number(value) else ""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


class Births:
    """Collects where branches end between neighbouring curves."""

    def __init__(self, neighbours: Mapping[str, Sequence[Neighbour]]) -> None:
        self._neighbours = neighbours
        self._found: dict[str, dict[str, list[dict[str, Any]]]] = {}  # by curve and mark of the branch

    def note(self, curve: str, lost: Sequence[LostBranch]) -> None:
        """Note which branches of its neighbours a curve does not have."""
        by_label = {neighbour.label: neighbour for neighbour in self._neighbours[curve]}
        for item in lost:
            neighbour = by_label[item.label]
            end = _followed(neighbour, item.followed)
            entry = {"parameter": neighbour.parameter, "exists": end, "missing": neighbour.here}
            self._found.setdefault(neighbour.curve, {}).setdefault(item.branch, []).append(entry)

    def by_number(self, curve: str, file: Path) -> dict[str, list[dict[str, Any]]]:
        """Where the detached branches in the file of a curve end, by their number.

        Each entry names the parameter, the value up to which the branch was followed (`exists`), and that of the
        neighbour which does not have it (`missing`).
        """
        import h5py

        found = self._found.get(curve)
        if not found:
            return {}
        with h5py.File(file, "r") as source:
            marks = [branch_mark(group["frequency_hz"][()]) for group in branch_groups(source)]
        return {
            str(number): sorted(found[mark], key=lambda entry: (entry["parameter"], repr(entry["missing"])))
            for number, mark in enumerate(marks, start=1)
            if mark in found
        }


def _followed(neighbour: Neighbour, part: float) -> Any:
    """The value of the parameter on the way from the neighbour, at a part of it from 0 to 1."""
    meaning = meaning_of(neighbour.parameter)
    if not meaning.solver or meaning.at_once:
        return neighbour.there
    if isinstance(neighbour.there, list | tuple):
        pairs = zip(neighbour.there, neighbour.here, strict=True)
        return [there + part * (here - there) for there, here in pairs]
    return neighbour.there + part * (neighbour.here - neighbour.there)


@dataclass(frozen=True)
class Turn:
    """A curve that is due."""

    curve: str  # key of the curve
    round: int  # number of the round, from 1
    sources: tuple[str, ...]  # its neighbours that have changed in the round before


@dataclass
class CarryRounds:
    """Rounds across a sweep; they end where no curve has changed in the last one."""

    neighbours: Mapping[str, Sequence[str]]  # the neighbours of every curve that has any, each once. They are mutual
    most: int  # number of rounds after which they are ended in any case
    _changed: dict[str, list[bool]] = field(default_factory=dict)  # of a curve, in each round that it has finished
    _left_out: set[str] = field(default_factory=set)
    _due: set[str] = field(default_factory=set)
    _last: int = -1  # last round in which a curve has changed so far

    @property
    def are_cut_short(self) -> bool:
        """Whether curves still changed in the last round allowed."""
        return self._last == self.most

    @property
    def before_first(self) -> int:
        """Number of curves that have not finished the first round."""
        return sum(len(self._changed.get(key, ())) < 2 for key in self.neighbours if key not in self._left_out)

    def leave_out(self, curve: str) -> list[Turn]:
        """A curve that could not be solved; returns which curves are due now."""
        self._left_out.add(curve)
        return self._advanced(self.neighbours[curve])

    def finished(self, curve: str, changed: bool) -> list[Turn]:
        """A curve has been solved (round 0), or has finished the next round; returns which curves are due now."""
        self._due.discard(curve)
        self._note(curve, changed)
        last = len(self._changed[curve]) - 1
        if changed and last > self._last:
            self._last = last
            return self._advanced(self.neighbours)
        return self._advanced([curve, *self.neighbours[curve]])

    def _note(self, curve: str, changed: bool) -> None:
        self._changed.setdefault(curve, []).append(changed)

    def _advanced(self, curves: Mapping[str, Sequence[str]] | Sequence[str]) -> list[Turn]:
        """Begin the next round of these curves, and of others that are due with them, where they have one."""
        waiting, turns = list(curves), []
        while waiting:
            curve = waiting.pop()
            number = len(self._changed.get(curve, ()))
            if not self._may_begin(curve, number):
                continue
            others = [other for other in self.neighbours[curve] if other not in self._left_out]
            sources = tuple(other for other in others if self._changed[other][number - 1])
            if sources:
                self._due.add(curve)
                turns.append(Turn(curve, number, sources))
            else:
                self._note(curve, False)
                waiting += [curve, *others]
        return turns

    def _may_begin(self, curve: str, number: int) -> bool:
        if curve in self._due or curve in self._left_out or not 0 < number <= min(self.most, self._last + 1):
            return False
        return all(
            other in self._left_out or len(self._changed.get(other, ())) >= number for other in self.neighbours[curve]
        )


EXTENDED, CARRIED = "extension", "carried"  # kinds of results in the store
RESULT = "carried.json"
THERE_AND_BACK = 2  # rounds, in longest ways through the sweep, after which carrying is given up


@dataclass(frozen=True)
class CurveState:
    """A curve with the branches that it has got so far."""

    # `kind`, `key`: its place in the store
    kind: str
    key: str
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


def added_branches(entry: Entry) -> int:
    """Number of branches that an extension of a curve has found."""
    return ExtensionFacts.read(entry.folder).added


def _extend(
    folder: Path,
    files: Mapping[str, Path],
    scene: Scene,
    labels: Sequence[str],
    progress: Progress | None = None,
) -> None:
    sources = [Source(files[f"source {k}"], files[f"rom {k}"], label) for k, label in enumerate(labels)]
    extend_curve(folder, files["rom"], scene, files["base"], sources, progress)
