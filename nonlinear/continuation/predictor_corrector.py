"""Prediction and correction of single points of a curve, with the compiled corrector for small problems."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.corrector import MAX_CORRECTIONS, BorderedSystem, Corrected, NormalPlane, correct
from nonlinear.continuation.solution_point import Metric, SolutionPoint, Tangent
from nonlinear.continuation.step_control import ContinuationParameters, next_step
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import HarmonicBalance, InterferenceChange
from nonlinear.options import SolverOptions
from rom import RelativeReceptance

if TYPE_CHECKING:
    from nonlinear.contact.event_driven import EventDrivenJenkins, NodeLaws, Scratch
    from nonlinear.continuation.corrector_kernels import Iterate, Path, Plane, Structure, Workspace


SMALLEST_COSINE = 0.5  # of the angle between the last two tangents
LARGEST_EXTRAPOLATION = 3.0  # relative to the distance of the last two points


def cubic_offset(previous: SolutionPoint, point: SolutionPoint, step: float, metric: Metric) -> Tangent | None:
    """Distance of the cubic Hermite extrapolation from the tangent, `step` beyond `point` and normal to the tangent.

    Let r be the distance of `previous` from the tangent line, at -L along it, and r' the derivative of r there. The
    offset is c2 s^2 + c3 s^3 with c2 = (r' L + 3 r) / L^2 and c3 = (r' L + 2 r) / L^3. None if the step is too long
    for an extrapolation or the tangents differ too much.
    """
    back = previous.unknown - point.unknown, previous.omega - point.omega
    length = -metric.product(back, point.tangent)
    if (
        length * LARGEST_EXTRAPOLATION < step
        or metric.product(metric.unit(previous.tangent), point.tangent) < SMALLEST_COSINE
    ):
        return None
    ratio = step / length
    weight_r, weight_dr = ratio**2 * (3.0 + 2.0 * ratio), ratio**2 * (1.0 + ratio) * length
    # r = back + L t and r' = t_previous / (t_previous . t) - t, so the offset is a sum of three known steps
    weight_previous = weight_dr / metric.product(previous.tangent, point.tangent)
    weight_tangent = weight_r * length - weight_dr
    displacement = weight_r * back[0] + weight_previous * previous.tangent[0] + weight_tangent * point.tangent[0]
    omega = weight_r * back[1] + weight_previous * previous.tangent[1] + weight_tangent * point.tangent[1]
    return displacement, omega


MOST_UNKNOWNS = 420  # above, LAPACK takes most of a step and the corrector in Python loses little


def compiled_corrector(balance: HarmonicBalance, options: SolverOptions) -> CompiledCorrector | None:
    """The compiled corrector of a balance; None for one that is not small, or of other equations or contacts."""
    from nonlinear.contact.event_driven import EventDrivenJenkins

    element = balance.element
    if type(balance) is not HarmonicBalance and balance.interference_path is None:
        return None  # a subclass has equations of its own
    if type(balance.receptance) is not RelativeReceptance:
        return None
    if type(element) is not EventDrivenJenkins or balance.frozen_static is not None:
        return None
    return CompiledCorrector(balance, element, options) if balance.size <= MOST_UNKNOWNS else None


@dataclass(frozen=True)
class CompiledCorrector:
    """`corrector.correct` compiled whole for one balance. Not for several threads at once: they share its scratch."""

    # the equations, without a frozen static displacement; over the frequency, or over the interference
    balance: HarmonicBalance
    element: EventDrivenJenkins  # the contact element of the balance
    options: SolverOptions  # tolerances

    def correct(self, plane: NormalPlane, offset: Tangent | None, refactorise: bool) -> Corrected | None:
        """The solution in the plane, see `corrector.correct`."""
        from nonlinear.continuation.corrector_kernels import FAILED, correct_in_plane

        metric, kernel_plane = plane.metric, self._plane(plane)
        at = self._iterate(plane, offset)
        work = self._work
        count = correct_in_plane(self._structure, self._laws, kernel_plane, at, work, self._scratch, refactorise)
        if count == FAILED:
            return None
        sign = int(work.sizes[1])
        tangent = metric.unit((at.tangent * metric.length, float(at.omega[1]) * metric.omega))
        signs = sign, sign * int(np.sign(at.omega[1]))
        contact = ContactForces(at.force, at.jacobian, at.state)
        return Corrected(at.unknown, float(at.omega[0]), contact, (tangent, *signs), count)

    def rate(self, plane: NormalPlane, change: InterferenceChange) -> Tangent:
        """Change of the solution (x, omega) in which the plane touches the curve, per unit of a parameter."""
        from nonlinear.continuation.corrector_kernels import rate_in_plane

        at, metric, of_parameter = self._iterate(plane, None), plane.metric, (change.shift, change.defect_rate)
        rate_in_plane(self._structure, self._laws, self._plane(plane), at, self._work, self._scratch, of_parameter)
        return at.tangent * metric.length, float(at.omega[1]) * metric.omega

    def _plane(self, plane: NormalPlane) -> Plane:
        """The plane as the kernels take it."""
        from nonlinear.continuation.corrector_kernels import Plane

        direction, direction_omega = plane.direction
        metric, options = plane.metric, self.options
        scales = (metric.length, metric.omega, plane.max_distance, options.tolerance, options.round_off)
        return Plane(plane.unknown, direction, float(plane.omega), float(direction_omega), *map(float, scales))

    def _iterate(self, plane: NormalPlane, offset: Tangent | None) -> Iterate:
        """The predicted point, or the one at `offset` from it."""
        from nonlinear.continuation.corrector_kernels import Iterate

        rows, n_contacts = 2 * self.balance.n_harmonics + 1, self.balance.n_contacts
        unknown, omega = plane.unknown.copy(), plane.omega
        if offset is not None:
            unknown, omega = unknown + offset[0], omega + offset[1]
        return Iterate(
            unknown=unknown,
            residual=np.empty(unknown.size),
            motion=unknown.reshape(rows, n_contacts, 3),
            omega=np.array([omega, 0.0]),
            force=np.empty((rows, n_contacts, 3)),
            jacobian=np.empty((n_contacts, 3, 3, rows, rows)),
            state=np.empty(n_contacts, np.int64),
            tangent=np.empty(unknown.size),
        )

    @cached_property
    def _laws(self) -> NodeLaws:
        """The contact laws; where the interference is the parameter, with loads of their own."""
        laws = self.element.laws
        return laws if self.balance.interference_path is None else laws._replace(offset=laws.offset.copy())

    @cached_property
    def _path(self) -> Path:
        """What takes the place of the frequency."""
        from nonlinear.continuation.corrector_kernels import Path

        path, load = self.balance.interference_path, self.element.laws.offset[:, 2].copy()
        if path is None:
            return Path(0.0, 0.0, load, np.zeros(load.size), np.zeros(self.balance.size))
        return Path(float(path.frequency), float(path.origin), load, path.change.shift, path.change.defect_rate)

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
            dR_domega=np.empty(size),
            tangent=np.empty(size),
            columns=np.empty(size, np.int64),
            active=np.empty(size, np.int64),
            passive=np.empty(size, np.int64),
            matrix=np.empty((size + 1) ** 2),
            pivots=np.empty(size + 1, np.int32),
            right=np.empty(size + 1),
            sizes=np.zeros(3, np.int64),
        )


@dataclass(frozen=True)
class PredictorCorrector:
    """Solves the balance for points in the (x, omega) space."""

    balance: HarmonicBalance  # the equations
    options: SolverOptions  # tolerances, frequency range and step lengths
    # largest deviations and scales
    parameters: ContinuationParameters = field(default_factory=ContinuationParameters)

    def metric(self, unknown: Array) -> Metric:
        """Scales at the unknown (n,)."""
        low, high = self.options.omega_range
        norm = math.sqrt(unknown @ unknown)
        length = max(self.balance.vibration(unknown), 1e-6 * norm, self.balance.tiny)
        return Metric(length, self.parameters.frequency_scale * (high - low))

    def starting_point(self, unknown: Array, omega: float, direction: float, iterations: int) -> SolutionPoint:
        """The solution (x, omega) as the start of a branch going up (`direction` +1) or down (-1) in frequency."""
        linearised = self.balance.evaluate(unknown, omega)
        dx_domega = linearised.solve(-linearised.dR_domega)
        return self.point(unknown, omega, (direction * dx_domega, direction), iterations, 0.0, self.options.step)

    def point(
        self, unknown: Array, omega: float, towards: Tangent, iterations: int, arc: float, step: float
    ) -> SolutionPoint:
        """The solution (x, omega) as a point with its tangent on the side of `towards`."""
        linearised = self.balance.evaluate(unknown, omega)
        metric = self.metric(unknown)
        tangent = BorderedSystem.factorise(linearised, metric.unit(towards), metric).tangent()
        solved = Corrected(unknown, omega, linearised.contact, tangent, iterations)
        return self._with_tangent(solved, towards, 0, arc, step)

    def _with_tangent(
        self, solved: Corrected, towards: Tangent, bordered_sign: int, arc: float, step: float
    ) -> SolutionPoint:
        """The point with its tangent on the side of `towards`.

        At a kink, where the tangent changes by a large angle, the `bordered_sign` of the curve decides on the side.
        It is 0 where it is not known.
        """
        metric = self.metric(solved.unknown)
        tangent, sign, jacobian_sign = solved.tangent
        tangent = metric.unit(tangent)
        if (
            bordered_sign not in (0, sign)
            and metric.product(metric.unit(towards), tangent) < self.parameters.min_cosine
        ):
            tangent, sign = (-tangent[0], -tangent[1]), -sign
        return SolutionPoint(
            balance=self.balance,
            unknown=solved.unknown,
            omega=solved.omega,
            tangent=tangent,
            metric=metric,
            contact=solved.contact,
            jacobian_sign=jacobian_sign,
            bordered_sign=sign,
            iterations=solved.iterations,
            arc=arc,
            step=step,
        )

    def step(
        self,
        point: SolutionPoint,
        step: float,
        direction: Tangent | None = None,
        previous: SolutionPoint | None = None,
        refactorise: bool = False,
    ) -> SolutionPoint | None:
        """The point at arc length `step` beyond `point`; None if the corrector fails."""
        normal = direction or point.tangent
        metric = point.metric
        max_distance = step * self._largest_relative_deviation(step)
        predicted = point.unknown + step * normal[0], point.omega + step * normal[1]
        plane = NormalPlane(*predicted, normal, metric, max_distance)
        offset = None
        if previous is not None and direction is None:
            offset = cubic_offset(previous, point, step, metric)
            if offset is not None and metric.norm(*offset) > 0.5 * max_distance:
                offset = None
        solved = self._correct(plane, offset, refactorise)
        if solved is None:
            return None
        deviation = plane.distance(solved.unknown, solved.omega)
        following = next_step(step, deviation, solved.iterations, self.options, self.parameters)
        return self._with_tangent(solved, normal, point.bordered_sign, point.arc + step, following)

    def _correct(
        self, plane: NormalPlane, offset: Tangent | None = None, refactorise: bool = False
    ) -> Corrected | None:
        """The solution in the plane: by the compiled corrector, if the problem is small."""
        if self._compiled is not None:
            return self._compiled.correct(plane, offset, refactorise)
        return correct(self.balance, self.options, plane, offset, refactorise)

    def interference_rate(self, point: SolutionPoint, change: InterferenceChange) -> Tangent | None:
        """dx/dp and domega/dp of a solution in the plane normal to its tangent, p a parameter of the interference.

        None where the problem is not small.
        """
        if self._compiled is None:
            return None
        normal = point.metric.unit(point.tangent)
        return self._compiled.rate(NormalPlane(point.unknown, point.omega, normal, point.metric, 0.0), change)

    @cached_property
    def _compiled(self) -> CompiledCorrector | None:
        return compiled_corrector(self.balance, self.options)

    def _largest_relative_deviation(self, step: float) -> float:
        crosses_kink = step <= self.parameters.kink_step
        return self.parameters.max_kink_deviation if crosses_kink else self.parameters.max_deviation

    def refit(self, point: SolutionPoint) -> SolutionPoint | None:
        """The solution with the harmonics of this balance nearest to `point`, in the plane normal to its tangent.

        `point` may have another number of harmonics. None if the corrector fails.
        """
        start = point.with_balance(self.balance)
        metric = self.metric(start.unknown)
        normal = metric.unit(start.tangent)
        plane = NormalPlane(start.unknown, start.omega, normal, metric, self.parameters.max_restart_distance)
        solved = self._correct(plane)
        if solved is None:
            return None
        return self._with_tangent(solved, normal, 0, point.arc, point.step)

    def at_frequency(self, point: SolutionPoint, omega: float) -> SolutionPoint | None:
        """The point of the curve near `point` at `omega` (rad/s), predicted by the tangent; None if not found."""
        step = (omega - point.omega) / point.tangent[1]
        guess = point.unknown + step * point.tangent[0]
        found = solve_at(self.balance, omega, guess, self.options, MAX_CORRECTIONS)
        if not found.converged:
            return None
        arc = point.arc + abs(step)
        return self.point(found.solution, omega, point.tangent, found.iterations, arc, point.step)
