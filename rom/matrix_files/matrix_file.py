"""Reads and writes a matrix in any of the formats, chosen by the suffix of the file and its first bytes.

Matrix Market files (.mtx: coordinate and array format, general and symmetric) and Ansys .full files (through
ansys-mapdl-reader) are read here.

References
----------
R. F. Boisvert, R. Pozo, K. A. Remington, The Matrix Market exchange formats: initial design, NISTIR 5935 (1996).
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.matrix_files.calculix import SUFFIXES, read_abaqus, read_calculix, write_abaqus
from rom.matrix_files.labelled_matrix import (
    LARGEST,
    MASS,
    STIFFNESS,
    DofLabels,
    LabelledMatrix,
    check_numbers,
    from_entries,
    with_both_halves,
)
from rom.matrix_files.matlab_file import read_matlab, write_matlab_file
from rom.matrix_files.nastran import read_dmig, read_op4, write_op4

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from scipy.sparse import csr_matrix

BANNER = b"%%MatrixMarket"
FORMATS = ("matrix-market", "abaqus", "op4", "mat", "mat-7.3")
_ALLOWED = "a .full file with stiffness and mass, such as MODAL analyses write it"
_COMPONENTS = 6


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


def write_matrices(
    path: str | os.PathLike[str], content: Mapping[str, csr_matrix | NDArray[np.float64]], file_format: str
) -> list[Path]:
    """Write real matrices for other programs. `content` (n, m): the matrices by name; vectors become one column."""
    target = Path(path)
    if file_format not in FORMATS:
        raise MatrixFileError(path, f"format {file_format!r}", ", ".join(FORMATS))
    columns = {name: value.reshape(-1, 1) if value.ndim == 1 else value for name, value in content.items()}
    if file_format == "op4":
        write_op4(target, columns)
    elif file_format in ("mat", "mat-7.3"):
        write_matlab_file(target, columns, "7.3" if file_format == "mat-7.3" else "5")
    if file_format not in ("matrix-market", "abaqus"):
        return [target]
    write_one = write_matrix_market if file_format == "matrix-market" else write_abaqus
    files = []
    for name, value in columns.items():
        if file_format == "abaqus" and value.shape[0] != value.shape[1]:
            continue
        files.append(target.with_name(f"{target.stem}_{name}{target.suffix}"))
        write_one(files[-1], value, name)
    return files


def read_ansys_full(path: str | os.PathLike[str], name: str | None, usual: tuple[str, ...]) -> LabelledMatrix:
    """Stiffness or mass of a .full file with the dofs of its rows; constrained dofs are not in it.

    `name` or the usual names say which of the two. Raises MatrixFileError where the file is damaged.
    """
    try:
        from ansys.mapdl.reader.full import FullFile
    except ImportError:
        allowed = "pip install 'shroud[matrices]', or another format"
        raise MatrixFileError(path, "needs the package ansys-mapdl-reader", allowed) from None
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            dofs, stiffness, mass = FullFile(os.fspath(path)).load_km(as_sparse=True, sort=False)
    except Exception as error:  # the library raises whatever a damaged record makes of its arithmetic
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise MatrixFileError(path, f"not readable as an Ansys file: {reason}", _ALLOWED) from None
    wanted = usual[0] if name is None else name
    matrix = mass if wanted.casefold() in {known.casefold() for known in MASS} else stiffness
    dofs = np.asarray(dofs, dtype=np.int64)
    if matrix.shape != (len(dofs), len(dofs)) or np.any((dofs[:, 1] < 0) | (dofs[:, 1] >= _COMPONENTS)):
        raise MatrixFileError(path, "dofs other than displacements and rotations", _ALLOWED)
    return from_entries(path, matrix.tocoo(), DofLabels(dofs[:, 0], dofs[:, 1] + 1), half=True)


NAMED = {
    ".mat": read_matlab,
    ".op4": read_op4,
    ".pch": read_dmig,
    ".dmig": read_dmig,
    ".bdf": read_dmig,
    ".dat": read_dmig,
    ".full": read_ansys_full,
}


MATRIX_SUFFIXES = (".mtx", ".inp", *SUFFIXES, *NAMED)


def read_matrix(
    path: str | os.PathLike[str],
    name: str | None = None,
    usual: tuple[str, ...] = STIFFNESS,
    *,
    is_symmetric: bool = True,
) -> LabelledMatrix:
    """Read a matrix that another program wrote.

    Parameters
    ----------
    path : str or path
        Matrix Market or Abaqus (.mtx, .inp), CalculiX (.sti, .mas), MATLAB (.mat), Nastran OP4 (.op4) and DMIG (.pch,
        .dmig, .bdf, .dat), Ansys (.full).
    name : str, optional
        Name of the matrix, for files that hold several.
    usual : tuple of str
        Names that are looked for where no name is given.
    is_symmetric : bool
        Whether the matrix is to be symmetric; one half alone is then completed.

    Returns
    -------
    LabelledMatrix
        The matrix, and the dofs of its rows where the file names them.

    Raises
    ------
    MatrixFileError
        The file cannot be read, or the matrix is not what it is to be; the message is one line.

    Examples
    --------
    >>> from pathlib import Path
    >>> from rom import read_matrix
    >>> text = "%%MatrixMarket matrix coordinate real symmetric\\n2 2 3\\n1 1 2.0\\n2 1 -1.0\\n2 2 1.0\\n"
    >>> _ = Path("K.mtx").write_text(text)
    >>> read_matrix("K.mtx").matrix.toarray().tolist()
    [[2.0, -1.0], [-1.0, 1.0]]
    """
    suffix = Path(path).suffix.lower()
    allowed = f"a file with a matrix: {', '.join(MATRIX_SUFFIXES)}"
    if suffix not in MATRIX_SUFFIXES:
        raise MatrixFileError(path, f'ends with "{suffix}"', allowed)
    try:
        with Path(path).open("rb") as file:
            start = file.read(len(BANNER))
    except OSError as error:
        raise MatrixFileError(path, os.strerror(error.errno or 0).lower(), allowed) from None
    if not start:
        raise MatrixFileError(path, "an empty file", allowed)
    if suffix in NAMED:
        found = NAMED[suffix](path, name, usual)
    elif suffix in SUFFIXES:
        found = read_calculix(path)
    elif start.lower() == BANNER.lower():
        found = read_matrix_market(path)
    else:
        found = read_abaqus(path)
    return with_both_halves(path, found) if is_symmetric else found
