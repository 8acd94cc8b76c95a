"""Neighbouring members of a sweep, which one step of one parameter leads to: solutions can be carried along it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from pipeline.scene.labels import value_label
from pipeline.scene.reading import Member

# Numbers from one value of which no continuous way leads to another one.
DISCRETE = ("excitation.engine_order", "blade.n_blades", "mesh.contact_grid")
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
    there: Any  # its value at that curve, and at the curve whose neighbour it is
    here: Any  # its value at that curve, and at the curve whose neighbour it is

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
    return [key for key in (members[0].parameters if members else ()) if key not in DISCRETE]


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
