"""Matrices of CalculiX and of Abaqus.

CalculiX stores .sti and .mas with one half, .dof with node and direction of each row. Abaqus writes with *MATRIX
OUTPUT and reads with *MATRIX INPUT (.mtx, .inp).
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.matrix_files.labelled_matrix import LARGEST, DofLabels, LabelledMatrix, from_entries

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

SUFFIXES = (".sti", ".mas")
_STORAGE_ALLOWED = "lines of row, column and value, as CalculiX writes them with SOLVER=MATRIXSTORAGE"
CONSTRAINED = 1e36  # Abaqus puts this on the diagonal of a dof with a boundary condition
_ALLOWED = "lines of node, dof, node, dof and value, or of row, column and value"


def read_calculix(path: str | os.PathLike[str]) -> LabelledMatrix:
    """A matrix of `*FREQUENCY, SOLVER=MATRIXSTORAGE`, with the dofs of the file .dof beside it.

    Raises MatrixFileError where a file is damaged or the two do not belong together.
    """
    from scipy.sparse import coo_matrix

    rows, columns, values = numbers_in(path, 3, _STORAGE_ALLOWED).T
    size = order_of(path, rows, columns)
    beside = Path(path).with_suffix(".dof")
    labels = read_calculix_dofs(beside) if beside.is_file() else None
    if labels is not None and len(labels) != size:
        raise MatrixFileError(path, f"{size} rows beside {len(labels)} dofs in {beside.name}", "the same number")
    entries = coo_matrix((values, (rows.astype(np.int64) - 1, columns.astype(np.int64) - 1)), shape=(size, size))
    return from_entries(path, entries, labels, half=True)


def read_calculix_dofs(path: str | os.PathLike[str]) -> DofLabels:
    """Node and direction of each row from a file .dof: lines such as 12.3."""
    allowed = "lines node.direction with directions 1 to 3, as CalculiX writes them"
    try:
        text = Path(path).read_text(encoding="ascii").split()
        pairs = np.array([[int(part) for part in line.split(".")] for line in text], dtype=np.int64)
    except (ValueError, OverflowError):
        raise MatrixFileError(path, "not readable as a table of dofs", allowed) from None
    if pairs.ndim != 2 or pairs.shape[1:] != (2,) or not len(pairs) or not np.isin(pairs[:, 1], (1, 2, 3)).all():
        raise MatrixFileError(path, "not readable as a table of dofs", allowed)
    return DofLabels(pairs[:, 0], pairs[:, 1])


def numbers_in(path: str | os.PathLike[str], per_line: int, allowed: str, text: str = "") -> NDArray[np.float64]:
    """All numbers (lines, per_line) of a text, by default that of the file. Raises MatrixFileError for others."""
    try:
        text = text or Path(path).read_text(encoding="ascii")
    except UnicodeDecodeError:
        raise MatrixFileError(path, "not a text file", allowed) from None
    text = text.replace(",", " ").replace("D", "E").replace("d", "E")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            found = np.fromstring(text, sep=" ")
        except (DeprecationWarning, ValueError):
            raise MatrixFileError(path, "text where numbers are expected", allowed) from None
    if not len(found) or len(found) % per_line:
        raise MatrixFileError(path, f"{len(found)} numbers, not {per_line} a line; it may be cut off", allowed)
    return found.reshape(-1, per_line)


def order_of(path: str | os.PathLike[str], rows: NDArray[np.float64], columns: NDArray[np.float64]) -> int:
    """Order of a square matrix with these row and column numbers. Raises MatrixFileError for impossible ones."""
    numbers = np.concatenate([rows, columns])
    if not np.isfinite(numbers).all() or np.any(numbers % 1) or numbers.min() < 1 or numbers.max() > LARGEST:
        raise MatrixFileError(path, "rows or columns that are no numbers from 1", f"whole numbers, 1 to {LARGEST}")
    return int(numbers.max())


def read_abaqus(path: str | os.PathLike[str]) -> LabelledMatrix:
    """A matrix in the format MATRIX INPUT, LABELS (five numbers a line) or COORDINATE (three numbers a line).

    Dofs with 1e36 on the diagonal are constrained; they are left out, with a note.
    Raises MatrixFileError where the file is damaged, or its two halves contradict each other.
    """
    from scipy.sparse import coo_matrix

    try:
        lines = Path(path).read_text(encoding="ascii").splitlines()
    except UnicodeDecodeError:
        raise MatrixFileError(path, "not a text file", _ALLOWED) from None
    keywords = " ".join(line.upper() for line in lines if line.startswith("*") and not line.startswith("**"))
    data = [line for line in lines if line.strip() and not line.startswith("*")]
    per_line = len(data[0].replace(",", " ").split()) if data else 0
    if per_line not in (3, 5):
        raise MatrixFileError(path, f"{per_line} numbers in the first line of data", _ALLOWED)
    table = numbers_in(path, per_line, _ALLOWED, "\n".join(data))
    labels = None
    if per_line == 3:
        size = order_of(path, table[:, 0], table[:, 1])
        row, column = table[:, 0].astype(np.int64) - 1, table[:, 1].astype(np.int64) - 1
    else:
        labels, row, column = _numbered(path, table)
        size = len(labels)
    unsymmetric = "UNSYMMETRIC" in keywords
    entries = coo_matrix((table[:, -1], (row, column)), shape=(size, size))
    return _without_constrained(from_entries(path, entries, labels, half=not unsymmetric))


def write_abaqus(path: str | os.PathLike[str], matrix: csr_matrix | NDArray[np.float64], name: str) -> None:
    """Write a symmetric matrix as *MATRIX INPUT with its lower half; row k is dof 1 of node k."""
    from scipy.sparse import tril

    lower = tril(matrix).tocoo()
    with open(path, "w", encoding="ascii") as file:
        file.write(f"** row k of the matrix is degree of freedom 1 of node k\n*MATRIX INPUT, NAME={name.upper()}\n")
        for row, column, value in zip(lower.row + 1, lower.col + 1, lower.data, strict=True):
            file.write(f"{row}, 1, {column}, 1, {value:.17e}\n")


def _numbered(
    path: str | os.PathLike[str], table: NDArray[np.float64]
) -> tuple[DofLabels, NDArray[np.int64], NDArray[np.int64]]:
    """Dofs of the rows, and the row and column of each entry."""
    where = np.concatenate([table[:, :2], table[:, 2:4]])
    if not np.isfinite(where).all() or np.any(where % 1) or np.abs(where).max() > 2**53:
        raise MatrixFileError(path, "nodes or dofs that are no whole numbers", _ALLOWED)
    pairs, place = np.unique(where.astype(np.int64), axis=0, return_inverse=True)
    place = place.reshape(-1)
    return DofLabels(pairs[:, 0], pairs[:, 1]), place[: len(table)], place[len(table) :]


def _without_constrained(found: LabelledMatrix) -> LabelledMatrix:
    matrix = found.matrix
    free = np.flatnonzero(matrix.diagonal() < CONSTRAINED)
    left_out = matrix.shape[0] - len(free)
    if not left_out or found.labels is None:
        return found
    labels = DofLabels(found.labels.node[free], found.labels.component[free])
    return LabelledMatrix(
        matrix[free][:, free], labels, (*found.notes, f"{left_out} constrained dofs (1e36) left out")
    )
