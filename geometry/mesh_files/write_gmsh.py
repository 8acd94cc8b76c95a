"""Writes a file of gmsh (.msh, version 2.2): materials, surfaces and node sets are physical groups.

Each block is an entity of its own: gmsh loses elements where one has linear and quadratic elements of a shape.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geometry.mesh_files.gmsh import columns_from_gmsh
from geometry.mesh_files.written_mesh import WrittenMesh

CODES = {"tet4": 4, "hex8": 5, "wedge6": 6, "tet10": 11, "hex20": 17, "wedge15": 18}
FACE_CODES = {("tri", 3): 2, ("quad", 4): 3, ("tri", 6): 9, ("quad", 8): 16}
POINT = 15


def gmsh_lines(mesh: WrittenMesh) -> Iterator[str]:
    """Lines of the file."""
    volumes = {name: tag for tag, name in enumerate(dict.fromkeys(map(mesh.material_of, range(len(mesh.blocks)))), 1)}
    surfaces = {name: tag for tag, name in enumerate(mesh.surfaces, len(volumes) + 1)}
    points = {name: tag for tag, name in enumerate(mesh.node_sets, len(volumes) + len(surfaces) + 1)}
    yield "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames"
    groups = [(0, points), (2, surfaces), (3, volumes)]
    yield str(sum(len(names) for _, names in groups))
    for dimension, names in groups:
        for name, tag in names.items():
            yield f'{dimension} {tag} "{name}"'
    yield f"$EndPhysicalNames\n$Nodes\n{len(mesh.points)}"
    for label, point in zip(mesh.node_labels.tolist(), mesh.points.tolist(), strict=True):
        yield f"{label} " + " ".join(map(repr, point))
    rows = list(_elements(mesh, volumes, surfaces, points))
    yield f"$EndNodes\n$Elements\n{len(rows)}"
    yield from rows
    yield "$EndElements"


def _elements(
    mesh: WrittenMesh, volumes: dict[str, int], surfaces: dict[str, int], points: dict[str, int]
) -> Iterator[str]:
    for index, block in enumerate(mesh.blocks):
        tag = volumes[mesh.material_of(index)]
        columns = np.argsort(columns_from_gmsh(block.kind))
        for label, row in zip(
            mesh.element_labels[index].tolist(), mesh.nodes_of(index)[:, columns].tolist(), strict=True
        ):
            yield f"{label} {CODES[block.kind]} 2 {tag} {index + 1} " + " ".join(map(str, row))
    label = max(int(labels.max()) for labels in mesh.element_labels)
    entity = 0
    for name, surface in mesh.surfaces.items():
        for kind, faces in mesh.faces_of(surface):
            entity += 1
            code = FACE_CODES[kind, faces.shape[1]]
            for row in mesh.node_labels[faces].tolist():
                label += 1
                yield f"{label} {code} 2 {surfaces[name]} {entity} " + " ".join(map(str, row))
    for name, nodes in mesh.node_sets.items():
        for node in mesh.node_labels[nodes].tolist():
            label += 1
            yield f"{label} {POINT} 2 {points[name]} {points[name]} {node}"
