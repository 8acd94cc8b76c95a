"""The receptance of a large contact face near a frequency: few modes one by one, all others as a power series.

With x = h w a mode far above x contributes

    1 / (w_m^2 + i c_m x - x^2) = a_0 + a_1 x + a_2 x^2 + ...,  w_m^2 a_k = a_(k-2) - i c_m a_(k-1),  a_0 = 1 / w_m^2,

so that the sum over such modes is S_0 + S_1 x + S_2 x^2 + ... with matrices that do not depend on the frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rom.cyclic.reduced_model import Array, ComplexArray

SMALLEST_FACE = 150  # relative displacements, below which the modal sum costs less
TERMS = 5
NEGLIGIBLE = 1e-16  # of the largest contribution of a mode: what all modes in the series together may leave out


@dataclass(frozen=True)
class ReceptanceSeries:
    """The receptance G of one harmonic at the frequencies x up to a limit."""

    relative: ComplexArray  # (3 n_c, k), relative motions of the modes that are summed one by one
    adjoint: ComplexArray  # (k, 3 n_c), their conjugate transpose
    frequency: Array  # (k,), their natural frequencies, rad/s, and damping coefficients, 1/s
    damping: Array  # (k,), their natural frequencies, rad/s, and damping coefficients, 1/s
    terms: ComplexArray  # (TERMS, 3 n_c, 3 n_c), S_0, S_1,

    @classmethod
    def of(cls, relative: ComplexArray, frequency: Array, damping: Array, limit: float) -> ReceptanceSeries:
        """Choose the modes and sum up the others.

        Shapes: `relative` (3 n_c, m), `frequency` (m,), `damping` (m,).
        """
        square = np.maximum(frequency**2, np.finfo(float).tiny)
        coefficients = np.zeros((TERMS, square.size), complex)
        coefficients[0] = 1.0 / square
        coefficients[1] = -1j * damping / square**2
        for k in range(2, TERMS):
            coefficients[k] = (coefficients[k - 2] - 1j * damping * coefficients[k - 1]) / square
        size = (relative.real**2 + relative.imag**2).sum(axis=0)
        exact = 1.0 / (square + 1j * damping * limit - limit**2)
        left_out = np.abs(exact - coefficients.T @ limit ** np.arange(TERMS)) * size
        left_out[frequency < 2.0 * limit] = np.inf
        order = np.argsort(left_out, kind="stable")
        small = np.cumsum(left_out[order]) <= NEGLIGIBLE * float((size / square).max())
        summed, single = np.sort(order[small]), np.sort(order[~small])
        largest = float((size / square).max())
        terms = np.empty((TERMS, relative.shape[0], relative.shape[0]), complex)
        for k in range(TERMS):
            matters = np.abs(coefficients[k, summed]) * size[summed] * limit**k > 1e-3 * NEGLIGIBLE * largest
            others = relative[:, summed[matters]]
            terms[k] = (others * coefficients[k, summed[matters]]) @ others.conj().T
        kept = np.ascontiguousarray(relative[:, single])
        return cls(kept, np.ascontiguousarray(kept.conj().T), frequency[single], damping[single], terms)

    def matrix(self, x: float) -> ComplexArray:
        """G at x = h w, rad/s: (3 n_c, 3 n_c), m/N."""
        value = self.frequency**2 + 1j * self.damping * x - x**2
        size = self.terms.shape[1]
        powers = (x ** np.arange(TERMS)).astype(complex)
        result: ComplexArray = (powers @ self.terms.reshape(TERMS, size * size)).reshape(size, size)
        result += (self.relative / value) @ self.adjoint
        return result
