"""Pseudo-arc-length continuation of the balance in the frequency: step control, kinks, linear stretches.

Lengths along the curve are measured relative to the present vibration and to a tenth of the frequency range, so that
a step means the same at the top of a resonance and far below it, and force and interference scaled together give the
same steps.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.bordered_system import BorderedSystem
from nonlinear.continuation.corrector import MAX_CORRECTIONS, Corrected, Plane, correct
from nonlinear.continuation.linear_segment_steps import LinearSegmentSteps
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.continuation.point_stability import PointStability
from nonlinear.continuation.predictor import cubic_offset
from nonlinear.continuation.resonances import Resonances
from nonlinear.continuation.response_quantities import amplitude_slope
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.balance_family import resized
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import SolverOptions

TARGET_DEVIATION = 0.08  # distance of the corrected from the predicted point, relative to the step
LARGEST_DEVIATION = 0.6
KINK_STEP = 0.01  # steps this short may cross a kink: there the deviation does not shrink with the step
KINK_DEVIATION = 4.0
KINK_COSINE = 0.5
RESONANCE_REACHED = 1e-9  # relative distance within which a resonance counts as reached
FARTHEST_RESTART = 1.5  # arc length within which a solution counts as the same one
ASIDE = 0.02  # distance from the mean of two tangents, relative to the step, that a smooth curve may have
BRANCH_GAP = 1e-4  # arc length within which a curve that goes straight on may be interrupted at a branch point
SAME_BRANCH = 1e-3  # distance of two branch points that are one
RANGE_FRACTION = 0.1
SAME_POINT = 1e-6  # relative distance of two solutions that are one
MANY_ITERATIONS = 6  # more of them make the next step shorter


@dataclass(frozen=True)
class Continuation:
    """Continuation of `balance` under `options`; frequencies in rad/s.

    No step passes one of the `resonances`, resonances that may be narrower than a step. With the
    `contact` given, stretches on which no contact changes its state are followed without iterations. `adapt` may give
    each new point another number of harmonics, `stability` adds the exponents. `branch_points`: beside those that the
    trace has gone through so far.
    """

    balance: HarmonicBalance
    options: SolverOptions
    resonances: Resonances = field(default_factory=Resonances)
    contact: ContactParameters | None = None
    adapt: Callable[["Continuation", SolutionPoint], SolutionPoint | None] | None = None
    stability: PointStability | None = None
    branch_points: list[SolutionPoint] = field(default_factory=list)

    @property
    def span(self) -> tuple[float, float]:
        """Frequency range in rad/s."""
        low, high = self.options.frequency_hz
        return 2.0 * np.pi * low, 2.0 * np.pi * high

    @cached_property
    def linear(self) -> LinearSegmentSteps | None:
        """Steps along linear stretches."""
        if self.contact is None:
            return None
        return LinearSegmentSteps(LinearSegments(self.balance, self.contact), self.metric, self.options.output)

    def of(self, balance: HarmonicBalance) -> "Continuation":
        """The same continuation of another balance of the problem."""
        return self if balance is self.balance else replace(self, balance=balance)

    def is_linear(self, point: SolutionPoint) -> bool:
        """Whether the point is known to lie on a linear stretch."""
        if point.linear is not None:
            return True
        return self.linear is not None and self.linear.stretches.state(point.displacement) is not None

    def metric(self, unknown: Array) -> Metric:
        """Scales at a point."""
        low, high = self.span
        whole = math.sqrt(unknown @ unknown)
        length = max(self.balance.vibration(unknown), 1e-6 * whole, self.balance.tiny)
        return Metric(length, RANGE_FRACTION * (high - low))

    def point(
        self, unknown: Array, omega: float, onward: Tangent, iterations: int, arc: float, step: float
    ) -> SolutionPoint:
        """The solved point (x, w) with its tangent on the side of `onward`."""
        at = self.balance.evaluate(unknown, omega)
        solved = Corrected(unknown, omega, at, None, iterations)
        return self._with_tangent(solved, onward, 0, arc, step)

    def onward(self, unknown: Array, omega: float, direction: float, iterations: int) -> SolutionPoint:
        """The solved point (x, w) as the beginning of a trace; `direction`: +1 or -1, its way in frequency."""
        at = self.balance.evaluate(unknown, omega)
        slope = np.asarray(np.linalg.solve(at.jacobian, -at.slope), dtype=np.float64)
        return self.point(unknown, omega, (direction * slope, direction), iterations, 0.0, self.options.step)

    def _with_tangent(
        self, solved: Corrected, onward: Tangent, orientation: int, arc: float, step: float
    ) -> SolutionPoint:
        """The point with its tangent; its orientation wins over the angle where the curve turns sharply (a kink)."""
        metric = self.metric(solved.unknown)
        system = solved.system or BorderedSystem.factorise(solved.at, metric.unit(onward), metric)
        tangent, sign, singular = system.tangent()
        tangent = metric.unit(tangent)
        if orientation not in (0, sign) and metric.product(metric.unit(onward), tangent) < KINK_COSINE:
            tangent, sign = (-tangent[0], -tangent[1]), -sign
        return SolutionPoint(
            balance=self.balance,
            unknown=solved.unknown,
            omega=solved.omega,
            tangent=tangent,
            metric=metric,
            contact=solved.at.contact,
            determinant_sign=singular,
            orientation=sign,
            iterations=solved.iterations,
            arc=arc,
            step=step,
        )

    def correct(
        self,
        point: SolutionPoint,
        step: float,
        tangent: Tangent | None = None,
        previous: SolutionPoint | None = None,
        sharp: bool = False,
    ) -> SolutionPoint | None:
        """The point at arc length `step` beyond `point`, in the plane normal to the tangent; None if not reached.

        With the `previous` point given, the search starts from the cubic through both instead of the tangent.
        `sharp`: the tangent of the new point is to be good to the last digit.
        """
        direction = tangent or point.tangent
        metric = point.metric
        allowed = step * (KINK_DEVIATION if step <= KINK_STEP else LARGEST_DEVIATION)
        base = point.unknown + step * direction[0], point.omega + step * direction[1]
        plane = Plane(*base, direction, metric, allowed)
        offset = None
        if previous is not None and tangent is None:
            offset = cubic_offset(previous, point, step, metric)
            if offset is not None and metric.norm(*offset) > 0.5 * allowed:
                offset = None
        solved = correct(self.balance, self.options, plane, offset)
        if solved is None:
            return None
        following = self._following(step, plane.distance(solved.unknown, solved.omega), solved.iterations)
        solved = replace(solved, system=None) if sharp else solved
        return self._with_tangent(solved, direction, point.orientation, point.arc + step, following)

    def _following(self, step: float, deviation: float, iterations: int) -> float:
        """The next step after one that left its tangent by `deviation`."""
        following = step * float(np.clip(TARGET_DEVIATION / (deviation / step + 1e-12), 0.3, 2.0))
        if iterations > MANY_ITERATIONS:
            following = min(following, 0.7 * step)
        return min(following, self.options.max_step)

    def refit(self, point: SolutionPoint) -> SolutionPoint | None:
        """The nearest solution of this balance in the plane normal to the tangent through a point of another one."""
        start = resized(point, self.balance)
        metric = self.metric(start.unknown)
        direction = metric.unit(start.tangent)
        solved = correct(
            self.balance, self.options, Plane(start.unknown, start.omega, direction, metric, FARTHEST_RESTART)
        )
        if solved is None:
            return None
        return self._with_tangent(solved, direction, 0, point.arc, point.step)

    def at_frequency(self, point: SolutionPoint, omega: float) -> SolutionPoint | None:
        """The point of the curve near `point` at a given w, along its tangent as first guess; None if not reached."""
        along = (omega - point.omega) / point.tangent[1]
        guess = point.unknown + along * point.tangent[0]
        found = solve_at(self.balance, omega, guess, self.options, MAX_CORRECTIONS)
        if not found.converged:
            return None
        arc = point.arc + abs(along)
        return self.point(found.solution, omega, point.tangent, found.iterations, arc, point.step)

    def next_point(self, previous: SolutionPoint | None, point: SolutionPoint) -> SolutionPoint | None:
        """The next accepted point: shorter steps first, then the secant in place of the tangent; None if all fail.

        A point of another orientation lies beyond a branch point, or on another leg of the curve: then it is refused.
        """
        found = self._linear_step(point)
        if found is not None:
            return found
        wanted = min(point.step, self.options.max_step)
        step = self._up_to_resonance(point, wanted, self.resonances.all)
        while step >= self.options.min_step:
            found = self.correct(point, step, previous=previous)
            if found is not None and (self._follows(point, found) or self._crosses_branch(point, found, step)):
                # a step that a resonance cut short says nothing against long ones
                return replace(found, step=wanted) if step < wanted and found.step >= step else found
            wanted = step = step / (3.0 if found is None else 2.0)
        if previous is not None:
            metric = point.metric
            secant = metric.unit((point.unknown - previous.unknown, point.omega - previous.omega))
            for step in np.geomspace(self.options.max_step, self.options.min_step, 24):
                found = self.correct(point, float(step), secant)
                if found is not None and found.orientation == point.orientation:
                    return replace(found, step=self.options.step)
        return self._beyond_kink(point)

    def _linear_step(self, point: SolutionPoint) -> SolutionPoint | None:
        """The next point of a linear stretch; None where there is none, or where it ends."""
        if self.linear is None or point.tangent[1] == 0.0:
            return None
        low, high = self.span
        metric = point.metric
        wanted = min(point.step, self.options.max_step)
        step = self._up_to_resonance(point, wanted, self.resonances.natural)
        limit = high if point.tangent[1] > 0.0 else low
        step = min(step, max((limit - point.omega) / point.tangent[1], self.options.min_step))
        while step >= self.options.min_step:
            found = self.linear.step(point, step)
            if found is None:
                return None
            predicted = point.unknown + step * point.tangent[0], point.omega + step * point.tangent[1]
            deviation = metric.norm(found.unknown - predicted[0], found.omega - predicted[1])
            if found.step < step or deviation <= LARGEST_DEVIATION * step:
                following = self._following(step, deviation, 0)
                return replace(found, step=wanted if step < wanted and following >= step else following)
            step /= 2.0
        return None

    def _follows(self, point: SolutionPoint, found: SolutionPoint) -> bool:
        """Whether `found` continues the leg of `point`."""
        same_leg = found.orientation == point.orientation
        return same_leg and not _turns_sharply(point, found) and not _moved_aside(point, found)

    def _crosses_branch(self, point: SolutionPoint, found: SolutionPoint, step: float) -> bool:
        """Whether the curve goes straight on through a branch point to `found`, the point `step` beyond `point`.

        There the orientation changes, within a gap that is nothing or next to it (if a symmetry is not quite exact).
        Where the curve has a leg beside it that runs the other way, its own leg is found in that place if the search
        starts near enough. No trace goes through a branch point twice in the same direction: it came to a loop.
        """
        metric = point.metric
        if found.orientation == point.orientation or _turns_sharply(point, found) or _moved_aside(point, found):
            return False
        near, left = point, step
        while left > BRANCH_GAP:
            for part in (0.5, 0.3, 0.7):  # the middle may be the singular point itself
                middle = self.correct(near, part * left)
                if middle is not None:
                    break
            else:
                return False
            if middle.orientation == point.orientation and not _turns_sharply(near, middle):
                near, left = middle, self._along(middle, found)
            else:
                found, left = middle, part * left
        if left < 0.0 or _distance(near, found, metric) > 2.0 * BRANCH_GAP:
            return False
        crossed = [other for other in self.branch_points if other.balance is self.balance]
        for other in crossed:
            parallel = abs(metric.product(metric.unit(other.tangent), metric.unit(found.tangent))) > KINK_COSINE
            if parallel and _distance(other, found, metric) < SAME_BRANCH:
                return False
        self.branch_points.append(found)
        return True

    def _up_to_resonance(self, point: SolutionPoint, step: float, resonances: tuple[float, ...]) -> float:
        """The step, or the one that reaches the next resonance frequency where it would pass that."""
        slope = point.tangent[1]
        for resonance in resonances:
            distance = resonance - point.omega
            if distance * slope > 0.0 and abs(distance) > RESONANCE_REACHED * resonance:
                step = min(step, distance / slope)
        return max(step, self.options.min_step)

    def _beyond_kink(self, point: SolutionPoint) -> SolutionPoint | None:
        """The next point where a kink turns the curve by more than a right angle, so that no plane ahead meets it.

        The tangent on the far side is that of the equations a little ahead, oriented like the curve so far.
        """
        metric = point.metric
        for ahead in np.geomspace(KINK_STEP, self.options.min_step, 13):
            x = point.unknown + ahead * point.tangent[0]
            at = self.balance.evaluate(x, point.omega + ahead * point.tangent[1])
            tangent, sign, _ = BorderedSystem.factorise(at, point.tangent, metric).tangent()
            beyond = tangent if sign == point.orientation else (-tangent[0], -tangent[1])
            for step in (ahead, 10.0 * ahead):
                found = self.correct(point, step, beyond)
                if found is not None and metric.product(metric.unit(found.tangent), beyond) > KINK_COSINE:
                    return found
        return None

    def trace(
        self, start: SolutionPoint, progress: Callable[[float, int], None] | None = None
    ) -> Iterator[SolutionPoint]:
        """Points from `start` on, until the range is left (its last point lies on the limit) or a step fails.

        A curve that comes back to `start` ends with it.
        """
        low, high = self.span
        here = replace(self, balance=start.balance, branch_points=[])
        first = start if self.adapt is None else self.adapt(here, start)
        yield self.recorded(first or start)
        if first is None:
            return
        previous, point, here = None, first, here.of(first.balance)
        for count in range(1, self.options.max_points):
            found = here.next_point(previous, point)
            if found is None:
                return
            if count > 2 and here._passes(point, found, first):
                yield self.recorded(replace(first, arc=point.arc + here._along(point, first)))
                return
            limit = high if found.omega >= high else low if found.omega <= low else None
            if limit is not None:
                end = found if found.omega == limit else here.at_frequency(point, limit)
                yield self.recorded(found if end is None else end)
                return
            adapted = found if here.adapt is None else here.adapt(here, found)
            if adapted is None:
                return
            previous = point if adapted.balance is point.balance else None
            point, here = adapted, here.of(adapted.balance)
            if progress is not None:
                progress(point.omega / (2.0 * np.pi), count)
            yield self.recorded(point)

    def recorded(self, point: SolutionPoint, exponents: bool = True) -> SolutionPoint:
        """The point with what is derived from its contact Jacobian, and without that; `exponents`: these too."""
        slope = point.amplitude_slope if point.linear is not None else amplitude_slope(point, self.options.output)
        found = self.stability.exponents(point) if self.stability is not None and exponents else None
        contact = point.contact.without_jacobian()
        return replace(point, amplitude_slope=slope, exponents=found, contact=contact)

    def with_exponents(self, point: SolutionPoint) -> SolutionPoint:
        """A recorded point with its exponents, if they are asked for."""
        if self.stability is None or point.exponents is not None:
            return point
        contact = self.balance.element.evaluate(point.displacement)
        return replace(point, exponents=self.stability.exponents(replace(point, contact=contact)))

    def _along(self, point: SolutionPoint, other: SolutionPoint) -> float:
        """Arc length from `point` to `other`, along the tangent."""
        apart = other.unknown - point.unknown, other.omega - point.omega
        return point.metric.product(apart, point.tangent)

    def _passes(self, point: SolutionPoint, found: SolutionPoint, home: SolutionPoint) -> bool:
        """Whether `home` lies on the curve between two neighbouring points of it."""
        if home.balance is not point.balance:
            return False
        along = self._along(point, home)
        if home.orientation != point.orientation or not 0.0 < along <= found.arc - point.arc:
            return False
        metric = point.metric
        beside = home.unknown - point.unknown - along * point.tangent[0]
        if metric.norm(beside, home.omega - point.omega - along * point.tangent[1]) > along:
            return False
        same = self.correct(point, along)
        return same is not None and metric.norm(same.unknown - home.unknown, 0.0) <= SAME_POINT


def _distance(one: SolutionPoint, other: SolutionPoint, metric: Metric) -> float:
    return metric.norm(one.unknown - other.unknown, one.omega - other.omega)


def _turns_sharply(point: SolutionPoint, found: SolutionPoint) -> bool:
    """Whether the curve turned by more than 60 degrees in a step too long to be that of a kink."""
    if found.arc - point.arc <= KINK_STEP:
        return False
    return point.metric.product(point.tangent, point.metric.unit(found.tangent)) < KINK_COSINE


def _moved_aside(point: SolutionPoint, found: SolutionPoint) -> bool:
    """Whether the step went to a neighbouring leg of the curve, as its two tangents tell.

    Between two points of one leg the curve follows the mean of the tangents there, to the third power of the step; a
    kink between them moves it by at most half of their difference. A leg beside runs parallel at a distance.
    """
    metric = point.metric
    first, last = point.tangent, metric.unit(found.tangent)
    moved = found.unknown - point.unknown, found.omega - point.omega
    length = metric.norm(*moved)
    turned = metric.norm(last[0] - first[0], last[1] - first[1])
    aside = (
        moved[0] - 0.5 * length * (first[0] + last[0]),
        moved[1] - 0.5 * length * (first[1] + last[1]),
    )
    return metric.norm(*aside) > length * (0.5 * turned + ASIDE)
