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
from nonlinear.harmonic_balance.residual import (
    BorderedFactors,
    HarmonicBalance,
    LinearisedResidual,
    counted_at_contacts,
    has_odd_harmonics_only,
)
from nonlinear.mistuned_ring.mistuned_structure import RingStructure, RingSystem
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.options import SolverOptions


@dataclass(frozen=True)
class WithBladeSprings:
    """A contact element for the nodes of N pairs, each followed by the nodes of the strain of its blade."""

    contact: ContactElement  # the contact nodes, pair after pair
    # `n_contacts`, `n_strain`: contact nodes of a pair, and nodes of the strain of a blade
    n_contacts: int
    n_strain: int
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
        """G df/dx, (n, n), and the indices of its columns, all: for checks, as `jacobian`."""
        return np.eye(self.balance.size) - self.jacobian, np.arange(self.balance.size)

    def system(self, column: Array, row: Array, corner: float) -> RingSystem:
        """The bordered Jacobian [dR/dx, c; t, e] for the structure."""
        return RingSystem(self.omega, self.balance.n_blades, self.force_jacobian, self.times, column, row, corner)

    def factorise(self, column: Array, row: Array, corner: float) -> BorderedFactors:
        """Factors of the bordered Jacobian [dR/dx, c; t, e].

        Shapes: `column` (n,), `row` (n,).
        """
        return self.balance.structure.factorise(self.system(column, row, corner))


@dataclass(frozen=True, kw_only=True)
class RingBalance(HarmonicBalance):
    """The balance of all contact pairs of a ring.

    The unknown holds the real Fourier coefficients of all d_j, each in the time of blade j: rows (0, Re 1, Im 1, ...)
    of 3 n_nodes N_b numbers, pair after pair. With a disk the strains of blade j follow d_j.
    """

    structure: RingStructure

    @classmethod
    def of(
        cls,
        structure: RingStructure,
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
    def is_modal_sum(self) -> bool:
        """The kernels have the equations of one pair."""
        return False

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

    def weighted(self, residual: Array) -> Array:
        """As `HarmonicBalance.weighted`, of the bodies of all sectors."""
        if not self.receptance.floating:
            return residual
        found, size = residual.copy(), self.n_blades * self.pair_dofs
        waves = np.fft.fft(found[:size].reshape(self.n_blades, -1, 1), axis=0)
        found[:size] = np.fft.ifft(counted_at_contacts(waves, self._floating_directions), axis=0).real.ravel()
        return found

    @cached_property
    def _floating_directions(self) -> ComplexArray:
        """Orthonormal ones of each wave, (N_b, 3 n_nodes, r)."""
        return np.asarray(np.linalg.qr(self.structure.floating_motions)[0])

    @cached_property
    def static_resolution(self) -> float:
        """Static relative displacement (m) of all pairs that is round-off; see `HarmonicBalance`."""
        return math.sqrt(self.n_blades) * super().static_resolution
