"""What a study of run time against error comes to: settings with their seconds and errors, and the reference."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Quantity:
    """Something whose relative error is measured; `uncertainty`: relative, of the reference that it is held against.

    Errors below the uncertainty say no more than that they are below it.
    """

    name: str
    uncertainty: float


@dataclass(frozen=True)
class Measured:
    """One setting.

    Attributes
    ----------
    series : line of the figure that it belongs to.
    setting : what was set, in few words.
    seconds : median of the wall seconds.
    errors : name of a quantity -> relative error, inf where nothing was found.
    counts : column -> whole number that tells the size of the problem, such as degrees of freedom.
    note : what went otherwise than asked for, empty where nothing did.
    """

    series: str
    setting: str
    seconds: float
    errors: Mapping[str, float]
    counts: Mapping[str, int] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class Study:
    """A finished study.

    Attributes
    ----------
    name : of its files. title : heading.
    about : what was varied, and what was timed. reference : what the errors are relative to, and how sure that is.
    quantities, rows : what was measured. facts : name -> text about the machine.
    """

    name: str
    title: str
    about: str
    reference: str
    quantities: tuple[Quantity, ...]
    rows: tuple[Measured, ...]
    facts: Mapping[str, str]

    def series(self) -> dict[str, tuple[Measured, ...]]:
        """Rows by line of the figure, in their order."""
        lines: dict[str, list[Measured]] = {}
        for row in self.rows:
            lines.setdefault(row.series, []).append(row)
        return {name: tuple(rows) for name, rows in lines.items()}


def said(row: Measured) -> Measured:
    """The row, after a line about it on standard error: a study takes minutes."""
    print(f"  {row.series}, {row.setting}: {row.seconds:.3g} s", file=sys.stderr, flush=True)
    return row


def relative_error(found: float, reference: float) -> float:
    """|found / reference - 1|; inf where nothing was found."""
    return abs(found / reference - 1.0) if math.isfinite(found) else math.inf


def pareto_front(rows: tuple[Measured, ...], quantity: str) -> tuple[Measured, ...]:
    """The rows that no other beats in both seconds and error, from the fastest on."""
    front: list[Measured] = []
    for row in sorted(rows, key=lambda one: (one.seconds, one.errors[quantity])):
        error = row.errors[quantity]
        if math.isfinite(error) and (not front or error < front[-1].errors[quantity]):
            front.append(row)
    return tuple(front)


def cheapest(rows: tuple[Measured, ...], quantity: Quantity, tolerance: float) -> Measured | None:
    """The fastest row whose error and the uncertainty of the reference stay within `tolerance` together, or None."""
    within = [row for row in rows if row.errors[quantity.name] + quantity.uncertainty <= tolerance]
    return min(within, key=lambda row: row.seconds, default=None)
