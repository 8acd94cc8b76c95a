"""Peaks of a response curve: where the slope of the amplitude along the arc changes sign, solved for."""

from dataclasses import dataclass

from nonlinear.branches.special_point_location import locate_zero
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint


@dataclass(frozen=True)
class Peak:
    """A local maximum of the amplitude along the curve: `amplitude_m` at `frequency_hz`.

    `index`: its place among the curve's points.

    `located`: solved for to the peak tolerance; False where the largest amplitude lies at an end of the curve.
    """

    frequency_hz: float
    amplitude_m: float
    index: int
    located: bool = True


def locate_peak(continuation: Continuation, before: SolutionPoint, after: SolutionPoint) -> SolutionPoint | None:
    """The maximum between two neighbouring points; None where the amplitude does not turn from growing to falling."""
    if not before.amplitude_slope > 0.0 > after.amplitude_slope:
        return None
    return locate_zero(continuation, before, after, lambda point: point.amplitude_slope)
