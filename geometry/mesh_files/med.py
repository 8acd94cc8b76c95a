"""MED files of Salome and Code_Aster (.med), by meshlane: groups become sets and surfaces."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from geometry.errors import MeshFileError
from geometry.hdf5_content import check_dataset, check_links
from geometry.mesh_files.file_mesh import CellBlock, FileMesh, add_cells_to_set, mesh_of_cells


def read_med(path: str | Path) -> FileMesh:
    """Nodes, elements and groups of a MED file."""
    meshlane = _optional_library("meshlane", path)
    try:
        _check_content(path)
        grid = meshlane.med.read(str(path))
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:  # whatever its parsers stumble over
        raise MeshFileError(path, f"cannot be read: {str(error) or type(error).__name__}") from None
    points = np.asarray(grid.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshFileError(path, f"has points of shape {points.shape}: must be (N, 3)")
    blocks, first = [], 1
    for cells in grid.cells:
        data = np.asarray(cells.data, dtype=np.int64)
        blocks.append(CellBlock(cells.type, data, np.arange(first, first + len(data))))
        first += len(data)
    mesh = mesh_of_cells(path, points, blocks)
    for name, members in grid.point_sets.items():
        mesh.node_sets[str(name)] = np.asarray(members, dtype=np.int64) + 1
    for name, groups in grid.cell_sets.items():
        for block, members in zip(blocks, groups, strict=True):
            if members is not None:
                add_cells_to_set(mesh, str(name), block, members)
    return mesh


def _optional_library(name: str, path: object) -> Any:
    """A module of the extra "meshes"."""
    if find_spec(name) is None:
        package = name.replace("_", "-")
        raise MeshFileError(path, f"needs the package {package}: pip install 'shroud[meshes]', or another format")
    return import_module(name)


def _check_content(path: str | Path) -> None:
    """Refuse links and data in other files, which meshlane would follow. Raises ValueError."""
    h5py = _optional_library("h5py", path)

    def check(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            check_dataset(item)

    with h5py.File(path, "r") as file:
        check_links(file)
        file.visititems(check)
