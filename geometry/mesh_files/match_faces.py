"""Sides of elements found by their corners, for formats that give a surface as elements of its own."""

from __future__ import annotations

import numpy as np

from geometry.elements import ElementBlock, ElementSides
from geometry.sector import IntArray


def sides_with_corners(blocks: tuple[ElementBlock, ...], faces: list[IntArray]) -> ElementSides:
    """The sides of elements that have given corners; between two elements that of the first.

    Shapes: `faces` (k, 3).
    """
    corners = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *(face.ravel() for face in faces)]))
    wanted = {
        count: np.unique(np.sort(np.concatenate(same), axis=1), axis=0)
        for count in (3, 4)
        if (same := [face for face in faces if face.shape[1] == count])
    }
    taken = {count: np.zeros(len(rows), dtype=bool) for count, rows in wanted.items()}
    found: list[IntArray] = [np.empty((0, 3), dtype=np.int64)]
    for index, block in enumerate(blocks):
        near = np.isin(block.nodes[:, : block.topology.corners], corners)
        rows = np.flatnonzero(near.sum(axis=1) >= 3)
        for side, local in enumerate(block.topology.sides):
            if len(local) not in wanted:
                continue
            here = rows[near[rows][:, list(local)].all(axis=1)]
            place = _row_of(wanted[len(local)], np.sort(block.nodes[here][:, list(local)], axis=1))
            known = np.flatnonzero(place >= 0)
            known = known[~taken[len(local)][place[known]]]
            known = known[np.unique(place[known], return_index=True)[1]]
            taken[len(local)][place[known]] = True
            found.append(np.column_stack([np.full(len(known), index), here[known], np.full(len(known), side)]))
    sides = np.concatenate(found)
    sides = sides[np.lexsort(sides.T[::-1])]
    return ElementSides(sides[:, 0], sides[:, 1], sides[:, 2])


def free_sides(blocks: list[tuple[IntArray, tuple[tuple[int, ...], ...]]]) -> list[IntArray]:
    """Sides that only one element has.

    Shapes: `blocks` (E, b), returns (k, 2).
    """
    keys, owners = [], []
    for index, (nodes, sides) in enumerate(blocks):
        for side, local in enumerate(sides):
            key = np.full((len(nodes), 4), -1, dtype=np.int64)
            key[:, : len(local)] = np.sort(nodes[:, list(local)], axis=1)
            keys.append(key)
            count = len(nodes)
            owners.append(np.column_stack([np.full(count, index), np.arange(count), np.full(count, side)]))
    _, which, times = np.unique(np.concatenate(keys), axis=0, return_inverse=True, return_counts=True)
    free = np.concatenate(owners)[times[which.ravel()] == 1]
    return [free[free[:, 0] == index][:, 1:] for index in range(len(blocks))]


def _row_of(table: IntArray, rows: IntArray) -> IntArray:
    """Row of a table of distinct, sorted rows that equals each row; -1 for none."""
    if not len(rows):
        return np.empty(0, dtype=np.int64)
    _, which = np.unique(np.concatenate([table, rows]), axis=0, return_inverse=True)
    which = which.ravel()
    place: IntArray = np.full(int(which.max()) + 1, -1, dtype=np.int64)
    place[which[: len(table)]] = np.arange(len(table))
    return place[which[len(table) :]]
