"""Hot spots: the largest values of a field on the mesh, apart from each other; which of them are singular.

Singular are the places where the stress of the model has no limit as the mesh is refined. At a sharp re-entrant edge
the stress of linear elasticity is infinite; so it is at the rim of a clamped surface, under a force on one node, at
the rim of a loaded contact face, and where two materials meet at the surface. A number found there says more of the
mesh than of the blade.

References
----------
M. L. Williams, Stress singularities resulting from various boundary conditions in angular corners of plates in
extension, J. Appl. Mech. 19 (1952) 526.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.stress.stress_recovery import StressRecovery

if TYPE_CHECKING:
    from geometry.elements import ElementBlock
    from geometry.sector import SectorMesh

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
# Angle inside the body, degrees, above which an edge counts as re-entrant. Sides of a fillet or of a curved surface
# meet at less.
REENTRANT = 210.0
# Distance from a singular place, relative to the diagonal of the bounding box of the body: fixed, so that what is
# outside converges as the mesh is refined.
NEAR = 0.02


@dataclass(frozen=True)
class BoundarySurface:
    """Sides on the surface and the edges between them."""

    # (S, 4), corners of each side, anticlockwise seen from outside; the fourth of a triangle is its third again
    sides: IntArray
    edges: IntArray  # (E, 2), ends of the edges at which exactly two sides meet
    pairs: IntArray  # (E, 2), the two sides of each edge
    # (E,), angle inside the body between the two sides, rad: below pi at convex edges, above it at re-entrant ones
    angle: Array
    crossed: IntArray  # (c, 2), ends of the edges at which more than two sides meet

    @classmethod
    def of(cls, blocks: Sequence[ElementBlock], points: Array) -> BoundarySurface:
        """The surface of blocks of elements with their nodes `points` (V, 3)."""
        sides = _free_sides(blocks)
        ends = np.stack([sides, np.roll(sides, -1, axis=1)], axis=-1).reshape(-1, 2)
        owner = np.repeat(np.arange(len(sides)), 4)
        real = ends[:, 0] != ends[:, 1]  # the fourth corner of a triangle makes none
        ends, owner = np.sort(ends[real], axis=1), owner[real]
        edges, place, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
        order = np.argsort(place.ravel(), kind="stable")
        first = np.concatenate([[0], np.cumsum(count)[:-1]])
        two = count == 2
        pairs = np.column_stack([owner[order][first[two]], owner[order][first[two] + 1]])
        return cls(sides, edges[two], pairs, _inner_angles(points[sides], pairs), edges[count > 2])


def _free_sides(blocks: Sequence[ElementBlock]) -> IntArray:
    """Corners (S, 4) of the sides that only one element has."""
    found = []
    for block in blocks:
        for corners in block.topology.sides:
            side = block.nodes[:, list(corners)]
            found.append(side if side.shape[1] == 4 else np.column_stack([side, side[:, -1]]))
    sides = np.concatenate(found).astype(np.int64)
    keys = sides.copy()
    keys[sides[:, 2] == sides[:, 3], 3] = -1  # whichever corner of a triangle is the last one
    _, first, count = np.unique(np.sort(keys, axis=1), axis=0, return_index=True, return_counts=True)
    return sides[np.sort(first[count == 1])]


def _inner_angles(corners: Array, pairs: IntArray) -> Array:
    """Angles (E,) inside the body between pairs of sides with corners (S, 4, 3)."""
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    flat = np.linalg.norm(normal, axis=1) == 0.0
    normal[flat] = np.cross(corners[flat, 1] - corners[flat, 0], corners[flat, 2] - corners[flat, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    middle = corners.mean(axis=1)
    one, other = pairs.T
    turn = np.arccos(np.clip(np.sum(normal[one] * normal[other], axis=1), -1.0, 1.0))
    rising = np.sum((middle[other] - middle[one]) * normal[one], axis=1) > 0.0
    return np.asarray(np.where(rising, np.pi + turn, np.pi - turn))


def singular_vertices(sector: SectorMesh, reentrant_degrees: float = REENTRANT) -> Mapping[str, IntArray]:
    """Vertices of a sector at which the stress does not converge, by the cause.

    `reentrant_degrees`: angle inside the body above which an edge is re-entrant, degrees. Returns (k,): sorted rows
    of `sector.points` for "re-entrant edge", "clamped edge", "contact edge", "material interface".
    """
    surface = BoundarySurface.of(sector.blocks, sector.points)
    sharp = surface.edges[np.degrees(surface.angle) > reentrant_degrees]
    faces = [
        _rim(surface, sector.node_sets[name]) for name in ("face_right", "face_left") if name in sector.node_sets
    ]
    return {
        "re-entrant edge": np.unique(np.concatenate([sharp.ravel(), surface.crossed.ravel()])),
        "clamped edge": _rim(surface, sector.node_sets["root"]),
        "contact edge": np.unique(np.concatenate([np.empty(0, dtype=np.int64), *faces])),
        "material interface": _interfaces(sector, surface),
    }


def point_loads(sector: SectorMesh, loaded: IntArray) -> IntArray:
    """Those of the loaded vertices (k,) with point forces: no side of an element there is loaded at all corners."""
    spread = []
    for block in sector.blocks:
        corners = block.nodes[:, : block.topology.corners]
        on = np.isin(corners, loaded)
        for side in block.topology.sides:
            spread.append(corners[on[:, side].all(axis=1)][:, side].ravel())
    return np.setdiff1d(loaded, np.concatenate(spread))


def _rim(surface: BoundarySurface, nodes: NDArray[np.integer]) -> IntArray:
    """Ends of the edges between a side with all its corners among some nodes and one that has not."""
    inside = np.asarray(np.isin(surface.sides, nodes).all(axis=1))
    one, other = surface.pairs.T
    return np.unique(surface.edges[inside[one] != inside[other]])


def _interfaces(sector: SectorMesh, surface: BoundarySurface) -> IntArray:
    """Vertices on the surface that elements of several materials share."""
    seen: dict[str, list[IntArray]] = {}
    for block in sector.blocks:
        seen.setdefault(block.material, []).append(np.unique(block.nodes))
    met = np.zeros(len(sector.points), dtype=np.int64)
    for parts in seen.values():
        met[np.unique(np.concatenate(parts))] += 1
    return np.intersect1d(np.flatnonzero(met > 1), surface.sides)


@dataclass(frozen=True)
class Surroundings:
    """What is near each place of a recovery."""

    # (s,) number in `causes` of a singular place within one element or 2 % of the size of the body; -1: none
    cause: IntArray
    causes: tuple[str, ...]  # the causes, in the order of precedence
    size: Array  # (s,) size of the elements at the place: diagonal of the largest of their bounding boxes, m

    @property
    def regular(self) -> NDArray[np.bool_]:
        """Places (s,) at which the stress converges."""
        return self.cause < 0

    @classmethod
    def of(cls, recovery: StressRecovery, positions: Array, singular: Mapping[str, IntArray]) -> Surroundings:
        """Surroundings of the places of a recovery.

        `positions` (n, 3): nodes, m; `singular` (k,): singular nodes by their cause; the first cause takes
        precedence.
        """
        cause = np.full(len(recovery.node), len(singular))
        size = np.zeros(len(recovery.node))
        marks = np.full(len(positions), len(singular))
        for number, nodes in reversed(list(enumerate(singular.values()))):
            marks[nodes] = number
        for block, places in zip(recovery.blocks, recovery.places, strict=True):
            corners = positions[block.nodes]
            extent = np.linalg.norm(np.ptp(corners, axis=1), axis=1)
            np.maximum.at(size, places, extent[:, None])
            np.minimum.at(cause, places, marks[block.nodes].min(axis=1)[:, None])
        _mark_near(cause, positions, recovery.node, marks)
        cause[cause == len(singular)] = -1
        return cls(cause, tuple(singular), size)


def _mark_near(cause: IntArray, positions: Array, node: IntArray, marks: IntArray) -> None:
    """Lower the causes of the places (s,) that are near a marked node; a higher number is no cause."""
    from scipy.spatial import cKDTree

    marked = np.flatnonzero(marks < marks.max())
    if len(marked) == 0:
        return
    reach = NEAR * float(np.linalg.norm(np.ptp(positions, axis=0)))
    distance, nearest = cKDTree(positions[marked]).query(positions[node], distance_upper_bound=reach)
    near = np.isfinite(distance)
    cause[near] = np.minimum(cause[near], marks[marked[nearest[near]]])


def hot_spots(values: Array, positions: Array, size: Array, chosen: NDArray[np.bool_], count: int) -> Sequence[int]:
    """Places of the largest values, each at least three elements away from the higher ones.

    `values` (s,): the field; `positions` (s, 3): where it is known, m; `size` (s,): size of the elements there, m;
    `chosen` (s,): the places that count. Returns places, the highest first; fewer than `count` where there are no
    more.
    """
    left = np.where(chosen & np.isfinite(values), values, -np.inf)
    found: list[int] = []
    while len(found) < count and left.size and np.max(left) > -np.inf:
        top = int(np.argmax(left))
        found.append(top)
        near = np.linalg.norm(positions - positions[top], axis=1) <= 3.0 * size[top]
        left[near] = -np.inf
    return found
