"""Peaks of a response curve: where the slope of the amplitude along the arc changes sign, solved for."""

from dataclasses import dataclass

from nonlinear.continuation import Continuation
from nonlinear.curve_point import CurvePoint

MAX_BISECTIONS = 60


@dataclass(frozen=True)
class Peak:
    """A local maximum of the amplitude along the curve; `index` is its place among the curve's points.

    `located`: solved for to the peak tolerance; False where the largest amplitude lies at an end of the curve.
    """

    frequency_hz: float
    amplitude_m: float
    index: int
    located: bool = True


def locate_peak(continuation: Continuation, before: CurvePoint, after: CurvePoint) -> CurvePoint | None:
    """The maximum between two neighbouring points; None where the amplitude does not turn from growing to falling.

    The arc length beyond `before` is narrowed by regula falsi (Illinois) on the slope of the amplitude, with a
    corrector solve at each trial, until the bracket is shorter than the peak tolerance asks for.
    """
    options = continuation.options
    left, right = 0.0, after.arc - before.arc
    rising, falling = before.amplitude_slope, after.amplitude_slope
    if not rising > 0.0 > falling:
        return None
    if before.balance is not after.balance:
        refitted = continuation.of(after.balance).refit(before)
        if refitted is None:
            return None
        before = continuation.recorded(refitted)
    continuation = continuation.of(before.balance)
    best, side = (before if rising < -falling else after), 0
    frequencies = (before.frequency, after.frequency)
    for _ in range(MAX_BISECTIONS):
        trial = (left * falling - right * rising) / (falling - rising)
        if not left < trial < right:
            trial = 0.5 * (left + right)
        point = continuation.correct(before, trial, sharp=True)
        if point is None:
            return best
        point = continuation.recorded(point)
        slope = point.amplitude_slope
        moved, best = abs(point.frequency - best.frequency), point
        if slope > 0.0:
            left, rising = trial, slope
            falling, side = (falling / 2.0 if side == 1 else falling), 1
            frequencies = (point.frequency, frequencies[1])
        else:
            right, falling = trial, slope
            rising, side = (rising / 2.0 if side == -1 else rising), -1
            frequencies = (frequencies[0], point.frequency)
        allowed = options.peak_tolerance * point.frequency
        if abs(frequencies[1] - frequencies[0]) <= allowed and moved <= allowed and right - left < 1e-3:
            return best
        if slope == 0.0 or right - left < 1e-13:
            return best
    return best
