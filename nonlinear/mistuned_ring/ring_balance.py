"""Harmonic balance of a mistuned ring: the relative displacements of all N_b contact pairs.

    R_j^(h) = d_j^(h) - d_lin,j^(h)(omega) - sum_k G_jk^(h)(omega) f_k^(h)(d_k) = 0.

The contact forces of a pair depend on its own displacement only. Of clamped blades k = j-1, j, j+1, and the Jacobian
is block-tridiagonal and cyclic like the receptance, with blocks of 3 n_c (2H+1) unknowns. Through a disk all pairs
move each other; there the strains s_j = Q^T S q_j (`strain_directions`) are unknowns like the displacements, and the
deviating stiffness of blade j acts like linear springs at nodes of its own: f_j = -((1 + delta_j)^2 - 1) s_j.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import STICK, Array, ContactElement, ContactForces, ContactParameters
from nonlinear.harmonic_balance.condensed_factors import DenseFactors
from nonlinear.harmonic_balance.residual import (
    BorderedFactors,
    HarmonicBalance,
    LinearisedResidual,
    has_odd_harmonics_only,
)
from nonlinear.mistuned_ring.cyclic_blocks import CyclicBlockFactors, CyclicBlocks
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.pair_order import by_pair, from_pairs, pair_force_change, real_product
from nonlinear.mistuned_ring.ring_receptance import RingReceptance
from nonlinear.mistuned_ring.sector_factors import SectorFactors
from nonlinear.mistuned_ring.sector_ring import SectorRing
from nonlinear.options import SolverOptions


@dataclass(frozen=True)
class WithBladeSprings:
    """A contact element for the nodes of N pairs, each followed by the nodes of the strain of its blade."""

    contact: ContactElement  # the contact nodes, pair after pair
    n_contacts: int  # contact nodes of a pair, and nodes of the strain of a blade
    n_strain: int  # contact nodes of a pair, and nodes of the strain of a blade
    stiffness: Array  # (N,), (1 + delta_j)^2 - 1

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for displacements and strains (2H+1, N (n_contacts + n_strain), 3)."""
        rows, count, own = displacement.shape[0], self.stiffness.size, self.n_contacts
        moved = displacement.reshape(rows, count, own + self.n_strain, 3)
        found = self.contact.evaluate(np.ascontiguousarray(moved[:, :, :own]).reshape(rows, -1, 3))
        force = np.empty_like(moved)
        force[:, :, :own] = found.force.reshape(rows, count, own, 3)
        force[:, :, own:] = -self.stiffness[:, None, None] * moved[:, :, own:]
        jacobian = np.zeros((count, own + self.n_strain, 3, 3, rows, rows))
        jacobian[:, :own] = found.jacobian.reshape(count, own, 3, 3, rows, rows)
        one = np.eye(3)[:, :, None, None] * np.eye(rows)
        jacobian[:, own:] = -self.stiffness[:, None, None, None, None, None] * one
        state = np.full((count, own + self.n_strain), STICK)
        state[:, :own] = found.state.reshape(count, own)
        return ContactForces(
            force.reshape(displacement.shape), jacobian.reshape(-1, 3, 3, rows, rows), state.reshape(-1)
        )


SMALLEST_ITERATIVE = 400  # unknowns of a ring with a disk from which GMRES is faster than a dense factorisation


@dataclass(frozen=True)
class RingFactors:
    """The bordered Jacobian of a ring, in the order of unknowns of the balance."""

    factors: CyclicBlockFactors
    n_rows: int

    @property
    def sign(self) -> int:
        """Sign of the determinant: that of the blocks, which are the unknowns in another order."""
        return self.factors.sign

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x (n,), z) for the right-hand side (b (n,), b_e); NaN for a singular system."""
        n_blades = len(self.factors.column)
        solution, z = self.factors.solve(by_pair(right, self.n_rows, n_blades), np.array([last]))
        return from_pairs(solution, self.n_rows), float(z[0])


@dataclass(frozen=True)
class LinearisedRing(LinearisedResidual):
    """The residual of a ring and its derivatives at one state; see `LinearisedResidual`."""

    balance: RingBalance

    @cached_property
    def force_jacobian(self) -> Array:
        """df/dx of the nodes, as `ContactForces.jacobian`; zero in the even harmonics of an odd balance."""
        jacobian = self.contact.jacobian
        if self.balance.odd:
            jacobian = jacobian.copy()
            jacobian[..., 3::4, :] = jacobian[..., 4::4, :] = 0.0
            jacobian[..., 3::4] = jacobian[..., 4::4] = 0.0
        return jacobian

    @cached_property
    def blocks(self) -> CyclicBlocks:
        """The blocks of dR/dx of clamped blades; rows and columns of a block: coefficient, node, component."""
        balance, ring = self.balance, self.balance.structure
        assert isinstance(ring, RingReceptance)
        n_blades, n_rows = balance.n_blades, 2 * balance.n_harmonics + 1
        change = pair_force_change(self.force_jacobian, n_blades)
        blocks = ring.blocks(self.omega)
        own = -real_product(blocks.own, change)
        own[:, np.arange(own.shape[1]), np.arange(own.shape[1])] += 1.0
        if ring.blade.left is None:
            return CyclicBlocks(np.zeros_like(own), own, np.zeros_like(own))
        before = -real_product(blocks.before, np.roll(change, 1, axis=0))
        after = -real_product(blocks.after, np.roll(change, -1, axis=0))
        assert own.shape == (n_blades, n_rows * balance.pair_dofs, n_rows * balance.pair_dofs)
        return CyclicBlocks(before, own, after)

    def times(self, change: Array) -> Array:
        """dR/dx times a change of the unknown (n,): no matrix is formed."""
        balance = self.balance
        forces = np.einsum("kabij,jkb->ika", self.force_jacobian, balance.displacement(change), optimize=True)
        increments = balance.structure.increments(self.omega, balance.by_harmonic(forces))
        moved = to_real(balance.structure.relative(increments).reshape(balance.n_harmonics + 1, -1))
        found: Array = change - moved.reshape(-1)
        return found

    @cached_property
    def jacobian(self) -> Array:
        """dR/dx, (n, n), in the order of the unknowns: for checks, as it is large."""
        return np.stack([self.times(column) for column in np.eye(self.balance.size)], axis=1)

    @cached_property
    def coupling(self) -> tuple[Array, NDArray[np.intp]]:
        """G df/dx of sectors joined at a disk, (n, n), and the indices of its columns: all."""
        balance, ring = self.balance, self.balance.structure
        assert isinstance(ring, SectorRing)
        count, n_rows = balance.n_blades, 2 * balance.n_harmonics + 1
        change, size = pair_force_change(self.force_jacobian, count), n_rows * balance.pair_dofs
        found = np.empty((count, size, count, size))
        pairs = np.arange(count)
        for distance, block in enumerate(ring.flexibility(self.omega)):
            before = (pairs - distance) % count
            found[pairs, :, before] = real_product(np.broadcast_to(block, (count, *block.shape)), change[before])
        indices = np.arange(balance.size)
        place = indices.reshape(n_rows, count, -1).transpose(1, 0, 2).reshape(-1)
        whole = np.empty((balance.size, balance.size))
        whole[np.ix_(place, place)] = found.reshape(balance.size, balance.size)
        return whole, indices

    def factorise(self, column: Array, row: Array, corner: float) -> BorderedFactors:
        """Factors of the bordered Jacobian [dR/dx, c; t, e].

        Shapes: `column` (n,), `row` (n,).
        """
        balance = self.balance
        if isinstance(balance.structure, SectorRing):
            if balance.size < SMALLEST_ITERATIVE:
                return DenseFactors.of(self.coupling, column, row, corner)
            return SectorFactors(self, column, row, corner)
        n_rows, end = 2 * balance.n_harmonics + 1, np.array([[corner]])
        own_column, own_row = (by_pair(values, n_rows, balance.n_blades)[..., None] for values in (column, row))
        return RingFactors(CyclicBlockFactors.of(self.blocks, own_column, own_row, end), n_rows)


@dataclass(frozen=True, kw_only=True)
class RingBalance(HarmonicBalance):
    """The balance of all contact pairs of a ring.

    The unknown holds the real Fourier coefficients of all d_j, each in the time of blade j: rows (0, Re 1, Im 1, ...)
    of 3 n_nodes N_b numbers, pair after pair. With a disk the strains of blade j follow d_j.
    """

    structure: RingReceptance | SectorRing  # clamped blades, or sectors joined at a disk

    @classmethod
    def of(
        cls,
        structure: RingReceptance | SectorRing,
        contact: ContactParameters,
        mistuning: Mistuning,
        options: SolverOptions,
    ) -> RingBalance:
        """The balance of a mistuned ring."""
        ring, receptance = mistuning.contact(contact), structure.tuned
        element = contact_element(ring, len(receptance.harmonics) - 1, options)
        if structure.n_nodes > contact.n_contacts:
            n_strain = structure.n_nodes - contact.n_contacts
            element = WithBladeSprings(element, contact.n_contacts, n_strain, mistuning.added_stiffness)
        odd = has_odd_harmonics_only(receptance, ring)
        return cls(receptance=receptance, element=element, odd=odd, structure=structure)

    @property
    def n_blades(self) -> int:
        """Number of blades N_b."""
        return self.structure.n_blades

    @property
    def pair_dofs(self) -> int:
        """Displacements and strains of a pair, 3 n_nodes."""
        return 3 * self.structure.n_nodes

    @property
    def n_contacts(self) -> int:
        """Number of nodes of all pairs."""
        return self.n_blades * self.structure.n_nodes

    def evaluate(self, unknown: Array, omega: float) -> LinearisedRing:
        """Residual and derivatives.

        Shapes: `unknown` (n,).
        """
        contact = self.forces(unknown)
        response, derivative = self.structure.response(omega, self.by_harmonic(contact.force))
        rows = response.shape[0]
        residual = unknown - to_real(response.reshape(rows, -1)).reshape(-1)
        return LinearisedRing(self, omega, residual, -to_real(derivative.reshape(rows, -1)).reshape(-1), contact)

    def by_harmonic(self, force: Array) -> ComplexArray:
        """Fourier coefficients by pair, (H+1, N_b, 3 n_nodes), of real ones (2H+1, N_b n_nodes, 3), N."""
        found = to_complex(force.reshape(force.shape[0], -1))
        return found.reshape(found.shape[0], self.n_blades, -1)

    @cached_property
    def static_resolution(self) -> float:
        """Static relative displacement (m) of all pairs that is round-off; see `HarmonicBalance`."""
        return math.sqrt(self.n_blades) * super().static_resolution
