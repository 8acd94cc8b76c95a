"""Errors of the highest amplitude of a branch: by neglected harmonics, and by time sampling.

By sampling (AFT): the peak is solved again with the event-driven contact element. The sampled force has a kink
wherever a contact event passes a sample, so that the error changes its sign and size from one number of samples to
the next: no extrapolation from two numbers tells it. On one peak the event-driven element costs little.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice, pairwise

from nonlinear.branches.branch import Branch
from nonlinear.branches.special_points import locate_peak
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.parameters import ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_selection.truncation_error import TruncationErrorEstimator, TruncationEstimate
from nonlinear.response_curve import Peak, ResponseCurve

FIRST_STEP = 0.05  # arc length of the first step from the stored peak
MAX_STEPS = 60  # in each direction
PAST_PEAK = 0.97  # part of the highest amplitude below which the search leaves a peak
PROBE_STEPS = (0, 1, 2, 4, 8, 16)  # points beside the peak at which the event-driven curve is sought
MAX_ITERATIONS = 20
SAME_FREQUENCY = 1e-9  # relative difference of two frequencies that count as one


@dataclass(frozen=True)
class SamplingError:
    """Estimated errors of a peak by time sampling; NaN: no peak, inf: the peak is lost without samples."""

    # `amplitude`, `frequency`: relative errors of the amplitude and of the frequency
    amplitude: float = float("nan")
    frequency: float = float("nan")


def sampling_error(
    continuation: Continuation, contact: ContactParameters, points: list[SolutionPoint], peak: Peak | None
) -> SamplingError:
    """Estimate the errors of a peak by time sampling: its change with the event-driven element, harmonics unchanged.

    A point with the event-driven element is solved for in the plane normal to the curve at the peak; from there the
    curve is followed in both directions until it is well below its highest point, and that is located. At an end of
    the range, where the frequency is given, only the amplitude changes.
    """
    if peak is None:
        return SamplingError()
    if continuation.options.integration == "exact":
        return SamplingError(0.0, 0.0)
    if not peak.located and _at_limit(continuation, points[peak.index]):
        amplitude = _amplitude_at(_event_driven(continuation, contact, points[peak.index]), points[peak.index])
        return SamplingError(_relative(peak.amplitude_m, amplitude), 0.0)
    found = _highest_nearby(continuation, contact, points, peak.index)
    if found is None:
        return SamplingError(float("inf"), float("inf"))
    amplitude = output_amplitude(found, continuation.options.output)
    return SamplingError(_relative(peak.amplitude_m, amplitude), _relative(points[peak.index].omega, found.omega))


def _at_limit(continuation: Continuation, point: SolutionPoint) -> bool:
    """Whether a point lies at an end of the frequency range."""
    return any(_relative(point.omega, limit) < SAME_FREQUENCY for limit in continuation.options.omega_range)


def _relative(value: float, reference: float) -> float:
    """Difference of two positive numbers relative to the second one; 0 where both are 0."""
    return 0.0 if value == reference else abs(value - reference) / max(reference, 1e-300)


def _event_driven(continuation: Continuation, contact: ContactParameters, point: SolutionPoint) -> Continuation:
    """The continuation with the event-driven element and the harmonics of a point, without exponents."""
    options = replace(continuation.options, integration="exact")
    element = contact_element(contact, point.balance.n_harmonics, options)
    balance = replace(point.balance, element=element)
    return replace(continuation, balance=balance, options=options, adapt=None, stability=None)


def _amplitude_at(event_driven: Continuation, point: SolutionPoint) -> float:
    """Amplitude at the frequency of a point; inf if no solution is found."""
    options, balance = event_driven.options, event_driven.balance
    solved = solve_at(balance, point.omega, point.unknown, options, MAX_ITERATIONS)
    if not solved.converged:
        return float("inf")
    contact = balance.evaluate(solved.solution, point.omega).contact
    found = replace(point, balance=balance, unknown=solved.solution, contact=contact)
    return output_amplitude(found, options.output)


def _highest_nearby(
    continuation: Continuation, contact: ContactParameters, points: list[SolutionPoint], index: int
) -> SolutionPoint | None:
    """The highest point of the event-driven curve near the point of this index; None if the curve is not found."""
    for steps in PROBE_STEPS:
        for place in dict.fromkeys((index - steps, index + steps)):
            if not 0 <= place < len(points):
                continue
            event_driven = _event_driven(continuation, contact, points[place])
            start = event_driven.solver.refit(points[place])
            if start is not None:
                found = _climb(event_driven, replace(start, step=FIRST_STEP))
                return max(found, key=lambda point: output_amplitude(point, continuation.options.output))
    return None


def _climb(event_driven: Continuation, start: SolutionPoint) -> Iterator[SolutionPoint]:
    """Points on both sides of `start` and the peaks between them, as far as the curve is near its highest point."""
    for direction in (start, start.reversed()):
        branch = islice(event_driven.continue_branch(direction), MAX_STEPS)
        yield from _with_peaks(event_driven, _up_to_descent(branch, event_driven.options.output))


def _up_to_descent(branch: Iterable[SolutionPoint], output: str) -> Iterator[SolutionPoint]:
    """The first points of a branch, to the first one well below the highest of them."""
    highest = 0.0
    for point in branch:
        yield point
        amplitude = output_amplitude(point, output)
        highest = max(highest, amplitude)
        if amplitude < PAST_PEAK * highest:
            return


def _with_peaks(event_driven: Continuation, points: Iterable[SolutionPoint]) -> Iterator[SolutionPoint]:
    """The points, and the peaks located between them."""
    listed = list(points)
    yield from listed
    for before, after in pairwise(listed):
        peak = locate_peak(event_driven, before, after)
        if peak is not None:
            yield peak


def with_peak_errors(
    curve: ResponseCurve,
    branch: Branch,
    contact: ContactParameters,
    estimator: TruncationErrorEstimator,
    truncation: TruncationEstimate | None = None,
) -> ResponseCurve:
    """A curve with the errors of its highest amplitude."""
    if truncation is None:
        wanted = estimator.continuation.options.truncation or estimator.continuation.options.harmonics == "auto"
        truncation = TruncationEstimate()
        if wanted:
            truncation = estimator.of_branch(branch.points, branch.peak_indices, main=False)
    sampling = sampling_error(estimator.continuation, contact, branch.points, curve.peak)
    return replace(
        curve,
        truncation_error=truncation.error,
        truncation_branch=truncation.branch,
        truncation_frequency_hz=truncation.omega / (2.0 * math.pi),
        motion_truncation_error=truncation.motion_error,
        sampling_error=sampling.amplitude,
        sampling_frequency_error=sampling.frequency,
    )
