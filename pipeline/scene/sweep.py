"""The table [sweep] of a scene: a grid of values, a list or file of points, or a Latin hypercube."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.errors import input_error, shown
from pipeline.scene.latin_hypercube import sampled_columns
from pipeline.scene.point_file import point_columns
from pipeline.scene.swept_keys import flattened
from pipeline.scene.validation_errors import shown_key

LARGEST_SWEEP = 10_000
GRID, POINTS, LATIN_HYPERCUBE = "grid", "points", "latin_hypercube"


@dataclass(frozen=True)
class Sweep:
    """Values of the swept keys."""

    # dotted keys with their values: of a grid the values to combine, otherwise one value for each point
    lists: Mapping[str, list[Any]]
    kind: str = GRID  # "grid", "points" or "latin_hypercube"
    lines: tuple[str, ...] = ()  # how messages name each point; empty with a grid

    def with_lists(self, lists: Mapping[str, list[Any]]) -> Sweep:
        """The same sweep with other spellings of its values."""
        return replace(self, lists=lists)

    def combinations(self) -> Iterator[dict[str, Any]]:
        """The values of each member by key; of a grid every combination, the last key changing fastest."""
        together = itertools.product if self.kind == GRID else zip
        for values in together(*self.lists.values()):
            yield dict(zip(self.lists, values, strict=True))

    def place(self, member: int) -> str:
        """How messages name the table with the values of a member, before the key."""
        return self.lines[member] if self.lines else "sweep"

    def places(self, member: int) -> dict[str, str]:
        """How messages name each value of a member."""
        if self.kind != GRID:
            return {key: f'{self.place(member)}."{key}"' for key in self.lists}
        places = {}
        for key, values in reversed(list(self.lists.items())):  # as the last digit of the number counts the last key
            member, position = divmod(member, len(values))
            places[key] = f'sweep."{key}"[{position}]'
        return places


def read_sweep(path: Path, table: Any) -> Sweep:
    """The sweep of a scene file from its raw table [sweep]."""
    if not isinstance(table, Mapping):
        raise input_error(path, "sweep", shown(table), "a table [sweep] of dotted keys with lists")
    kinds = [kind for kind in (POINTS, LATIN_HYPERCUBE) if kind in table]
    if not kinds:
        return Sweep(_grid_lists(path, table))
    kind = kinds[0]
    if others := [key for key in table if key != kind]:
        allowed = "one of points, latin_hypercube and lists of values"
        raise input_error(path, f"sweep.{kind}", f"given beside {shown_key(others[0])}", allowed)
    if kind == LATIN_HYPERCUBE:
        lists = sampled_columns(path, table[kind], LARGEST_SWEEP)
        count = len(next(iter(lists.values())))
        return Sweep(lists, kind, ("sweep.latin_hypercube.ranges",) * count)
    return _points(path, table[kind])


def _grid_lists(path: Path, table: Mapping[str, Any]) -> dict[str, list[Any]]:
    """The swept keys with their lists."""
    lists: dict[str, list[Any]] = {}
    count = 1
    for key, values in flattened(path, table, "sweep"):
        if not isinstance(values, list) or not values:
            raise input_error(path, f"sweep.{shown_key(key)}", shown(values), "a list of one or more values")
        lists[key] = values
        count *= len(values)
    if count > LARGEST_SWEEP:
        raise input_error(path, "sweep", f"{count} combinations", f"{LARGEST_SWEEP} at most")
    return lists


def _points(path: Path, points: Any) -> Sweep:
    """A list of points, or the points of a file."""
    if isinstance(points, str):
        lists, lines = point_columns(path, points, LARGEST_SWEEP)
    else:
        lists, lines = _listed_points(path, points)
    _refuse_repeated(path, lists, lines)
    return Sweep(lists, POINTS, lines)


def _listed_points(path: Path, points: Any) -> tuple[dict[str, list[Any]], tuple[str, ...]]:
    """Columns of a list of tables, each with the same keys, and how messages name each point."""
    allowed = "a list of one or more tables with the same keys, or the name of a CSV file"
    if not isinstance(points, list) or not points:
        raise input_error(path, "sweep.points", shown(points), allowed)
    if len(points) > LARGEST_SWEEP:
        raise input_error(path, "sweep.points", f"{len(points)} points", f"{LARGEST_SWEEP} at most")
    lines = tuple(f"sweep.points[{number}]" for number in range(len(points)))
    rows = []
    for line, point in zip(lines, points, strict=True):
        if not isinstance(point, Mapping) or not point:
            raise input_error(path, line, shown(point), "a table of dotted keys with values")
        rows.append(dict(flattened(path, point, line)))
        if different := rows[0].keys() ^ rows[-1].keys():
            key = min(different)
            found = "missing" if key in rows[0] else f"not in {lines[0]}"
            raise input_error(path, f'{line}."{key}"', found, "the same keys in every point")
    return {key: [row[key] for row in rows] for key in rows[0]}, lines


def _refuse_repeated(path: Path, lists: Mapping[str, list[Any]], lines: tuple[str, ...]) -> None:
    """Each point stands once: two would have the same curve."""
    first: dict[str, str] = {}
    for line, values in zip(lines, zip(*lists.values(), strict=True), strict=True):
        known = first.setdefault(repr([_comparable(value) for value in values]), line)
        if known != line:
            raise input_error(path, line, f"the same point as {known}", "each point once")


def _comparable(value: Any) -> Any:
    """Whole numbers as the equal numbers with a fraction."""
    if isinstance(value, list):
        return [_comparable(item) for item in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**53 else value
