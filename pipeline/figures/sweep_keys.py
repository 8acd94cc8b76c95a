"""The swept keys of the curves: their values, places along an axis, and the label of that axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

from pipeline.scene.labels import quantity

_AXES = {"contact.interference": "interference v0 [µm], gap below 0"}


class _Swept(Protocol):
    """The common part of `PlottedCurve` and `SweepPoint`."""

    @property
    def parameters(self) -> Mapping[str, Any]: ...


@dataclass(frozen=True)
class SweepKey:
    """One swept key with its distinct values: numbers in ascending order, others in that of the sweep."""

    name: str
    values: tuple[Any, ...]

    @cached_property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {repr(value): number for number, value in enumerate(self.values)}

    def number(self, value: Any) -> int:
        """Place of a value among the distinct ones."""
        return self._numbers[repr(value)]

    def position(self, value: Any) -> float:
        """Place of a value on an axis: in the unit of the axis, or its number where the values are no numbers."""
        return float(value) * quantity(self.name).factor if self.numeric else float(self.number(value))

    def text(self, value: Any) -> str:
        """A value without its unit."""
        named = quantity(self.name)
        shown = named.value(value)
        return shown.removesuffix(f" {named.unit}") if named.unit else shown

    @property
    def axis(self) -> str:
        """Label of an axis, with the convention of the sign where there is one."""
        return _AXES.get(self.name) or quantity(self.name).axis()


def sweep_keys(curves: Sequence[_Swept]) -> list[SweepKey]:
    """Keys with more than one value, those with the most values first."""
    found = []
    for name in curves[0].parameters if curves else ():
        distinct = {repr(curve.parameters[name]): curve.parameters[name] for curve in curves}
        key = SweepKey(name, tuple(distinct.values()))
        if key.numeric:
            key = SweepKey(name, tuple(sorted(key.values)))
        if len(key.values) > 1:
            found.append(key)
    return sorted(found, key=lambda key: -len(key.values))


def groups(curves: Sequence[Any], key: SweepKey) -> list[tuple[Any, list[Any]]]:
    """The curves by the value of a key, in the order of its values."""
    found: list[tuple[Any, list[Any]]] = [(value, []) for value in key.values]
    for curve in curves:
        found[key.number(curve.parameters[key.name])][1].append(curve)
    return found


def is_grid(curves: Sequence[_Swept], keys: Sequence[SweepKey]) -> bool:
    """Whether every combination of the values of these keys has exactly one curve."""
    places = {tuple(key.number(curve.parameters[key.name]) for key in keys) for curve in curves}
    count = 1
    for key in keys:
        count *= len(key.values)
    return len(places) == len(curves) == count
