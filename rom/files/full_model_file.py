"""Full models as HDF5 files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rom.errors import FullModelFileError
from rom.files.hdf5 import UNREADABLE, new_hdf5, opened, stored_array, why_unreadable
from rom.finite_elements.full_model import FullModel

if TYPE_CHECKING:
    import h5py
    from scipy.sparse import csr_matrix

_FORMAT = "shroud-full-model-2"
_ARRAYS = ("positions", "vertex_node", "fixed", "centrifugal")


def save_full_model(path: str | Path, full: FullModel) -> None:
    """Write a full model to an HDF5 file, exactly.

    The file is written in place; an interrupted call leaves a partial file.
    """
    with new_hdf5(path) as file:
        file.attrs["format"] = _FORMAT
        file.attrs["element"] = full.element or ""
        file.attrs["speed_rpm"] = full.speed_rpm
        file.attrs["isotropic_mass"] = full.isotropic_mass
        for name in _ARRAYS:
            file[name] = getattr(full, name)
        for name, matrix in (("stiffness", full.stiffness), ("mass", full.mass)):
            _write_upper(file.create_group(name), matrix)


def load_full_model(path: str | Path) -> FullModel:
    """Read a full model written by `save_full_model`."""
    try:
        with opened(path) as file:
            if file.attrs.get("format") != _FORMAT:
                raise FullModelFileError(f"{path}: not a full model ({_FORMAT})")
            size = file["centrifugal"].shape[0]
            return FullModel(
                stiffness=_read_upper(file["stiffness"], size),
                mass=_read_upper(file["mass"], size),
                element=str(file.attrs["element"]) or None,
                speed_rpm=float(file.attrs["speed_rpm"]),
                isotropic_mass=bool(file.attrs.get("isotropic_mass", True)),
                **{name: stored_array(file[name]) for name in _ARRAYS},
            )
    except FullModelFileError:
        raise
    except UNREADABLE as error:
        raise FullModelFileError(f"{path}: cannot be read as a full model: {why_unreadable(error)}") from None


def _write_upper(group: h5py.Group, matrix: csr_matrix) -> None:
    """Write the upper triangle: half of the entries."""
    from scipy.sparse import triu

    upper = triu(matrix, format="csr")
    group["indptr"], group["indices"], group["data"] = upper.indptr, upper.indices.astype(np.int32), upper.data


def _read_upper(group: h5py.Group, size: int) -> csr_matrix:
    """Symmetric CSR matrix from its upper triangle."""
    from scipy.sparse import coo_matrix, csr_matrix

    upper = csr_matrix(tuple(stored_array(group[n]) for n in ("data", "indices", "indptr")), shape=(size, size))
    upper.check_format()  # SciPy would read beyond the arrays with indices out of range
    upper = upper.tocoo()
    off_diagonal = upper.row != upper.col
    rows = np.concatenate([upper.row, upper.col[off_diagonal]])
    columns = np.concatenate([upper.col, upper.row[off_diagonal]])
    return coo_matrix((np.concatenate([upper.data, upper.data[off_diagonal]]), (rows, columns)), (size, size)).tocsr()
