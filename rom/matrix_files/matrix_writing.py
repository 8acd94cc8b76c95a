"""Matrices to files that other programs read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import NDArray

from rom.errors import MatrixFileError
from rom.matrix_files.abaqus_matrix import write_abaqus
from rom.matrix_files.matlab_file import write_matlab_file
from rom.matrix_files.matrix_market import write_matrix_market
from rom.matrix_files.nastran_op4 import write_op4

if TYPE_CHECKING:
    import numpy as np
    from scipy.sparse import csr_matrix

FORMATS = ("matrix-market", "abaqus", "op4", "mat", "mat-7.3")


def write_matrices(
    path: str | os.PathLike[str], content: Mapping[str, csr_matrix | NDArray[np.float64]], file_format: str
) -> list[Path]:
    """Write real matrices for other programs.

    Parameters
    ----------
    path : str or path
        The file. Formats with one matrix a file put its name before the suffix: `blade.mtx` becomes
        `blade_stiffness.mtx` and so on.
    content : mapping of str to (n, m) array or sparse matrix
        The matrices by name; vectors become one column.
    file_format : {"matrix-market", "abaqus", "op4", "mat", "mat-7.3"}
        The format. Abaqus takes square symmetric matrices only, row k becomes dof 1 of node k; names in OP4 files are
        cut to 8 characters.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    MatrixFileError
        The format is unknown, or a package that it needs is missing.

    Examples
    --------
    >>> import numpy as np
    >>> from rom import read_matrix, write_matrices
    >>> files = write_matrices("blade.mtx", {"K": np.array([[2.0, -1.0], [-1.0, 1.0]])}, "matrix-market")
    >>> files[0].name, read_matrix(files[0]).matrix.toarray().tolist()
    ('blade_K.mtx', [[2.0, -1.0], [-1.0, 1.0]])
    """
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
