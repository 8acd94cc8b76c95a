"""Matrices that CalculiX stores: .sti and .mas with one half, .dof with node and direction of each row."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.matrix_files.labelled_matrix import LARGEST, DofLabels, LabelledMatrix, from_entries

SUFFIXES = (".sti", ".mas")
_STORAGE_ALLOWED = "lines of row, column and value, as CalculiX writes them with SOLVER=MATRIXSTORAGE"


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
