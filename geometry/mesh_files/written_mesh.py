"""A mesh as the writers of mesh files need it: by labels, with its surfaces also as node sets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from geometry.elements import ElementBlock, ElementSides, sides_on
from geometry.imported_mesh import ImportedMesh
from geometry.sector import FloatArray, IntArray, SectorMesh

MATERIAL = "MATERIAL"  # name of the material of blocks without one
FACES = ("face_right", "face_left")


@dataclass(frozen=True)
class WrittenMesh:
    """What is written."""

    points: FloatArray  # (N, 3), nodes
    node_labels: IntArray  # (N, 3), nodes
    blocks: tuple[ElementBlock, ...]  # (E,), elements
    element_labels: tuple[IntArray, ...]  # (E,), elements
    node_sets: dict[str, IntArray]  # (k,), rows of the points
    element_sets: dict[str, IntArray]  # (k, 2), block and element
    surfaces: dict[str, ElementSides]  # surfaces
    materials: dict[str, dict[str, float]]  # properties by the name of the material of a block

    def nodes_of(self, block: int) -> IntArray:
        """Labels of the nodes of each element of a block (E, b)."""
        return self.node_labels[self.blocks[block].nodes]

    def material_of(self, block: int) -> str:
        """Name of the material of a block in the file."""
        return self.blocks[block].material or MATERIAL

    def labels_of(self, places: IntArray) -> IntArray:
        """Labels of elements (k,).

        Shapes: `places` (k, 2).
        """
        labels = np.empty(len(places), dtype=np.int64)
        for index, own in enumerate(self.element_labels):
            here = places[:, 0] == index
            labels[here] = own[places[here, 1]]
        return labels

    def faces_of(self, surface: ElementSides) -> Iterator[tuple[str, IntArray]]:
        """Kind ("tri" or "quad") and rows of the nodes (k, c) of the faces of a surface, corners first."""
        for index, block in enumerate(self.blocks):
            for side, corners in enumerate(block.topology.sides):
                elements = surface.element[(surface.block == index) & (surface.side == side)]
                if len(elements):
                    nodes = block.nodes[elements][:, list(block.topology.side_nodes(side))]
                    yield ("tri" if len(corners) == 3 else "quad"), nodes


def written_mesh(mesh: SectorMesh | ImportedMesh, materials: Mapping[str, Mapping[str, float]] | None) -> WrittenMesh:
    """The mesh by labels; a sector gets labels from 1."""
    surfaces = dict(mesh.surfaces)
    if isinstance(mesh, ImportedMesh):
        node_labels, element_labels = mesh.node_labels, mesh.element_labels
        everything = np.concatenate(element_labels)
        if len(np.unique(everything)) < len(everything):
            element_labels = _numbered(mesh.blocks)
        element_sets = dict(mesh.element_sets)
        materials = mesh.materials if materials is None else materials
    else:
        node_labels = np.arange(1, len(mesh.points) + 1)
        element_labels = _numbered(mesh.blocks)
        element_sets = {}
        for name in FACES:
            if name not in surfaces and name in mesh.node_sets:
                surfaces[name] = sides_on(mesh.blocks, mesh.node_sets[name])
    node_sets = {name: nodes for name, nodes in mesh.node_sets.items() if len(nodes)}
    for name, surface in surfaces.items():
        node_sets.setdefault(name, surface.nodes(mesh.blocks))
    named = {name or MATERIAL: dict(values) for name, values in (materials or {}).items()}
    return WrittenMesh(
        mesh.points, node_labels, mesh.blocks, element_labels, node_sets, element_sets, surfaces, named
    )


def _numbered(blocks: tuple[ElementBlock, ...]) -> tuple[IntArray, ...]:
    """Labels from 1, block by block."""
    ends = np.cumsum([len(block) for block in blocks])
    return tuple(np.arange(last - len(block) + 1, last + 1) for block, last in zip(blocks, ends, strict=True))


def lines_of(values: IntArray, count: int) -> Iterator[list[str]]:
    """Numbers as text, some to a line.

    Shapes: `values` (k,).
    """
    text = list(map(str, values.tolist()))
    for start in range(0, len(text), count):
        yield text[start : start + count]
