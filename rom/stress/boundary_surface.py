"""Surface of a mesh: the sides that belong to one element only, and the edges at which two of them meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from geometry import ElementBlock

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


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
