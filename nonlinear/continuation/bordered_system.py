"""The bordered linear system of a continuation step."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from nonlinear.contact.parameters import Array
from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.harmonic_balance.residual import LinearisedResidual


@dataclass(frozen=True)
class BorderedSystem:
    """The factorised Jacobian, bordered by dR/domega and by a unit direction t.

    ::

        [ dR/dx   dR/domega ] [ dx     ]   [ right ]
        [ t_x     t_omega   ] [ domega ] = [ last  ]

    The unknowns are scaled by the metric. Passive unknowns, on which no contact force depends (an open contact, a
    direction without friction), have the column of the unit matrix in dR/dx: they follow from the active ones and
    are eliminated before the factorisation.

    Attributes
    ----------
    metric : Metric
        Scales of displacement and frequency.
    coupling : (n, n_active) float
        G df/dx in the columns of the active unknowns.
    active, passive : (n_active,) int, (n - n_active,) int
        Indices of the active and of the passive unknowns.
    dR_domega : (n,) float
        Derivative of the residual, scaled.
    border : tuple of (n,) float and float
        t, scaled.
    factors, pivots : (n_active + 1, n_active + 1) float, (n_active + 1,) int
        LU factors of the transpose.
    sign : int
        Sign of the determinant.
    """

    metric: Metric
    coupling: Array
    active: NDArray[np.intp]
    passive: NDArray[np.intp]
    dR_domega: Array
    border: tuple[Array, float]
    factors: Array
    pivots: Array
    sign: int

    @classmethod
    def factorise(cls, linearised: LinearisedResidual, border: Tangent, metric: Metric) -> "BorderedSystem":
        """Factorise at one state; `border` is of unit length in `metric`. A singular system solves to NaN."""
        coupling, active = linearised.coupling
        size, n_active = coupling.shape
        dR_domega = linearised.dR_domega * (metric.omega / metric.length)
        row, corner = border[0] / metric.length, border[1] / metric.omega
        passive = np.delete(np.arange(size), active) if n_active < size else np.empty(0, dtype=np.intp)
        matrix = np.empty((n_active + 1, n_active + 1))
        np.negative(coupling[active], out=matrix[:-1, :-1])
        matrix[np.arange(n_active), np.arange(n_active)] += 1.0
        matrix[:-1, -1] = dR_domega[active]
        matrix[-1, :-1], matrix[-1, -1] = row[active], corner
        if passive.size:
            matrix[-1, :-1] += row[passive] @ coupling[passive]
            matrix[-1, -1] -= row[passive] @ dR_domega[passive]
        factors, pivots, _ = dgetrf(matrix.T, overwrite_a=1)
        swaps = int(np.count_nonzero(pivots != np.arange(n_active + 1)))
        sign = int(np.prod(np.sign(factors.diagonal()))) * (-1) ** swaps
        return cls(metric, coupling, active, passive, dR_domega, (row, corner), factors, pivots, sign)

    def _solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution in scaled unknowns for the right-hand side (right (n,), last)."""
        reduced = np.append(right[self.active], last)
        if self.passive.size:
            reduced[-1] -= self.border[0][self.passive] @ right[self.passive]
        with np.errstate(all="ignore"):
            solution, _ = dgetrs(self.factors, self.pivots, reduced, trans=1, overwrite_b=1)
        scaled = np.empty(right.size)
        scaled[self.active] = solution[:-1]
        if self.passive.size:
            uncoupled = right[self.passive] + self.coupling[self.passive] @ solution[:-1]
            scaled[self.passive] = uncoupled - self.dR_domega[self.passive] * solution[-1]
        return scaled, float(solution[-1])

    def newton_step(self, residual: Array) -> Tangent:
        """The Newton step (dx, domega) for the residual (n,), normal to the border."""
        scaled, scaled_omega = self._solve(residual / -self.metric.length, 0.0)
        return scaled * self.metric.length, scaled_omega * self.metric.omega

    def tangent(self) -> tuple[Tangent, int, int]:
        """Unit tangent on the side of the border, sign of det [dR/dx, dR/domega; t], sign of det dR/dx.

        The tangent z solves B z = e_last. By Cramer's rule det dR/dx = z_last det B.
        """
        scaled, scaled_omega = self._solve(np.zeros(self.dR_domega.size), 1.0)
        tangent = self.metric.unit((scaled * self.metric.length, scaled_omega * self.metric.omega))
        return tangent, self.sign, self.sign * int(np.sign(scaled_omega))
