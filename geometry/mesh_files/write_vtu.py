"""Writes an unstructured grid of VTK (.vtu), by meshlane: sets and surfaces as fields ``set_NAME``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geometry.mesh_files.libraries import vtk_library
from geometry.mesh_files.vtu import SET
from geometry.mesh_files.written_mesh import WrittenMesh

CELLS = {
    **{"tet4": "tetra", "tet10": "tetra10", "wedge6": "wedge", "wedge15": "wedge15"},
    **{"hex8": "hexahedron", "hex20": "hexahedron20"},
}
FACES = {("tri", 3): "triangle", ("tri", 6): "triangle6", ("quad", 4): "quad", ("quad", 8): "quad8"}


def write_vtu(path: str | Path, mesh: WrittenMesh) -> None:
    """Write the file."""
    library = vtk_library()

    fields = {}
    for name, nodes in mesh.node_sets.items():
        fields[SET + name] = np.zeros(len(mesh.points))
        fields[SET + name][nodes] = 1 + np.arange(len(nodes))
    cells = [(CELLS[block.kind], block.nodes) for block in mesh.blocks]
    marks: dict[str, dict[int, np.ndarray]] = {}
    for name, places in mesh.element_sets.items():
        for index, block in enumerate(mesh.blocks):
            inside = np.zeros(len(block))
            inside[places[places[:, 0] == index, 1]] = 1
            marks.setdefault(SET + name, {})[index] = inside
    for name, surface in mesh.surfaces.items():
        for kind, faces in mesh.faces_of(surface):
            marks.setdefault(SET + name, {})[len(cells)] = np.ones(len(faces))
            cells.append((FACES[kind, faces.shape[1]], faces))
    cell_fields = {
        name: [own.get(index, np.zeros(len(nodes))) for index, (_, nodes) in enumerate(cells)]
        for name, own in marks.items()
    }
    library.vtu.write(str(path), library.Mesh(mesh.points, cells, fields, cell_fields))
