"""Harmonic balance on the relative contact displacements: residual, Jacobian and derivative in the frequency."""

from dataclasses import dataclass, replace

import numpy as np

from nonlinear.contact import Array, ContactElement, ContactForces
from nonlinear.fourier import ComplexArray, to_complex, to_real
from rom import RelativeReceptance

FINEST_VIBRATION = 1e-6


@dataclass(frozen=True)
class BalanceAt:
    """Residual (n,), its Jacobian (n, n), its derivative in w (n,), and the contact forces at one state."""

    residual: Array
    jacobian: Array
    slope: Array
    contact: ContactForces


@dataclass(frozen=True)
class HarmonicBalance:
    """R^(h) = d^(h) - d_lin^(h)(w) - G^(h)(w) f^(h)(d) = 0 (paper eq. 6 in relative displacements).

    The unknown x holds the real Fourier coefficients of d, rows (0, Re 1, Im 1, ...) of 3 n_c numbers each. With
    `frozen_static` (n_c, 3) harmonic 0 of d is given and not balanced: the second of the classical two steps.
    `tiny` is a length far below any displacement of interest; it keeps relative errors finite where nothing moves.
    """

    receptance: RelativeReceptance
    element: ContactElement
    frozen_static: Array | None = None
    tiny: float = 1e-15

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes."""
        return self.receptance.modal.n_contacts

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
        return self.element.evaluate(self.displacement(unknown))

    def with_force(self, force: float) -> "HarmonicBalance":
        """The same balance under another excitation amplitude (N)."""
        return replace(self, receptance=replace(self.receptance, force=force))

    def evaluate(self, unknown: Array, frequency: float) -> BalanceAt:
        """Residual and derivatives at `unknown` and w = `frequency` (rad/s)."""
        contact = self.forces(unknown)
        at = self.receptance.evaluate(frequency)
        force = to_complex(contact.force.reshape(contact.force.shape[0], -1))
        response = at.linear + (at.matrix @ force[..., None])[..., 0]
        slope = at.linear_slope + (at.matrix_slope @ force[..., None])[..., 0]
        first = self.first_row
        jacobian = -_chain(at.matrix, contact.jacobian, first)
        jacobian[np.diag_indices_from(jacobian)] += 1.0
        return BalanceAt(
            residual=unknown - to_real(response)[first:].reshape(-1),
            jacobian=jacobian,
            slope=-to_real(slope)[first:].reshape(-1),
            contact=contact,
        )

    def vibration(self, unknown: Array) -> float:
        """2-norm of the dynamic part (harmonics 1 .. H) of `unknown`, metres."""
        return float(np.linalg.norm(self._dynamic(unknown)))

    def relative_error(self, residual: Array, unknown: Array) -> float:
        """Residual relative to the displacement: its static rows to all of it, its dynamic rows to the vibration.

        A vibration that is a million times smaller than the static displacement is resolved no further: round-off
        of the contact forces stands in the way.
        """
        whole = float(np.linalg.norm(unknown)) + self.tiny
        vibration = max(self.vibration(unknown), FINEST_VIBRATION * whole)
        dynamic = self.vibration(residual) / vibration
        return max(dynamic, float(np.linalg.norm(residual)) / whole)

    def _dynamic(self, unknown: Array) -> Array:
        return unknown[(1 - self.first_row) * 3 * self.n_contacts :]


def _chain(matrix: ComplexArray, jacobian: Array, first: int) -> Array:
    """Product of the receptance with the derivative of the contact forces, in the rows and columns from `first`.

    Matrix (n_h, 3 n_c, 3 n_c) complex, jacobian (n_c, 3, 3, 2H+1, 2H+1) block diagonal in the nodes.
    """
    n_contacts, rows = jacobian.shape[0], jacobian.shape[3]
    nodes = np.arange(n_contacts)
    dense = np.zeros((rows, n_contacts, 3, rows - first, n_contacts, 3))
    dense[:, nodes, :, :, nodes, :] = jacobian[..., first:].transpose(0, 3, 1, 4, 2)
    dense = dense.reshape(rows, 3 * n_contacts, -1)
    product = np.empty_like(dense)
    product[0] = matrix[0].real @ dense[0]
    for h in range(1, matrix.shape[0]):
        real, imaginary = matrix[h].real, matrix[h].imag
        re, im = dense[2 * h - 1], dense[2 * h]
        product[2 * h - 1] = real @ re - imaginary @ im
        product[2 * h] = imaginary @ re + real @ im
    return product[first:].reshape((rows - first) * 3 * n_contacts, -1)
