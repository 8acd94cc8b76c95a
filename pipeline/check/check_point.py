"""Check of one motion, and the answer as lines of text and as values for JSON.

At a frequency the ring is integrated in time from one of the solutions of a curve. Of the worst motions that a run
prints, solutions of a branch are integrated as well; what left something open (`>=`) has a longer search beside it.
What was found with the ring of blades itself, and left nothing open, has been seen.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.codec import plain
from pipeline.errors import input_error, reason_of
from pipeline.results.worst import motion_said, with_unit
from pipeline.stages.curve.curve_file import read_curve
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.request import Request
from pipeline.stages.scene_to_solver import nonlinear_problem

if TYPE_CHECKING:
    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.options import Excitation, SolverOptions
    from nonlinear.response_curve import ResponseCurve, WorstMotion
    from nonlinear.time_integration.ring import Ring
    from nonlinear.time_integration.ring_motion import RingMotion
    from nonlinear.worst_motion.solution_search import FoundSolution
    from pipeline.scene.schema import Scene
    from rom.cyclic.sector_modes import RingModes


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
    rate_error: float  # its estimated error by neglected harmonics, 1/s; NaN: not known

    @property
    def checked(self) -> FoundSolution:
        """The solution that the ring started from."""
        return self.solutions[self.point.solution - 1]


def refuse(request: Request, point: CheckedPoint) -> None:
    """Refuse a point that no result of the scene can have, before anything is computed."""
    refuse_curve(request, point.curve)
    response = request.scene.members[point.curve].scene.response
    low, high = response.frequency
    if not low <= point.frequency_hz <= high:
        allowed = f"{low:g} to {high:g} Hz, the range of curve {point.curve}"
        raise input_error("shroud check", "--frequency", f"{point.frequency_hz:g}", allowed)


def refuse_curve(request: Request, curve: int) -> None:
    """Refuse a curve that the scene does not have, or that has no motion in time."""
    members = request.scene.members
    if curve >= len(members):
        last = len(members) - 1
        raise input_error("shroud check", "--curve", str(curve), f"0 to {last}" if last else "0")
    if members[curve].scene.response.method == "static-first":
        allowed = '"coupled": with a frozen static part a ring has no motion in time'
        raise input_error(request.scene.path, "response.method", '"static-first"', allowed)


def check_point(point: CheckedPoint, curve: CurveResult, label: str) -> Check:
    """Find the solutions of a solved curve at the frequency and integrate the ring from one of them."""
    from nonlinear.worst_motion.solution_search import SolutionSearch
    from rom.linear_algebra.threads import one_blas_thread

    if curve.file is None or curve.rom is None:
        raise input_error("shroud check", "--curve", str(point.curve), f"a curve that was solved ({curve.reason})")
    solved = read_curve(curve.file)
    branches = [solved, *solved.detached]
    _refuse_branch(point, branches)
    ring, options = _ring(_problem(curve.member.scene, curve.rom))
    with one_blas_thread():
        every = SolutionSearch(ring, options, point.frequency_hz).solutions(branches)
        found = [each for each in every if point.branch in (None, each.branch)]
        _refuse_solution(point, found)
        try:
            return _integrated(point, label, found, ring, options)
        except ArithmeticError as error:
            raise input_error(
                "shroud check", "", reason_of(error), "contacts that can be integrated in time"
            ) from None


def _integrated(
    point: CheckedPoint, label: str, found: list[FoundSolution], ring: Ring, options: SolverOptions
) -> Check:
    """The ring integrated in time from one of the solutions found."""
    from nonlinear.worst_motion.ring_integration import RingIntegration, RingPatterns

    start = found[point.solution - 1].solution
    motion = RingIntegration(ring, options).motion(start, MOST_PERIODS)
    patterns = RingPatterns(ring, options, start.omega, start.displacement)
    k = motion.nodal_diameter
    return Check(point, label, found, motion, patterns.growth_rate(k), patterns.rate_error(k))


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


def _problem(scene: Scene, rom: Path) -> tuple[RingModes, ContactParameters, Excitation, SolverOptions]:
    """What a curve was solved with."""
    from rom.files.reduced_model_file import read_reduced_model

    return nonlinear_problem(scene, read_reduced_model(rom, with_basis=False))


def _ring(problem: tuple[RingModes, ContactParameters, Excitation, SolverOptions]) -> tuple[Ring, SolverOptions]:
    """The ring of a curve, and its options."""
    from nonlinear.time_integration.ring import Ring

    modal, contact, excited, options = problem
    return Ring(modal, contact, excited, options.output), options


SAME_AMPLITUDE = 0.05  # relative difference of a motion in time and a solution that count as one


def answer_lines(check: Check) -> Iterator[str]:
    """What was found, a line for each solution and some for the ring."""
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
    error = f" (harmonics: +- {check.rate_error:.2g})" if math.isfinite(check.rate_error) else ""
    yield f"growth rate of the disturbance: {measured} in time, {check.predicted_rate:.4g} 1/s predicted{error}"
    yield verdict(check)


def verdict(check: Check) -> str:
    """Stays, or where the ring goes and how high."""
    motion, stored = check.motion, check.checked.amplitude_m
    if motion.stays:
        return f"the ring keeps this motion: {with_unit(motion.amplitude_m)}, solution {with_unit(stored)}"
    if motion.unbounded:
        return f"the ring leaves this motion for one that grows without bound, {with_unit(motion.amplitude_m)} so far"
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
            "unbounded": motion.unbounded,
            "reaches_solution": matching_solution(check),
            "growth_rate": motion.growth_rate,
            "predicted_growth_rate": check.predicted_rate,
            "growth_rate_error": check.rate_error,
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


@dataclass(frozen=True)
class WorstCheck:
    """The worst motion of a curve, and what a check or a longer search says of it."""

    number: int  # of the curve
    label: str  # its swept parameters
    worst: WorstMotion | None  # what the run prints; None where there is no curve
    check: Check | None = None  # of a solution of a branch
    longer: WorstMotion | None = None  # what a thorough search finds
    reason: str = ""  # why there is neither


def check_worst(number: int, curve: CurveResult, label: str) -> WorstCheck:
    """Check the worst motion of a solved curve whose search left nothing open."""
    from rom.linear_algebra.threads import one_blas_thread

    solved = None if curve.file is None else read_curve(curve.file)
    if solved is None or curve.rom is None or solved.worst is None:
        return WorstCheck(number, label, None, reason=curve.reason or "no point was solved")
    worst = solved.worst
    found = WorstCheck(number, label, worst)
    if worst.branch < 0 or worst.motion != "periodic":
        return replace(found, reason="found with the ring of blades itself, nothing was left open")
    with one_blas_thread():
        try:
            ring = _ring(_problem(curve.member.scene, curve.rom))
            check = _worst_in_time(found, [solved, *solved.detached], *ring)
        except ArithmeticError as error:
            return replace(found, reason=f"not integrated in time: {reason_of(error)}")
    return replace(found, check=check, reason="" if check else "Newton's method finds no solution there")


def _worst_in_time(
    found: WorstCheck, branches: list[ResponseCurve], ring: Ring, options: SolverOptions
) -> Check | None:
    """The ring in time from a worst motion that is a solution of a branch; None where that is not found again."""
    from nonlinear.worst_motion.solution_search import SolutionSearch

    worst = found.worst
    assert worst is not None
    every = SolutionSearch(ring, options, worst.frequency_hz).solutions(branches)
    own = [each for each in every if each.branch == worst.branch]
    if not own:
        return None
    away = [abs(each.amplitude_m - worst.amplitude_m) for each in own]
    point = CheckedPoint(found.number, worst.frequency_hz, worst.branch, 1 + away.index(min(away)))
    return _integrated(point, found.label, own, ring, options)


def is_open(worst: WorstMotion) -> bool:
    """Whether more than an end of the frequency range was left open; not of a solution that the ring leaves."""
    return bool(set(worst.open_kinds) - {"end"}) and not worst.unstable


def worst_lines(found: WorstCheck) -> Iterator[str]:
    """The worst motion and what the check says, a line each."""
    name = f"curve {found.number}{f' ({found.label})' if found.label else ''}"
    if found.worst is None:
        yield f"{name}: no worst motion ({found.reason})"
        return
    yield f"{name}: {_said(found.worst)}"
    if found.longer is not None:
        left = f"; still open: {found.longer.unresolved}" if found.longer.unresolved else ", nothing is left open"
        yield f"  a thorough search: {_said(found.longer)}{left}"
    elif found.check is not None:
        yield f"  {found.check.motion.periods} periods in time: {verdict(found.check)}"
    else:
        yield f"  {found.reason}"


def _said(worst: WorstMotion) -> str:
    at_least = ">= " if worst.unresolved and not worst.unstable else ""
    where = "on no branch"
    if worst.branch >= 0 and worst.motion == "periodic":
        where = f"detached branch {worst.branch}" if worst.branch else "main branch"
    return f"worst motion {at_least}{motion_said(worst.amplitude_m, worst.frequency_hz, 6)}, {worst.motion}, {where}"


def worst_values(found: WorstCheck) -> dict[str, Any]:
    """The same as values for JSON."""
    return {
        "curve": found.number,
        "worst": plain(found.worst),
        "check": None if found.check is None else printed(found.check),
        "longer": plain(found.longer),
        "reason": found.reason,
    }
