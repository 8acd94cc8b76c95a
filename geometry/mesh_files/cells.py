"""Cells of VTK and MED as elements and faces of a mesh file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.mesh_files.file_mesh import FileElements, FileMesh
from geometry.sector import FloatArray, IntArray

KINDS = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "wedge": "wedge6",
    "wedge15": "wedge15",
    "wedge18": "wedge15",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "hexahedron24": "hex20",
    "hexahedron27": "hex20",
}
NODES = {"wedge15": 15, "hex20": 20}
FACE_CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}


@dataclass(frozen=True)
class CellBlock:
    """Cells of one kind."""

    type: str  # name of the cell, as meshio has it
    data: IntArray  # (k, n), points of each cell, from 0, in the order of VTK
    labels: IntArray  # (k,), numbers of the cells in the file


def mesh_of_cells(path: object, points: FloatArray, cells: list[CellBlock]) -> FileMesh:
    """A mesh of points and blocks of cells; labels are places in the file, from 1.

    Shapes: `points` (N, 3).
    """
    mesh = FileMesh(str(path))
    mesh.points = np.ascontiguousarray(points, dtype=np.float64)
    mesh.node_labels = np.arange(1, len(points) + 1)
    for block in cells:
        if block.type.startswith("pyramid"):
            raise mesh.refuse(f"cell {block.labels[0]} is a pyramid: only tetrahedra, wedges and hexahedra are read")
        if block.type in KINDS:
            kind = KINDS[block.type]
            nodes = block.data + 1
            if (nodes < 1).any():
                raise mesh.refuse(f"{block.type} cells name point {nodes.min() - 1}: points are counted from 0")
            if nodes.shape[1] > NODES.get(kind, 20):
                mesh.notes.append(f"{block.type} cells are taken as {kind}: their inner nodes are left out")
                nodes = nodes[:, : NODES[kind]]
            mesh.elements.append(FileElements(kind, block.labels, nodes))
        elif block.type not in FACE_CORNERS and block.type not in ("vertex", "line", "line3"):
            mesh.leave_out("bodies", {f"cells {block.type}": len(block.data)})
    return mesh


def add_cells_to_set(mesh: FileMesh, name: str, block: CellBlock, inside: IntArray) -> None:
    """Put cells of a block into a set: solids into an element set, faces into a surface, all others into a node set.

    Shapes: `inside` (k,).
    """
    rows = np.asarray(inside, dtype=np.int64)
    if not len(rows):
        return
    if block.type in KINDS:
        before = mesh.element_sets.get(name, np.empty(0, dtype=np.int64))
        mesh.element_sets[name] = np.concatenate([before, block.labels[rows]])
        return
    nodes = block.data[rows] + 1
    if block.type in FACE_CORNERS:
        mesh.faces.setdefault(name, []).append(nodes[:, : FACE_CORNERS[block.type]])
    before = mesh.node_sets.get(name, np.empty(0, dtype=np.int64))
    everything = np.concatenate([before, nodes.ravel()])
    mesh.node_sets[name] = everything[np.sort(np.unique(everything, return_index=True)[1])]
