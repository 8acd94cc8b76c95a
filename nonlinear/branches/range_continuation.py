"""The main curve over the whole frequency range: from the low end, and where that fails, from the high end."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nonlinear.branches.branch import Branch, with_special_points
from nonlinear.branches.termination import TerminationReason
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.options import SolverOptions

Progress = Callable[[float, int], None]
UP, DOWN = "from the low end up", "from the high end down"
FINER = 4.0  # how much shorter the longest step of a second attempt is
MUCH_FINER = 100.0  # the same of its shortest step


def continue_over_range(continuation: Continuation, static: Array, progress: Progress | None = None) -> list[Branch]:
    """Branch from the low end of the range; if the high end is not reached, from there down, then with finer steps.

    `static` (n_c, 3): static displacement to start from. The first trace is the curve. Where no attempt is complete,
    it is the longest one, and the longest that came from the other end follows it.
    """
    failed: list[tuple[str, Branch]] = []
    for way, upwards, options in _attempts(continuation.options):
        trace = _trace_from_end(replace(continuation, options=options), static, upwards, progress)
        if trace.termination.complete:
            return [_rising(trace, _told(way, trace, failed))]
        failed.append((way, trace))
        if trace.termination.kind == "too many points":
            break
    way, longest = max(failed, key=lambda attempt: len(attempt[1].points))
    others = [attempt for attempt in failed if attempt[1] is not longest]
    far_side = [trace for other, trace in others if (UP in other) != (UP in way) and trace.points]
    pieces = sorted(far_side, key=lambda trace: -len(trace.points))[:1]
    return [
        _rising(piece, piece.termination)
        for piece in (longest._replace(termination=_told(way, longest, others)), *pieces)
    ]


def _attempts(options: SolverOptions) -> list[tuple[str, bool, SolverOptions]]:
    """What is tried one after another: its name, whether it goes up in frequency, and its options."""
    finer = replace(options, max_step=options.max_step / FINER, min_step=options.min_step / MUCH_FINER)
    return [
        (UP, True, options),
        (DOWN, False, options),
        (f"{UP} with finer steps", True, finer),
        (f"{DOWN} with finer steps", False, finer),
    ]


def _told(way: str, kept: Branch, others: list[tuple[str, Branch]]) -> TerminationReason:
    """The outcome of the trace that is kept, with what became of the other ones."""
    if not others:
        return kept.termination
    story = "; ".join(f"{other}: {trace.termination.message}" for other, trace in others)
    return replace(kept.termination, message=f"{kept.termination.message}, {way}; {story}")


def _rising(trace: Branch, termination: TerminationReason) -> Branch:
    """The trace in the order of rising frequency of its ends."""
    points = trace.points
    if not points or points[0].omega <= points[-1].omega:
        return trace._replace(termination=termination)
    return trace.reversed()._replace(termination=termination)


def _trace_from_end(continuation: Continuation, static: Array, upwards: bool, progress: Progress | None) -> Branch:
    options = continuation.options
    end, direction = continuation.span[0 if upwards else 1], 1.0 if upwards else -1.0
    hertz = options.frequency_hz[0 if upwards else 1]
    first = continuation.linear.start(end, direction, options.step) if continuation.linear else None
    if first is None:
        start = periodic_start(continuation.balance, end, static, options, continuation.contact)
        if not start.converged:
            error = f"relative residual {start.residual:.2g}"
            message = f"no start at {hertz:.6g} Hz: no periodic solution found, {error}"
            return Branch([], [], [], TerminationReason("start failed", hertz, message))
        first = continuation.onward(start.solution, end, direction, start.iterations)
    points = list(continuation.trace(first, progress))
    return with_special_points(continuation, points, _outcome(points, options, upwards))


def _outcome(points: list[SolutionPoint], options: SolverOptions, upwards: bool) -> TerminationReason:
    low, high = options.frequency_hz
    last = points[-1].omega / (2.0 * np.pi)
    at_high, at_low = last >= high * (1.0 - 1e-12), len(points) > 1 and last <= low * (1.0 + 1e-12)
    if at_high if upwards else at_low:
        return TerminationReason("complete", last, f"complete: {low:g} to {high:g} Hz in {len(points)} points")
    if len(points) > 1 and (at_low or at_high):
        side, hertz, way = ("low", low, "lower") if upwards else ("high", high, "higher")
        message = f"the curve turned back and left the range at its {side} end, {hertz:g} Hz: start {way}"
        return TerminationReason("turned back", last, message)
    if len(points) >= options.max_points:
        return TerminationReason("too many points", last, f"given up at {last:.6g} Hz after {len(points)} points")
    message = f"no next point found at {last:.6g} Hz with steps down to {options.min_step:g}"
    return TerminationReason("step too small", last, message)
