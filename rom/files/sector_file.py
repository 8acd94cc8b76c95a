"""Sectors as HDF5 files, bit for bit."""

from pathlib import Path
from typing import Any

import numpy as np

from geometry import ContactFace, SectorFileError, SectorMesh, check_sector
from rom.files.hdf5_reading import UNREADABLE, opened, stored_array, why_unreadable
from rom.files.hdf5_writing import new_hdf5

FORMAT = "1"
FACE_FIELDS = ("nodes", "position", "frame", "area")


def save_sector(path: str | Path, sector: SectorMesh) -> None:
    """Write a sector to an HDF5 file: `points`, `hexahedra` and the groups `node_sets`, `right` and `left`.

    The file is written in place; an interrupted call leaves a partial file.

    Parameters
    ----------
    path : str or path
        The file.
    sector : SectorMesh
        The mesh.
    """
    with new_hdf5(path) as file:
        file.attrs["format"] = FORMAT
        file.attrs["n_blades"] = sector.n_blades
        file["points"] = sector.points
        file["hexahedra"] = sector.hexahedra
        for name, nodes in sector.node_sets.items():
            file[f"node_sets/{name}"] = nodes
        for side in ("right", "left"):
            for field in FACE_FIELDS:
                file[f"{side}/{field}"] = getattr(getattr(sector, side), field)


def load_sector(path: str | Path) -> SectorMesh:
    """Read a sector written by `save_sector`.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    SectorMesh
        The mesh.

    Raises
    ------
    SectorFileError
        The file is missing or does not hold a sector.
    """
    try:
        with opened(path) as file:
            if file.attrs.get("format") != FORMAT:
                raise SectorFileError(f"{path}: not a sector of format {FORMAT}")
            sets = {name: _integers(nodes) for name, nodes in file["node_sets"].items()}
            sector = SectorMesh(
                points=_reals(file["points"]),
                hexahedra=_integers(file["hexahedra"]),
                node_sets=sets,
                right=_face(file["right"]),
                left=_face(file["left"]),
                n_blades=int(file.attrs["n_blades"]),
            )
    except SectorFileError:
        raise
    except UNREADABLE as error:
        raise SectorFileError(f"{path}: not a sector: {why_unreadable(error)}") from error
    check_sector(path, sector)
    return sector


def _face(group: Any) -> ContactFace:
    return ContactFace(
        _integers(group["nodes"]), _reals(group["position"]), _reals(group["frame"]), _reals(group["area"])
    )


def _integers(dataset: Any) -> np.ndarray:
    values = stored_array(dataset)
    if values.dtype.kind not in "iu":
        raise TypeError(f"{dataset.name} holds no integers")
    return values.astype(np.int64)


def _reals(dataset: Any) -> np.ndarray:
    values = stored_array(dataset)
    if values.dtype.kind != "f":
        raise TypeError(f"{dataset.name} holds no real numbers")
    return values.astype(np.float64)
