"""Tables of nodes and dofs that go with matrices: nodes.csv and dofs.csv.

They are text with a header, and commas, semicolons or tabs between the columns.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.matrix_files.calculix import read_calculix_dofs
from rom.matrix_files.labelled_matrix import DofLabels

Columns = dict[str, list[str]]
_NORMAL = ("nx", "ny", "nz")
_AXES = ("e1x", "e1y", "e1z", "e2x", "e2y", "e2z")
_COMPONENTS = {
    **{str(k): k for k in range(7)},
    **{name: k for k, name in enumerate(("", "x", "y", "z", "rx", "ry", "rz")) if name},
    **{name: k for k, name in enumerate(("", "ux", "uy", "uz", "rotx", "roty", "rotz")) if name},
}


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
            # decimal commas stand in tables with semicolons or tabs
            value = empty if text == "" and empty is not None else float(text.replace(",", "."))
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


@dataclass(frozen=True)
class NodeTable:
    """Nodes of a model from elsewhere, in its units and axes."""

    path: str  # the file
    labels: NDArray[np.int64]  # (n,) numbers of the nodes
    points: NDArray[np.float64]  # (n, 3) coordinates
    sets: Mapping[str, NDArray[np.int64]]  # (k,) rows by the name of the set, in the order of the table
    normals: NDArray[np.float64] | None = None  # (n, 3) outward normals; NaN where the table is empty
    area: NDArray[np.float64] | None = None  # (n,) areas that the nodes stand for; NaN where the table is empty
    # (n, 3, 3) rows: the axes of the displacements of each node; None: those of the coordinates
    axes: NDArray[np.float64] | None = None

    def rows_of(self, labels: NDArray[np.int64] | list[int]) -> NDArray[np.int64]:
        """Rows of nodes by number; -1 for one that the table does not have. `labels` (k,): numbers of nodes."""
        order = np.argsort(self.labels, kind="stable")
        place = np.minimum(np.searchsorted(self.labels[order], labels), len(order) - 1)
        found = order[place]
        return np.where(self.labels[found] == labels, found, -1)


def read_nodes(path: str | os.PathLike[str]) -> NodeTable:
    """Read a table of nodes."""
    columns = read_table(path, ("node", "x", "y", "z"), ("sets", "area", *_NORMAL, *_AXES))
    labels = whole_numbers(path, columns, "node")
    if not len(labels):
        raise MatrixFileError(path, "no nodes", "one node or more")
    if len(np.unique(labels)) < len(labels):
        values, counts = np.unique(labels, return_counts=True)
        raise MatrixFileError(path, f"node {values[counts > 1][0]} is given twice", "each node once")
    points = np.column_stack([numbers(path, columns, axis) for axis in "xyz"])
    members: dict[str, list[int]] = {}
    for row, text in enumerate(columns.get("sets", [])):
        for name in dict.fromkeys(text.replace(";", " ").split()):
            members.setdefault(name, []).append(row)
    return NodeTable(
        os.fspath(path),
        labels,
        points,
        {name: np.array(rows, dtype=np.int64) for name, rows in members.items()},
        _normals(path, columns),
        _areas(path, columns),
        _axes(path, columns),
    )


def read_dofs(path: str | os.PathLike[str]) -> DofLabels:
    """Read the dofs of the rows of a matrix.

    `path`: CSV with the columns node and component (1, 2, 3 or x, y, z: displacements; 4, 5, 6 or rx, ry, rz:
    rotations; 0: a generalised coordinate, whose node is of no account), one line for each row of the matrix in their
    order or with the column row, from 1; or a file .dof of CalculiX.
    """
    if Path(path).suffix.lower() == ".dof" and Path(path).is_file():
        return checked_dofs(path, read_calculix_dofs(path))
    columns = read_table(path, ("node", "component"), ("row",))
    component = np.empty(len(columns["component"]), dtype=np.int64)
    for k, text in enumerate(columns["component"]):
        if text.lower() not in _COMPONENTS:
            allowed = "1 to 3 or x, y, z, 4 to 6 or rx, ry, rz, 0 for a generalised coordinate"
            raise MatrixFileError(path, f"component in row {k + 1} is {text!r}", allowed)
        component[k] = _COMPONENTS[text.lower()]
    columns["node"] = [text or "0" for text in columns["node"]]
    node = np.where(component == 0, 0, whole_numbers(path, columns, "node"))
    if "row" in columns:
        row = whole_numbers(path, columns, "row")
        if not np.array_equal(np.sort(row), np.arange(1, len(row) + 1)):
            raise MatrixFileError(path, "rows that are not each number once", f"1 to {len(row)}")
        order = np.argsort(row)
        node, component = node[order], component[order]
    return checked_dofs(path, DofLabels(node, component))


def checked_dofs(path: str | os.PathLike[str], dofs: DofLabels) -> DofLabels:
    """The dofs themselves. Raises MatrixFileError where there are none or one is given twice."""
    if not len(dofs):
        raise MatrixFileError(path, "no dofs", "one dof or more")
    pairs, counts = np.unique(dofs.pairs[dofs.component > 0], axis=0, return_counts=True)
    if np.any(counts > 1):
        node, component = pairs[counts > 1][0]
        raise MatrixFileError(path, f"component {component} of node {node} is given twice", "each dof once")
    if np.any((dofs.component < 0) | (dofs.component > 6)):
        found = dofs.component[(dofs.component < 0) | (dofs.component > 6)][0]
        raise MatrixFileError(path, f"a dof of component {found}", "1 to 3 (displacements), 4 to 6 (rotations) or 0")
    return dofs


def _normals(path: str | os.PathLike[str], columns: dict[str, list[str]]) -> NDArray[np.float64] | None:
    if not _all_given(path, columns, _NORMAL):
        return None
    normals = np.column_stack([numbers(path, columns, name, empty=np.nan) for name in _NORMAL])
    length = np.linalg.norm(normals, axis=1)
    if np.any(length == 0.0):
        raise MatrixFileError(path, f"a normal of length 0 in row {int(np.argmin(length)) + 1}", "an outward normal")
    return np.asarray(normals / length[:, None])


def _areas(path: str | os.PathLike[str], columns: dict[str, list[str]]) -> NDArray[np.float64] | None:
    if "area" not in columns:
        return None
    area = numbers(path, columns, "area", empty=np.nan)
    if np.any(area <= 0.0):
        raise MatrixFileError(
            path, f"area in row {int(np.argmax(area <= 0.0)) + 1} is not above 0", "areas, or empty"
        )
    return area


def _axes(path: str | os.PathLike[str], columns: dict[str, list[str]]) -> NDArray[np.float64] | None:
    if not _all_given(path, columns, _AXES):
        return None
    table = np.column_stack([numbers(path, columns, name, empty=np.nan) for name in _AXES])
    table[np.isnan(table).all(axis=1)] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    first, second = table[:, :3], table[:, 3:]
    lengths = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        first, second = first / lengths[0][:, None], second / lengths[1][:, None]
    wrong = ~(np.abs(np.sum(first * second, axis=1)) < 1e-6)  # catches NaN too
    if np.any(wrong):
        raise MatrixFileError(path, f"the axes in row {int(np.argmax(wrong)) + 1}", "two axes at right angles")
    second = second - np.sum(first * second, axis=1)[:, None] * first
    second /= np.linalg.norm(second, axis=1)[:, None]
    return np.stack([first, second, np.cross(first, second)], axis=1)


def _all_given(path: str | os.PathLike[str], columns: dict[str, list[str]], names: tuple[str, ...]) -> bool:
    given = [name for name in names if name in columns]
    if given and len(given) < len(names):
        raise MatrixFileError(path, f"only the columns {', '.join(given)}", f"all of {', '.join(names)}, or none")
    return bool(given)
