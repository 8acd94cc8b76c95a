"""Harmonic balance of a mistuned ring: the relative displacements of all N_b contact pairs.

    R_j^(h) = d_j^(h) - d_lin,j^(h)(omega) - sum_k G_jk^(h)(omega) f_k^(h)(d_k) = 0,    k = j-1, j, j+1.

The contact forces of a pair depend on its own displacement only, so that the Jacobian is block-tridiagonal and cyclic
like the receptance, with blocks of 3 n_c (2H+1) unknowns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array, ContactForces, ContactParameters
from nonlinear.harmonic_balance.residual import (
    STATIC_RESOLUTION,
    HarmonicBalance,
    LinearisedResidual,
    has_odd_harmonics_only,
)
from nonlinear.mistuned_ring.cyclic_blocks import CyclicBlockFactors, CyclicBlocks
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_receptance import RingReceptance
from nonlinear.options import SolverOptions
from rom import RelativeReceptance


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
        solution, z = self.factors.solve(by_pair(right, self.n_rows, n_blades), last)
        return from_pairs(solution, self.n_rows), z


@dataclass(frozen=True)
class LinearisedRing(LinearisedResidual):
    """The residual of a ring and its derivatives at one state; see `LinearisedResidual`."""

    @cached_property
    def blocks(self) -> CyclicBlocks:
        """The blocks of dR/dx; rows and columns of a block in the order coefficient, node, component."""
        balance = self.balance
        assert isinstance(balance, RingBalance)
        n_blades, n_rows = balance.n_blades, 2 * balance.n_harmonics + 1
        jacobian = self.contact.jacobian
        if balance.odd:
            jacobian = jacobian.copy()
            jacobian[..., 3::4, :] = jacobian[..., 4::4, :] = 0.0
            jacobian[..., 3::4] = jacobian[..., 4::4] = 0.0
        change = _force_change(jacobian, n_blades)
        blocks = balance.ring.blocks(self.omega)
        own = -_product(blocks.own, change)
        own[:, np.arange(own.shape[1]), np.arange(own.shape[1])] += 1.0
        if balance.ring.blade.left is None:
            return CyclicBlocks(np.zeros_like(own), own, np.zeros_like(own))
        before = -_product(blocks.before, np.roll(change, 1, axis=0))
        after = -_product(blocks.after, np.roll(change, -1, axis=0))
        assert own.shape == (n_blades, n_rows * balance.pair_dofs, n_rows * balance.pair_dofs)
        return CyclicBlocks(before, own, after)

    @cached_property
    def jacobian(self) -> Array:
        """dR/dx, (n, n), in the order of the unknowns: for checks, as it is large."""
        balance = self.balance
        assert isinstance(balance, RingBalance)
        n_rows = 2 * balance.n_harmonics + 1
        places = by_pair(np.arange(balance.size, dtype=float), n_rows, balance.n_blades)
        order = np.argsort(places.reshape(-1))
        return self.blocks.dense()[np.ix_(order, order)]

    def factorise(self, column: Array, row: Array, corner: float) -> RingFactors:
        """Factors of the bordered Jacobian [dR/dx, c; t, e].

        Parameters
        ----------
        column, row : (n,) float
            c and t.
        corner : float
            e.
        """
        balance = self.balance
        assert isinstance(balance, RingBalance)
        n_rows = 2 * balance.n_harmonics + 1
        own_column, own_row = (by_pair(values, n_rows, balance.n_blades) for values in (column, row))
        return RingFactors(CyclicBlockFactors.of(self.blocks, own_column, own_row, corner), n_rows)


@dataclass(frozen=True, kw_only=True)
class RingBalance(HarmonicBalance):
    """The balance of all contact pairs of a ring of clamped blades.

    The unknown holds the real Fourier coefficients of all d_j, each in the time of blade j: rows (0, Re 1, Im 1, ...)
    of 3 n_c N_b numbers, pair after pair.

    Attributes
    ----------
    frequency_ratio : (N_b,) array
        1 + delta_j.
    """

    frequency_ratio: Array

    @classmethod
    def of(
        cls, receptance: RelativeReceptance, contact: ContactParameters, mistuning: Mistuning, options: SolverOptions
    ) -> RingBalance:
        """The balance of a mistuned ring.

        Parameters
        ----------
        receptance : rom.RelativeReceptance
            The tuned blade, with the harmonics and the excitation.
        contact : ContactParameters
            Parameters of the n_c nodes of the tuned pair.
        mistuning : Mistuning
            Deviations of blades and pairs.
        options : SolverOptions
            How the contact forces are integrated.
        """
        ring = mistuning.contact(contact)
        return cls(
            receptance=receptance,
            element=contact_element(ring, len(receptance.harmonics) - 1, options),
            odd=has_odd_harmonics_only(receptance, ring),
            frequency_ratio=1.0 + mistuning.frequency,
        )

    @property
    def n_blades(self) -> int:
        """Number of blades N_b."""
        return self.frequency_ratio.size

    @property
    def pair_dofs(self) -> int:
        """Relative displacements of a pair, 3 n_c."""
        return 3 * self.receptance.modal.n_contacts

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes of all pairs, N_b n_c."""
        return self.n_blades * self.receptance.modal.n_contacts

    @cached_property
    def ring(self) -> RingReceptance:
        """The structure."""
        return RingReceptance(self.receptance, self.frequency_ratio)

    def evaluate(self, unknown: Array, omega: float) -> LinearisedRing:
        """Residual and derivatives.

        Parameters
        ----------
        unknown : (n,) float
            x, m.
        omega : float
            Excitation frequency, rad/s.
        """
        contact = self.forces(unknown)
        response, derivative = self.ring.response(omega, self.pair_forces(contact))
        rows = response.shape[0]
        residual = unknown - to_real(response.reshape(rows, -1)).reshape(-1)
        return LinearisedRing(self, omega, residual, -to_real(derivative.reshape(rows, -1)).reshape(-1), contact)

    def pair_forces(self, contact: ContactForces) -> ComplexArray:
        """Fourier coefficients of the contact forces by pair, (H+1, N_b, 3 n_c), N."""
        force = to_complex(contact.force.reshape(contact.force.shape[0], -1))
        return force.reshape(force.shape[0], self.n_blades, -1)

    @cached_property
    def static_resolution(self) -> float:
        """Static relative displacement (m) of all pairs that is round-off; see `HarmonicBalance`."""
        blade = self.ring.blade
        free = np.abs(self.receptance.modal_force[0] / blade.angular_frequency**2)
        one = float(np.linalg.norm(np.abs(blade.right) @ free))
        return STATIC_RESOLUTION * math.sqrt(self.n_blades) * one


def by_pair(values: Array, n_rows: int, n_blades: int) -> Array:
    """Values in the order coefficient, pair, dof as (N_b, coefficients and dofs)."""
    return np.ascontiguousarray(values.reshape(n_rows, n_blades, -1).transpose(1, 0, 2)).reshape(n_blades, -1)


def from_pairs(values: Array, n_rows: int) -> Array:
    """The inverse of `by_pair`."""
    return values.reshape(len(values), n_rows, -1).transpose(1, 0, 2).reshape(-1)


def _force_change(jacobian: Array, n_blades: int) -> ComplexArray:
    """df/dx of the nodes of each pair: (N_b, H+1, n_c, 3, 3 (2H+1)) complex force coefficients."""
    nodes, rows = jacobian.shape[0], jacobian.shape[3]
    by_row = jacobian.transpose(0, 3, 1, 4, 2).reshape(nodes, rows, 3, 3 * rows)
    change = np.zeros((nodes, (rows + 1) // 2, 3, 3 * rows), complex)
    change[:, 0] = by_row[:, 0]
    change.real[:, 1:], change.imag[:, 1:] = by_row[:, 1::2], by_row[:, 2::2]
    return change.reshape(n_blades, nodes // n_blades, *change.shape[1:]).transpose(0, 2, 1, 3, 4)


def _product(receptance: ComplexArray, change: ComplexArray) -> Array:
    """G df/dx of all pairs, (N_b, b, b), rows and columns in the order coefficient, node, component.

    `receptance` : (N_b, H+1, 3 n_c, 3 n_c); `change`: see `_force_change`.
    """
    n_blades, n_h, dofs, _ = receptance.shape
    n_c = dofs // 3
    faces = receptance.reshape(n_blades, n_h, dofs, n_c, 3).transpose(0, 1, 3, 2, 4)
    moved = faces @ change  # (N_b, H+1, node of the force, dof, coefficient and component of its displacement)
    rows = 2 * n_h - 1
    real = np.empty((n_blades, rows, dofs, rows, n_c, 3))
    split = moved.reshape(n_blades, n_h, n_c, dofs, rows, 3).transpose(0, 1, 3, 4, 2, 5)
    real[:, 0] = split[:, 0].real
    real[:, 1::2], real[:, 2::2] = split[:, 1:].real, split[:, 1:].imag
    return real.reshape(n_blades, rows * dofs, rows * dofs)
