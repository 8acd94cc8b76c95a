"""The truth of a truncated peak: the highest peak with up to 31 harmonics.

A whole curve is solved with more harmonics than the case has. Its highest peaks, and the peak of the case itself, are
continued to 31 harmonics, or until they have converged, in steps and located again each time. The highest peak of the
curve is the truth of the branch, the higher of the two results that of the motion.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from stress_cases import StressCase
from stress_solving import NAN, OutOfTimeError, frequency_range, posed

if TYPE_CHECKING:
    from nonlinear.branches.branch import Branch
    from nonlinear.contact.parameters import Array
    from nonlinear.continuation.arclength_continuation import Continuation
    from nonlinear.continuation.solution_point import SolutionPoint
    from nonlinear.harmonic_balance.initial_solution import TruncatedBalances
    from nonlinear.harmonic_selection.truncation_error import TruncationEstimate

STEPS_UP = (3, 5, 7, 9, 11, 15, 21, 31)
REFERENCES = {1: (7, 5), 3: (7, 5), 5: (9, 7), 7: (11, 9)}  # harmonics of the case -> those of the whole curve
NEAR_THE_TOP = 0.75  # peaks of that curve this high, relative to the highest, are continued too
MOST_PEAKS = 3
STRICT_ABOVE = 15  # with more harmonics than these a peak whose height jumps is another one
JUMP = 0.1  # relative change of the height that is a jump
FEW, JUMP_OF_FEW = 7, 0.3  # with at most so many harmonics a larger change is allowed
CONVERGED, LEAST_CONVERGED = 1e-4, 11  # a last change below this, with this many harmonics, is the limit
MOST_STEPS = 40
FIRST_STEP = 0.05
AROUND = 4  # points on each side of a peak from which it is sought with more harmonics


@dataclass(frozen=True)
class Problem:
    """What a case asks to solve, ready for any number of harmonics; `static` (n_c, 3) to start from."""

    continuation: Continuation
    balances: TruncatedBalances
    static: Array

    def branch(self, n_harmonics: int, seconds: float) -> Branch:
        """The main branch with so many harmonics.

        Raises
        ------
        OutOfTimeError
            It takes longer than `seconds`.
        """
        from nonlinear.branches.range_continuation import continue_over_range

        began = time.perf_counter()

        def watch(frequency_hz: float, points: int) -> None:
            if time.perf_counter() - began > seconds:
                raise OutOfTimeError(f"H = {n_harmonics} given up at {frequency_hz:.6g} Hz after {seconds:g} s")

        return continue_over_range(self.at(n_harmonics), self.static, watch)[0]

    def at(self, n_harmonics: int) -> Continuation:
        """The continuation with so many harmonics."""
        return self.continuation.with_balance(self.balances.balance(n_harmonics))

    def height(self, point: SolutionPoint) -> float:
        """Amplitude of the output at a point, m."""
        from nonlinear.continuation.response_quantities import output_amplitude

        return output_amplitude(point, self.continuation.options.output)


def problem_of(case: StressCase, model: Path) -> Problem:
    """The problem of a case under 1 N, as the test matrix poses it."""
    from nonlinear.continuation.arclength_continuation import Continuation
    from nonlinear.continuation.step_control import find_resonances
    from nonlinear.harmonic_balance.initial_solution import TruncatedBalances, static_displacement
    from nonlinear.response_solver import build_harmonic_balance

    modal, contact, excitation, options = posed(case, model, frequency_range(case, model))
    balance = build_harmonic_balance(modal, contact, excitation, options)
    continuation = Continuation(balance, options, find_resonances(balance.receptance, contact, options), contact)
    static = static_displacement(balance.receptance, contact, options)
    return Problem(continuation, TruncatedBalances(balance, contact, options), static)


@dataclass(frozen=True)
class Truth:
    """Highest peak with more harmonics.

    Attributes
    ----------
    height : float
        Its amplitude, m.
    harmonics : int
        Harmonics of the last solution.
    before : float
        Height with the number of harmonics before, m, to judge the convergence.
    curve : float
        The highest peak of the whole curve alone, m; the branch of the case's peak may have detached from it.
    reference : int
        Harmonics of the whole curve.
    """

    height: float = NAN
    harmonics: int = 0
    before: float = NAN
    curve: float = NAN
    reference: int = 0


def estimate_of(problem: Problem, branch: Branch) -> TruncationEstimate:
    """The truncation error of the highest peak of a main branch as the program estimates it."""
    from nonlinear.harmonic_selection.truncation_error import TruncationErrorEstimator

    estimator = TruncationErrorEstimator(problem.continuation, problem.balances)
    return estimator.of_branch(branch.points, branch.peak_indices)


def truth_of(problem: Problem, branch: Branch, seconds: float) -> Truth:
    """The truth about a solved curve.

    Raises
    ------
    OutOfTimeError
        No whole curve was complete in `seconds`.
    """
    own = max(branch.peak_indices, key=lambda place: problem.height(branch.points[place]))
    reference, of_curve = _top_of_whole_curve(problem, seconds)
    of_branch = continued(problem, branch.points, own, gradually=True)
    as_far = max(of_branch) >= min(STRICT_ABOVE, max(of_curve))
    best = of_branch if as_far and _last(of_branch) > _last(of_curve) else of_curve
    solved = sorted(best)
    return Truth(best[solved[-1]], solved[-1], best[solved[max(len(solved) - 2, 0)]], _last(of_curve), reference)


def _top_of_whole_curve(problem: Problem, seconds: float) -> tuple[int, dict[int, float]]:
    """Harmonics of a whole curve, and the highest of its peaks as `continued`.

    A peak that is lost on the way may not exist with more harmonics: then the next curve decides.
    """
    own = problem.continuation.balance.n_harmonics
    reasons: list[str] = []
    result: tuple[int, dict[int, float]] | None = None
    for n_harmonics in (*REFERENCES[own], own + 2):
        if (n_harmonics == own + 2) if result is not None else (reasons and n_harmonics != own + 2):
            continue  # own + 2 harmonics only where the curves with more take too long
        try:
            whole = problem.branch(n_harmonics, seconds)
        except OutOfTimeError as error:
            reasons.append(str(error))
            continue
        if not whole.termination.complete or not whole.peak_indices:
            reasons.append(f"H = {n_harmonics}: {whole.termination.message}")
            continue
        heights = {place: problem.height(whole.points[place]) for place in whole.peak_indices}
        tops = sorted(heights, key=lambda place: -heights[place])[:MOST_PEAKS]
        near = [place for place in tops if heights[place] >= NEAR_THE_TOP * heights[tops[0]]]
        peaks = [continued(problem, whole.points, place) for place in near]
        result = n_harmonics, max(peaks, key=_last)
        if max(peaks[0]) == STEPS_UP[-1]:
            return result
    if result is None:
        raise OutOfTimeError("; ".join(reasons))
    return result


def _last(heights: dict[int, float]) -> float:
    return heights[max(heights)]


def continued(
    problem: Problem, points: Sequence[SolutionPoint], place: int, gradually: bool = False
) -> dict[int, float]:
    """Number of harmonics -> height of a located peak, as far up to 31 as it can be followed.

    In steps of two harmonics where the longer ones lose it. `gradually`: only as long as no step is a jump.
    """
    peak = points[place]
    heights = {peak.balance.n_harmonics: problem.height(peak)}
    beside = points[max(place - AROUND, 0) : place + AROUND + 1]
    starts = sorted(beside, key=lambda point: abs(point.arc - points[place].arc))
    while (reached := max(heights)) < STEPS_UP[-1]:
        for n_harmonics in (next(number for number in STEPS_UP if number > reached), reached + 2):
            found = _peak_near(problem, n_harmonics, starts, heights[reached])
            free = n_harmonics <= STRICT_ABOVE and not gradually
            jump = JUMP_OF_FEW if n_harmonics <= FEW else JUMP
            if found is not None and (free or _alike(problem.height(found[0]), heights[reached], jump)):
                break
        else:
            break
        starts = found
        heights[n_harmonics] = problem.height(found[0])
        if n_harmonics >= LEAST_CONVERGED and _alike(heights[n_harmonics], heights[reached], CONVERGED):
            break
    return heights


def _alike(height: float, other: float, jump: float = JUMP) -> bool:
    return abs(height / other - 1.0) <= jump


def _peak_near(
    problem: Problem, n_harmonics: int, starts: Sequence[SolutionPoint], height: float
) -> list[SolutionPoint] | None:
    """A located peak with more harmonics, reached from one of the points, and the points around it.

    The first that is about as high as before, else the first of all.
    """
    from nonlinear.branches.special_points import locate_peak

    here = problem.at(n_harmonics)
    others = []
    for start in starts:
        found = here.solver.refit(start)
        if found is None:
            continue
        walk = list(_up_and_over(here, found))
        peak = locate_peak(here, walk[-2], walk[-1]) if len(walk) > 1 else None
        if peak is None:
            continue
        around = [peak, *reversed(walk[-AROUND:])]
        if _alike(problem.height(peak), height):
            return around
        others.append(around)
    return others[0] if others else None


def _up_and_over(here: Continuation, start: SolutionPoint) -> Iterator[SolutionPoint]:
    """Points along the curve from `start` to the first one beyond a peak."""
    from nonlinear.continuation.response_quantities import amplitude_derivative

    if amplitude_derivative(start, here.options.output) < 0.0:
        start = start.reversed()
    for point in islice(here.continue_branch(replace(start, step=FIRST_STEP)), MOST_STEPS):
        yield point
        if point.dA_ds < 0.0:
            return
