"""The contact of one point closed around the mean flexibility of all waves, once for all phase shifts."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.stability.block_matrices import Matrix
from nonlinear.stability.hill import HillEigenproblem, HillProblem, touching_nodes
from nonlinear.stability.memory_feedback import SliderMemoryFeedback
from nonlinear.stability.point_contact import PointContact, in_harmonics
from nonlinear.stability.shared_motions import ClosingMotions, SharedMotions, series


@dataclass(frozen=True)
class ClosedContact:
    """Forces on the shared motions y under motions y, K_U(sigma) = U^T K (I - M K)^-1 U, M the mean flexibility.

    M is linear in sigma, the slider memory in K is not linearised. The contact is closed in few motions, d = D v.
    """

    closed: HillEigenproblem  # the contact around the mean flexibility, in real motions
    harmonics: int  # S, those of the perturbation: 0, 1, -1,
    motions: ClosingMotions  # the motions v
    mean: ComplexArray  # (S, r, r), M at sigma = 0, in these motions

    @property
    def static(self) -> bool:
        """Whether there is a harmonic 0."""
        return self.harmonics % 2 == 1

    @classmethod
    def of(cls, problem: HillProblem, motions: SharedMotions, contact: PointContact) -> "ClosedContact":
        """Close the contact of a point."""
        chosen = motions.closing(np.repeat(touching_nodes(contact.jacobian), 3))
        structure = chosen.structure(problem.n_harmonics, contact.omega, problem.static)
        closed = problem.closed_in_motions(structure, chosen.motions, contact.jacobian, contact.memory)
        s = np.asarray(1j * contact.omega * problem.harmonics, dtype=complex)
        return cls(closed, problem.harmonics.size, chosen, series(chosen.mean, s, contact.omega)[0])

    def at(self, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """K_U and its derivative in sigma, in the amplitudes of the harmonics, (S p, S p) each."""
        if sigma not in self._known:
            (state, linear), memory = self._without_memory, self.closed.memory
            value, change = state + sigma * linear, linear
            if isinstance(memory, SliderMemoryFeedback):
                of_memory = self._of_sliders(memory, sigma)
                value, change = value + of_memory[0], change + of_memory[1]
            elif memory is not None:
                terms = memory.terms(sigma)
                value = value + self._in_amplitudes(terms.state + sigma * terms.flexibility)
                change = change + self._in_amplitudes(terms.flexibility + terms.derivative)
            self._known[sigma] = value, change
        return self._known[sigma]

    def _of_sliders(self, memory: SliderMemoryFeedback, sigma: complex) -> tuple[ComplexArray, ComplexArray]:
        """What the memory adds to K_U and to its derivative; its factors, of low rank, are brought to amplitudes."""
        parts = memory.factors(sigma)
        right = self._columns_in_amplitudes(np.concatenate([parts.dw, memory.output_derivative]))
        value = np.concatenate([parts.state + sigma * parts.flexibility, sigma * parts.inputs], axis=1)
        change = np.concatenate([parts.flexibility + parts.derivative, parts.inputs], axis=1)
        return self._rows_in_amplitudes(value) @ right, self._rows_in_amplitudes(change) @ right

    @cached_property
    def _without_memory(self) -> tuple[ComplexArray, ComplexArray]:
        """K_U at sigma = 0 and its derivative without the memory of the sliders."""
        return self._in_amplitudes(self.closed.state_matrix), self._in_amplitudes(self.closed.flexibility_matrix)

    def motion(self, sigma: complex, free: ComplexArray) -> ComplexArray:
        """(I - M K(sigma))^-1 v: the motion under contact forces of one without them, (S, r).

        Shapes: `free` (S, r).
        """
        first = int(self.static)
        real = free.copy()
        one, other = free[first::2], free[first + 1 :: 2]
        real[first::2], real[first + 1 :: 2] = one + other, -1j * (one - other)
        moved = self.closed.x_times(sigma, real.ravel())
        return self._rows_in_amplitudes(moved[:, None]).reshape(free.shape)

    @cached_property
    def _known(self) -> dict[complex, tuple[ComplexArray, ComplexArray]]:
        return {}

    def _rows_in_amplitudes(self, rows: Matrix) -> ComplexArray:
        """Forces or motions (S n, k) of real coefficients as amplitudes of the harmonics 0, 1, -1, ..."""
        first, real = int(self.static), rows.reshape(self.harmonics, -1)
        result = real.astype(complex)
        one, other = real[first::2], 1j * real[first + 1 :: 2]
        result[first::2], result[first + 1 :: 2] = 0.5 * (one + other), 0.5 * (one - other)
        return result.reshape(rows.shape)

    def _columns_in_amplitudes(self, columns: Matrix) -> ComplexArray:
        """What is multiplied by real coefficients (k, S p), as what is multiplied by the amplitudes."""
        first, real = int(self.static), columns.reshape(len(columns), self.harmonics, -1)
        result = real.astype(complex)
        one, other = real[:, first::2], 1j * real[:, first + 1 :: 2]
        result[:, first::2], result[:, first + 1 :: 2] = one - other, one + other
        return result.reshape(columns.shape)

    def _in_amplitudes(self, matrix: Matrix) -> ComplexArray:
        size, rows = self.harmonics, len(matrix) // max(self.harmonics, 1)
        missing = int(not self.static)  # harmonic 0
        values = np.zeros((rows, rows, size + missing, size + missing), dtype=matrix.dtype)
        values[:, :, missing:, missing:] = matrix.reshape(size, rows, size, rows).transpose(1, 3, 0, 2)
        result = in_harmonics(values)[:, :, missing:, missing:]
        return np.ascontiguousarray(result.transpose(2, 0, 3, 1)).reshape(matrix.shape)
