"""VTK's unstructured grids (.vtu): any version, compression and encoding; fields become sets.

A point field ``set_NAME`` is a node set: 0 outside, else 1 + place in the set. A cell field ``set_NAME`` marks solids
(an element set) and faces (a surface and its nodes). Any other field of integers gives a set ``FIELD_VALUE`` for each
of its values but 0 at points, and for each of its values in cells.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geometry.errors import MeshFileError
from geometry.mesh_files.cells import CellBlock, add_cells_to_set, mesh_of_cells
from geometry.mesh_files.file_mesh import FileMesh
from geometry.mesh_files.vtk_xml import Grid, read_grid
from geometry.sector import IntArray

SET = "set_"
MOST_VALUES = 1000
# names of cells by their number in VTK and the number of their nodes; Lagrange cells of order 2 are numbered as the
# quadratic ones
NAMES = {
    (1, 1): "vertex", (3, 2): "line", (4, 2): "line", (21, 3): "line3", (68, 2): "line", (68, 3): "line3",
    (5, 3): "triangle", (69, 3): "triangle", (22, 6): "triangle6", (69, 6): "triangle6", (34, 7): "triangle7",
    (9, 4): "quad", (8, 4): "quad", (70, 4): "quad", (23, 8): "quad8", (28, 9): "quad9", (70, 9): "quad9",
    (10, 4): "tetra", (71, 4): "tetra", (24, 10): "tetra10", (71, 10): "tetra10",
    (13, 6): "wedge", (73, 6): "wedge", (26, 15): "wedge15", (32, 18): "wedge18", (73, 18): "wedge18",
    (12, 8): "hexahedron", (11, 8): "hexahedron", (72, 8): "hexahedron", (25, 20): "hexahedron20",
    (33, 24): "hexahedron24", (29, 27): "hexahedron27", (72, 27): "hexahedron27",
}  # fmt: skip
PYRAMIDS = (14, 27, 37, 74, 81)
ROWS = {8: [0, 1, 3, 2], 11: [0, 1, 3, 2, 4, 5, 7, 6]}  # pixels and voxels go row by row
SOLIDS = {  # of which those that are not in `NAMES` are refused
    31: "quadratic-linear wedge", 42: "polyhedron",
    71: "Lagrange tetrahedron", 72: "Lagrange hexahedron", 73: "Lagrange wedge",
    78: "Bezier tetrahedron", 79: "Bezier hexahedron", 80: "Bezier wedge",
    10: "tetrahedron", 11: "voxel", 12: "hexahedron", 13: "wedge", 24: "quadratic tetrahedron",
    25: "quadratic hexahedron", 26: "quadratic wedge", 29: "triquadratic hexahedron",
    32: "biquadratic wedge", 33: "biquadratic hexahedron",
}  # fmt: skip
LAGRANGE_HEXAHEDRON, SWAPPED_BEFORE = 72, (2, 1)  # files of earlier versions exchange its nodes 18 and 19


def read_vtu(path: str | Path) -> FileMesh:
    """Points, cells and sets of an unstructured grid."""
    grid = read_grid(path)
    blocks = _blocks(path, grid)
    mesh = mesh_of_cells(path, grid.points, blocks)
    if grid.pieces > 1:
        mesh.notes.append(f"holds {grid.pieces} pieces: points at their borders are not joined")
    for name, values in grid.at_points.items():
        for set_name, members in _sets_of(mesh, name, values, at_points=True):
            mesh.node_sets[set_name] = members + 1
    for block in blocks:
        for name, values in grid.in_cells.items():
            for set_name, members in _sets_of(mesh, name, values[block.labels - 1], at_points=False):
                add_cells_to_set(mesh, set_name, block, members)
    return mesh


def _blocks(path: str | Path, grid: Grid) -> list[CellBlock]:
    """Cells by their kind; labels are places in the file, from 1."""
    starts = np.concatenate([[0], grid.ends[:-1]])
    sizes = grid.ends - starts
    blocks = []
    for code, size in np.unique(np.column_stack([grid.codes, sizes]), axis=0).tolist():
        rows = np.flatnonzero((grid.codes == code) & (sizes == size))
        name = "pyramid" if code in PYRAMIDS else NAMES.get((code, size))
        if name is None and code in SOLIDS:
            raise MeshFileError(
                path,
                f"cell {rows[0] + 1} is a {SOLIDS[code]} of {size} nodes: must be a tetrahedron, wedge or hexahedron "
                "of order 1 or 2; write the file with such cells",
            )
        data = grid.connected[starts[rows][:, None] + np.arange(size)]
        if (code, size) == (LAGRANGE_HEXAHEDRON, 27) and grid.version < SWAPPED_BEFORE:
            data[:, [18, 19]] = data[:, [19, 18]]
        columns = ROWS.get(code, slice(None))
        blocks.append(CellBlock(name or f"of VTK type {code}", data[:, columns], rows + 1))
    return blocks


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
