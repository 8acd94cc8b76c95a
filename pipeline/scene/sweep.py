"""The table [sweep] of a scene: a grid of values, a list or file (CSV) of points, or a Latin hypercube.

Of a Latin hypercube of n points, each n-th of every range holds exactly one point. The value of a swept key as one
number, also where the scene lists it node by node.
"""

from __future__ import annotations

import csv
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pipeline.errors import InputError, input_error, shown, shown_key, system_reason
from pipeline.scene.contact_section import Contact, FaceField, Interface, mean_of
from pipeline.scene.dotted_keys import INTERFACE, interface_of, of_contact, split_key
from pipeline.scene.input_files import csv_rows, decimal_point, open_regular
from pipeline.scene.schema import MEANINGS, NOT_SWEPT, NOT_SWEPT_KEYS, SECTIONS, Scene, section_class
from pipeline.scene.units import column_name
from pipeline.scene.validation_errors import unknown_key


def grid_values(parameters: Mapping[str, Sequence[Any]]) -> dict[str, list[Any]] | None:
    """The different values of each swept key where the points are every combination of them, each once.

    Shapes: `parameters` (n,).
    """
    count = len(next(iter(parameters.values()), ()))
    values = {key: list(dict.fromkeys(found)) for key, found in parameters.items()}
    if not parameters or math.prod(len(found) for found in values.values()) != count:
        return None
    return values if len(set(zip(*parameters.values(), strict=True))) == count else None


SWEPT_KEYS = tuple(
    key
    for section, model in SECTIONS.items()
    if section not in NOT_SWEPT
    for key in (f"{section}.{name}" for name in model.model_fields)
    if key not in NOT_SWEPT_KEYS
)


def swept_keys(key: str) -> tuple[str, ...]:
    """The keys that can be swept, where `key` is one of an interface those of its table too."""
    table, _ = split_key(key)
    return SWEPT_KEYS + tuple(f"{table}.{name}" for name in Interface.model_fields if interface_of(key))


def flattened(path: Path, table: Mapping[str, Any], place: str) -> Iterator[tuple[str, Any]]:
    """Dotted keys with what stands under them, whether written "contact.friction" or contact.friction."""
    found = set()
    for key, item in _items(table):
        if key in found:
            table_name, name = split_key(key)
            said = f'given twice, as "{key}" and as {name} of [{place}.{table_name}]'
            raise input_error(path, f"{place}.{shown_key(key)}", said, "one of the two")
        if key not in (known := swept_keys(key)):
            raise unknown_key(path, key, known, place)
        found.add(key)
        yield key, item


def _items(table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping) and (key in SECTIONS or key == INTERFACE or interface_of(f"{key}.")):
            yield from _items({f"{key}.{name}": inner for name, inner in value.items()})
        else:
            yield key, value


LARGEST_FILE = 20_000_000
POINTS_PLACE = "sweep.points"


def point_columns(scene: Path, name: str, most: int) -> tuple[dict[str, list[Any]], tuple[str, ...]]:
    """The points of a file."""
    path = scene.parent / name
    table = [(number, row) for number, row in _rows(scene, path) if row]
    if not table:
        raise _refused(scene, name, "empty", "a line of dotted keys, then a line for each point")
    keys = _keys(scene, name, table[0][1])
    points = table[1:]
    if not 1 <= len(points) <= most:
        raise _refused(scene, name, f"{len(points)} points", f"1 to {most} points")
    for number, row in points:
        if len(row) != len(keys):
            found = f"{len(row)} value{'s' if len(row) != 1 else ''}"
            raise _refused(
                scene,
                f"{name} line {number}",
                found,
                f"{len(keys)}, one for each key; decimal commas only with semicolons between",
            )
        if "" in (cells := [cell.strip() for cell in row]):
            raise _refused(scene, f"{name} line {number}", f"no {keys[cells.index('')]}", "a value for each key")
    columns = {key: [_value(row[place]) for _, row in points] for place, key in enumerate(keys)}
    return columns, tuple(f"{POINTS_PLACE} ({name} line {number})" for number, _ in points)


def _rows(scene: Path, path: Path) -> list[tuple[int, list[str]]]:
    """Rows with the numbers of their lines."""
    allowed = "a readable CSV file in UTF-8"
    try:
        if path.exists() and not path.is_file():
            raise _refused(scene, str(path), "not a file", allowed)
        with open_regular(path) as file:
            content = file.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise _refused(scene, str(path), f"larger than {LARGEST_FILE} bytes", allowed)
        return list(csv_rows(content.decode("utf-8-sig")))
    except FileNotFoundError:
        raise _refused(scene, str(path), "no such file") from None
    except (OSError, ValueError) as error:
        reason = system_reason(error) if isinstance(error, OSError) else "no such name or not UTF-8 text"
        raise _refused(scene, str(path), f"cannot be read: {reason}", allowed) from None
    except csv.Error as error:
        raise _refused(scene, str(path), f"not CSV: {error}", allowed) from None


def _keys(scene: Path, name: str, header: Sequence[str]) -> list[str]:
    """The dotted keys of the columns."""
    keys: list[str] = []
    for cell in (cell.strip() for cell in header):
        known = swept_keys(cell)
        key = next((key for key in known if cell in (key, column_name(key))), None)
        if key is None:
            raise unknown_key(scene, cell, known, f"{POINTS_PLACE} ({name})")
        if key in keys:
            raise _refused(scene, name, f"two columns {key}", "each key once")
        keys.append(key)
    return keys


def _value(cell: str) -> Any:
    """A number, a list or a word."""
    try:
        return json.loads(decimal_point(cell))
    except ValueError:
        return cell.strip()


def _refused(scene: Path, name: str, found: str, allowed: str = "") -> InputError:
    return input_error(scene, f'{POINTS_PLACE} = "{name}"', found, allowed)  # the whole name: a path may be long


HYPERCUBE_PLACE = "sweep.latin_hypercube"
HYPERCUBE_KEYS = ("samples", "seed", "ranges", "logarithmic")
LARGEST_SEED = 2**63 - 1  # of TOML's whole numbers
_RANGE = "[low, high], two numbers, low below high"


def sampled_columns(path: Path, table: Any, most: int) -> dict[str, list[float]]:
    """The points of a Latin hypercube, a list for each key."""
    if not isinstance(table, Mapping):
        raise input_error(
            path, HYPERCUBE_PLACE, shown(table), f"a table [{HYPERCUBE_PLACE}] with {', '.join(HYPERCUBE_KEYS)}"
        )
    for key in table:
        if key not in HYPERCUBE_KEYS:
            raise unknown_key(path, key, HYPERCUBE_KEYS, HYPERCUBE_PLACE)
    samples = _whole(path, table, "samples", (1, most), f"a whole number of points, 1 to {most}")
    allowed = "a whole number, 0 or more: the same seed gives the same points"
    seed = _whole(path, table, "seed", (0, LARGEST_SEED), allowed)
    ranges = _ranges(path, table.get("ranges"))
    logarithmic = _logarithmic(path, table.get("logarithmic", []), ranges)
    return _sample(samples, seed, ranges, logarithmic)


def _whole(path: Path, table: Mapping[str, Any], name: str, bounds: tuple[int, int], allowed: str) -> int:
    value = table.get(name)
    found = "missing" if name not in table else shown(value)
    if not isinstance(value, int) or isinstance(value, bool) or not bounds[0] <= value <= bounds[1]:
        raise input_error(path, f"{HYPERCUBE_PLACE}.{name}", found, allowed)
    return value


def _ranges(path: Path, table: Any) -> dict[str, tuple[float, float]]:
    """Lowest and highest value of each key."""
    place = f"{HYPERCUBE_PLACE}.ranges"
    if not isinstance(table, Mapping) or not table:
        found = "missing" if table is None else shown(table)
        raise input_error(path, place, found, "a table of dotted keys with [low, high]")
    ranges = {}
    for key, bounds in flattened(path, table, place):
        if not takes_fractions(key):
            allowed = "keys of numbers with a fraction; others as lists or points"
            raise input_error(path, f"{place}.{shown_key(key)}", "cannot have a range", allowed)
        if not _is_range(bounds):
            raise input_error(path, f"{place}.{shown_key(key)}", shown(bounds), _RANGE)
        ranges[key] = (float(bounds[0]), float(bounds[1]))
    return ranges


def _is_range(bounds: Any) -> bool:
    if not isinstance(bounds, list) or len(bounds) != 2:
        return False
    numbers = all(isinstance(b, int | float) and not isinstance(b, bool) and abs(b) < 1e100 for b in bounds)
    return numbers and bounds[0] < bounds[1]


def _logarithmic(path: Path, keys: Any, ranges: Mapping[str, tuple[float, float]]) -> frozenset[str]:
    """Keys whose logarithm is sampled."""
    allowed = "a list of keys of ranges above 0"
    if not isinstance(keys, list) or not all(isinstance(key, str) for key in keys):
        raise input_error(path, f"{HYPERCUBE_PLACE}.logarithmic", shown(keys), allowed)
    for key in keys:
        if key not in ranges or ranges[key][0] <= 0.0:
            found = f"{shown(key)} has {f'the range {list(ranges[key])}' if key in ranges else 'no range'}"
            raise input_error(path, f"{HYPERCUBE_PLACE}.logarithmic", found, allowed)
    return frozenset(keys)


def _sample(
    samples: int, seed: int, ranges: Mapping[str, tuple[float, float]], logarithmic: frozenset[str]
) -> dict[str, list[float]]:
    import numpy as np
    from scipy.stats import qmc

    unit = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed)).random(samples)
    columns = {}
    for number, (key, (low, high)) in enumerate(ranges.items()):
        a, b = (math.log(low), math.log(high)) if key in logarithmic else (low, high)
        values = a + (b - a) * unit[:, number]
        columns[key] = np.clip(np.exp(values) if key in logarithmic else values, low, high).tolist()
    return columns


def takes_fractions(key: str) -> bool:
    """Whether a key may be any number of a range."""
    table, name = split_key(key)
    return _holds_float(section_class(table).model_fields[name].annotation)


def _holds_float(annotation: Any) -> bool:
    origin = get_origin(annotation)
    if origin is Annotated:
        return _holds_float(get_args(annotation)[0])
    if origin in (Union, UnionType):
        return any(_holds_float(item) for item in get_args(annotation))
    return annotation is float


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
        if (twice := _repeated(values)) is not None:
            raise input_error(path, f"sweep.{shown_key(key)}", f"{shown(twice)} twice", "each value once")
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


def _repeated(values: Sequence[Any]) -> Any:
    """The first value that stands in a list before; None where there is none."""
    seen = set()
    for value in values:
        if (known := repr(_comparable(value))) in seen:
            return value
        seen.add(known)
    return None


def _comparable(value: Any) -> Any:
    """Whole numbers as the equal numbers with a fraction."""
    if isinstance(value, list):
        return [_comparable(item) for item in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**53 else value


# A number of the first is the sum over the nodes; lists of the others are multiplied by a factor, or shifted.
WHOLE_FACE, SHIFTED = (
    tuple(key for key, meaning in MEANINGS.items() if meaning.nodes == kind) for kind in ("summed", "shifted")
)


def key_value(scene: Scene, key: str, contacts: Mapping[str, Contact] | None = None) -> float | None:
    """The value of a key as one number; None where it has none.

    `contacts`: sections by their tables, in place of those of the scene.
    """
    table, name = split_key(key)
    section: Any = (contacts or {}).get(table) or scene.section(table)
    value = None if section is None else getattr(section, name)
    if isinstance(value, tuple):
        return float(sum(value)) / (1.0 if of_contact(key) in WHOLE_FACE else len(value))
    value = mean_of(value)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def as_in_scene(scene: Scene, key: str, value: float) -> Any:
    """A value of `key_value` as the scene gives the key: a number, or a list or field of the same shape."""
    table, name = split_key(key)
    given = getattr(scene.section(table), name)
    now = key_value(scene, key)
    if isinstance(given, FaceField):
        scaled = of_contact(key) not in SHIFTED and given.mean != 0.0
        return given.with_mean(value, value / given.mean if scaled else 1.0)
    if not isinstance(given, tuple):
        return value
    assert now is not None
    if of_contact(key) in SHIFTED or now == 0.0:
        return [item + (value - now) for item in given]
    return [item * (value / now) for item in given]
