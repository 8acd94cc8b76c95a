"""Writes an Ansys archive (.cdb): SOLID185 to SOLID187, prisms and linear tetrahedra with repeated nodes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geometry.mesh_files.written_mesh import WrittenMesh, lines_of
from geometry.sector import IntArray

TYPES = {"tet4": 185, "wedge6": 185, "hex8": 185, "wedge15": 186, "hex20": 186, "tet10": 187}
# place in the element here of each node in the archive
FORMS = {
    "tet4": [0, 1, 2, 2, 3, 3, 3, 3],
    "wedge6": [0, 1, 2, 2, 3, 4, 5, 5],
    "wedge15": [0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 2, 8, 9, 10, 5, 11, 12, 13, 14, 14],
}
LABELS = {"young_modulus": "EX", "poisson_ratio": "NUXY", "density": "DENS", "expansion": "ALPX"}


def ansys_lines(mesh: WrittenMesh) -> Iterator[str]:
    """Lines of the file."""
    yield "/PREP7"
    types = {code: number for number, code in enumerate(sorted({TYPES[block.kind] for block in mesh.blocks}), 1)}
    for code, number in types.items():
        yield f"ET,{number:9d},{code}"
    count = len(mesh.points)
    yield f"NBLOCK,6,SOLID,{mesh.node_labels.max():10d},{count:10d}"
    yield "(3i9,6e25.16e3)"
    for label, point in zip(mesh.node_labels.tolist(), mesh.points.tolist(), strict=True):
        yield f"{label:9d}{0:9d}{0:9d}" + "".join(f"{x:25.16E}" for x in point)
    yield "N,R5.3,LOC,       -1,"
    highest = max(int(labels.max()) for labels in mesh.element_labels)
    yield f"EBLOCK,19,SOLID,{highest:10d},{sum(map(len, mesh.blocks)):10d}"
    yield "(19i10)"
    materials = {name: number for number, name in enumerate(mesh.materials, 1)}
    spare = len(materials) + 1
    for index, block in enumerate(mesh.blocks):
        nodes = mesh.nodes_of(index)
        nodes = nodes[:, FORMS.get(block.kind, list(range(nodes.shape[1])))]
        material = materials.get(mesh.material_of(index), spare)
        head = [material, types[TYPES[block.kind]], 1, 1, 0, 0, 0, 0, nodes.shape[1], 0]
        yield from _rows(head, mesh.element_labels[index], nodes)
    yield f"{-1:10d}"
    for name, nodes in mesh.node_sets.items():
        yield from _component(name, "NODE", mesh.node_labels[nodes])
    for name, places in mesh.element_sets.items():
        yield from _component(name, "ELEM", mesh.labels_of(places))
    for name, number in materials.items():
        for key, label in LABELS.items():
            if key in mesh.materials[name]:
                yield f"MPDATA,R5.0, 1,{label:4s},{number:8d}, 1,{mesh.materials[name][key]:.16E},"
    yield "FINISH"


def _rows(head: list[int], labels: IntArray, nodes: IntArray) -> Iterator[str]:
    start = "".join(f"{x:10d}" for x in head)
    for label, row in zip(labels.tolist(), nodes.tolist(), strict=True):
        text = start + f"{label:10d}" + "".join(f"{x:10d}" for x in row[:8])
        yield text + ("\n" + "".join(f"{x:10d}" for x in row[8:]) if len(row) > 8 else "")


def _component(name: str, kind: str, labels: IntArray) -> Iterator[str]:
    yield f"CMBLOCK,{name:8s},{kind},{len(labels):10d}"
    yield "(8i10)"
    for row in lines_of(np.sort(labels), 8):
        yield "".join(f"{x:>10s}" for x in row)
