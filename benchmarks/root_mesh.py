"""Mesh of a blade with a dovetail root in the slot of a disk sector: `python -m benchmarks.root_mesh FILE`.

The section in the plane (y, z) is made of four-sided parts with straight edges, drawn along x. Blade and disk share
no nodes; the flanks of the root lie on those of the slot. The sets: BLADE_FLANKS, DISK_FLANKS, CYCLIC_HIGH,
CYCLIC_LOW, BORE, TIP, and with a damper PLATFORM_RIGHT, PLATFORM_LEFT, DAMPER_OWN, DAMPER_NEXT.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from geometry import ElementBlock, ImportedMesh
from geometry.elements import ELEMENT_KINDS

N_BLADES = 40
WIDTH = 0.02  # m, along x
HALF_PITCH = np.pi / N_BLADES
FLANK = ((0.009, 0.206), (0.005, 0.212))  # (y, z), ends of the right flank of the root, m
BORE = 0.15  # m
TIP = 0.30
PLATFORM = (0.232, 0.238)  # m, z of the underside of the platform at the root, and of its top
SAME = 1e-7  # m, nearer points are one

Point = tuple[float, float]


@dataclass(frozen=True)
class Part:
    """A four-sided part of the section, corners anticlockwise seen from +x in (y, z); elements along both edges."""

    corners: tuple[Point, Point, Point, Point]
    across: int
    along: int


def cut(z: float) -> Point:
    """The point of the right cut face at a height."""
    return z * float(np.tan(HALF_PITCH)), z


def blade_parts(fine: int = 1) -> list[Part]:
    """The right half of the blade from the bottom of the root to the tip."""
    (y0, z0), (y1, z1) = FLANK
    return [
        Part(((0.0, 0.203), (y0, 0.203), (y0, z0), (0.0, z0)), 2 * fine, fine),
        Part(((0.0, z0), (y0, z0), (y1, z1), (0.0, z1)), 2 * fine, 2 * fine),
        Part(((0.0, z1), (y1, z1), (y1, PLATFORM[0]), (0.0, PLATFORM[0])), 2 * fine, 3 * fine),
        Part(((0.0, PLATFORM[0]), (y1, PLATFORM[0]), (y1, PLATFORM[1]), (0.0, PLATFORM[1])), 2 * fine, fine),
        Part(((0.0, PLATFORM[1]), (y1, PLATFORM[1]), (0.0015, TIP), (0.0, TIP)), 2 * fine, 6 * fine),
    ]


def disk_parts(fine: int = 1, along_flank: int = 2) -> list[Part]:
    """The right half of the disk sector from the bore to the rim."""
    (y0, z0), (y1, z1) = FLANK
    slot = 0.0095
    return [
        Part(((0.0, BORE), (slot, BORE), (slot, 0.2), (0.0, 0.2)), 2 * fine, 3 * fine),
        Part(((slot, BORE), cut(BORE), cut(0.2), (slot, 0.2)), 2 * fine, 3 * fine),
        Part(((slot, 0.2), cut(0.2), cut(z0), (y0, z0)), 2 * fine, fine),
        Part(((y0, z0), cut(z0), cut(z1), (y1, z1)), 2 * fine, along_flank * fine),
        Part(((y1, z1), cut(z1), cut(0.218), (0.0055, 0.218)), 2 * fine, fine),
    ]


def platform_part(fine: int = 1) -> Part:
    """The right half of a platform, whose underside rises towards the neighbour."""
    end = 0.0155
    return Part(
        ((0.005, PLATFORM[0]), (end, PLATFORM[0] + 0.004), (end, PLATFORM[1] + 0.0015), (0.005, PLATFORM[1])),
        2 * fine,
        fine,
    )


def damper_part(fine: int = 1) -> Part:
    """A wedge under the platforms of two neighbours, its own side first; in the frame midway between them."""
    (y, z), (ye, ze) = platform_part().corners[:2]
    c, s = np.cos(HALF_PITCH), np.sin(HALF_PITCH)
    turned = [(c * p[0] - s * p[1], s * p[0] + c * p[1]) for p in ((y, z), (ye, ze))]
    low, high = ((float(p[0]), float(p[1])) for p in turned)
    return Part((low, (-low[0], low[1]), (-high[0], high[1]), high), 2 * fine, 2 * fine)


def mirrored(part: Part) -> Part:
    """The left half of a part."""
    a, b, c, d = ((-y, z) for y, z in part.corners)
    return Part((b, a, d, c), part.across, part.along)


def body(parts: list[Part], layers: int, turn: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and 20-node hexahedra (E, 20) of parts drawn along x, turned about it towards +y."""
    cells = [cell for part in parts for cell in _cells(part, layers)]
    corners = np.array(cells)
    points, index = _merged(corners.reshape(-1, 3))
    hexahedra = index.reshape(-1, 8)
    edges = np.array([[h[list(edge)] for edge in ELEMENT_KINDS["hex20"].edges] for h in hexahedra])
    unique, place = np.unique(np.sort(edges.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    middle = points[unique].mean(axis=1)
    nodes = np.hstack([hexahedra, len(points) + place.reshape(len(hexahedra), -1)])
    points = np.vstack([points, middle])
    c, s = np.cos(turn), np.sin(turn)
    y, z = points[:, 1].copy(), points[:, 2].copy()
    points[:, 1], points[:, 2] = c * y + s * z, c * z - s * y
    return points, nodes


def _cells(part: Part, layers: int) -> list[np.ndarray]:
    """Corners (8, 3) of the elements of a part."""
    p = np.array(part.corners)
    s, t = np.meshgrid(np.linspace(0, 1, part.across + 1), np.linspace(0, 1, part.along + 1), indexing="ij")
    s, t = s[..., None], t[..., None]
    grid = (1 - s) * (1 - t) * p[0] + s * (1 - t) * p[1] + s * t * p[2] + (1 - s) * t * p[3]
    x = np.linspace(-WIDTH / 2, WIDTH / 2, layers + 1)
    found = []
    for k in range(layers):
        for i in range(part.across):
            for j in range(part.along):
                quad = [grid[i, j], grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1]]
                found.append(np.array([[at, *q] for at in (x[k], x[k + 1]) for q in quad]))
    return found


def _merged(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distinct points and the place of each."""
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    place = np.arange(len(points))
    for i, j in sorted(map(tuple, tree.query_pairs(SAME))):
        place[j] = min(place[j], place[i])
    while not np.array_equal(place, place[place]):
        place = place[place]
    kept, index = np.unique(place, return_inverse=True)
    return points[kept], index


def root_mesh(
    fine: int = 1, layers: int = 3, along_flank: int = 2, damper: bool = False, merged: bool = False
) -> ImportedMesh:
    """Blade and disk sector, with an elastic damper or with the nodes of the flanks merged where asked for."""
    halves = blade_parts(fine) + ([platform_part(fine)] if damper else [])
    bodies = [body([*halves, *map(mirrored, halves)], layers)]
    halves = disk_parts(fine, along_flank)
    bodies.append(body([*halves, *map(mirrored, halves)], layers))
    if damper:
        bodies.append(body([damper_part(fine)], layers, turn=HALF_PITCH))
    first = np.cumsum([0, *(len(points) for points, _ in bodies)])
    points = np.vstack([points for points, _ in bodies])
    nodes = np.vstack([cells + start for (_, cells), start in zip(bodies, first, strict=False)])
    owner = np.repeat(np.arange(len(bodies)), [len(each) for each, _ in bodies])
    sets = _sets(points, owner)
    if damper:
        sets |= _damper_sets(points, owner)
    if merged:
        points, index = _merged(points)
        nodes = index[nodes]
        sets = {name: np.unique(index[rows]) for name, rows in sets.items()}
    steel = {"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}
    counts = [sum(len(cells) for _, cells in bodies[:2]), *(len(cells) for _, cells in bodies[2:])]
    names = ("STEEL", "DAMPER")[: len(counts)]
    parts = np.split(np.arange(len(nodes)), np.cumsum(counts)[:-1])
    blocks = tuple(ElementBlock("hex20", nodes[rows], name) for rows, name in zip(parts, names, strict=True))
    labels, numbers = tuple(rows + 1 for rows in parts), np.arange(1, len(points) + 1)
    return ImportedMesh("root.inp", points, numbers, blocks, labels, sets, materials=dict.fromkeys(names, steel))


def _sets(points: np.ndarray, owner: np.ndarray) -> dict[str, np.ndarray]:
    _, y, z = points.T
    (y0, z0), (y1, z1) = FLANK

    def on(line: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        return np.abs(line(y, z)) < SAME

    slope = (y1 - y0) / (z1 - z0)
    flanks = (np.abs(np.abs(y) - y0 - slope * (z - z0)) < SAME) & (z > z0 - SAME) & (z < z1 + SAME)
    rows = {
        "BLADE_FLANKS": flanks & (owner == 0),
        "DISK_FLANKS": flanks & (owner == 1),
        "CYCLIC_HIGH": on(lambda y, z: y - z * np.tan(HALF_PITCH)) & (owner == 1),
        "CYCLIC_LOW": on(lambda y, z: y + z * np.tan(HALF_PITCH)) & (owner == 1),
        "BORE": (np.abs(z - BORE) < SAME) & (owner == 1),
        "TIP": (np.abs(z - TIP) < SAME) & (owner == 0),
    }
    return {name: np.flatnonzero(chosen) for name, chosen in rows.items()}


def _damper_sets(points: np.ndarray, owner: np.ndarray) -> dict[str, np.ndarray]:
    """Undersides of the platforms where the damper lies, and the two flanks of the damper."""
    (y0, z0), (y1, z1) = platform_part().corners[:2]
    along = np.array([y1 - y0, z1 - z0]) / np.hypot(y1 - y0, z1 - z0)

    def under(sign: float, turn: float) -> np.ndarray:
        c, s = np.cos(turn), np.sin(turn)
        y, z = sign * (c * points[:, 1] + s * points[:, 2]), c * points[:, 2] - s * points[:, 1]
        off = (y - y0) * along[1] - (z - z0) * along[0]
        return (np.abs(off) < SAME) & (y > y0 - SAME) & (y < y1 + SAME)

    rows = {
        "PLATFORM_RIGHT": under(1.0, 0.0) & (owner == 0),
        "PLATFORM_LEFT": under(-1.0, 0.0) & (owner == 0),
        "DAMPER_OWN": under(1.0, 0.0) & (owner == 2),
        "DAMPER_NEXT": under(-1.0, -2.0 * HALF_PITCH) & (owner == 2),
    }
    return {name: np.flatnonzero(chosen) for name, chosen in rows.items()}


if __name__ == "__main__":
    from tests.mesh_writer import write_mesh

    write_mesh(sys.argv[1], root_mesh())
