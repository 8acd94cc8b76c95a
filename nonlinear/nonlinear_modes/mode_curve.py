"""A nonlinear mode over its amplitude: pseudo-arc-length continuation of the extended periodic motion.

The arc length is measured in ln a, ln omega, zeta over `DAMPING_UNIT`, the coordinate of the carrier over a, and the
vibration over its own size: relative changes, so that one step length serves from the smallest to the largest
amplitude.

In an internal resonance 1:h a higher harmonic h resonates with another mode. The curve makes a tongue there: it turns
back in amplitude, and may pass over to a motion in harmonic h alone, which is another mode at h times the frequency.
The mode is then sought again at a larger amplitude, and followed from there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.continuation.step_control import IterationControl
from nonlinear.continuation.zero_bracket import closed_bracket
from nonlinear.nonlinear_modes.extended_motion import EXTRA, ExtendedMotion, LinearisedMotion, MotionState

TOLERANCE = 1e-11  # of the last Newton step, relative
ITERATIONS = 12
STEPS = IterationControl(first=0.05, largest=0.15, smallest=1e-5, few=4, many=8)
MOST_POINTS = 400
DAMPING_UNIT = 0.15  # change of the damping ratio that counts as much as one of the amplitude by a factor e
KINK_STEP = 2e-3  # arc length of a step over which a turn below 90 degrees counts as a kink of the contact law
SMALLEST_COSINE = 0.8  # of the angle between the tangents of two successive points
RATE_STEP = 1e-4  # arc length of a derivative along the curve
BETWEEN = 1e-9  # of a step: tolerance of a motion located between two
_LARGEST_MOVE = 0.5  # of a Newton step, in arc length


@dataclass(frozen=True)
class MotionPoint:
    """A solution on the curve: the state, its linearised equations and the unit tangent, scaled.

    The equations are linearised where the last step of Newton's method, within the tolerance, began.
    """

    state: MotionState
    linearised: LinearisedMotion
    tangent: Array
    iterations: int


@dataclass(frozen=True)
class ModeContinuation:
    """Follows an extended periodic motion over its amplitude."""

    motion: ExtendedMotion  # the equations
    shape: tuple[int, ...]  # shape of the displacement, (2H+1, n_c, 3)
    steps: IterationControl = STEPS  # arc lengths of steps
    tolerance: float = TOLERANCE  # relative size of the last step of Newton's method
    smallest_cosine: float = SMALLEST_COSINE  # A step over which the tangent turns further is halved

    def solve_at_level(self, guess: MotionState) -> MotionPoint | None:
        """The motion of the amplitude of `guess`; None where Newton's method does not converge."""
        return self._solve_at(guess, -1)

    def solve_at_damping(self, guess: MotionState) -> MotionPoint | None:
        """The motion of the damping ratio of `guess`; None where Newton's method does not converge."""
        return self._solve_at(guess, -2)

    def _solve_at(self, guess: MotionState, unknown: int) -> MotionPoint | None:
        """The motion with one of the unknowns of `guess`."""
        along = np.zeros(guess.displacement.size + EXTRA)
        along[unknown] = 1.0
        return self._correct(guess.packed(), along)

    def points(self, start: MotionPoint) -> Iterator[MotionPoint]:
        """Points after `start`, at first towards larger amplitudes; it ends where no next point is found."""
        for step in self.steps.follow(start, self._advance, MOST_POINTS):
            yield step.state

    def _advance(self, point: MotionPoint, step: float) -> tuple[MotionPoint, int] | None:
        """The point a step along the tangent; None where the curve would turn too far, but for a kink."""
        values = point.state.packed()
        found = self._correct(values + step * self._scale(values) * point.tangent, point.tangent)
        least = self.smallest_cosine if step > KINK_STEP else 0.0
        if found is None or found.tangent @ point.tangent < least:
            return None
        return found, found.iterations

    def between(
        self, first: MotionState, last: MotionState, excess: Callable[[MotionPoint], float]
    ) -> MotionPoint | None:
        """The motion between two successive ones at which `excess`, of different sign at the two, vanishes.

        None where Newton's method does not converge on the way.
        """
        start, chord = first.packed(), last.packed() - first.packed()
        direction = chord / self._scale(start)
        direction /= np.linalg.norm(direction)
        found: dict[float, MotionPoint] = {}

        def at(part: float) -> float:
            point = self._correct(start + part * chord, direction)
            if point is None:
                raise ArithmeticError
            found[part] = point
            return excess(point)

        try:
            sides = (0.0, at(0.0)), (1.0, at(1.0))
            if sides[0][1] * sides[1][1] > 0.0:
                return None
            best = min(closed_bracket(at, *sides, BETWEEN), key=lambda side: abs(side[1]))
            return found[best[0]]
        except ArithmeticError:
            return None

    def rate(self, point: MotionPoint, quantity: Callable[[MotionState, ComplexArray], float]) -> float:
        """Derivative of a quantity of state and modal coordinates by ln a along the curve."""
        values = point.state.packed()
        step = RATE_STEP * self._scale(values) * point.tangent
        found = []
        for state in (MotionState.unpacked(values + sign * step, self.shape) for sign in (1.0, -1.0)):
            found.append(quantity(state, self.motion.evaluate(state).coordinates))
        along = 2.0 * RATE_STEP * float(point.tangent[-1])
        return (found[0] - found[1]) / (along if along != 0.0 else 1e-300)

    def _scale(self, values: Array) -> Array:
        """Unit of each unknown in the arc length, (n + 4,)."""
        dynamic = values[self.shape[1] * 3 : -EXTRA]
        a = np.exp(values[-1])
        scale = np.full(values.size, np.linalg.norm(dynamic) or a)
        scale[-EXTRA:] = a, values[-3], DAMPING_UNIT, 1.0
        return scale

    def _correct(self, values: Array, tangent: Array) -> MotionPoint | None:
        """Newton's method in the plane through `values` normal to the (scaled) tangent."""
        scale, values = self._scale(values), values.copy()
        for iteration in range(ITERATIONS):
            linearised = self.motion.evaluate(MotionState.unpacked(values, self.shape))
            matrix = self._scaled(linearised, scale, tangent)
            right = np.append(-linearised.residual / self._rows(scale), 0.0)
            try:
                move = np.linalg.solve(matrix, right)
            except np.linalg.LinAlgError:
                return None
            static, size = self.shape[1] * 3, float(np.linalg.norm(move))
            shift = max(1.0, float(np.linalg.norm(values[:static])) / scale[0])  # the static part over the vibration
            if not np.linalg.norm(np.append(move[:static] / shift, move[static:])) < _LARGEST_MOVE:
                return None
            values += scale * move
            if size < self.tolerance * shift:
                last = np.zeros(values.size)
                last[-1] = 1.0
                along = np.linalg.solve(matrix, last) * scale / self._scale(values)
                state = MotionState.unpacked(values, self.shape)
                return MotionPoint(state, linearised, along / np.linalg.norm(along), iteration + 1)
        return None

    @staticmethod
    def _rows(scale: Array) -> Array:
        """Unit of each equation: displacements, the carrier's, the amplitude's."""
        rows = np.ones(scale.size - 1)
        rows[: scale.size - EXTRA] = scale[0]
        rows[-3:-1] = scale[-EXTRA]
        return rows

    def _scaled(self, linearised: LinearisedMotion, scale: Array, tangent: Array) -> Array:
        """The Jacobian in scaled unknowns and equations, bordered by the tangent."""
        return np.vstack([linearised.jacobian * scale / self._rows(scale)[:, None], tangent])


LOWEST = 0.9  # of the amplitude of the start: a curve that comes back to it is ended
OTHER_MODE = 3.0  # share of a higher harmonic, relative to harmonic 1, at which the motion is another mode
OWN_MODE = 0.12  # share of all higher harmonics below which a motion belongs to the mode
JUMPS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.1)  # in ln of the amplitude, across an internal resonance
MOST_PIECES = 4
Size = Callable[[MotionPoint], float]  # amplitude of a motion
REACHED = "the largest amplitude was reached"


@dataclass(frozen=True)
class ModePoint:
    """What is kept of a solution: all but the derivatives."""

    state: MotionState  # the unknowns
    coordinates: ComplexArray  # (H+1, m), modal coordinates
    nodes: NDArray[np.int64]  # (n_c,), worst state of each contact node

    @classmethod
    def of(cls, point: MotionPoint) -> ModePoint:
        """Of a solution with its derivatives."""
        return cls(point.state, point.linearised.coordinates, np.asarray(point.linearised.contact.state))


@dataclass(frozen=True)
class ModePath:
    """The points of a mode in the order of the arc length, in one piece or more."""

    # between two pieces there is an internal resonance that was passed over
    pieces: tuple[tuple[ModePoint, ...], ...]
    complete: bool  # whether the largest amplitude was reached
    message: str  # why the path ends, and where it was interrupted


def harmonic_shares(coordinates: ComplexArray) -> Array:
    """Sizes of the harmonics 2 .. H relative to that of harmonic 1, (..., H-1).

    `coordinates` (..., H+1, m): mass-normalised modal coordinates.
    """
    size = np.linalg.norm(coordinates, axis=-1)
    return np.asarray(size[..., 2:] / np.maximum(size[..., 1:2], 1e-300))


def follow_mode(
    continuation: ModeContinuation, start: MotionPoint, size: Size, largest: float, linear: tuple[float, ...] = ()
) -> ModePath:
    """Follow a mode up to the largest amplitude."""
    before, last = _linear_points(continuation, start, linear)
    pieces: list[tuple[ModePoint, ...]] = []
    interruptions: list[str] = []
    point: MotionPoint | None = last
    smallest, reason = LOWEST * size(start), ""
    while point is not None and len(pieces) < MOST_PIECES:
        piece, reason = _piece(continuation, point, size, (smallest, largest))
        pieces.append(piece if pieces else (*before, *piece))
        if reason == REACHED:
            break
        interruptions.append(reason)
        point = _beyond(continuation, [each for piece in pieces for each in piece])
    complete = reason == REACHED
    message = "; ".join([*interruptions, "followed on above it", REACHED] if complete and interruptions else [reason])
    return ModePath(tuple(pieces), complete, message)


def _linear_points(
    continuation: ModeContinuation, start: MotionPoint, levels: tuple[float, ...]
) -> tuple[list[ModePoint], MotionPoint]:
    """Points of a linear mode, the last of them apart: there the continuation goes on."""
    points, last = [], start
    for level in levels:
        found = continuation.solve_at_level(_scaled(last.state, level))
        if found is None:
            break
        points.append(ModePoint.of(last))
        last = found
    return points, last


def _piece(
    continuation: ModeContinuation, start: MotionPoint, size: Size, limits: tuple[float, float]
) -> tuple[tuple[ModePoint, ...], str]:
    """Points from one on, and why they end; those of a curve that goes back the way it came are left out."""
    points = [ModePoint.of(start)]
    if size(start) > limits[1]:
        return tuple(points), REACHED
    for point in continuation.points(start):
        points.append(ModePoint.of(point))
        amplitude, shares = size(point), harmonic_shares(point.linearised.coordinates)
        if amplitude > limits[1]:
            return tuple(points), REACHED
        if np.max(shares, initial=0.0) > OTHER_MODE:
            return tuple(points), _where(points[-1])
        if amplitude < limits[0]:
            top = int(np.argmax([each.state.level for each in points]))
            return tuple(points[: top + 1]), _where(points[top])
    many = len(points) > MOST_POINTS
    why = f"{MOST_POINTS} points were computed" if many else "no next motion was found"
    return tuple(points), f"{why}, {_where(points[-1])}"


def _where(point: ModePoint) -> str:
    """Frequency of a motion at which a piece ends, and its largest higher harmonic."""
    frequency = point.state.omega / (2.0 * np.pi)
    shares = harmonic_shares(point.coordinates)
    if np.max(shares, initial=0.0) < OWN_MODE:
        return f"at {frequency:.6g} Hz"
    h = int(np.argmax(shares)) + 2
    return f"internal resonance 1:{h} at {frequency:.6g} Hz (harmonic {h} at {h * frequency:.6g} Hz)"


def _beyond(continuation: ModeContinuation, points: list[ModePoint]) -> MotionPoint | None:
    """The mode at an amplitude above all `points`, from the highest of them that belongs to it; None if not found."""
    own = [each for each in points if np.max(harmonic_shares(each.coordinates), initial=0.0) < OWN_MODE]
    if not own:
        return None
    highest, base = max(each.state.level for each in points), max(own, key=lambda each: each.state.level)
    for jump in JUMPS:
        for harmonics in (len(base.coordinates) - 1, 1):
            found = continuation.solve_at_level(_scaled(base.state, highest + jump, harmonics))
            if found is not None and np.max(harmonic_shares(found.linearised.coordinates), initial=0.0) < OWN_MODE:
                return found
    return None


def _scaled(state: MotionState, level: float, harmonics: int | None = None) -> MotionState:
    """A motion with its vibration scaled to another level, of all harmonics or up to one; the mean stays."""
    factor = float(np.exp(level - state.level))
    displacement = state.displacement.copy()
    displacement[1:] *= factor
    if harmonics is not None:
        displacement[2 * harmonics + 1 :] = 0.0
    return replace(state, displacement=displacement, carrier=state.carrier * factor, level=level)
