"""Pseudo-arc-length continuation of the balance in the frequency: predictor, corrector, step control.

Lengths along the curve are measured relative to the present vibration and to a tenth of the frequency range, so that
a step means the same at the top of a resonance and far below it, and force and interference scaled together give the
same steps.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from nonlinear.balance import BalanceAt, HarmonicBalance
from nonlinear.contact import Array, ContactForces
from nonlinear.newton import Convergence
from nonlinear.options import SolverOptions

MAX_CORRECTIONS = 12
TARGET_DEVIATION = 0.08  # distance of the corrected from the predicted point, relative to the step
LARGEST_DEVIATION = 0.6
KINK_STEP = 0.01  # steps this short may cross a kink: there the deviation does not shrink with the step
KINK_DEVIATION = 4.0
KINK_COSINE = 0.5
LANDMARK_REACHED = 1e-9  # relative distance within which a landmark counts as reached
FARTHEST_RESTART = 1.5  # arc length within which a solution counts as the same one
RANGE_FRACTION = 0.1

Tangent = tuple[Array, float]  # dx/ds (n,), dw/ds


@dataclass(frozen=True)
class CurvePoint:
    """One solved point: unknown x (n,), w (rad/s), unit tangent (dx/ds, dw/ds) of growing arc, and how it was found.

    `determinant_sign` is that of det dR/dx: -1 where an odd number of real Floquet exponents is positive.
    `orientation` is the sign of det [dR/dx, dR/dw; tangent], the same along a curve, kinks included.
    """

    unknown: Array
    frequency: float
    tangent: Tangent
    contact: ContactForces
    determinant_sign: int
    orientation: int
    iterations: int
    arc: float
    step: float


@dataclass(frozen=True)
class Metric:
    """Scales of an arc length: of the displacement (m) and of the frequency (rad/s)."""

    length: float
    frequency: float

    def norm(self, displacement: Array, frequency: float) -> float:
        """Length of a step."""
        return float(np.hypot(np.linalg.norm(displacement) / self.length, frequency / self.frequency))

    def product(self, one: Tangent, other: Tangent) -> float:
        """Scalar product of two steps."""
        return float(one[0] @ other[0] / self.length**2 + one[1] * other[1] / self.frequency**2)

    def unit(self, tangent: Tangent) -> Tangent:
        """The same direction with length 1."""
        norm = self.norm(*tangent)
        return tangent[0] / norm, tangent[1] / norm


@dataclass(frozen=True)
class Continuation:
    """Continuation of `balance` under `options`; frequencies in rad/s.

    No step passes one of the `landmarks`, natural frequencies whose resonance may be narrower than a step.
    """

    balance: HarmonicBalance
    options: SolverOptions
    landmarks: tuple[float, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """Frequency range in rad/s."""
        low, high = self.options.frequency
        return 2.0 * np.pi * low, 2.0 * np.pi * high

    def metric(self, unknown: Array) -> Metric:
        """Scales at a point."""
        low, high = self.span
        whole = float(np.linalg.norm(unknown))
        length = max(self.balance.vibration(unknown), 1e-6 * whole, self.balance.tiny)
        return Metric(length, RANGE_FRACTION * (high - low))

    def point(
        self, unknown: Array, frequency: float, onward: Tangent, iterations: int, arc: float, step: float
    ) -> CurvePoint:
        """The solved point (x, w) with its tangent on the side of `onward`."""
        at = self.balance.evaluate(unknown, frequency)
        return self._with_tangent(unknown, frequency, at, onward, 0, (iterations, arc, step))

    def _with_tangent(
        self,
        unknown: Array,
        frequency: float,
        at: BalanceAt,
        onward: Tangent,
        orientation: int,
        record: tuple[int, float, float],
    ) -> CurvePoint:
        """The point with its tangent; its orientation wins over the angle where the curve turns sharply (a kink)."""
        metric = self.metric(unknown)
        tangent, sign, singular = _tangent(at, onward, metric)
        if orientation not in (0, sign) and metric.product(metric.unit(onward), tangent) < KINK_COSINE:
            tangent, sign = (-tangent[0], -tangent[1]), -sign
        iterations, arc, step = record
        return CurvePoint(unknown, frequency, tangent, at.contact, singular, sign, iterations, arc, step)

    def correct(self, point: CurvePoint, step: float, tangent: Tangent | None = None) -> CurvePoint | None:
        """The point at arc length `step` beyond `point`, in the plane normal to the tangent; None if not reached."""
        direction = tangent or point.tangent
        metric = self.metric(point.unknown)
        predicted = point.unknown + step * direction[0], point.frequency + step * direction[1]
        x, w = predicted
        allowed = step * (KINK_DEVIATION if step <= KINK_STEP else LARGEST_DEVIATION)
        watch = Convergence(self.options.tolerance, self.options.round_off)
        for iteration in range(MAX_CORRECTIONS + 1):
            at = self.balance.evaluate(x, w)
            error = self.balance.relative_error(at.residual, x)
            if watch.reached(error):
                break
            if iteration == MAX_CORRECTIONS or not np.isfinite(error):
                return None
            dx, dw = _bordered_solve(at.jacobian, at.slope, direction, metric, -at.residual)
            x, w = x + dx, w + dw
            if w <= 0.0 or metric.norm(x - predicted[0], w - predicted[1]) > allowed:
                return None
        deviation = metric.norm(x - predicted[0], w - predicted[1]) / step
        following = step * float(np.clip(TARGET_DEVIATION / (deviation + 1e-12), 0.3, 2.0))
        if iteration > 6:
            following = min(following, 0.7 * step)
        record = (iteration, point.arc + step, min(following, self.options.max_step))
        return self._with_tangent(x, w, at, direction, point.orientation, record)

    def correct_in_plane(self, start: CurvePoint) -> CurvePoint | None:
        """The nearest solution in the plane normal to the tangent through `start`, which need not be one itself."""
        metric = self.metric(start.unknown)
        x, w = start.unknown, start.frequency
        watch = Convergence(self.options.tolerance, self.options.round_off)
        for iteration in range(MAX_CORRECTIONS + 1):
            at = self.balance.evaluate(x, w)
            error = self.balance.relative_error(at.residual, x)
            if watch.reached(error):
                return replace(start, unknown=x, frequency=w, contact=at.contact, iterations=iteration)
            if not np.isfinite(error):
                return None
            dx, dw = _bordered_solve(at.jacobian, at.slope, start.tangent, metric, -at.residual)
            x, w = x + dx, w + dw
            if w <= 0.0 or metric.norm(x - start.unknown, w - start.frequency) > FARTHEST_RESTART:
                return None
        return None

    def at_frequency(self, point: CurvePoint, frequency: float) -> CurvePoint | None:
        """The point of the curve near `point` at a given w, along its tangent as first guess; None if not reached."""
        along = (frequency - point.frequency) / point.tangent[1]
        x = point.unknown + along * point.tangent[0]
        watch = Convergence(self.options.tolerance, self.options.round_off)
        for iteration in range(MAX_CORRECTIONS + 1):
            at = self.balance.evaluate(x, frequency)
            error = self.balance.relative_error(at.residual, x)
            if watch.reached(error):
                record = (iteration, point.arc + abs(along), point.step)
                return self._with_tangent(x, frequency, at, point.tangent, point.orientation, record)
            try:
                x = x + np.linalg.solve(at.jacobian, -at.residual)
            except np.linalg.LinAlgError:
                return None
            if not np.all(np.isfinite(x)):
                return None
        return None

    def next_point(self, previous: CurvePoint | None, point: CurvePoint) -> CurvePoint | None:
        """The next accepted point: shorter steps first, then the secant in place of the tangent; None if all fail.

        A point of another orientation lies on another leg of the curve (or beyond a branch point): it is refused.
        """
        wanted = min(point.step, self.options.max_step)
        step = self._up_to_landmark(point, wanted)
        while step >= self.options.min_step:
            found = self.correct(point, step)
            if found is not None and self._follows(point, found):
                # a step that a landmark cut short says nothing against long ones
                return replace(found, step=wanted) if step < wanted and found.step >= step else found
            wanted = step = step / (3.0 if found is None else 2.0)
        if previous is not None:
            metric = self.metric(point.unknown)
            secant = metric.unit((point.unknown - previous.unknown, point.frequency - previous.frequency))
            for step in np.geomspace(self.options.max_step, self.options.min_step, 24):
                found = self.correct(point, float(step), secant)
                if found is not None and found.orientation == point.orientation:
                    return replace(found, step=self.options.step)
        return self._beyond_kink(point)

    def _follows(self, point: CurvePoint, found: CurvePoint) -> bool:
        """Whether `found` continues the leg of `point`."""
        same_leg = found.orientation == point.orientation
        return same_leg and not _turns_sharply(point, found, self.metric(point.unknown))

    def _up_to_landmark(self, point: CurvePoint, step: float) -> float:
        """The step, or the one that reaches the next landmark frequency where it would pass that."""
        slope = point.tangent[1]
        for landmark in self.landmarks:
            distance = landmark - point.frequency
            if distance * slope > 0.0 and abs(distance) > LANDMARK_REACHED * landmark:
                step = min(step, distance / slope)
        return max(step, self.options.min_step)

    def _beyond_kink(self, point: CurvePoint) -> CurvePoint | None:
        """The next point where a kink turns the curve by more than a right angle, so that no plane ahead meets it.

        The tangent on the far side is that of the equations a little ahead, oriented like the curve so far.
        """
        metric = self.metric(point.unknown)
        for ahead in np.geomspace(KINK_STEP, self.options.min_step, 13):
            x = point.unknown + ahead * point.tangent[0]
            at = self.balance.evaluate(x, point.frequency + ahead * point.tangent[1])
            tangent, sign, _ = _tangent(at, point.tangent, metric)
            beyond = tangent if sign == point.orientation else (-tangent[0], -tangent[1])
            for step in (ahead, 10.0 * ahead):
                found = self.correct(point, step, beyond)
                if found is not None and metric.product(metric.unit(found.tangent), beyond) > KINK_COSINE:
                    return found
        return None

    def trace(self, start: CurvePoint, progress: Callable[[float, int], None] | None = None) -> Iterator[CurvePoint]:
        """Points from `start` on, until the range is left (its last point lies on the limit) or a step fails."""
        low, high = self.span
        previous, point = None, start
        yield point
        for count in range(1, self.options.max_points):
            found = self.next_point(previous, point)
            if found is None:
                return
            limit = high if found.frequency >= high else low if found.frequency <= low else None
            if limit is not None:
                end = self.at_frequency(point, limit)
                yield found if end is None else end
                return
            previous, point = point, found
            if progress is not None:
                progress(point.frequency / (2.0 * np.pi), count)
            yield point


def _tangent(at: BalanceAt, onward: Tangent, metric: Metric) -> tuple[Tangent, int, int]:
    """Unit tangent on the side of `onward`, the sign of det [dR/dx, dR/dw; tangent], and that of det dR/dx.

    z solves B z = e_last with B bordered by `onward`; by Cramer's rule det dR/dx = z_last det B.
    """
    from scipy.linalg import lu_factor, lu_solve

    factor, pivots = lu_factor(_bordered(at.jacobian, at.slope, metric.unit(onward), metric), overwrite_a=True)
    last = np.zeros(factor.shape[0])
    last[-1] = 1.0
    solution = lu_solve((factor, pivots), last)
    swaps = int(np.count_nonzero(pivots != np.arange(pivots.size)))
    sign = int(np.prod(np.sign(factor.diagonal()))) * (-1) ** swaps
    tangent = metric.unit((solution[:-1] * metric.length, float(solution[-1] * metric.frequency)))
    return tangent, sign, sign * int(np.sign(solution[-1]))


def _turns_sharply(point: CurvePoint, found: CurvePoint, metric: Metric) -> bool:
    """Whether the curve turned by more than 60 degrees in a step too long to be that of a kink."""
    cosine = metric.product(metric.unit(point.tangent), metric.unit(found.tangent))
    return cosine < KINK_COSINE and found.arc - point.arc > KINK_STEP


def _bordered(jacobian: Array, slope: Array, border: Tangent, metric: Metric) -> Array:
    """[[dR/dx, dR/dw], [t_x, t_w]] in scaled unknowns; the rows of R divided by the length scale."""
    size = jacobian.shape[0]
    matrix = np.empty((size + 1, size + 1))
    matrix[:-1, :-1] = jacobian
    matrix[:-1, -1] = slope * (metric.frequency / metric.length)
    matrix[-1, :-1] = border[0] / metric.length
    matrix[-1, -1] = border[1] / metric.frequency
    return matrix


def _bordered_solve(jacobian: Array, slope: Array, border: Tangent, metric: Metric, right: Array) -> Tangent:
    """Newton step in the plane normal to `border`."""
    system = _bordered(jacobian, slope, border, metric)
    solution = np.linalg.solve(system, np.append(right / metric.length, 0.0))
    return solution[:-1] * metric.length, float(solution[-1] * metric.frequency)
