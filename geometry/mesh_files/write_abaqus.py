"""Writes an Abaqus or CalculiX input file (.inp)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geometry.mesh_files.written_mesh import WrittenMesh, lines_of

WIDTH = 20  # CalculiX reads no more characters of a number
TYPES = {"tet4": "C3D4", "tet10": "C3D10", "wedge6": "C3D6", "wedge15": "C3D15", "hex8": "C3D8", "hex20": "C3D20"}
PER_LINE = 11


def abaqus_lines(mesh: WrittenMesh) -> Iterator[str]:
    """Lines of the file."""
    yield "*NODE"
    for label, point in zip(mesh.node_labels.tolist(), mesh.points.tolist(), strict=True):
        yield f"{label}, " + ", ".join(map(abaqus_number, point))
    for index, block in enumerate(mesh.blocks):
        yield f"*ELEMENT, TYPE={TYPES[block.kind]}, ELSET=block_{index + 1}"
        rows = np.column_stack([mesh.element_labels[index], mesh.nodes_of(index)])
        for row in rows.tolist():
            yield ",\n".join(", ".join(map(str, row[k : k + PER_LINE])) for k in range(0, len(row), PER_LINE))
    for name, nodes in mesh.node_sets.items():
        yield f"*NSET, NSET={name}"
        yield from map(", ".join, lines_of(mesh.node_labels[nodes], PER_LINE))
    for name, places in mesh.element_sets.items():
        yield f"*ELSET, ELSET={name}"
        yield from map(", ".join, lines_of(mesh.labels_of(places), PER_LINE))
    for name, surface in mesh.surfaces.items():
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        labels = mesh.labels_of(np.column_stack([surface.block, surface.element]))
        for label, side in zip(labels.tolist(), surface.side.tolist(), strict=True):
            yield f"{label}, S{side + 1}"
    yield from _materials(mesh)


def abaqus_number(value: float) -> str:
    """The number with as many digits as 20 characters hold: a relative error of 1e-14 at most."""
    text = repr(value)
    digits = 17
    while len(text) > WIDTH:
        digits -= 1
        text = f"{value:.{digits}g}"
    return text


def _materials(mesh: WrittenMesh) -> Iterator[str]:
    for name, values in mesh.materials.items():
        yield f"*MATERIAL, NAME={name}"
        if "young_modulus" in values:
            yield f"*ELASTIC\n{abaqus_number(values['young_modulus'])}, {abaqus_number(values['poisson_ratio'])}"
        if "density" in values:
            yield f"*DENSITY\n{abaqus_number(values['density'])}"
        if "expansion" in values:
            yield f"*EXPANSION\n{abaqus_number(values['expansion'])}"
    for index in range(len(mesh.blocks)):
        if mesh.material_of(index) in mesh.materials:
            yield f"*SOLID SECTION, ELSET=block_{index + 1}, MATERIAL={mesh.material_of(index)}"
