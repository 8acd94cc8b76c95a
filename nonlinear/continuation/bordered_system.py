"""The bordered linear system of a continuation step."""

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.harmonic_balance.residual import BorderedFactors, LinearisedResidual


@dataclass(frozen=True)
class BorderedSystem:
    """The factorised Jacobian, bordered by dR/domega and by a unit direction t.

    ::

        [ dR/dx   dR/domega ] [ dx     ]   [ right ]
        [ t_x     t_omega   ] [ domega ] = [ last  ]

    The unknowns are scaled by the metric.
    """

    metric: Metric  # scales of displacement and frequency
    size: int  # number of unknowns n
    factors: BorderedFactors  # solves the scaled system

    @classmethod
    def factorise(cls, linearised: LinearisedResidual, border: Tangent, metric: Metric) -> "BorderedSystem":
        """Factorise at one state; `border` is of unit length in `metric`. A singular system solves to NaN."""
        dR_domega = linearised.dR_domega * (metric.omega / metric.length)
        factors = linearised.factorise(dR_domega, border[0] / metric.length, border[1] / metric.omega)
        return cls(metric, linearised.residual.size, factors)

    @property
    def sign(self) -> int:
        """Sign of the determinant."""
        return self.factors.sign

    def newton_step(self, residual: Array) -> Tangent:
        """The Newton step (dx, domega) for the residual (n,), normal to the border."""
        scaled, scaled_omega = self.factors.solve(residual / -self.metric.length, 0.0)
        return scaled * self.metric.length, scaled_omega * self.metric.omega

    def tangent(self) -> tuple[Tangent, int, int]:
        """Unit tangent on the side of the border, sign of det [dR/dx, dR/domega; t], sign of det dR/dx.

        The tangent z solves B z = e_last. By Cramer's rule det dR/dx = z_last det B.
        """
        scaled, scaled_omega = self.factors.solve(np.zeros(self.size), 1.0)
        tangent = self.metric.unit((scaled * self.metric.length, scaled_omega * self.metric.omega))
        side = 0 if np.isnan(scaled_omega) else int(np.sign(scaled_omega))  # NaN of a singular system
        return tangent, self.sign, self.sign * side
