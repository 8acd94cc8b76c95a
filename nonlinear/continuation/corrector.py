"""Corrector: Newton's method from a predicted point to the solution, in the plane normal to the tangent or by the
smallest step (Moore-Penrose), and the bordered linear system of its steps. Small problems have it compiled whole.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.solution_point import Metric, Tangent
from nonlinear.harmonic_balance.initial_solution import ConvergenceMonitor
from nonlinear.harmonic_balance.newton_decisions import MAX_CORRECTIONS, SAME_SYSTEM, chord_steps, needs_factors
from nonlinear.harmonic_balance.residual import (
    BorderedFactors,
    HarmonicBalance,
    InterferenceChange,
    LinearisedResidual,
)
from nonlinear.options import SolverOptions

if TYPE_CHECKING:
    from nonlinear.contact.event_driven import EventDrivenJenkins, NodeLaws, Scratch
    from nonlinear.continuation.corrector_kernels import Iterate, Path, Plane, Structure, Workspace


@dataclass(frozen=True)
class BorderedSystem:
    """The factorised Jacobian, bordered by dR/dp and by a unit direction t.

    ::

        [ dR/dx   dR/dp ] [ dx ]   [ right ]
        [ t_x     t_p   ] [ dp ] = [ last  ]

    The unknowns are scaled by the metric.
    """

    metric: Metric  # scales of displacement and parameter
    size: int  # number of unknowns n
    factors: BorderedFactors  # solves the scaled system

    @classmethod
    def factorise(cls, linearised: LinearisedResidual, border: Tangent, metric: Metric) -> BorderedSystem:
        """Factorise at one state; `border` is of unit length in `metric`. A singular system solves to NaN."""
        dR_dp = linearised.dR_dp * (metric.parameter / metric.length)
        factors = linearised.factorise(dR_dp, border[0] / metric.length, border[1] / metric.parameter)
        return cls(metric, linearised.residual.size, factors)

    @property
    def sign(self) -> int:
        """Sign of the determinant."""
        return self.factors.sign

    def newton_step(self, residual: Array) -> Tangent:
        """The Newton step (dx, dp) for the residual (n,), normal to the border."""
        scaled, scaled_parameter = self.factors.solve(residual / -self.metric.length, 0.0)
        return scaled * self.metric.length, scaled_parameter * self.metric.parameter

    def tangent(self) -> tuple[Tangent, int, int]:
        """Unit tangent on the side of the border, sign of det [dR/dx, dR/dp; t], sign of det dR/dx.

        The tangent z solves B z = e_last. By Cramer's rule det dR/dx = z_last det B.
        """
        scaled, scaled_parameter = self.factors.solve(np.zeros(self.size), 1.0)
        tangent = self.metric.unit((scaled * self.metric.length, scaled_parameter * self.metric.parameter))
        side = 0 if np.isnan(scaled_parameter) else int(np.sign(scaled_parameter))  # NaN of a singular system
        return tangent, self.sign, self.sign * side


TOLERANCE = 1e-10  # relative residual; the solution is only a start
LARGEST_STEP = 1.0  # in the metric


def nearest_solution(
    balance: HarmonicBalance, unknown: Array, parameter: float, metric: Metric, most_iterations: int = 15
) -> tuple[Array, float] | None:
    """A solution (x, p) near a point; None where Newton's method does not converge.

    Each step is the smallest one, in the metric, that solves R + dR/dx dx + dR/dp dp = 0: no direction has to
    be known, as for a plane through the point.
    """
    x, p = unknown.copy(), parameter
    for _ in range(most_iterations):
        linearised = balance.evaluate(x, p)
        if balance.relative_error(linearised.residual, x) < TOLERANCE:
            return x, p
        matrix = np.column_stack([linearised.jacobian * metric.length, linearised.dR_dp * metric.parameter])
        step = -np.linalg.lstsq(matrix, linearised.residual, rcond=None)[0]
        if not np.linalg.norm(step) < LARGEST_STEP:
            return None
        x, p = x + metric.length * step[:-1], p + metric.parameter * float(step[-1])
    return None


@dataclass(frozen=True)
class Corrected:
    """A solution of the corrector."""

    unknown: Array  # (n,), x, m
    parameter: float  # p
    contact: ContactForces  # contact forces at the solution
    tangent: tuple[Tangent, int, int]  # see `BorderedSystem.tangent`
    iterations: int  # Newton iterations


@dataclass(frozen=True)
class NormalPlane:
    """The arc-length constraint: the plane through the predicted point (x, p), normal to a unit direction."""

    unknown: Array  # (n,), x, m
    parameter: float  # p
    direction: Tangent  # normal of the plane
    metric: Metric  # scales of displacement and parameter
    max_distance: float  # distance from the predicted point beyond which a solution is refused

    def distance(self, unknown: Array, parameter: float) -> float:
        """Distance of (x, p) from the predicted point."""
        return self.metric.norm(unknown - self.unknown, parameter - self.parameter)


def correct(
    balance: HarmonicBalance,
    options: SolverOptions,
    plane: NormalPlane,
    offset: Tangent | None = None,
    refactorise: bool = False,
) -> Corrected | None:
    """Solve R(x, p) = 0 in the plane; None if the iteration fails.

    The iteration starts at the predicted point, or at `offset` beside it in the plane. The factors of a Jacobian
    serve some further steps (`needs_factors`). The last factors also give the tangent, unless their steps contract
    the error too little or the caller wants to `refactorise` at the very solution.
    """
    x, p, lowest = plane.unknown, plane.parameter, balance.parameter.lowest
    if offset is not None:
        x, p = x + offset[0], p + offset[1]
    steps = chord_steps(balance.size)
    monitor = ConvergenceMonitor(options.tolerance, options.round_off)
    system, previous_error, first_contraction = None, np.inf, np.inf
    for iteration in range(MAX_CORRECTIONS + 1):
        linearised = balance.evaluate(x, p)
        error = balance.relative_error(linearised.residual, x)
        contraction = error / previous_error
        if first_contraction == np.inf:  # of this system; the later ones may be round-off
            first_contraction = contraction
        if monitor.converged(error):
            if system is None or refactorise or first_contraction > SAME_SYSTEM:
                system = BorderedSystem.factorise(linearised, plane.direction, plane.metric)
            return Corrected(x, p, linearised.contact, system.tangent(), iteration)
        if iteration == MAX_CORRECTIONS or not np.isfinite(error):
            return None
        if system is None or needs_factors(error, contraction, steps, options.tolerance):
            system = BorderedSystem.factorise(linearised, plane.direction, plane.metric)
            first_contraction = np.inf
        dx, dp = system.newton_step(linearised.residual)
        x, p, previous_error = x + dx, p + dp, error
        # a NaN fails this comparison too
        if not (p > lowest and plane.distance(x, p) <= plane.max_distance):
            return None
    return None


MOST_UNKNOWNS = 420  # above, LAPACK takes most of a step and the corrector in Python loses little


def compiled_corrector(balance: HarmonicBalance, options: SolverOptions) -> CompiledCorrector | None:
    """The compiled corrector of a balance; None for one that is not small, or of other equations or contacts."""
    from nonlinear.contact.event_driven import EventDrivenJenkins

    element = balance.element
    small = balance.is_modal_sum and balance.size <= MOST_UNKNOWNS
    return CompiledCorrector(balance, element, options) if small and isinstance(element, EventDrivenJenkins) else None


@dataclass(frozen=True)
class CompiledCorrector:
    """`correct` compiled whole for one balance. Not for several threads at once: they share its scratch."""

    balance: HarmonicBalance  # the equations, over the frequency or over the interference
    element: EventDrivenJenkins  # the contact element of the balance
    options: SolverOptions  # tolerances

    def correct(self, plane: NormalPlane, offset: Tangent | None, refactorise: bool) -> Corrected | None:
        """The solution in the plane, see `correct`."""
        from nonlinear.continuation.corrector_kernels import FAILED, correct_in_plane

        metric, kernel_plane = plane.metric, self._plane(plane)
        at = self._iterate(plane, offset)
        work = self._work
        count, sign = correct_in_plane(
            self._structure, self._laws, kernel_plane, at, work, self._scratch, refactorise
        )
        if count == FAILED:
            return None
        tangent = metric.unit((at.tangent * metric.length, float(at.change[0]) * metric.parameter))
        signs = sign, sign * int(np.sign(at.change[0]))
        contact = ContactForces(at.force, at.jacobian, at.state)
        return Corrected(at.unknown, float(at.parameter[0]), contact, (tangent, *signs), count)

    def rate(self, plane: NormalPlane, change: InterferenceChange) -> Tangent:
        """Change of the solution (x, p) in which the plane touches the curve, per unit of another parameter."""
        from nonlinear.continuation.corrector_kernels import rate_in_plane

        at, metric, of_change = self._iterate(plane, None), plane.metric, (change.shift, change.defect_rate)
        rate_in_plane(self._structure, self._laws, self._plane(plane), at, self._work, self._scratch, of_change)
        return at.tangent * metric.length, float(at.change[0]) * metric.parameter

    def _plane(self, plane: NormalPlane) -> Plane:
        """The plane as the kernels take it."""
        from nonlinear.continuation.corrector_kernels import Plane

        (direction, direction_parameter), metric, options = plane.direction, plane.metric, self.options
        return Plane(
            unknown=plane.unknown,
            direction=direction,
            parameter=float(plane.parameter),
            direction_parameter=float(direction_parameter),
            length=float(metric.length),
            parameter_scale=float(metric.parameter),
            max_distance=float(plane.max_distance),
            lowest=self.balance.parameter.lowest,
            tolerance=float(options.tolerance),
            round_off=float(options.round_off),
        )

    def _iterate(self, plane: NormalPlane, offset: Tangent | None) -> Iterate:
        """The predicted point, or the one at `offset` from it."""
        from nonlinear.continuation.corrector_kernels import Iterate

        rows, n_contacts = 2 * self.balance.n_harmonics + 1, self.balance.n_contacts
        unknown, parameter = plane.unknown.copy(), plane.parameter
        if offset is not None:
            unknown, parameter = unknown + offset[0], parameter + offset[1]
        return Iterate(
            unknown=unknown,
            residual=np.empty(unknown.size),
            motion=unknown.reshape(rows, n_contacts, 3),
            parameter=np.array([parameter]),
            change=np.zeros(1),
            force=np.empty((rows, n_contacts, 3)),
            jacobian=np.empty((n_contacts, 3, 3, rows, rows)),
            state=np.empty(n_contacts, np.int64),
            tangent=np.empty(unknown.size),
        )

    @cached_property
    def _laws(self) -> NodeLaws:
        """The contact laws; where the interference is the parameter, with loads of their own."""
        laws = self.element.laws
        return laws if self.balance.parameter.change is None else laws._replace(offset=laws.offset.copy())

    @cached_property
    def _path(self) -> Path:
        """The parameter as the kernels take it."""
        from nonlinear.continuation.corrector_kernels import Path

        parameter, load = self.balance.parameter, self.element.laws.offset[:, 2].copy()
        change = parameter.change or InterferenceChange(np.zeros(load.size), np.zeros(self.balance.size))
        fixed = parameter.omega is not None
        return Path(not fixed, parameter.omega or 0.0, parameter.origin, load, change.shift, change.defect_rate)

    @cached_property
    def _scratch(self) -> Scratch:
        return self.element.scratch()

    @cached_property
    def _structure(self) -> Structure:
        from nonlinear.continuation.corrector_kernels import Structure

        balance, receptance = self.balance, self.balance.receptance
        return Structure(
            relative=np.ascontiguousarray(receptance.relative),
            adjoint=receptance.adjoint,
            modal_force=receptance.modal_force,
            stiffness=np.ascontiguousarray(receptance.waves.angular_frequency**2, dtype=float),
            damping=np.ascontiguousarray(receptance.waves.damping, dtype=float),
            odd=balance.odd,
            floor=balance.tiny + balance.static_resolution,
            defect=np.zeros(balance.size) if balance.defect is None else balance.defect,
            path=self._path,
        )

    @cached_property
    def _work(self) -> Workspace:
        from nonlinear.continuation.corrector_kernels import Workspace

        n_h, size = self.balance.n_harmonics + 1, self.balance.size
        displacements, modes = self._structure.relative.shape[1:]
        of_modes, of_nodes = (n_h, modes), (n_h, displacements)
        receptance = np.empty((n_h, displacements, displacements), complex)
        receptance[0] = self.balance.receptance.static_matrix
        if self.balance.parameter.omega is not None:
            receptance[1:] = self.balance.receptance.matrix(self.balance.parameter.omega)[1:]
        return Workspace(
            denominators=np.empty(of_modes, complex),
            rates=np.empty(of_modes, complex),
            coordinates=np.empty(of_modes, complex),
            weighted_force=np.empty(of_modes, complex),
            contact_force=np.empty(of_nodes, complex),
            response=np.empty(of_nodes, complex),
            receptance=receptance,
            weighted=np.empty((displacements, modes), complex),
            by_row=np.empty((2 * n_h - 1, self.balance.n_contacts, 3, 3 * (2 * n_h - 1))),
            coupling=np.empty((size, size)),
            dR_dp=np.empty(size),
            tangent=np.empty(size),
            columns=np.empty(size, np.int64),
            active=np.empty(size, np.int64),
            passive=np.empty(size, np.int64),
            matrix=np.empty((size + 1) ** 2),
            pivots=np.empty(size + 1, np.int32),
            right=np.empty(size + 1),
        )
