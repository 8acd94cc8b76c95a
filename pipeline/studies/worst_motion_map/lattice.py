"""Points of a map as a triangulation: neighbours, and the part of each triangle that is nearest to each corner.

All is done in columns and rows of the grid, where neighbouring values are one apart: the axes of a map may be
logarithmic, and its values unevenly spaced.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def triangulated(places: Array) -> Indices:
    """Delaunay triangles of the points of a map.

    Shapes: `places` (n, 2), returns (t, 3).
    """
    from scipy.spatial import Delaunay

    corners = np.asarray(Delaunay(places).simplices, dtype=np.int64)
    a, b, c = (places[corners[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    corners[area < 0.0] = corners[area < 0.0][:, [0, 2, 1]]
    return corners[np.abs(area) > 1e-12]


def edges_of(triangles: Indices) -> Indices:
    """Pairs of neighbouring points, (e, 2), each once, the smaller number first."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def edge_numbers(triangles: Indices, edges: Indices) -> Indices:
    """Numbers of the edges of each triangle, (t, 3): those from corner 0 to 1, 1 to 2 and 2 to 0."""
    count = int(triangles.max(initial=0)) + 1
    known = edges[:, 0] * count + edges[:, 1]
    pairs = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    return np.searchsorted(known, pairs[:, :, 0] * count + pairs[:, :, 1])


def circumcentres(places: Array, triangles: Indices) -> Array:
    """Circumcentre of each triangle, (t, 2); it lies in the triangle unless that is obtuse."""
    a, b, c = (places[triangles[:, k]] for k in range(3))
    ab, ac = b - a, c - a
    twice = 2.0 * (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    b2, c2 = (ab**2).sum(axis=1), (ac**2).sum(axis=1)
    offset = np.stack([ac[:, 1] * b2 - ab[:, 1] * c2, ab[:, 0] * c2 - ac[:, 0] * b2], axis=1)
    return np.asarray(a + offset / twice[:, None])


def nearest_parts(places: Array, triangles: Indices) -> Array:
    """The part of each triangle that is nearest to each of its corners.

    Parts of a point from all its triangles are its cell: on a full grid a rectangle that ends half-way to its
    neighbours.
    Shapes: returns (t, 3, 4, 2).
    """
    corners = places[triangles]
    after = 0.5 * (corners + np.roll(corners, -1, axis=1))
    before = np.roll(after, 1, axis=1)
    centre = np.broadcast_to(circumcentres(places, triangles)[:, None], corners.shape)
    return np.stack([corners, after, centre, before], axis=2)


def separating_lines(places: Array, triangles: Indices, parted: NDArray[np.bool_]) -> Array:
    """Lines half-way between neighbours, across the edges of triangles that are `parted` (t, 3).

    Shapes: returns (m, 2, 2).
    """
    pieces = np.asarray(nearest_parts(places, triangles)[:, :, 1:3][parted])
    return pieces[np.abs(pieces[:, 0] - pieces[:, 1]).max(axis=1) > 1e-12]


def differing(triangles: Indices, classes: Sequence[object]) -> NDArray[np.bool_]:
    """Edges of triangles, (t, 3), whose ends are of different classes."""
    number = {each: k for k, each in enumerate(dict.fromkeys(classes))}
    of_point = np.array([number[each] for each in classes])
    return np.asarray(of_point[triangles] != of_point[np.roll(triangles, -1, axis=1)])
