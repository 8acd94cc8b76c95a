"""Tables of text with a header: commas, semicolons or tabs between the columns."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError

Columns = dict[str, list[str]]


def read_table(path: str | os.PathLike[str], required: tuple[str, ...], optional: tuple[str, ...]) -> Columns:
    """The columns of a table by name, as text; lines that begin with # are comments.

    Raises MatrixFileError where the file cannot be read, a column is missing, unknown or given twice, or a line has
    another number of fields.
    """
    allowed = f"a table with the columns {', '.join(required)}" + (
        f" and any of {', '.join(optional)}" * bool(optional)
    )
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MatrixFileError(path, os.strerror(error.errno or 0).lower(), allowed) from None
    except UnicodeDecodeError:
        raise MatrixFileError(path, "not a text file", allowed) from None
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"]
    if not lines:
        raise MatrixFileError(path, "an empty table", allowed)
    delimiter = max(",;\t", key=lines[0][1].count)
    try:
        rows = list(csv.reader((line for _, line in lines), delimiter=delimiter))
    except csv.Error as error:
        raise MatrixFileError(path, f"not readable as a table: {error}", allowed) from None
    names = [name.strip().lower() for name in rows[0]]
    for name in required:
        if name not in names:
            raise MatrixFileError(path, f"no column {name}", allowed)
    for name in names:
        if name not in required + optional or names.count(name) > 1:
            raise MatrixFileError(path, f"column {name!r} unknown or given twice", allowed)
    for (number, _), row in zip(lines[1:], rows[1:], strict=True):
        if len(row) != len(names):
            found = f"line {number} has {len(row)} fields"
            raise MatrixFileError(path, found, f"{len(names)}: {', '.join(names)}")
    return {name: [row[k].strip() for row in rows[1:]] for k, name in enumerate(names)}


def numbers(
    path: str | os.PathLike[str], columns: Columns, name: str, *, empty: float | None = None
) -> NDArray[np.float64]:
    """A column as finite numbers; `empty`: what an empty field stands for. Raises MatrixFileError for others."""
    found = np.empty(len(columns[name]))
    for k, text in enumerate(columns[name]):
        try:
            value = empty if text == "" and empty is not None else float(text)
        except ValueError:
            value = np.nan
        if not np.isfinite(value) and not (text == "" and empty is not None):
            raise MatrixFileError(path, f"{name} in row {k + 1} is {text!r}", "a finite number")
        found[k] = value
    return found


def whole_numbers(path: str | os.PathLike[str], columns: Columns, name: str) -> NDArray[np.int64]:
    """A column as whole numbers. Raises MatrixFileError for others."""
    found = numbers(path, columns, name)
    wrong = np.flatnonzero((found % 1 != 0.0) | (np.abs(found) > 2**53))
    if len(wrong):
        raise MatrixFileError(path, f"{name} in row {wrong[0] + 1} is {columns[name][wrong[0]]!r}", "a whole number")
    return found.astype(np.int64)
