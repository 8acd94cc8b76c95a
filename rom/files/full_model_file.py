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

    Parameters
    ----------
    path : str or path
        The file.
    full : FullModel
        The full model.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, opened, save_full_model
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> save_full_model("full.h5", assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8"))
    >>> with opened("full.h5") as file:
    ...     print(file.attrs["element"], file.attrs["speed_rpm"])
    hex8 0.0
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
    """Read a full model written by `save_full_model`.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    FullModel
        The full model, bit for bit.

    Raises
    ------
    FullModelFileError
        The file is missing or does not hold a full model.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, load_full_model, save_full_model
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> full = assemble(build_sector(blade, shroud, MeshParameters(size=0.02)), Material(2e11, 0.3, 7800.0), "hex8")
    >>> save_full_model("full.h5", full)
    >>> abs(load_full_model("full.h5").stiffness - full.stiffness).nnz
    0
    """
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
