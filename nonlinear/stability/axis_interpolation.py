"""Hermite interpolation of a matrix that is analytic in sigma, along the imaginary axis."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.stability.block_matrices import Matrix


@dataclass(frozen=True)
class AxisInterpolation:
    """A matrix and its derivative in sigma at any sigma = i c, from those at J values of c; a polynomial in c."""

    # (matrix, derivative), by c, the matrix (n, n) at sigma = i c and its derivative in sigma
    known: Mapping[float, tuple[Matrix, Matrix]]

    @cached_property
    def _coefficients(self) -> ComplexArray:
        """Of the powers of c, (2 J, n^2)."""
        centres, powers = np.array([*self.known]), np.arange(2 * len(self.known))
        values = centres[:, None] ** powers
        slopes = powers * centres[:, None] ** np.maximum(powers - 1, 0)
        matrices = [part[0].ravel() for part in self.known.values()]
        changes = [1j * part[1].ravel() for part in self.known.values()]  # d / dc = i d / dsigma
        return np.linalg.solve(np.concatenate([values, slopes]), np.stack(matrices + changes).astype(complex))

    def at(self, centres: Array) -> tuple[ComplexArray, ComplexArray]:
        """The matrix and its derivative in sigma at sigma = i c, (m, n, n) each.

        Shapes: `centres` (m,).
        """
        size = len(next(iter(self.known.values()))[0])
        powers = np.arange(len(self._coefficients))
        values = centres[:, None] ** powers
        slopes = powers * centres[:, None] ** np.maximum(powers - 1, 0)
        matrix, change = ((part @ self._coefficients).reshape(-1, size, size) for part in (values, -1j * slopes))
        return matrix, change
