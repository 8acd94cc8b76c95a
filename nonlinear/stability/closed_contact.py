"""The contact of one point closed around the mean flexibility of all waves, once for all phase shifts."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.stability.block_matrices import Matrix
from nonlinear.stability.hill import HillEigenproblem, HillProblem, touching_nodes
from nonlinear.stability.point_contact import PointContact, in_harmonics
from nonlinear.stability.shared_motions import ClosingMotions, SharedMotions, series


@dataclass(frozen=True)
class ClosedContact:
    """Forces on the shared motions y under motions y, K_U(sigma) = U^T K (I - M K)^-1 U, M the mean flexibility.

    M is linear in sigma, the slider memory in K is not linearised. The contact is closed in few motions, d = D v.

    Attributes
    ----------
    closed : HillEigenproblem
        The contact around the mean flexibility, in real motions.
    harmonics : int
        S, those of the perturbation: 0, 1, -1, ...
    motions : ClosingMotions
        The motions v.
    mean : (S, r, r)
        M at sigma = 0, in these motions.
    """

    closed: HillEigenproblem
    harmonics: int
    motions: ClosingMotions
    mean: ComplexArray

    @property
    def static(self) -> bool:
        """Whether there is a harmonic 0."""
        return self.harmonics % 2 == 1

    @classmethod
    def of(cls, problem: HillProblem, motions: SharedMotions, contact: PointContact) -> "ClosedContact":
        """Close the contact of a point.

        Parameters
        ----------
        problem : HillProblem
            Perturbations of the wave, kappa = 0.
        motions : SharedMotions
            The mean flexibility, and the shared motions.
        contact : PointContact
            The point.
        """
        chosen = motions.closing(np.repeat(touching_nodes(contact.jacobian), 3))
        structure = chosen.structure(problem.n_harmonics, contact.omega, problem.static)
        closed = problem.closed_in_motions(structure, chosen.motions, contact.jacobian, contact.memory)
        s = np.asarray(1j * contact.omega * problem.harmonics, dtype=complex)
        return cls(closed, problem.harmonics.size, chosen, series(chosen.mean, s, contact.omega)[0])

    def at(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """K_U and its derivative in sigma, in the amplitudes of the harmonics, (S p, S p) each.

        Parameters
        ----------
        sigma : complex
            lambda / omega.
        """
        if sigma not in self._known:
            value, change = self.closed.state_matrix, self.closed.flexibility_matrix
            linear = change
            if self.closed.memory is not None:
                terms = self.closed.memory.terms(sigma)
                linear = linear + terms.flexibility
                value, change = value + terms.state, linear + terms.derivative
            value = value + sigma * linear
            self._known[sigma] = self._in_amplitudes(value), self._in_amplitudes(change)
        return self._known[sigma]

    def motion(self, sigma: complex, free: ComplexArray) -> ComplexArray:
        """(I - M K(sigma))^-1 v: the motion under contact forces of one without them, (S, r).

        Parameters
        ----------
        sigma : complex
            lambda / omega.
        free : (S, r)
            v, amplitudes of the harmonics 0, 1, -1, ...
        """
        first = int(self.static)
        real = free.copy()
        one, other = free[first::2], free[first + 1 :: 2]
        real[first::2], real[first + 1 :: 2] = one + other, -1j * (one - other)
        moved = self.closed.x_times(sigma, real.ravel()).reshape(free.shape)
        result = moved.astype(complex)
        one, other = moved[first::2], 1j * moved[first + 1 :: 2]
        result[first::2], result[first + 1 :: 2] = 0.5 * (one + other), 0.5 * (one - other)
        return result

    @cached_property
    def _known(self) -> dict[complex, tuple[ComplexArray, ComplexArray]]:
        return {}

    def _in_amplitudes(self, matrix: Matrix) -> ComplexArray:
        size, rows = self.harmonics, len(matrix) // max(self.harmonics, 1)
        missing = int(not self.static)  # harmonic 0
        values = np.zeros((rows, rows, size + missing, size + missing), dtype=matrix.dtype)
        values[:, :, missing:, missing:] = matrix.reshape(size, rows, size, rows).transpose(1, 3, 0, 2)
        result = in_harmonics(values)[:, :, missing:, missing:]
        return np.ascontiguousarray(result.transpose(2, 0, 3, 1)).reshape(matrix.shape)
