"""Check of one motion: the solutions of a curve at a frequency, the ring integrated in time from one of them, and the
answer as lines of text and as values for JSON.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain
from pipeline.errors import input_error, reason_of
from pipeline.results.worst import with_unit
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.request import Request
from pipeline.stages.scene_to_solver import contact_on_model, damped_modes, excitation, solver_options

if TYPE_CHECKING:
    from nonlinear import FoundSolution, ResponseCurve, Ring, RingMotion, SolverOptions


MOST_PERIODS = 3000


@dataclass(frozen=True)
class CheckedPoint:
    """Which motion to check."""

    curve: int  # number of the curve, from 0
    frequency_hz: float  # excitation frequency, Hz
    branch: int | None = None  # 0: main branch, k: detached branch k; None: all
    solution: int = 1  # number of the solution among those at the frequency, from 1, the highest


@dataclass(frozen=True)
class Check:
    """The answer."""

    point: CheckedPoint  # which motion was checked
    label: str  # swept parameters of the curve
    solutions: list[FoundSolution]  # all solutions at the frequency, the highest first
    motion: RingMotion  # what the ring did
    predicted_rate: float  # growth rate of the disturbance from the Floquet exponents, 1/s

    @property
    def checked(self) -> FoundSolution:
        """The solution that the ring started from."""
        return self.solutions[self.point.solution - 1]


def refuse(request: Request, point: CheckedPoint) -> None:
    """Refuse a point that no result of the scene can have, before anything is computed."""
    members = request.scene.members
    if point.curve >= len(members):
        last = len(members) - 1
        raise input_error("shroud check", "--curve", str(point.curve), f"0 to {last}" if last else "0")
    response = members[point.curve].scene.response
    low, high = response.frequency
    if not low <= point.frequency_hz <= high:
        allowed = f"{low:g} to {high:g} Hz, the range of curve {point.curve}"
        raise input_error("shroud check", "--frequency", f"{point.frequency_hz:g}", allowed)
    if response.method == "static-first":
        allowed = '"coupled": with a frozen static part a ring has no motion in time'
        raise input_error(request.scene.path, "response.method", '"static-first"', allowed)


def check_point(point: CheckedPoint, curve: CurveResult, label: str) -> Check:
    """Find the solutions of a solved curve at the frequency and integrate the ring from one of them."""
    from nonlinear import RingIntegration, RingPatterns, SolutionSearch
    from rom import one_blas_thread

    if curve.file is None or curve.rom is None:
        raise input_error("shroud check", "--curve", str(point.curve), f"a curve that was solved ({curve.reason})")
    solved = read_curve(curve.file)
    branches = [solved, *solved.detached]
    _refuse_branch(point, branches)
    ring, options = _problem(curve, curve.rom)
    with one_blas_thread():
        search = SolutionSearch(ring, options, point.frequency_hz)
        found = [each for each in search.solutions(branches) if point.branch in (None, each.branch)]
        _refuse_solution(point, found)
        start = found[point.solution - 1].solution
        try:
            motion = RingIntegration(ring, options).motion(start, MOST_PERIODS)
        except ArithmeticError as error:
            raise input_error(
                "shroud check", "", reason_of(error), "contacts that can be integrated in time"
            ) from None
        patterns = RingPatterns(ring, options, start.omega, start.displacement)
        return Check(point, label, found, motion, patterns.growth_rate(motion.nodal_diameter))


def _refuse_branch(point: CheckedPoint, branches: list[ResponseCurve]) -> None:
    if point.branch is None:
        return
    last = len(branches) - 1
    if point.branch > last:
        allowed = f"0, the main branch, to {last}" if last else "0, the main branch: there is no detached one"
        raise input_error("shroud check", "--branch", str(point.branch), allowed)
    frequency_hz = branches[point.branch].frequency_hz
    low, high = frequency_hz.min(), frequency_hz.max()
    if not low <= point.frequency_hz <= high:
        allowed = f"{low:.6g} to {high:.6g} Hz, the range of branch {point.branch}"
        raise input_error("shroud check", "--frequency", f"{point.frequency_hz:g}", allowed)


def _refuse_solution(point: CheckedPoint, found: list[FoundSolution]) -> None:
    if point.solution > len(found):
        allowed = f"1 to {len(found)}" if found else "a frequency with a solution: Newton's method found none there"
        raise input_error("shroud check", "--solution", str(point.solution), allowed)


def _problem(curve: CurveResult, rom: Path) -> tuple[Ring, SolverOptions]:
    """The ring and the options that a curve was solved with."""
    from nonlinear import Ring
    from rom import read_reduced_model

    scene, model = curve.member.scene, read_reduced_model(rom, with_basis=False)
    options = solver_options(scene)
    modal = damped_modes(model, scene.response, scene.load)
    return Ring(modal, contact_on_model(scene, model), excitation(scene), options.output), options


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
    height = f"{with_unit(motion.amplitude_m)} ({ratio:.3g} times the {with_unit(stored)} of the solution)"
    text = f"the ring ends in {kind}: {height}"
    if motion.lowest_m < 0.99 * motion.amplitude_m:
        text += f"; every period of every blade reaches at least {with_unit(motion.lowest_m)}"
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


def printed(check: Check) -> dict[str, Any]:
    """The answer as values for JSON."""
    motion = check.motion
    values: dict[str, Any] = plain(
        {
            "curve": check.point.curve,
            "frequency_hz": check.point.frequency_hz,
            "solutions": [
                {
                    "branch": each.branch,
                    "amplitude_m": each.amplitude_m,
                    "stable": each.solution.growth_rate <= 0.0,
                    "growth_rate": each.solution.growth_rate,
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
            "growth_rate": motion.growth_rate,
            "predicted_growth_rate": check.predicted_rate,
            "nodal_diameter": motion.nodal_diameter,
            "ring_blades": motion.n_blades,
            "periods": motion.periods,
        }
    )
    return values


def _described(found: FoundSolution) -> str:
    branch = f"detached branch {found.branch}" if found.branch else "main branch"
    rate, k = found.solution.growth_rate, found.solution.nodal_diameter
    stable = "stable" if rate <= 0.0 else "unstable"
    return f"{branch}, {with_unit(found.amplitude_m)}, {stable}: growth rate {rate:.4g} 1/s, nodal diameter {k}"
