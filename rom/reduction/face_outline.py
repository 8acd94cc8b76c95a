"""Outline of a contact face that is no rectangle: straightened to a rectangle, so that the mortar holds for it too.

With the chord from s_a(r) to s_b(r) that the face has at a radius r, the coordinate

    xi = (s - (s_a + s_b) / 2) / ((s_b - s_a) / 2)

makes the area element a product, dA = (s_b - s_a) / 2 dxi dr on a flat face: tensor polynomials in (xi, r) with Gauss
points of the two measures are orthogonal. On parallelograms and trapezia s is in their space, from two points a
direction on: rigid rotations are exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry import ElementBlock, ElementSides

Array = NDArray[np.float64]
_SAME = 1e-7  # corners of the outline nearer than this, over the height of the face, are at one radius
_INSIDE = (0.25, 0.75)  # where in an interval its chord is taken


@dataclass(frozen=True)
class Outline:
    """Chords of a face between the radii of the corners of its outline."""

    radius: Array  # (m + 1,), radii of the corners, rising
    low: Array  # (m, 2), in each interval the chord's ends as polynomials: value at the lower radius, and slope
    high: Array  # (m, 2), in each interval the chord's ends as polynomials: value at the lower radius, and slope

    def straightened(self, s: Array, r: Array) -> Array:
        """xi (q,) of points with coordinates s and r (q,)."""
        interval = np.clip(np.searchsorted(self.radius, r) - 1, 0, len(self.low) - 1)
        above = r - self.radius[interval]
        low, high = (ends[interval, 0] + ends[interval, 1] * above for ends in (self.low, self.high))
        return np.asarray((2.0 * s - low - high) / (high - low))


def outline_edges(blocks: tuple[ElementBlock, ...], surface: ElementSides) -> NDArray[np.int64]:
    """Edges (e, 2) of a surface that belong to one of its sides only; halves of an edge with a mid-side node."""
    edges = []
    for index, block in enumerate(blocks):
        for side in range(len(block.topology.sides)):
            elements = surface.element[(surface.block == index) & (surface.side == side)]
            nodes = block.nodes[elements][:, list(block.topology.side_nodes(side))]
            count = len(block.topology.sides[side])
            order = list(range(count))
            if block.topology.quadratic:
                order = [k for corner in range(count) for k in (corner, count + corner)]
            ring = nodes[:, order]
            edges.append(np.stack([ring, np.roll(ring, -1, axis=1)], axis=-1).reshape(-1, 2))
    every = np.sort(np.concatenate(edges), axis=1)
    unique, uses = np.unique(every, axis=0, return_counts=True)
    return np.asarray(unique[uses == 1])


def outline(s: Array, r: Array) -> Outline | None:
    """The outline of edges with ends at s and r (e, 2); None where a line of constant r cuts it more than twice."""
    every = np.unique(r)
    height = every[-1] - every[0]
    radius = every[np.concatenate([[True], np.diff(every) > _SAME * height])]
    radius[-1] = every[-1]
    ends = []
    for share in _INSIDE:
        at = radius[:-1] + share * np.diff(radius)
        below, above = r.min(axis=1)[:, None] < at, r.max(axis=1)[:, None] > at
        cut = below & above
        if (cut.sum(axis=0) != 2).any():
            return None
        slope = (s[:, 1] - s[:, 0]) / np.where(r[:, 1] == r[:, 0], 1.0, r[:, 1] - r[:, 0])
        there = s[:, :1] + slope[:, None] * (at - r[:, :1])
        ends.append((np.where(cut, there, np.inf).min(axis=0), np.where(cut, there, -np.inf).max(axis=0)))
    steps = (_INSIDE[1] - _INSIDE[0]) * np.diff(radius)
    found = []
    for first, second in zip(*ends, strict=True):
        slope = (second - first) / steps
        found.append(np.stack([first - slope * _INSIDE[0] * np.diff(radius), slope], axis=1))
    return Outline(radius, found[0], found[1])
