"""A matrix from a file of any of the formats, chosen by its suffix and its first bytes."""

from __future__ import annotations

import os
from pathlib import Path

from rom.errors import MatrixFileError
from rom.matrix_files.abaqus_matrix import read_abaqus
from rom.matrix_files.ansys_full import read_ansys_full
from rom.matrix_files.calculix_storage import SUFFIXES, read_calculix
from rom.matrix_files.labelled_matrix import LabelledMatrix, with_both_halves
from rom.matrix_files.matlab_file import read_matlab
from rom.matrix_files.matrix_market import BANNER, read_matrix_market
from rom.matrix_files.matrix_names import STIFFNESS
from rom.matrix_files.nastran_dmig import read_dmig
from rom.matrix_files.nastran_op4 import read_op4

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
