"""Bordered systems of a ring of sectors joined at a disk.

A force on one pair moves all, through the disk. Modes near the frequency carry the motion far around the ring: their
modal coordinates z are unknowns of their own, beside the border. What the other modes move further than the
neighbouring pairs is left out, as is what they make of the small forces -k s of the strains s = Q^T S q, in which k
is the stiffness by which the blades differ. With the relative displacements d the rest is block-tridiagonal and
cyclic,

    [ I - G_near df/dd   -B                   c ] [ d ]
    [ -D^-1 B^H df/dd     I + D^-1 S^H k S    0 ] [ z ],    s = S z + S_near df/dd d.
    [ t                   0                   e ] [ y ]

Its factors, also those of a state nearby, precondition GMRES [1]_ on the whole system, so that the solution is that
of the whole system.

References
----------
.. [1] Y. Saad, M. H. Schultz, GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear
   systems, SIAM J. Sci. Stat. Comput. 7 (1986) 856-869.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.mistuned_ring.cyclic_blocks import CyclicBlockFactors, CyclicBlocks
from nonlinear.mistuned_ring.pair_order import by_pair, from_pairs, pair_force_change, real_product
from nonlinear.mistuned_ring.sector_ring import SectorRing, WaveChoice, wave_turns

if TYPE_CHECKING:
    from nonlinear.mistuned_ring.ring_balance import LinearisedRing

NEAR = 1.2  # ratio of frequencies up to which a mode carries motion far around the ring
SOLVED, ENOUGH = 1e-9, 1e-7  # relative residual asked for, and one that will do
ITERATIONS = 80
PATIENCE = 25  # iterations with the factors of another state


@dataclass(frozen=True)
class NearFactors:
    """Factors of what is near to a bordered Jacobian, for displacements d, strains s, modal coordinates z and y."""

    factors: CyclicBlockFactors  # factors for d, and for (y, z) as border; s is eliminated
    # (N, rows t, w), strains of (y, z), and the transpose of the coefficients of s in the rows of (y, z)
    strain: Array
    # (N, rows t, w), strains of (y, z), and the transpose of the coefficients of s in the rows of (y, z)
    strain_row: Array
    change: ComplexArray  # (N, H+1, n_c, 3, 3 rows), df/dd, see `pair_force_change`
    # (H+1, t, 3 n_c), strains of a blade under forces on the pair before it, its own pair and the pair after it, m/N
    flexibility: tuple[ComplexArray, ComplexArray, ComplexArray]

    @classmethod
    def of(cls, linearised: LinearisedRing, column: Array, row: Array, corner: float) -> NearFactors:
        """Factorise; the parameters are those of `SectorFactors`."""
        balance, ring = linearised.balance, linearised.balance.structure
        assert isinstance(ring, SectorRing)
        count, rows, contacts = balance.n_blades, 2 * balance.n_harmonics + 1, ring.modal.n_contacts
        change = pair_force_change(linearised.force_jacobian, count)
        own = change[:, :, :contacts]
        chosen = [_far_reaching(ring, h, linearised.omega) for h in range(balance.n_harmonics + 1)]
        near = ring.near_flexibility(linearised.omega, chosen, 3 * contacts)
        motion = _real_columns(ring, chosen, rows)
        force = _real_rows(ring, change, chosen, linearised.omega)
        beside, below = (by_pair(each, rows, count).reshape(count, rows, -1) for each in (column, row))
        strain = _with_border(motion, -beside, slice(3 * contacts, None))
        strain_row = _with_border(-force, below, slice(3 * contacts, None))
        end = np.eye(strain.shape[2])
        end[0, 0] = corner
        factors = CyclicBlockFactors.of(
            _near_blocks([each[:, : 3 * contacts] for each in near], own),
            _with_border(-motion, beside, slice(3 * contacts)),
            _with_border(-force, below, slice(3 * contacts)),
            end + np.einsum("kbw,kbv->wv", strain_row, strain),
        )
        before, middle, after = (each[:, 3 * contacts :] for each in near)
        return cls(factors, strain, strain_row, own, (before, middle, after))

    def solve(self, vector: Array) -> Array:
        """Solution (d, s, y) for a right-hand side in the order of the unknowns, (n + 1,)."""
        count, rows = len(self.strain), self.change.shape[-1] // 3
        contacts = 3 * self.change.shape[2]
        right = by_pair(vector[:-1], rows, count).reshape(count, rows, -1)
        strain = right[:, :, contacts:].reshape(self.strain.shape[:2])
        last = -np.einsum("kbw,kb->w", self.strain_row, strain)
        last[0] += vector[-1]
        displacement, border = self.factors.eliminated(right[:, :, :contacts].reshape(count, -1), last)
        displacement = displacement.reshape(count, rows, contacts)
        strain = (strain + self.strain @ border).reshape(right[:, :, contacts:].shape)
        found = np.concatenate([displacement, strain + self._strain_of(displacement)], axis=2)
        return np.append(from_pairs(found.reshape(count, -1), rows), border[0])

    def _strain_of(self, displacement: Array) -> Array:
        """Strains by the contact forces of displacements (N, rows, 3 n_c), (N, rows, t)."""
        count, rows, contacts = displacement.shape
        by_node = (
            displacement.reshape(count, rows, -1, 3).transpose(0, 2, 1, 3).reshape(count, 1, contacts // 3, -1, 1)
        )
        force = (self.change @ by_node).reshape(count, -1, contacts, 1)
        before, own, after = self.flexibility
        strain = own @ force + before @ np.roll(force, 1, axis=0) + after @ np.roll(force, -1, axis=0)
        real = np.empty((count, rows, strain.shape[2]))
        real[:, 0] = strain[:, 0, :, 0].real
        real[:, 1::2], real[:, 2::2] = strain[:, 1:, :, 0].real, strain[:, 1:, :, 0].imag
        return real


@dataclass(frozen=True)
class SectorFactors:
    """A bordered Jacobian of a ring, solved by GMRES."""

    linearised: LinearisedRing  # the residual and its derivatives
    column: Array  # (n,), c and t
    row: Array  # (n,), c and t
    corner: float  # e

    @cached_property
    def near(self) -> NearFactors:
        """Factors of what is near to it; the ring keeps them for the states that follow."""
        found = NearFactors.of(self.linearised, self.column, self.row, self.corner)
        self._kept[self.linearised.residual.size] = found
        return found

    @property
    def _kept(self) -> dict[int, NearFactors]:
        structure = self.linearised.balance.structure
        assert isinstance(structure, SectorRing)
        return structure.factors

    @property
    def sign(self) -> int:
        """Sign of the determinant of the system that is near to it."""
        return self.near.factors.sign

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x (n,), y) for the right-hand side (b (n,), b_e); NaN for a singular system."""
        whole = np.append(right, last)
        before = self._kept.get(right.size)
        found = None if before is None else self._solved(whole, before, PATIENCE, 10.0 * SOLVED)
        if found is None:
            found = self._solved(whole, self.near, ITERATIONS, ENOUGH)
        if found is None:
            return np.full(right.shape, np.nan), np.nan
        return found[:-1], float(found[-1])

    def _solved(self, whole: Array, near: NearFactors, iterations: int, enough: float) -> Array | None:
        """The solution (n + 1,) with these factors; None where so many iterations leave a larger residual."""
        from scipy.sparse.linalg import LinearOperator, gmres

        def times(vector: Array) -> Array:
            return self._times(near.solve(vector))

        operator = LinearOperator((whole.size, whole.size), matvec=times, dtype=np.float64)
        with np.errstate(all="ignore"):
            if not np.isfinite(near.solve(whole)).all():
                return None
            found = near.solve(gmres(operator, whole, rtol=SOLVED, restart=iterations, maxiter=1)[0])
            left = np.linalg.norm(whole - self._times(found))
        return found if left <= enough * np.linalg.norm(whole) else None

    def _times(self, vector: Array) -> Array:
        x, y = vector[:-1], vector[-1]
        return np.append(self.linearised.times(x) + y * self.column, self.row @ x + self.corner * y)


def _near_blocks(flexibility: list[ComplexArray], change: ComplexArray) -> CyclicBlocks:
    """I - G_near df/dd of the contact nodes of each pair."""
    before, own, after = (np.broadcast_to(each, (len(change), *each.shape)) for each in flexibility)
    blocks = -real_product(own, change)
    blocks[:, np.arange(blocks.shape[1]), np.arange(blocks.shape[1])] += 1.0
    return CyclicBlocks(
        -real_product(before, np.roll(change, 1, axis=0)), blocks, -real_product(after, np.roll(change, -1, axis=0))
    )


def _with_border(values: Array, first: Array, dofs: slice) -> Array:
    """A column (N, rows, 3 n_nodes) and values (N, rows, 3 n_nodes, w - 1) beside it, of some dofs, (N, b, w)."""
    whole = np.concatenate([first[:, :, dofs, None], values[:, :, dofs]], axis=3)
    return whole.reshape(len(whole), math.prod(whole.shape[1:3]), whole.shape[3])


def _far_reaching(ring: SectorRing, row: int, omega: float) -> WaveChoice:
    """The modes of one harmonic that are near its frequency; none in harmonic 0, and in small rings."""
    none: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
    at = ring.tuned.harmonics[row] * omega
    if at == 0.0 or ring.neighbours_only:
        return WaveChoice(none, none)
    frequency = ring.waves.angular_frequency.reshape(len(ring.tuned.harmonics), ring.n_blades, -1)[row]
    return WaveChoice(*np.nonzero((frequency > at / NEAR) & (frequency < NEAR * at)))


def _real_columns(ring: SectorRing, chosen: list[WaveChoice], rows: int) -> Array:
    """Motions of the nodes for unit Re z and Im z of the chosen modes, (N, rows, 3 n_nodes, w)."""
    parts = [np.zeros((ring.n_blades, rows, 3 * ring.n_nodes, 0))]
    for h, (wave, mode) in enumerate(chosen):
        moved = wave_turns(ring.n_blades, wave)[:, None, :] * ring.motion[h, wave, :, mode].T
        part = np.zeros((*moved.shape[:1], rows, moved.shape[1], 2 * wave.size))
        if wave.size:
            part[:, 2 * h - 1] = np.concatenate([moved.real, -moved.imag], axis=2)
            part[:, 2 * h] = np.concatenate([moved.imag, moved.real], axis=2)
        parts.append(part)
    return np.concatenate(parts, axis=3)


def _real_rows(ring: SectorRing, change: ComplexArray, chosen: list[WaveChoice], omega: float) -> Array:
    """Re z and Im z of the chosen modes for unit motions of the nodes, (N, rows, 3 n_nodes, w)."""
    count, nodes = ring.n_blades, ring.n_nodes
    rows, denominators = change.shape[-1] // 3, ring.denominators(omega)[0]
    parts = [np.zeros((count, rows, 3 * nodes, 0))]
    for h, (wave, mode) in enumerate(chosen):
        shapes = ring.motion[h, wave, :, mode].conj() / denominators[h, wave, mode][:, None]
        by_node = shapes.reshape(wave.size, nodes, 3).transpose(1, 0, 2)
        pushed = (by_node @ change[:, h]).reshape(count, nodes, wave.size, rows, 3)
        pushed = wave_turns(count, wave).conj()[:, None, :, None, None] * pushed
        both = np.concatenate([pushed.real, pushed.imag], axis=2)
        parts.append(both.transpose(0, 3, 1, 4, 2).reshape(count, rows, 3 * nodes, 2 * wave.size))
    return np.concatenate(parts, axis=3)
