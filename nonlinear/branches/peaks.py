"""Peaks of a response curve, where dA/ds changes its sign from positive to negative."""

from dataclasses import dataclass

from nonlinear.branches.special_point_location import locate_zero
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint


@dataclass(frozen=True)
class Peak:
    """A local maximum of the amplitude along a response curve.

    Attributes
    ----------
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Amplitude of the output, m.
    index : int
        Index among the points of the curve.
    located : bool
        Whether the maximum was solved for, to the peak tolerance. False where the largest amplitude lies at an end of
        the curve.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> peak = curve.peak
    >>> bool(peak.located), bool(peak.amplitude_m == curve.amplitude_m[peak.index])
    (True, True)
    """

    frequency_hz: float
    amplitude_m: float
    index: int
    located: bool = True


def locate_peak(continuation: Continuation, before: SolutionPoint, after: SolutionPoint) -> SolutionPoint | None:
    """The maximum of the amplitude between two neighbouring points; None if there is none."""
    if not before.dA_ds > 0.0 > after.dA_ds:
        return None
    output = continuation.options.output
    return locate_zero(
        continuation, before, after, lambda point: point.dA_ds, lambda point: output_amplitude(point, output)
    )
