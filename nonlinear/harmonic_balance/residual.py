"""Harmonic balance on the relative contact displacements: residual, Jacobian and derivative in the frequency."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array, ContactElement, ContactForces
from rom import RelativeReceptance

FINEST_VIBRATION = 1e-6
RESOLUTION = 1e-3  # a tolerance of 1e-13 of it is the round-off of one side


@dataclass(frozen=True)
class BalanceAt:
    """A balance at one state: what Newton's method needs there, the Jacobian when asked for.

    Attributes
    ----------
    balance : the equations. omega : w, rad/s.
    residual : (n,) R. slope : (n,) its derivative in w.
    contact : the contact forces.
    """

    balance: "HarmonicBalance"
    omega: float
    residual: Array
    slope: Array
    contact: ContactForces

    @cached_property
    def coupling(self) -> tuple[Array, NDArray[np.intp]]:
        """G df/dx without columns that are zero or meet zeros only, (n, n_active), and the unknowns that remain."""
        first = self.balance.first_row
        matrix = self.balance.receptance.matrix(self.omega)
        product = _chain(matrix, self.contact.jacobian, first)
        n_contacts, rows = self.balance.n_contacts, product.shape[0] // (3 * self.balance.n_contacts)
        unknowns = np.arange(product.shape[0]).reshape(rows, n_contacts, 3).transpose(1, 0, 2)
        depends: NDArray[np.bool_] = np.any(self.contact.jacobian, axis=(1, 3, 4))
        if depends.all() and not self.balance.odd:
            return product, unknowns.reshape(-1)
        active = np.repeat(depends[:, None, :], rows, axis=1)
        if self.balance.odd:
            active[:, 3 - first :: 4] = active[:, 4 - first :: 4] = False
        return product[:, active.reshape(-1)], unknowns[active]

    @cached_property
    def jacobian(self) -> Array:
        """dR/dx, (n, n)."""
        product, active = self.coupling
        jacobian = np.eye(self.residual.size)
        jacobian[:, active] -= product
        return jacobian


@dataclass(frozen=True)
class HarmonicBalance:
    """R^(h) = d^(h) - d_lin^(h)(w) - G^(h)(w) f^(h)(d) = 0 (paper eq. 6 in relative displacements).

    The unknown x holds the real Fourier coefficients of d, rows (0, Re 1, Im 1, ...) of 3 n_c numbers each. With
    `frozen_static` (n_c, 3) harmonic 0 of d is given and not balanced: the second of the classical two steps.
    `tiny` is a length far below any displacement of interest; it keeps relative errors finite where nothing moves.
    `receptance`: the structure, `element`: the contact. `odd`: the contact excites no even harmonics (see
    `ContactParameters.odd`); they stay zero and are not solved for.
    """

    receptance: RelativeReceptance
    element: ContactElement
    frozen_static: Array | None = None
    tiny: float = 1e-15
    odd: bool = False

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes."""
        return self.receptance.modal.n_contacts

    @property
    def n_harmonics(self) -> int:
        """H."""
        return len(self.receptance.harmonics) - 1

    @property
    def first_row(self) -> int:
        """First row of coefficients that is unknown: 1 if harmonic 0 is frozen, else 0."""
        return 0 if self.frozen_static is None else 1

    @property
    def size(self) -> int:
        """Number of real unknowns."""
        return (2 * len(self.receptance.harmonics) - 1 - self.first_row) * 3 * self.n_contacts

    def displacement(self, unknown: Array) -> Array:
        """Coefficients of d, (2H+1, n_c, 3), frozen harmonic 0 included."""
        rows = unknown.reshape(-1, self.n_contacts, 3)
        return rows if self.frozen_static is None else np.concatenate([self.frozen_static[None], rows])

    def unknown(self, displacement: Array) -> Array:
        """The inverse of `displacement`."""
        return displacement[self.first_row :].reshape(-1)

    def forces(self, unknown: Array) -> ContactForces:
        """Contact forces and Jacobian at `unknown`."""
        forces = self.element.evaluate(self.displacement(unknown))
        if self.odd:
            forces.force[3::4] = forces.force[4::4] = 0.0  # round-off, which stiff contacts would make grow
        return forces

    def with_force(self, force: float) -> "HarmonicBalance":
        """The same balance under another excitation amplitude `force` (N)."""
        return replace(self, receptance=replace(self.receptance, force=force))

    def evaluate(self, unknown: Array, omega: float) -> BalanceAt:
        """Residual and derivatives at `unknown` and w = `omega` (rad/s)."""
        contact = self.forces(unknown)
        force = to_complex(contact.force.reshape(contact.force.shape[0], -1))
        response, slope = self.receptance.response(omega, force)
        first = self.first_row
        residual = unknown - to_real(response)[first:].reshape(-1)
        return BalanceAt(self, omega, residual, -to_real(slope)[first:].reshape(-1), contact)

    def vibration(self, unknown: Array) -> float:
        """2-norm of the dynamic part (harmonics 1 .. H) of `unknown`, metres."""
        dynamic = self._dynamic(unknown)
        return math.sqrt(dynamic @ dynamic)

    def relative_error(self, residual: Array, unknown: Array) -> float:
        """A `residual` (n,) relative to the displacement: static rows to all of it, dynamic rows to the vibration.

        A vibration that is a million times smaller than the static displacement is resolved no further: round-off
        of the contact forces stands in the way.
        """
        whole = math.sqrt(unknown @ unknown) + self.tiny + self._static_resolution
        vibration = max(self.vibration(unknown), FINEST_VIBRATION * whole)
        dynamic = self.vibration(residual) / vibration
        return max(dynamic, math.sqrt(residual @ residual) / whole)

    @cached_property
    def _static_resolution(self) -> float:
        """Static relative displacement (m) that is solved to round-off of the motion of either side, no further.

        A static force that moves both sides alike leaves a difference that is round-off.
        """
        receptance = self.receptance
        if receptance.harmonics[0] != 0 or self.frozen_static is not None:
            return 0.0
        free = np.abs(receptance.modal_force[0] / receptance.modal.angular_frequency**2)
        return RESOLUTION * float(np.linalg.norm(np.abs(receptance.modal.right) @ free))

    def _dynamic(self, unknown: Array) -> Array:
        return unknown[(1 - self.first_row) * 3 * self.n_contacts :]


def _chain(matrix: ComplexArray, jacobian: Array, first: int) -> Array:
    """Product of the receptance with the derivative of the contact forces, in the rows and columns from `first`.

    Matrix (n_h, 3 n_c, 3 n_c), jacobian (n_c, 3, 3, 2H+1, 2H+1) block diagonal in the nodes: one small product a node
    and harmonic. The columns come in the order node, coefficient, component.
    """
    n_h, n_contacts, rows = matrix.shape[0], jacobian.shape[0], jacobian.shape[3]
    columns = 3 * (rows - first)
    by_row = jacobian[..., first:].transpose(3, 0, 1, 4, 2).reshape(rows, n_contacts, 3, columns)
    derivative = np.zeros((n_h, n_contacts, 3, columns), dtype=complex)
    derivative[0] = by_row[0]
    derivative.real[1:], derivative.imag[1:] = by_row[1::2], by_row[2::2]
    blocks = matrix.reshape(n_h, 3 * n_contacts, n_contacts, 3).transpose(0, 2, 1, 3)
    product = (blocks @ derivative).transpose(0, 2, 1, 3)
    result = np.empty((rows, 3 * n_contacts, n_contacts, columns))
    result[0] = product[0].real
    result[1::2], result[2::2] = product[1:].real, product[1:].imag
    return result[first:].reshape((rows - first) * 3 * n_contacts, -1)
