"""Corrector: Newton's method from a predicted point to the solution, in the plane normal to the tangent or by the
smallest step (Moore-Penrose), and the bordered linear system of its steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.solution_point import Metric, Tangent
from nonlinear.harmonic_balance.initial_solution import ConvergenceMonitor
from nonlinear.harmonic_balance.residual import BorderedFactors, HarmonicBalance, LinearisedResidual
from nonlinear.options import SolverOptions


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
    def factorise(cls, linearised: LinearisedResidual, border: Tangent, metric: Metric) -> BorderedSystem:
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


TOLERANCE = 1e-10  # relative residual; the solution is only a start
LARGEST_STEP = 1.0  # in the metric


def nearest_solution(
    balance: HarmonicBalance, unknown: Array, omega: float, metric: Metric, most_iterations: int = 15
) -> tuple[Array, float] | None:
    """A solution (x, omega) near a point; None where Newton's method does not converge.

    Each step is the smallest one, in the metric, that solves R + dR/dx dx + dR/domega domega = 0: no direction has to
    be known, as for a plane through the point.
    """
    x, w = unknown.copy(), omega
    for _ in range(most_iterations):
        linearised = balance.evaluate(x, w)
        if balance.relative_error(linearised.residual, x) < TOLERANCE:
            return x, w
        matrix = np.column_stack([linearised.jacobian * metric.length, linearised.dR_domega * metric.omega])
        step = -np.linalg.lstsq(matrix, linearised.residual, rcond=None)[0]
        if not np.linalg.norm(step) < LARGEST_STEP:
            return None
        x, w = x + metric.length * step[:-1], w + metric.omega * float(step[-1])
    return None


MAX_CORRECTIONS = 12
MANY_UNKNOWNS = 120  # a factorisation costs as much as ten evaluations, not as three
CHORD_STEPS, MANY_CHORD_STEPS = 2, 4  # that the factors of a Jacobian may still serve for; of many unknowns
SAME_SYSTEM = 1e-3  # contraction of the error by a step, below which its Jacobian also gives the tangent


@dataclass(frozen=True)
class Corrected:
    """A solution of the corrector."""

    unknown: Array  # (n,), x, m
    omega: float  # frequency, rad/s
    contact: ContactForces  # contact forces at the solution
    tangent: tuple[Tangent, int, int]  # see `BorderedSystem.tangent`
    iterations: int  # Newton iterations


@dataclass(frozen=True)
class NormalPlane:
    """The arc-length constraint: the plane through the predicted point (x, omega), normal to a unit direction."""

    unknown: Array  # (n,), x, m
    omega: float  # frequency, rad/s
    direction: Tangent  # normal of the plane
    metric: Metric  # scales of displacement and frequency
    max_distance: float  # distance from the predicted point beyond which a solution is refused

    def distance(self, unknown: Array, omega: float) -> float:
        """Distance of (x, omega) from the predicted point."""
        return self.metric.norm(unknown - self.unknown, omega - self.omega)


def correct(
    balance: HarmonicBalance,
    options: SolverOptions,
    plane: NormalPlane,
    offset: Tangent | None = None,
    refactorise: bool = False,
) -> Corrected | None:
    """Solve R(x, omega) = 0 in the plane; None if the iteration fails.

    The iteration starts at the predicted point, or at `offset` beside it in the plane. The factors of a Jacobian
    serve some further steps, as long as the errors predict that these suffice: with an error e and a
    contraction c of the last step, the next step with the same factors leaves 2 c e or less. The last factors also
    give the tangent, unless their steps contract the error too little or the caller wants to `refactorise` at the
    very solution.
    """
    x, omega = plane.unknown, plane.omega
    if offset is not None:
        x, omega = x + offset[0], omega + offset[1]
    chord_steps = CHORD_STEPS if balance.size < MANY_UNKNOWNS else MANY_CHORD_STEPS
    monitor = ConvergenceMonitor(options.tolerance, options.round_off)
    system, previous_error, first_contraction = None, np.inf, np.inf
    for iteration in range(MAX_CORRECTIONS + 1):
        linearised = balance.evaluate(x, omega)
        error = balance.relative_error(linearised.residual, x)
        contraction = error / previous_error
        if first_contraction == np.inf:  # of this system; the later ones may be round-off
            first_contraction = contraction
        if monitor.converged(error):
            if system is None or refactorise or first_contraction > SAME_SYSTEM:
                system = BorderedSystem.factorise(linearised, plane.direction, plane.metric)
            return Corrected(x, omega, linearised.contact, system.tangent(), iteration)
        if iteration == MAX_CORRECTIONS or not np.isfinite(error):
            return None
        if system is None or error * (2.0 * contraction) ** chord_steps > options.tolerance:
            system = BorderedSystem.factorise(linearised, plane.direction, plane.metric)
            first_contraction = np.inf
        dx, domega = system.newton_step(linearised.residual)
        x, omega, previous_error = x + dx, omega + domega, error
        # a NaN fails this comparison too
        if not (omega > 0.0 and plane.distance(x, omega) <= plane.max_distance):
            return None
    return None
