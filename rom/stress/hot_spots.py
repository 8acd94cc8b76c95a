"""Hot spots: the largest values of a field on the mesh, apart from each other; which of them are singular."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.stress.stress_recovery import StressRecovery

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
# Distance from a singular place, relative to the diagonal of the bounding box of the body: fixed, so that what is
# outside converges as the mesh is refined.
NEAR = 0.02


@dataclass(frozen=True)
class Surroundings:
    """What is near each place of a recovery.

    Attributes
    ----------
    cause : (s,) array
        Number in `causes` of a singular place within one element or 2 % of the size of the body; -1: none.
    causes : tuple of str
        The causes, in the order of precedence.
    size : (s,) array
        Size of the elements at the place: diagonal of the largest of their bounding boxes, m.

    Examples
    --------
    >>> from rom import Surroundings
    >>> Surroundings(np.array([-1, 0]), ("clamped edge",), np.ones(2)).regular.tolist()
    [True, False]
    """

    cause: IntArray
    causes: tuple[str, ...]
    size: Array

    @property
    def regular(self) -> NDArray[np.bool_]:
        """Places (s,) at which the stress converges."""
        return self.cause < 0

    @classmethod
    def of(cls, recovery: StressRecovery, positions: Array, singular: Mapping[str, IntArray]) -> Surroundings:
        """Surroundings of the places of a recovery.

        Parameters
        ----------
        recovery : StressRecovery
            The recovery.
        positions : (n, 3) array
            Nodes, m.
        singular : mapping of str to (k,) array
            Singular nodes by their cause; the first cause takes precedence.
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

    Parameters
    ----------
    values : (s,) array
        The field.
    positions : (s, 3) array
        Where it is known, m.
    size : (s,) array
        Size of the elements there, m.
    chosen : (s,) array of bool
        The places that count.
    count : int
        Number of hot spots at most.

    Returns
    -------
    sequence of int
        Places, the highest first; fewer than `count` where there are no more.

    Examples
    --------
    >>> from rom import hot_spots
    >>> line = np.column_stack([np.arange(9.0), np.zeros(9), np.zeros(9)])
    >>> hot_spots(np.array([3.0, 5, 4, 1, 1, 1, 1, 2, 1]), line, np.ones(9), np.ones(9, bool), 2)
    [1, 7]
    """
    left = np.where(chosen & np.isfinite(values), values, -np.inf)
    found: list[int] = []
    while len(found) < count and left.size and np.max(left) > -np.inf:
        top = int(np.argmax(left))
        found.append(top)
        near = np.linalg.norm(positions - positions[top], axis=1) <= 3.0 * size[top]
        left[near] = -np.inf
    return found
