"""A curve over the whole frequency range: from the low end, and where that fails, from the high end."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from nonlinear.contact import Array
from nonlinear.continuation import Continuation
from nonlinear.curve_point import CurvePoint
from nonlinear.options import SolverOptions
from nonlinear.outcome import Ending, Outcome
from nonlinear.peaks import locate_peak
from nonlinear.quantities import amplitude_slope
from nonlinear.start import periodic_start

Progress = Callable[[float, int], None]


class Trace(NamedTuple):
    """Points from low to high arc, the indices of the located peaks among them, and how the tracing ended."""

    points: list[CurvePoint]
    peak_indices: list[int]
    outcome: Outcome


def trace_range(continuation: Continuation, static: Array, progress: Progress | None = None) -> Trace:
    """Trace from the low end of the range; if the high end is not reached, trace back from there.

    `static` (n_c, 3): static displacement to start from. Of two incomplete traces the one with more points is kept.
    """
    upwards = _trace_from_end(continuation, static, upwards=True, progress=progress)
    if upwards.outcome.complete or upwards.outcome.ending is Ending.TOO_MANY_POINTS:
        return upwards
    downwards = _trace_from_end(continuation, static, upwards=False, progress=progress)
    if downwards.outcome.complete or len(downwards.points) > len(upwards.points):
        return _reversed(downwards, _both(downwards, "from the high end down", upwards, "from the low end up"))
    return upwards._replace(outcome=_both(upwards, "from the low end up", downwards, "from the high end down"))


def _both(kept: Trace, kept_way: str, other: Trace, other_way: str) -> Outcome:
    """The outcome of the trace that is kept, with what became of the other one."""
    message = f"{kept.outcome.message}, {kept_way}; {other_way}: {other.outcome.message}"
    return replace(kept.outcome, message=message)


def _trace_from_end(continuation: Continuation, static: Array, upwards: bool, progress: Progress | None) -> Trace:
    options = continuation.options
    end = continuation.span[0 if upwards else 1]
    hertz = options.frequency[0 if upwards else 1]
    first = continuation.linear.start(end, 1.0 if upwards else -1.0, options.step) if continuation.linear else None
    if first is None:
        start = periodic_start(continuation.balance, end, static, options)
        if not start.converged:
            message = (
                f"no start at {hertz:.6g} Hz: no periodic solution found, relative residual {start.residual:.2g}"
            )
            return Trace([], [], Outcome(Ending.START_FAILED, hertz, message))
        at = continuation.balance.evaluate(start.solution, end)
        forward = np.asarray(np.linalg.solve(at.jacobian, -at.slope), dtype=np.float64), 1.0
        onward = forward if upwards else (-forward[0], -1.0)
        first = continuation.point(start.solution, end, onward, start.iterations, 0.0, options.step)
    points = list(continuation.trace(first, progress))
    outcome = _outcome(points, options, upwards)
    return Trace(*_insert_peaks(continuation, points), outcome)


def _outcome(points: list[CurvePoint], options: SolverOptions, upwards: bool) -> Outcome:
    low, high = options.frequency
    last = points[-1].frequency / (2.0 * np.pi)
    at_high, at_low = last >= high * (1.0 - 1e-12), len(points) > 1 and last <= low * (1.0 + 1e-12)
    if at_high if upwards else at_low:
        return Outcome(Ending.COMPLETE, last, f"complete: {low:g} to {high:g} Hz in {len(points)} points")
    if len(points) > 1 and (at_low or at_high):
        side, hertz, way = ("low", low, "lower") if upwards else ("high", high, "higher")
        message = f"the curve turned back and left the range at its {side} end, {hertz:g} Hz: start {way}"
        return Outcome(Ending.TURNED_BACK, last, message)
    if len(points) >= options.max_points:
        return Outcome(Ending.TOO_MANY_POINTS, last, f"given up at {last:.6g} Hz after {len(points)} points")
    message = f"no next point found at {last:.6g} Hz with steps down to {options.min_step:g}"
    return Outcome(Ending.STEP_TOO_SMALL, last, message)


def _insert_peaks(continuation: Continuation, points: list[CurvePoint]) -> tuple[list[CurvePoint], list[int]]:
    """The points with the located maxima among them, and the indices of these."""
    result, indices = points[:1], []
    slopes = [amplitude_slope(continuation.balance, point, continuation.options.output) for point in points]
    for (before, after), bracket in zip(pairwise(points), pairwise(slopes), strict=True):
        peak = locate_peak(continuation, before, after, bracket)
        if peak is not None:
            if peak is not before and peak is not after:
                result.append(peak)
            indices.append(len(result) - 1 if peak is not after else len(result))
        result.append(after)
    return result, indices


def _reversed(trace: Trace, outcome: Outcome) -> Trace:
    """The same curve the other way round."""
    whole = trace.points[-1].arc
    points = [
        replace(point, arc=whole - point.arc, tangent=(-point.tangent[0], -point.tangent[1]))
        for point in reversed(trace.points)
    ]
    last = len(points) - 1
    return Trace(points, [last - index for index in reversed(trace.peak_indices)], outcome)
