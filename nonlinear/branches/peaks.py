"""Peaks of a response curve, where dA/ds changes its sign from positive to negative."""

from dataclasses import dataclass

from nonlinear.branches.special_point_location import locate_zero
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint

END_TOLERANCE = 1e-9  # relative distance of a frequency from a limit of the range that counts as reached


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
    at_end : bool
        Whether it is the amplitude at an end of the frequency range, from where the response rises further: no peak.

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
    at_end: bool = False


def at_range_end(frequency_hz: float, limits_hz: tuple[float, float]) -> bool:
    """Whether a frequency is a limit of the frequency range: the largest amplitude of a curve there is no peak.

    Parameters
    ----------
    frequency_hz : float
        Frequency, Hz.
    limits_hz : (float, float)
        The frequency range, Hz.

    Examples
    --------
    >>> from nonlinear import at_range_end
    >>> at_range_end(600.0, (150.0, 600.0)), at_range_end(599.9, (150.0, 600.0))
    (True, False)
    """
    return any(abs(frequency_hz - limit) <= END_TOLERANCE * limit for limit in limits_hz)


def locate_peak(continuation: Continuation, before: SolutionPoint, after: SolutionPoint) -> SolutionPoint | None:
    """The maximum of the amplitude between two neighbouring points; None if there is none."""
    if not before.dA_ds > 0.0 > after.dA_ds:
        return None
    output = continuation.options.output
    return locate_zero(
        continuation, before, after, lambda point: point.dA_ds, lambda point: output_amplitude(point, output)
    )
