"""Few contact motions that all waves share, and the mean flexibility of the contacts in all waves.

The lowest modes of each wave stay what they are. All others are a flexibility without resonance, a series in s:

    1 / (s^2 + c_m s + omega_m^2) = 1 / omega_m^2 - (s^2 + c_m s) / omega_m^4 + s^4 / omega_m^6 - ...

Most of it, the local flexibility of the contact faces, is the same in all waves. The contact motions of the lowest
modes, and what the flexibility of a wave differs by from the mean of all waves, span few dimensions.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.stability.modal_condensation import CondensedModes, HarmonicBlocks, Matrix, real_form
from rom import contact_springs

TERMS = 4  # of the series: 1, -s^2, -s, s^4
NEGLIGIBLE_MEAN = 0.03  # of the mean flexibility, times the contact stiffness, where contacts are closed around it


@dataclass(frozen=True)
class SharedMotions:
    """Shared motions of the contacts, and the mean flexibility.

    Contact displacements times the square root of the contact stiffness have the p shared motions U, orthonormal
    columns: d = W^-1 U y. Few more have nearly all of the mean flexibility: Q = (U, V), orthonormal too.
    """

    shared: Array  # (3 n_c, p), W^-1 U
    mean: Array  # (4, 3 n_c, 3 n_c), terms of the flexibility of the modes above the lowest ones, mean of all waves
    flexible: Array  # (3 n_c, r), W^-1 Q
    mean_of_flexible: Array  # (4, r, r), terms of the mean flexibility in Q

    def closing(self, active: NDArray[np.bool_]) -> "ClosingMotions":
        """The motions in which a contact is closed: Q, or the dofs that touch where these are fewer.

        Shapes: `active` (3 n_c,).
        """
        p, r = self.shared.shape[1], self.flexible.shape[1]
        touching = int(np.count_nonzero(active))
        if touching <= r:
            return ClosingMotions(active, np.eye(touching), self.shared[active], self.mean[:, active][:, :, active])
        return ClosingMotions(active, self.flexible[active], np.eye(r, p), self.mean_of_flexible)


class ClosingMotions(NamedTuple):
    """Few contact motions in which a contact is closed around the mean flexibility."""

    active: NDArray[np.bool_]  # (3 n_c,), the dofs of the nodes that touch, n of them
    motions: Array  # (n, r), D, d = D v
    shared: Array  # (r, p), E, the shared motions among them: v = E y
    mean: Array  # (4, r, r), terms of the mean flexibility in v

    def structure(self, n_harmonics: int, omega: float, static: bool) -> CondensedModes:
        """The mean flexibility, with y as outputs and the forces on these as inputs; no states.

        In real motions, rows (0, Re 1, Im 1, ...), near sigma = 0.
        """
        harmonics = np.arange(0 if static else 1, n_harmonics + 1)
        s = np.asarray(1j * omega * harmonics, dtype=complex)
        first, size = int(static), len(self.shared)
        blocks, changes = (
            HarmonicBlocks(
                part[0].real if static else np.zeros((0, 0)),
                real_form(part[first:]).reshape(n_harmonics, 2 * size, 2 * size),
            )
            for part in series(self.mean, s, omega)
        )
        shared = np.kron(np.eye(first + 2 * n_harmonics), self.shared)
        return CondensedModes(np.zeros((shared.shape[1],) * 2), shared.T, shared, blocks, changes)


def series(terms: Matrix, s: ComplexArray, omega: float) -> tuple[ComplexArray, ComplexArray]:
    """A flexibility from the `terms` of its series, (..., 4, n, n), and its derivative in sigma = s / omega.

    Shapes: `terms` (4, n, n), `s` (S,), returns (..., S, n, n).
    """
    powers = np.stack([np.ones_like(s), -(s**2), -s, s**4], axis=-1)
    changes = omega * np.stack([np.zeros_like(s), -2.0 * s, -np.ones_like(s), 4.0 * s**3], axis=-1)
    flat = terms.reshape(*terms.shape[:-2], -1)
    shape = (*(terms.shape[:-3] or s.shape), *terms.shape[-2:])
    value, change = ((factors[..., None, :] @ flat).reshape(shape) for factors in (powers, changes))
    return value, change


class WeightedModes(NamedTuple):
    """Frequency and damping (m,) of some modes and their weighted motion (n, m), of contacts or of one face."""

    frequency: Array
    damping: Array
    motion: Matrix

    def in_motions(self, vectors: Array) -> "WeightedModes":
        """The same in the motions that are the columns of `vectors` (n, p)."""
        return self._replace(motion=vectors.T @ self.motion)

    def term(self, number: int, other: "WeightedModes | None" = None) -> Matrix:
        """A factor of the series (`series`), (n, n); with the motion of the same modes of an `other` face, across."""
        squared = self.frequency**2
        factor = (1.0 / squared, 1.0 / squared**2, self.damping / squared**2, 1.0 / squared**3)[number]
        return np.asarray((self.motion * factor) @ (self if other is None else other).motion.conj().T)

    def terms(self, other: "WeightedModes | None" = None) -> Matrix:
        """All factors, (4, n, n)."""
        return np.stack([self.term(number, other) for number in range(TERMS)])


def contact_weights(contact: ContactParameters) -> Array:
    """Square roots of the contact stiffnesses, (3 n_c,)."""
    springs = contact_springs(contact.n_contacts, contact.normal_stiffness, contact.tangential_stiffness)
    return np.asarray(np.sqrt(springs.ravel()))


def unweighted(mean: Array, vectors: Array, weight: Array) -> tuple[Array, Array, Array, Array]:
    """The attributes of `SharedMotions` from U `vectors` and the terms of the mean flexibility, with weights."""
    inverse = np.divide(1.0, weight, out=np.zeros_like(weight), where=weight > 0.0)
    across = vectors.T @ mean[0]
    rest = mean[0] - vectors @ across
    rest -= (rest @ vectors) @ vectors.T
    sizes, others = np.linalg.eigh(rest)
    flexible = np.concatenate([vectors, others[:, sizes > NEGLIGIBLE_MEAN]], axis=1)
    in_flexible = flexible.T @ mean @ flexible
    return inverse[:, None] * vectors, mean * (inverse[:, None] * inverse), inverse[:, None] * flexible, in_flexible
