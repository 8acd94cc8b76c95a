"""VTK's unstructured grids (.vtu), by meshlane: fields named ``set_NAME`` and fields of integers become sets.

A point field ``set_NAME`` is a node set: 0 outside, else 1 + place in the set. A cell field ``set_NAME`` marks solids
(an element set) and faces (a surface and its nodes). Any other field of integers gives a set ``FIELD_VALUE`` for each
of its values but 0 at points, and for each of its values in cells.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geometry.errors import MeshFileError
from geometry.mesh_files.cells import add_cells_to_set, mesh_of_cells
from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.libraries import vtk_library
from geometry.sector import IntArray

SET = "set_"
MOST_VALUES = 1000


def read_vtu(path: str | Path) -> FileMesh:
    """Points, cells and sets of an unstructured grid.

    Parameters
    ----------
    path : str or path
        The file.

    Raises
    ------
    MeshFileError
        The file cannot be used.
    """
    try:
        grid = vtk_library().vtu.read(str(path))  # not its `read`, which ends the program on a bad file
    except MemoryError:
        raise
    except (Exception, SystemExit) as error:  # it raises whatever its parsers stumble over
        raise MeshFileError(path, f"cannot be read: {str(error) or type(error).__name__}") from None
    points = np.asarray(grid.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshFileError(path, f"has points of shape {points.shape}: must be (N, 3)")
    mesh = mesh_of_cells(path, points, grid.cells)
    for name, field in grid.point_data.items():
        for set_name, members in _sets_of(mesh, name, np.asarray(field), at_points=True):
            mesh.node_sets[set_name] = members + 1
    first = 1
    for index, block in enumerate(grid.cells):
        for name, fields in grid.cell_data.items():
            for set_name, members in _sets_of(mesh, name, np.asarray(fields[index]), at_points=False):
                add_cells_to_set(mesh, set_name, block, first, members)
        first += len(block.data)
    return mesh


def _sets_of(mesh: FileMesh, name: str, field: np.ndarray, at_points: bool) -> list[tuple[str, IntArray]]:
    """Names and members of the sets that a field stands for."""
    if field.ndim == 2 and field.shape[1] == 1:
        field = field[:, 0]
    if field.ndim != 1 or not len(field):
        return []
    if name.startswith(SET):
        inside = np.flatnonzero(field)
        inside = inside[np.argsort(field[inside], kind="stable")] if at_points else inside
        return [(name.removeprefix(SET), inside)]
    if field.dtype.kind not in "iub":
        return []
    values = np.unique(field)
    if len(values) > MOST_VALUES:
        mesh.notes.append(f"field {name} has {len(values)} values and is not taken for sets: at most {MOST_VALUES}")
        return []
    return [(f"{name}_{value}", np.flatnonzero(field == value)) for value in values if value != 0 or not at_points]
