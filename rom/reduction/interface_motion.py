"""Motions of nodes that a few coordinates stand for, as boundary dofs beside the contact nodes and the tip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class WaveReference:
    """Natural frequencies of the whole mesh at a nodal diameter.

    Attributes
    ----------
    nodal_diameter : int
        Number of nodal diameters.
    frequency_hz : (m,) array
        The lowest frequencies, Hz, ascending.
    sampled : bool
        Whether the motions of the cut faces were taken from these modes too.
    """

    nodal_diameter: int
    frequency_hz: NDArray[np.float64]
    sampled: bool


@dataclass(frozen=True)
class InterfaceMotion:
    """Cut faces of a sector whose k nodes move in c given patterns.

    Attributes
    ----------
    nodes : (k,) array
        Nodes of the full model.
    rows : (c, 3k) array
        Patterns, orthonormal: coordinates = rows @ u of the displacements u, u = rows^T @ coordinates.
    right, left : (r, c) arrays
        The same r motions of the right and of the left face from the coordinates, those of the left one turned by
        one pitch: in a travelling wave the right ones are those of the left times exp(i psi).
    references : tuple of WaveReference
        Frequencies of the whole mesh against which a reduction can be measured.
    """

    nodes: NDArray[np.int64]
    rows: NDArray[np.float64]
    right: NDArray[np.float64]
    left: NDArray[np.float64]
    references: tuple[WaveReference, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates c."""
        return len(self.rows)
