"""Small meshes with every kind of element, and their volumes by the divergence theorem."""

import numpy as np

from geometry import ElementBlock, ImportedMesh
from geometry.elements import ELEMENT_KINDS, sides_on

CORNERS = {
    "tet": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}
VOLUMES = {"tet": 1 / 6, "wedge": 1 / 2, "hex": 1.0}


def shape_of(kind):
    return kind.rstrip("0123456789")


def element_points(kind, shift=(0.0, 0.0, 0.0)):
    """Nodes of one element with straight edges; sheared, so that no two directions are alike."""
    topology = ELEMENT_KINDS[kind]
    corners = np.array(CORNERS[shape_of(kind)], dtype=float)
    corners = corners @ np.array([[1.0, 0.1, 0.0], [0.0, 1.0, 0.2], [0.3, 0.0, 1.0]]) + shift
    middles = [(corners[a] + corners[b]) / 2 for a, b in topology.edges if topology.quadratic]
    return np.vstack([corners, *middles])


def every_kind():
    """A mesh of one element of each kind, apart from each other, with irrational coordinates."""
    points, blocks, labels = [], [], []
    for number, kind in enumerate(ELEMENT_KINDS, 1):
        start = sum(map(len, points))
        points.append(np.pi / 300 * element_points(kind, (3.0 * number, -1.0, 0.1)))
        blocks.append(ElementBlock(kind, start + np.arange(len(points[-1]))[None]))
        labels.append(np.array([10 * number]))
    points = np.vstack(points)
    blocks = tuple(blocks)
    low = np.flatnonzero(points[:, 0] < 0.1)
    return ImportedMesh(
        "every_kind", points, 5 + 3 * np.arange(len(points)), blocks, tuple(labels),
        {"low": low}, {"pair": np.array([[1, 0], [4, 0]])},
        {"below": sides_on(blocks, np.arange(len(points)))},
    )  # fmt: skip


def volumes(mesh):
    """Volume of each block from the corners of all its sides, by the divergence theorem."""
    found = []
    for block in mesh.blocks:
        total = 0.0
        for side in block.topology.sides:
            x = mesh.points[block.nodes[:, list(side)]]
            for k in range(1, len(side) - 1):
                total += np.einsum("ei,ei->e", x[:, 0], np.cross(x[:, k], x[:, k + 1])).sum() / 6
        found.append(total)
    return found


def area(mesh, name):
    """Area of a surface of plane sides."""
    surface, total = mesh.surfaces[name], 0.0
    for block, element, side in zip(surface.block, surface.element, surface.side, strict=True):
        x = mesh.points[mesh.blocks[block].nodes[element][list(mesh.blocks[block].topology.sides[side])]]
        total += sum(np.linalg.norm(np.cross(x[k] - x[0], x[k + 1] - x[0])) / 2 for k in range(1, len(x) - 1))
    return total


def straight_middles(mesh, tolerance=1e-12):
    """Whether each mid-side node stands in the middle of the edge where it belongs."""
    for block in mesh.blocks:
        topology = block.topology
        if topology.quadratic:
            ends = mesh.points[block.nodes[:, np.array(topology.edges)]].mean(axis=2)
            middles = mesh.points[block.nodes[:, topology.corners :]]
            if np.abs(ends - middles).max() > tolerance:
                return False
    return True
