"""Nastran OP4 files, binary or text, dense or sparse, of either byte order, through pyYeti."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.matrix_files.labelled_matrix import LARGEST, LabelledMatrix, check_numbers
from rom.matrix_files.matrix_names import chosen_name

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_OP4_ALLOWED = "a complete OP4 file"
_LONGEST_NAME = 8


def read_op4(path: str | os.PathLike[str], name: str | None, usual: tuple[str, ...]) -> LabelledMatrix:
    """A matrix of an OP4 file: `name`, or the only one, or the first with a usual name.

    Raises MatrixFileError where the file is damaged or does not have the matrix; the message lists those it has.
    """
    from scipy.sparse import csr_matrix

    op4 = _library(path)
    size = Path(path).stat().st_size
    with np.printoptions(), np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            names, shapes, _, _ = op4.dir(os.fspath(path), verbose=False)
        except Exception as error:  # the library raises whatever a damaged record makes of its arithmetic
            raise MatrixFileError(path, f"not readable as OP4: {_reason(error)}", _OP4_ALLOWED) from None
        if not names:
            raise MatrixFileError(path, "no matrix, or cut off in the first one", _OP4_ALLOWED)
        chosen = chosen_name(path, name, tuple(names), usual)
        rows, columns = shapes[list(names).index(chosen)]
        if not min(rows, columns) > 0 or max(rows, columns) > min(LARGEST, 64 * size):
            raise MatrixFileError(path, f"{chosen} claims {rows} x {columns}", "as many rows as the file holds")
        try:
            matrix = op4.load(os.fspath(path), chosen, into="dct", justmatrix=True, sparse=True)[chosen.lower()]
        except Exception as error:
            raise MatrixFileError(path, f"{chosen} is not readable: {_reason(error)}", _OP4_ALLOWED) from None
    if matrix.shape != (rows, columns):
        raise MatrixFileError(path, f"{chosen} is cut off", _OP4_ALLOWED)
    found = csr_matrix(matrix)
    check_numbers(path, found.data)
    return LabelledMatrix(found.astype(np.float64))


def write_op4(path: str | os.PathLike[str], content: Mapping[str, csr_matrix | NDArray[np.float64]]) -> None:
    """Write matrices to a binary OP4 file; names have 8 characters at most, symmetric matrices the form 6."""
    op4 = _library(path)
    names = [name[:_LONGEST_NAME] for name in content]
    matrices = [np.atleast_2d(np.asarray(value)) for value in content.values()]
    forms = [
        6 if m.shape[0] == m.shape[1] and np.array_equal(m, m.T) else 2 - (m.shape[0] == m.shape[1]) for m in matrices
    ]
    with np.printoptions():
        op4.write(os.fspath(path), names, matrices, binary=True, sparse="dense", forms=forms)


def _library(path: str | os.PathLike[str]) -> Any:
    """The module pyyeti.nastran.op4; its import changes how NumPy prints numbers, which is undone."""
    options = np.get_printoptions()
    try:
        from pyyeti.nastran import op4
    except ImportError:
        raise MatrixFileError(
            path, "needs the package pyyeti", "pip install 'shroud[matrices]', or another format"
        ) from None
    finally:
        np.set_printoptions(**options)
    return op4


def _reason(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0] or type(error).__name__
