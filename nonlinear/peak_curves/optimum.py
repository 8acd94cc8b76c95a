"""The value of a parameter at which the worst motion is lowest.

Responses are solved at single values with all options. Their peaks are followed over the parameter, with their
stability. Where the highest followed peak persists it is the worst motion; elsewhere responses are solved until the
line between them is accurate. The lowest point of this envelope is confirmed by a response there and beside it: what
is higher than expected joins the envelope, and the search goes on.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nonlinear.options import NO_PEAK, OptionsError, SolverOptions
from nonlinear.peak_curves.optimum_description import described
from nonlinear.peak_curves.optimum_result import Optimum
from nonlinear.peak_curves.parameter_family import ParameterFamily, Problem, check_range
from nonlinear.peak_curves.peak_search import PeakSearch, Solve, solve_in_turn, solved_response
from nonlinear.peak_curves.response_placement import FIRST_SHARES, Placement
from nonlinear.peak_curves.worst_envelope import AGREES, MARGIN, EnvelopeOfPeaks, Minimum, lowest_of
from nonlinear.response_curve import ResponseCurve
from rom import one_blas_thread

MOST_RESPONSES = 40
FEWEST_RESPONSES = 12
RESERVE = 8  # responses kept for the confirmation of the optimum
ROUNDS = 4
BESIDE = 5e-3  # of the share, of the responses beside the optimum
TOLD = 0.01  # relative change by more harmonics, somewhere in the range, that is told of


def find_optimum(
    problem: Problem,
    name: str,
    low: float,
    high: float,
    progress: Callable[[str], None] = lambda line: None,
    solver: Solve = solve_in_turn,
    most_responses: int = MOST_RESPONSES,
) -> Optimum:
    """The value of a parameter in a range at which the worst motion is lowest.

    Parameters
    ----------
    problem : tuple
        Modes, contact, excitation and options, as the arguments of `forced_response`. With harmonics "auto" the
        largest number that is chosen at the optimum and at the ends of the range within 10 % of it holds for the
        whole range; a remark says what more harmonics would change elsewhere.
    name : str
        The parameter: "interference", "friction", "normal_stiffness", "tangential_stiffness", "preload", "force" or
        "damping"; see `with_parameter`.
    low, high : float
        Its range, SI units.
    progress : callable
        Called with a line on what is done.
    solver : callable
        Takes a list of problems and returns their responses, in worker processes for example.
    most_responses : int
        Largest number of responses that are solved, 12 or more.

    Returns
    -------
    Optimum
        The optimum, confirmed by a response with all options.

    Raises
    ------
    ArithmeticError
        No response in the range has a motion that persists.
    ContactError
        The range holds values that the contact does not allow.
    OptionsError
        There is no such parameter, or the range is empty.

    Examples
    --------
    With the names of the example of `forced_response`: the stiffer the slider, the lower the peak.

    >>> from nonlinear import find_optimum
    >>> optimum = find_optimum((modal, contact, excitation, options), "tangential_stiffness", 1.0, 3.0)
    >>> optimum.kind, optimum.value
    ('edge', 3.0)
    """
    if most_responses < FEWEST_RESPONSES:
        raise OptionsError(f"most_responses: {most_responses}, allowed: {FEWEST_RESPONSES} or more")
    check_range(problem, name, low, high)
    family = ParameterFamily(problem, name, low, high)
    started = time.perf_counter()
    with one_blas_thread():
        if problem[3].harmonics != "auto":
            found = _optimum(family, progress, solver, most_responses)
        else:
            found = _with_chosen_harmonics(family, progress, solver, most_responses)
    return replace(found, seconds=max(0.0, time.perf_counter() - started))


def _with_chosen_harmonics(
    family: ParameterFamily, progress: Callable[[str], None], solver: Solve, most: int
) -> Optimum:
    """The optimum with as many harmonics as "auto" chooses there and at the ends of the range within 10 %.

    The search begins with the fewest that "auto" chooses at both ends of the whole range and in the middle. Where
    one of the responses with its own number of harmonics is lower than the optimum, more are taken too.
    """
    progress(f"number of harmonics at both ends and in the middle of {family.name}")
    known = dict(zip(FIRST_SHARES, solver([family.at(share) for share in FIRST_SHARES]), strict=True))
    number = min(map(_harmonics, known.values()))
    while True:
        fixed = replace(family, problem=_with_harmonics(family.problem, number))
        found = _optimum(fixed, progress, solver, most)
        span = family.high - family.low
        shares = [float((value - family.low) / span) for value in (found.value, *found.within)]
        progress(f"number of harmonics at the optimum of {family.name} and where the worst motion is 10 % higher")
        there = solver([family.at(share) for share in shares])
        known |= zip(shares, there, strict=True)
        lower = [
            curve
            for curve in known.values()
            if _height(curve, family.problem[3]) < (1.0 - AGREES) * found.amplitude_m
        ]
        asked = max(map(_harmonics, (*there, *lower)))
        if asked <= number:
            return replace(found, remarks=(_harmonics_said(family, number, known, found), *found.remarks))
        progress(f"{asked} harmonics are needed")
        number = asked


def _height(curve: ResponseCurve, options: SolverOptions) -> float:
    """Amplitude of the worst motion of a response, m; infinite where it is not known."""
    return solved_response(0.0, curve, "", options).height


def _harmonics_said(family: ParameterFamily, number: int, known: dict[float, ResponseCurve], found: Optimum) -> str:
    """How many harmonics the optimum has, and what their number changes where the envelope is least accurate."""
    said = f"{number} harmonics, as many as the tolerance asks for at the optimum and where it is 10 % higher"
    values = np.array([family.value(share) for share in known])
    heights = np.array([_height(curve, family.problem[3]) for curve in known.values()])
    with np.errstate(all="ignore"):
        change = np.abs(found.envelope.at(values) / heights - 1.0)
    change = np.where(np.isfinite(change), change, 0.0)
    worst = int(np.argmax(change))
    if change[worst] <= TOLD:
        return said
    where = f"{family.name} = {values[worst]:.6g}"
    return f"{said}; at {where} more of them change the worst motion by {100.0 * change[worst]:.2g} %"


def _harmonics(curve: ResponseCurve) -> int:
    return max(branch.harmonics for branch in (curve, *curve.detached))


def _with_harmonics(problem: Problem, number: int) -> Problem:
    modal, contact, excitation, options = problem
    return modal, contact, excitation, replace(options, harmonics=number)


def _optimum(family: ParameterFamily, progress: Callable[[str], None], solver: Solve, most: int) -> Optimum:
    """The optimum with a fixed number of harmonics."""
    search = PeakSearch(family, progress, solver)
    placement = Placement(search, most)
    placement.explore()
    at_end = all(response.solved.at_end for response in search.responses)
    if at_end or not (search.pieces or any(np.isfinite(each.solved.bound_m) for each in search.responses)):
        first = NO_PEAK if at_end else search.responses[0].curve.termination.message
        raise ArithmeticError(
            f"no peak to follow over {family.name} from {family.low:.6g} to {family.high:.6g}: {first}"
        )
    placement.refine(RESERVE, _lowest_height)
    lowest = lowest_of(placement.envelope(), search.follower)
    for _ in range(ROUNDS):
        if _confirmed(placement, lowest):
            break
        placement.refine(max(RESERVE // 2, 1), _lowest_height)
        lowest = lowest_of(placement.envelope(), search.follower)
    return described(placement, lowest)


def _confirmed(placement: Placement, lowest: Minimum) -> bool:
    """Whether responses at the optimum and beside it are no higher than the envelope, and no lower point is left."""
    pieces, gaps = len(placement.search.pieces), len(placement.envelope().gaps)
    step = MARGIN if lowest.kind == "jump" else BESIDE
    places = [lowest.share + side * step for side in (0.0, -1.0, 1.0)]
    placement.solve([share for share in places if 0.0 <= share <= 1.0], "optimum")
    envelope = placement.envelope()
    height = float(envelope.at(np.array([lowest.share]))[0])
    same = len(placement.search.pieces) == pieces and len(envelope.gaps) <= gaps
    return (
        same
        and height <= (1.0 + AGREES) * lowest.height
        and lowest.height <= (1.0 + AGREES) * _lowest_height(envelope)
    )


def _lowest_height(envelope: EnvelopeOfPeaks) -> float:
    """Lowest height of the envelope, m; infinite where nothing is known."""
    return float(envelope.at(envelope.shares).min())
