"""Points of a sweep from a CSV file: a column for each key, a row for each point."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.errors import InputError, input_error, system_reason
from pipeline.scene.input_files import open_regular
from pipeline.scene.swept_keys import SWEPT_KEYS
from pipeline.scene.units import column_name
from pipeline.scene.validation_errors import unknown_key

LARGEST_FILE = 20_000_000
PLACE = "sweep.points"


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
            raise _refused(scene, f"{name} line {number}", found, f"{len(keys)}, one for each key")
        if "" in (cells := [cell.strip() for cell in row]):
            raise _refused(scene, f"{name} line {number}", f"no {keys[cells.index('')]}", "a value for each key")
    columns = {key: [_value(row[place]) for _, row in points] for place, key in enumerate(keys)}
    return columns, tuple(f"{PLACE} ({name} line {number})" for number, _ in points)


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
        reader = csv.reader(io.StringIO(content.decode("utf-8-sig"), newline=""), strict=True)
        return [(reader.line_num, row) for row in reader]
    except FileNotFoundError:
        raise _refused(scene, str(path), "no such file", allowed) from None
    except (OSError, ValueError) as error:
        reason = system_reason(error) if isinstance(error, OSError) else "no such name or not UTF-8 text"
        raise _refused(scene, str(path), f"cannot be read: {reason}", allowed) from None
    except csv.Error as error:
        raise _refused(scene, str(path), f"not CSV: {error}", allowed) from None


def _keys(scene: Path, name: str, header: Sequence[str]) -> list[str]:
    """The dotted keys of the columns."""
    spelled = {column_name(key): key for key in SWEPT_KEYS} | {key: key for key in SWEPT_KEYS}
    keys: list[str] = []
    for cell in header:
        key = spelled.get(cell.strip())
        if key is None:
            raise unknown_key(scene, cell.strip(), SWEPT_KEYS, f"{PLACE} ({name})")
        if key in keys:
            raise _refused(scene, name, f"two columns {key}", "each key once")
        keys.append(key)
    return keys


def _value(cell: str) -> Any:
    """A number, a list or a word."""
    try:
        return json.loads(cell)
    except ValueError:
        return cell.strip()


def _refused(scene: Path, name: str, found: str, allowed: str) -> InputError:
    return input_error(scene, f'{PLACE} = "{name}"', found, allowed)  # the whole name: a path may be long
