"""Ansys .full files with stiffness and mass, through ansys-mapdl-reader."""

from __future__ import annotations

import os
import warnings

import numpy as np

from rom.errors import MatrixFileError
from rom.matrix_files.labelled_matrix import DofLabels, LabelledMatrix, from_entries
from rom.matrix_files.matrix_names import MASS

_ALLOWED = "a .full file with stiffness and mass, such as MODAL analyses write it"
_COMPONENTS = 6


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
