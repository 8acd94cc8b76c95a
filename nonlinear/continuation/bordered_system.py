"""The linear system of a continuation step: the Jacobian bordered by the frequency and by a direction, factorised."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from nonlinear.contact.parameters import Array
from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.harmonic_balance.residual import BalanceAt


@dataclass(frozen=True)
class BorderedSystem:
    """[[dR/dx, dR/dw], [t_x, t_w]] in scaled unknowns, reduced to the displacements that the forces depend on.

    Of a displacement on which no force depends (an open contact, a direction without friction) the Jacobian has the
    column of the unit matrix: it follows from the others and is left out of the factors.
    """

    metric: Metric
    coupling: Array  # d(response) / d(active unknowns), (n, n_active)
    active: NDArray[np.intp]  # their places among the unknowns
    passive: NDArray[np.intp]  # the places of the others
    slope: Array  # dR/dw, scaled, (n,)
    border: tuple[Array, float]  # scaled
    factors: Array
    pivots: Array
    determinant_sign: int

    @classmethod
    def factorise(cls, at: BalanceAt, border: Tangent, metric: Metric) -> "BorderedSystem":
        """Factorise at one state; `border` is of unit length in `metric`. A singular system solves to NaN."""
        coupling, active = at.coupling
        size, n_active = coupling.shape
        slope = at.slope * (metric.omega / metric.length)
        row, corner = border[0] / metric.length, border[1] / metric.omega
        passive = np.delete(np.arange(size), active) if n_active < size else np.empty(0, dtype=np.intp)
        matrix = np.empty((n_active + 1, n_active + 1))
        np.negative(coupling[active], out=matrix[:-1, :-1])
        matrix[np.arange(n_active), np.arange(n_active)] += 1.0
        matrix[:-1, -1] = slope[active]
        matrix[-1, :-1], matrix[-1, -1] = row[active], corner
        if passive.size:
            matrix[-1, :-1] += row[passive] @ coupling[passive]
            matrix[-1, -1] -= row[passive] @ slope[passive]
        factors, pivots, _ = dgetrf(matrix.T, overwrite_a=1)
        swaps = int(np.count_nonzero(pivots != np.arange(n_active + 1)))
        sign = int(np.prod(np.sign(factors.diagonal()))) * (-1) ** swaps
        return cls(metric, coupling, active, passive, slope, (row, corner), factors, pivots, sign)

    def _solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution in scaled unknowns for the right-hand side (right, last)."""
        reduced = np.append(right[self.active], last)
        if self.passive.size:
            reduced[-1] -= self.border[0][self.passive] @ right[self.passive]
        with np.errstate(all="ignore"):
            solution, _ = dgetrs(self.factors, self.pivots, reduced, trans=1, overwrite_b=1)
        scaled = np.empty(right.size)
        scaled[self.active] = solution[:-1]
        if self.passive.size:
            rest = right[self.passive] + self.coupling[self.passive] @ solution[:-1]
            scaled[self.passive] = rest - self.slope[self.passive] * solution[-1]
        return scaled, float(solution[-1])

    def step(self, residual: Array) -> Tangent:
        """Newton step in the plane normal to the border."""
        scaled, rate = self._solve(residual / -self.metric.length, 0.0)
        return scaled * self.metric.length, rate * self.metric.omega

    def tangent(self) -> tuple[Tangent, int, int]:
        """Unit tangent on the side of the border, the sign of det [dR/dx, dR/dw; tangent], and that of det dR/dx.

        z solves B z = e_last; by Cramer's rule det dR/dx = z_last det B.
        """
        scaled, rate = self._solve(np.zeros(self.slope.size), 1.0)
        tangent = self.metric.unit((scaled * self.metric.length, rate * self.metric.omega))
        return tangent, self.determinant_sign, self.determinant_sign * int(np.sign(rate))
