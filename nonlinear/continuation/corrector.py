"""Corrector: Newton's method from a predicted point to the solution, in the plane normal to the tangent or by the
smallest step (Moore-Penrose), and the bordered linear system of its steps. Small problems have it compiled whole.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.corrector_state import (
    FORCES,
    MOTIONS,
    PAIRS,
    Condensation,
    Iterate,
    Path,
    Plane,
    Structure,
    Workspace,
)
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
LARGEST_SHARE = 0.4  # of motions in the relative displacements
TYPICAL = 0.3  # contraction of the refinement, relative to what is left of G k where this is small
LARGEST_CONTRACTION = 0.2  # beyond, condensed factors are not tried
# errors of the solutions of a point, relative; number of these solutions
SOLVED, SOLUTIONS = 1e-5, 4
PROBES = 3
OLD = 1e-2  # contraction with factors of another iterate
PRODUCTS = 2.0  # work of a product with the Jacobian relative to that of as many multiplications in factors


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


MOST_UNKNOWNS = 420  # of dense factors: above, LAPACK takes most of a step and the corrector in Python loses little


def compiled_corrector(balance: HarmonicBalance, options: SolverOptions) -> CompiledCorrector | None:
    """The compiled corrector of a balance.

    None for one that is neither small nor condenses well, or that has other equations or contacts.
    """
    from nonlinear.contact.event_driven import EventDrivenJenkins

    element, omega = balance.element, balance.parameter.omega
    if not (balance.is_modal_sum and isinstance(element, EventDrivenJenkins)):
        return None
    stiffness = max(element.laws.normal_stiffness.max(), element.laws.tangential_stiffness.max())
    condensed = condensation(balance, stiffness, options.omega_range if omega is None else (omega, omega))
    small = balance.size <= MOST_UNKNOWNS or condensed.motions.shape[1] > 0
    return CompiledCorrector(balance, element, options, condensed) if small else None


@dataclass(frozen=True)
class CompiledCorrector:
    """`correct` compiled whole for one balance. Not for several threads at once: they share its scratch."""

    balance: HarmonicBalance  # the equations, over the frequency or over the interference
    element: EventDrivenJenkins  # the contact element of the balance
    options: SolverOptions  # tolerances
    condensed: Condensation  # basis of condensed factors

    def correct(self, plane: NormalPlane, offset: Tangent | None, refactorise: bool) -> Corrected | None:
        """The solution in the plane, see `correct`, which takes over where many unknowns need dense factors."""
        from nonlinear.continuation.corrector_kernels import EXACT, FAILED, SOLUTION, UNSOLVED

        at, metric = self._iterate(plane, offset), plane.metric
        count, sign = self._run(plane, at, EXACT if refactorise else SOLUTION)
        if count == UNSOLVED:
            return correct(self.balance, self.options, plane, offset, refactorise)
        if count == FAILED:
            return None
        tangent = metric.unit((at.tangent * metric.length, float(at.change[0]) * metric.parameter))
        signs = sign, sign * int(np.sign(at.change[0]))
        contact = ContactForces(at.force, at.jacobian, at.state)
        return Corrected(at.unknown, float(at.parameter[0]), contact, (tangent, *signs), count)

    def rate(self, plane: NormalPlane, change: InterferenceChange) -> Tangent | None:
        """Change of the solution (x, p) in which the plane touches the curve, per unit of another parameter.

        None where many unknowns need dense factors.
        """
        from nonlinear.continuation.corrector_kernels import RATE, UNSOLVED

        at, metric = self._iterate(plane, None), plane.metric
        self._work.other_shift[:], self._work.other_defect_rate[:] = change.shift, change.defect_rate
        if self._run(plane, at, RATE)[0] == UNSOLVED:
            return None
        return at.tangent * metric.length, float(at.change[0]) * metric.parameter

    def _run(self, plane: NormalPlane, at: Iterate, wanted: int) -> tuple[int, int]:
        """Run the kernel: iterations and sign."""
        from nonlinear.continuation.corrector_kernels import correct_in_plane

        given = self._structure, self._laws, self._plane(plane)
        found: tuple[int, int] = correct_in_plane(*given, at, self._work, self._scratch, wanted)
        return found

    def _plane(self, plane: NormalPlane) -> Plane:
        """The plane as the kernels take it."""
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
        parameter, load = self.balance.parameter, self.element.laws.offset[:, 2].copy()
        change = parameter.change or InterferenceChange(np.zeros(load.size), np.zeros(self.balance.size))
        fixed = parameter.omega is not None
        return Path(not fixed, parameter.omega or 0.0, parameter.origin, load, change.shift, change.defect_rate)

    @cached_property
    def _scratch(self) -> Scratch:
        return self.element.scratch()

    @cached_property
    def _structure(self) -> Structure:
        balance, receptance = self.balance, self.balance.receptance
        return Structure(
            relative=np.ascontiguousarray(receptance.relative),
            adjoint=receptance.adjoint,
            force=receptance.force_of_waves,
            stiffness=np.ascontiguousarray(receptance.waves.total_stiffness, dtype=complex),
            damping=np.ascontiguousarray(receptance.waves.total_damping, dtype=complex),
            inertia=receptance.waves.inertia,
            odd=balance.odd,
            floor=balance.tiny + balance.static_resolution,
            defect=np.zeros(balance.size) if balance.defect is None else balance.defect,
            floating=np.ascontiguousarray(balance.floating_motions.T),
            path=self._path,
        )

    @property
    def _has_dense_factors(self) -> bool:
        return self.balance.size <= MOST_UNKNOWNS

    @cached_property
    def _work(self) -> Workspace:
        n_h, size = self.balance.n_harmonics + 1, self.balance.size
        displacements, modes = self._structure.relative.shape[1:]
        of_modes, of_nodes = (n_h, modes), (n_h, displacements)
        dense = size if self._has_dense_factors else 0
        largest = 1 + max(dense, self.condensed.reduced.size)
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
            dR_dp=np.empty(size),
            tangent=np.empty(size),
            unsolved=np.empty(size),
            of_dof=np.empty(2 * n_h - 1),
            shares=np.empty(len(self._structure.floating)),
            other_shift=np.empty(self.balance.n_contacts),
            other_defect_rate=np.empty(size),
            condensed=self.condensed,
            receptance=receptance,
            weighted=np.empty((displacements, modes), complex),
            by_row=np.empty((2 * n_h - 1, self.balance.n_contacts, 3, 3 * (2 * n_h - 1))),
            coupling=np.empty((dense, dense)),
            columns=np.empty(dense, np.int64),
            active=np.empty(dense, np.int64),
            passive=np.empty(dense, np.int64),
            matrix=np.empty(largest * largest),
            pivots=np.empty(largest, np.int32),
            right=np.empty(largest),
        )


def condensation(balance: HarmonicBalance, stiffness: float, omega_range: tuple[float, float]) -> Condensation:
    """The motions with the least estimated work, with the scratch of the kernels; none where dense factors take less.

    `stiffness`: the largest one of a contact node, N/m. What is chosen depends on the problem alone, not on what was
    solved before.
    """
    receptance, modes, values = balance.receptance, np.zeros((3 * balance.n_contacts, 0)), np.zeros(0)
    if not receptance.large:
        modes, values = receptance.common_interface_modes(*omega_range)
    return _with_scratch(balance, modes[:, : motion_count(balance, values * stiffness)])


def motion_count(balance: HarmonicBalance, left: Array) -> int:
    """The number of motions with the least estimated work; 0 where dense factors take less.

    `left` (3 n_c,): bounds of G k in each motion; empty: unknown, as of faces with many nodes.
    """
    rows, face, modes = 2 * balance.n_harmonics + 1, 3 * balance.n_contacts, balance.receptance.relative.shape[2]
    product = PRODUCTS * (8.0 * (balance.n_harmonics + 1) * face * modes + PAIRS / 3.0 * face * rows * rows)
    n, receptance = balance.size, 4.0 * balance.n_harmonics * modes
    dense = n**3 / 3.0 + 3.0 * n * n + receptance * face**2
    least, best = dense + _solutions(n * n, product, OLD), 0
    for count in range(1, min(int(LARGEST_SHARE * face) + 1, left.size)):
        largest = float(left[count:].max())
        contraction = TYPICAL * largest / (1.0 + largest)
        size = rows * count
        factors = size**3 / 3.0 + (2.0 * count + PAIRS / 3.0 * face) * size * size + receptance * count**2
        solution = size * size + PAIRS / 3.0 * face * rows * rows + 2.0 * face * size
        work = factors + _solutions(solution, product, contraction)
        if contraction < LARGEST_CONTRACTION and work < least:
            least, best = work, count
    return best


def _solutions(solution: float, product: float, contraction: float) -> float:
    """Estimate of the multiplications for the solutions of a point by iterative refinement."""
    refinements = max(1.0, math.log(SOLVED) / math.log(max(contraction, SOLVED)) - 1.0)
    return SOLUTIONS * (solution + refinements * (solution + product))


def _with_scratch(balance: HarmonicBalance, motions: Array) -> Condensation:
    """What the kernels need of the motions Q, (3 n_c, r)."""
    rows, nodes, (face, r) = 2 * balance.n_harmonics + 1, balance.n_contacts, motions.shape
    by_node = motions.reshape(nodes, 3, r)
    products = by_node[:, FORCES, :, None] * by_node[:, MOTIONS, None, :]
    relative = np.ascontiguousarray(motions.T @ balance.receptance.relative)
    size = rows * r
    return Condensation(
        motions=np.ascontiguousarray(motions),
        transposed=np.ascontiguousarray(motions.T),
        products=np.ascontiguousarray(products.reshape(nodes * PAIRS, r * r).T),
        relative=relative,
        adjoint=np.ascontiguousarray(balance.receptance.adjoint @ motions),
        static=np.ascontiguousarray(motions.T @ balance.receptance.static_matrix @ motions),
        weighted=np.empty(relative.shape[1:], complex),
        receptance=np.empty((r, r), complex),
        flexibility=np.empty((balance.n_harmonics, 2 * r, 2 * r)),
        stiffness=np.empty((nodes * PAIRS, rows * rows)),
        coupling=np.empty((r * r, rows * rows)),
        projected=np.empty((size, size)),
        moved=np.empty((size, size)),
        force=np.empty((rows, face)),
        reduced=np.empty((rows, r)),
        probes=np.random.default_rng(0).standard_normal((PROBES, rows * face + 1)),
    )
