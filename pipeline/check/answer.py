"""The answer of a check as lines of text and as values for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from pipeline.check.check_point import Check
from pipeline.results.outputs import number_or_null
from pipeline.results.worst import with_unit

if TYPE_CHECKING:
    from nonlinear import FoundSolution

SAME_AMPLITUDE = 0.05  # relative difference of a motion in time and a solution that count as one


def answer_lines(check: Check) -> Iterator[str]:
    """What was found, a line for each solution and four for the ring."""
    point, motion = check.point, check.motion
    named = f" ({check.label})" if check.label else ""
    count = len(check.solutions)
    yield f"curve {point.curve}{named} at {point.frequency_hz:.6g} Hz: {count} solution{'s' if count > 1 else ''}"
    for number, each in enumerate(check.solutions, start=1):
        yield f"  {number}  {_described(each)}"
    ring = f"ring of {motion.n_blades} blade{'s' if motion.n_blades > 1 else ''}"
    pattern = f"disturbed in nodal diameter {motion.nodal_diameter}"
    yield f"solution {point.solution}, {ring}, {pattern}, {motion.periods} periods:"
    measured = f"{motion.growth_rate:.4g} 1/s" if math.isfinite(motion.growth_rate) else "not measurable"
    yield f"growth rate of the disturbance: {measured} in time, {check.predicted_rate:.4g} 1/s predicted"
    yield verdict(check)


def verdict(check: Check) -> str:
    """Stays, or where the ring goes and how high."""
    motion, stored = check.motion, check.checked.amplitude_m
    if motion.stays:
        return f"the ring keeps this motion: {with_unit(motion.amplitude_m)}, solution {with_unit(stored)}"
    kind = "a periodic motion" if motion.periodic else "a quasi-periodic motion"
    if motion.repeats_after > 1:
        kind = f"a motion that repeats after {motion.repeats_after} periods"
    if not motion.settled:
        kind = "a motion that has not settled"
    ratio = motion.amplitude_m / stored if stored > 0.0 else math.inf
    known = matching_solution(check)
    height = f"{with_unit(motion.amplitude_m)}, {ratio:.3g} times the {with_unit(stored)} of the solution"
    text = f"the ring ends in {kind} of {height}"
    if motion.lowest_m < 0.99 * motion.amplitude_m:
        text += f"; single periods and blades reach {with_unit(motion.lowest_m)} or more"
    return text if known is None else f"{text}; this is solution {known} above"


def matching_solution(check: Check) -> int | None:
    """Number of the solution that the ring has reached; None where it is none of them."""
    motion = check.motion
    if motion.stays or not (motion.periodic and motion.settled):
        return None
    others = [n for n in range(1, len(check.solutions) + 1) if n != check.point.solution]
    away = {n: abs(check.solutions[n - 1].amplitude_m / motion.amplitude_m - 1.0) for n in others}
    best = min(away, key=away.__getitem__, default=None)
    return best if best is not None and away[best] <= SAME_AMPLITUDE else None


def plain(check: Check) -> dict[str, Any]:
    """The answer as values for JSON."""
    motion = check.motion
    return {
        "curve": check.point.curve,
        "frequency_hz": check.point.frequency_hz,
        "solutions": [
            {
                "branch": each.branch,
                "amplitude_m": each.amplitude_m,
                "stable": each.solution.growth_rate <= 0.0,
                "growth_rate": number_or_null(each.solution.growth_rate),
                "nodal_diameter": each.solution.nodal_diameter,
            }
            for each in check.solutions
        ],
        "solution": check.point.solution,
        "stays": motion.stays,
        "amplitude_m": motion.amplitude_m,
        "lowest_m": motion.lowest_m,
        "periodic": motion.periodic,
        "repeats_after": motion.repeats_after,
        "settled": motion.settled,
        "reaches_solution": matching_solution(check),
        "growth_rate": number_or_null(motion.growth_rate),
        "predicted_growth_rate": number_or_null(check.predicted_rate),
        "nodal_diameter": motion.nodal_diameter,
        "ring_blades": motion.n_blades,
        "periods": motion.periods,
    }


def _described(found: FoundSolution) -> str:
    branch = f"detached branch {found.branch}" if found.branch else "main branch"
    rate, k = found.solution.growth_rate, found.solution.nodal_diameter
    stable = "stable" if rate <= 0.0 else "unstable"
    return f"{branch}, {with_unit(found.amplitude_m)}, {stable}: growth rate {rate:.4g} 1/s, nodal diameter {k}"
