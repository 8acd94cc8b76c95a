"""Meshes of every kind of element: bricks cut into hexahedra, wedges or tetrahedra, then bent by a mapping."""

import numpy as np
from rom_meshes import box, mesh_of_blocks

from geometry import ElementBlock
from geometry.elements import ELEMENT_KINDS

KINDS = tuple(ELEMENT_KINDS)
QUADRATIC = tuple(name for name, kind in ELEMENT_KINDS.items() if kind.quadratic)
# Parts of a hexahedron; all diagonals of a side agree with those of the neighbour in a structured brick.
_PARTS = {
    4: ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)),
    6: ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
    8: ((0, 1, 2, 3, 4, 5, 6, 7),),
}


def cut(hexahedra, kind):
    """Corners (E, c) of the elements of a kind that hexahedra (h, 8) of a structured brick are cut into."""
    return np.concatenate([hexahedra[:, part] for part in _PARTS[ELEMENT_KINDS[kind].corners]])


def with_mid_sides(points, tables):
    """Points with one more in the middle of every edge of quadratic elements, and the blocks.

    The tables are (kind, corners (E, c), material).
    """
    edges = [np.array(ELEMENT_KINDS[kind].edges) for kind, _, _ in tables]
    ends = [
        np.sort(corners[:, edge], axis=-1).reshape(-1, 2) for edge, (_, corners, _) in zip(edges, tables, strict=True)
    ]
    needed = [end for end, (kind, _, _) in zip(ends, tables, strict=True) if ELEMENT_KINDS[kind].quadratic]
    if not needed:
        return points, [ElementBlock(*table) for table in tables]
    unique = np.unique(np.concatenate(needed), axis=0)
    keys = unique[:, 0] * len(points) + unique[:, 1]
    blocks = []
    for end, (kind, corners, material) in zip(ends, tables, strict=True):
        middle = len(points) + np.searchsorted(keys, end[:, 0] * len(points) + end[:, 1]).reshape(len(corners), -1)
        nodes = np.hstack([corners, middle]) if ELEMENT_KINDS[kind].quadratic else corners
        blocks.append(ElementBlock(kind, nodes, material))
    return np.vstack([points, points[unique].mean(axis=1)]), blocks


def brick(kind, divisions, lengths=(1.0, 1.0, 1.0), bend=None):
    """A mesh of a brick, its nodes moved by the mapping `bend` of points (n, 3): curved edges."""
    points, hexahedra = box(divisions, lengths)
    points, blocks = with_mid_sides(points, [(kind, cut(hexahedra, kind), "")])
    return mesh_of_blocks(points if bend is None else bend(points), *blocks)


def mixed_brick(bend=None, materials=("", "", "")):
    """hex20 below, wedge15 beside them and tet10 on top of the wedges: an L of 2 x 1 x 2 m."""
    points, hexahedra = box((4, 2, 4), (2.0, 1.0, 2.0))
    centre = points[hexahedra].mean(axis=1)
    right, high = centre[:, 0] > 1.0, centre[:, 2] > 1.0
    parts = (hexahedra[~right & ~high], hexahedra[right & ~high], hexahedra[right & high])
    kinds = ("hex20", "wedge15", "tet10")
    points, blocks = with_mid_sides(
        points, [(kind, cut(part, kind), name) for kind, part, name in zip(kinds, parts, materials, strict=True)]
    )
    used, rows = np.unique(np.concatenate([block.nodes.ravel() for block in blocks]), return_inverse=True)
    sizes = np.cumsum([block.nodes.size for block in blocks])[:-1]
    tables = [part.reshape(block.nodes.shape) for part, block in zip(np.split(rows, sizes), blocks, strict=True)]
    points = points[used]
    renumbered = [
        ElementBlock(block.kind, table, block.material) for block, table in zip(blocks, tables, strict=True)
    ]
    return mesh_of_blocks(points if bend is None else bend(points), *renumbered)


def arched(points):
    """An arch: x along an arc about the y axis, with a wavy thickness."""
    angle, radius = 0.6 * points[:, 0], 2.0 + points[:, 2]
    y = points[:, 1] * (1.0 + 0.1 * np.sin(2.0 * points[:, 0]))
    return np.column_stack([radius * np.sin(angle), y, radius * np.cos(angle)])


def wavy(points):
    """The unit cube with its inside bent; its faces stay flat and its edges where they are."""
    x, y, z = np.pi * points.T
    shift = 0.05 * np.column_stack([np.sin(x) * np.cos(y) * np.cos(z), np.sin(y) * np.cos(z), np.sin(z) * np.cos(x)])
    return points + shift


def moved(mesh, amount, seed=1):
    """The mesh with its inner corners moved at random and straight edges."""
    points = mesh.points.copy()
    corners = np.unique(np.concatenate([block.nodes[:, : block.topology.corners].ravel() for block in mesh.blocks]))
    low, high = points.min(axis=0), points.max(axis=0)
    inner = corners[np.all((points[corners] > low + 1e-9) & (points[corners] < high - 1e-9), axis=1)]
    points[inner] += np.random.default_rng(seed).uniform(-amount, amount, (len(inner), 3))
    for block in mesh.blocks:
        if block.topology.quadratic:
            edges = np.array(block.topology.edges)
            points[block.nodes[:, block.topology.corners :]] = points[block.nodes[:, edges]].mean(axis=2)
    return mesh_of_blocks(points, *mesh.blocks)


def split_to_tetrahedra(points, hexahedra):
    """tet10 with straight edges from any hexahedra: each is cut from its centre to two triangles on each side.

    The diagonal of a side starts at its lowest node, so neighbours agree.
    """
    kind = ELEMENT_KINDS["hex8"]
    centre = len(points) + np.arange(len(hexahedra))
    triangles = []
    for side in kind.sides:
        quad = hexahedra[:, side]
        first = np.argmin(quad, axis=1)
        turned = np.take_along_axis(quad, (first[:, None] + np.arange(4)) % 4, axis=1)
        triangles += [np.column_stack([turned[:, loop], centre]) for loop in ([0, 2, 1], [0, 3, 2])]
    points = np.vstack([points, points[hexahedra].mean(axis=1)])
    return with_mid_sides(points, [("tet10", np.concatenate(triangles), "")])
