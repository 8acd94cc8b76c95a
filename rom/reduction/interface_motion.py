"""Motions of nodes that a few coordinates stand for, as boundary dofs beside the contact nodes and the tip."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class WaveReference:
    """Natural frequencies of the whole mesh at a nodal diameter."""

    nodal_diameter: int  # number of nodal diameters
    frequency_hz: NDArray[np.float64]  # (m,), the lowest frequencies, Hz, ascending
    sampled: bool  # whether the motions of the cut faces were taken from these modes too


@dataclass(frozen=True)
class InterfaceMotion:
    """Cut faces of a sector whose k nodes move in c given patterns."""

    nodes: NDArray[np.int64]  # (k,), nodes of the full model
    # (c, 3k), patterns, orthonormal: coordinates = rows @ u of the displacements u, u = rows^T @ coordinates
    rows: NDArray[np.float64]
    # (r, c), the same r motions of the right and of the left face from the coordinates, those of the left one turned
    # by one pitch: in a travelling wave the right ones are those of the left times exp(i psi)
    right: NDArray[np.float64]
    # (r, c), the same r motions of the right and of the left face from the coordinates, those of the left one turned
    # by one pitch: in a travelling wave the right ones are those of the left times exp(i psi)
    left: NDArray[np.float64]
    # frequencies of the whole mesh against which a reduction can be measured
    references: tuple[WaveReference, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates c."""
        return len(self.rows)
