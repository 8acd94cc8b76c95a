"""Matrix Market files (.mtx): coordinate and array format, general and symmetric.

References
----------
R. F. Boisvert, R. Pozo, K. A. Remington, The Matrix Market exchange formats: initial design, NISTIR 5935 (1996).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rom.errors import MatrixFileError
from rom.matrix_files.labelled_matrix import LARGEST, LabelledMatrix, check_numbers

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_matrix

BANNER = b"%%MatrixMarket"


def read_matrix_market(path: str | os.PathLike[str]) -> LabelledMatrix:
    """A real matrix of a Matrix Market file; the other half of a symmetric one is completed, as the format says.

    Raises MatrixFileError where the file is damaged, complex, skew-symmetric or without values.
    """
    from scipy.io import mminfo, mmread
    from scipy.sparse import csr_matrix

    try:
        rows, columns, entries, _, field, symmetry = mminfo(path)
    except (ValueError, TypeError, OverflowError, IndexError, UnicodeDecodeError) as error:
        raise MatrixFileError(path, f"not readable as Matrix Market: {error}", "a Matrix Market file") from None
    if field not in ("real", "integer"):
        raise MatrixFileError(path, f"numbers of the kind {field}", "real or integer")
    if symmetry not in ("general", "symmetric"):
        raise MatrixFileError(path, f"symmetry {symmetry}", "general or symmetric")
    if max(rows, columns) > LARGEST or entries > 40 * Path(path).stat().st_size:
        raise MatrixFileError(path, f"claims {rows} x {columns} with {entries} entries", "as many as the file holds")
    try:
        matrix = mmread(path, spmatrix=True)
    except (ValueError, TypeError, OverflowError, IndexError, UnicodeDecodeError, MemoryError) as error:
        raise MatrixFileError(path, f"not readable as Matrix Market: {error}", "a complete file") from None
    found = csr_matrix(matrix, dtype=np.float64)
    check_numbers(path, found.data)
    return LabelledMatrix(found)


def write_matrix_market(path: str | os.PathLike[str], matrix: csr_matrix | NDArray[np.float64], name: str) -> None:
    """Write a matrix with all digits; a symmetric one is written as its lower half."""
    from scipy.io import mmwrite
    from scipy.sparse import csr_matrix

    found = csr_matrix(matrix)
    symmetry = "symmetric" if found.shape[0] == found.shape[1] and not abs(found - found.T).nnz else "general"
    with open(path, "wb") as file:
        mmwrite(file, found, comment=name, precision=17, symmetry=symmetry)
