"""The value of a parameter at which the worst motion is lowest.

Responses are solved at single values with all options. Their peaks are followed over the parameter, with their
stability. Where the highest followed peak persists it is the worst motion; elsewhere responses are solved until the
line between them is accurate. The lowest point of this envelope is confirmed by a response there and beside it: what
is higher than expected joins the envelope, and the search goes on.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.options import NEARLY_LOWEST, NO_PEAK, OptionsError, SolverOptions
from nonlinear.peak_curves.optimum_result import KINDS, Optimum, PeakCurve, WorstEnvelope
from nonlinear.peak_curves.parameter_family import ParameterFamily, check_range, parameter_value
from nonlinear.peak_curves.peak_branch import PeakPiece
from nonlinear.peak_curves.peak_search import (
    ACCURATE,
    FIRST_SHARES,
    MOST_RESPONSES,
    SAME_SHARE,
    PeakSearch,
    Solve,
    ends_said,
    most_harmonics,
    open_gaps,
    solve_in_turn,
    solved_response,
    with_enough_harmonics,
)
from nonlinear.peak_curves.peak_sensitivity import peak_derivatives
from nonlinear.peak_curves.worst_envelope import (
    AGREES,
    MARGIN,
    NARROW,
    UNKNOWN,
    EnvelopeOfPeaks,
    Minimum,
    ResponseAt,
    lowest_of,
    range_below,
)
from nonlinear.problem import Problem, ProblemTuple
from nonlinear.response_curve import ResponseCurve
from rom.linear_algebra.threads import one_blas_thread

PLOTTED = 401  # values of the envelope, besides its nodes
FEWEST_RESPONSES = 12
RESERVE = 8  # responses kept for the confirmation of the optimum
ROUNDS = 4
BESIDE = 5e-3  # of the share, of the responses beside the optimum
TOLD = 0.01  # relative change by more harmonics, somewhere in the range, that is told of


def described(search: PeakSearch, lowest: Minimum) -> Optimum:
    """The optimum with its surroundings, as plain data."""
    family, envelope = search.family, search.envelope
    here = _response_at(search.responses, lowest.share)
    amplitude, frequency, kind = _height(lowest, here, search.responses)
    motion = motion_said(family.problem.options, amplitude, frequency)
    span, value = family.high - family.low, family.value(lowest.share)
    derivatives = {} if lowest.peak is None else peak_derivatives(family.at(lowest.share), lowest.peak.point)
    solved = tuple(response.solved for response in search.responses)
    problem = family.at(lowest.share)
    heights = envelope.at(envelope.shares)
    near = range_below(envelope.shares, heights, lowest.share, NEARLY_LOWEST * amplitude)
    return Optimum(
        name=family.name,
        low=family.low,
        high=family.high,
        value=value,
        frequency_hz=frequency,
        amplitude_m=amplitude,
        motion=kind,
        kind=lowest.kind,
        curvature=lowest.second / span**2,
        slopes=(lowest.rates[0] / span, lowest.rates[1] / span),
        within=(family.value(near[0]), family.value(near[1])),
        derivatives=derivatives,
        elasticities=elasticities(problem, derivatives, amplitude),
        worst=None if here is None else here.curve.worst,
        envelope=_sampled(envelope, family),
        curves=tuple(_curve(piece, family) for piece in search.pieces),
        responses=solved,
        harmonics=problem.options.fixed_harmonics,
        truncation_error=float("nan") if here is None else here.solved.truncation_error,
        seconds=0.0,
        message=f"{family.name} = {value:.6g}: {KINDS[lowest.kind].said}, {motion}",
        remarks=tuple(_remarks(search, envelope, lowest, here)),
        objective=problem.options.objective,
    )


def elasticities(problem: Problem, derivatives: dict[str, float], amplitude: float) -> dict[str, float]:
    """Relative derivatives p / A dA/dp."""
    return {name: parameter_value(problem, name) / amplitude * value for name, value in derivatives.items()}


def _response_at(responses: list[ResponseAt], share: float) -> ResponseAt | None:
    """The response at a share; the nearest one, where the optimum was refined after it."""
    nearest = min(responses, key=lambda each: abs(each.share - share), default=None)
    return nearest if nearest is not None and abs(nearest.share - share) < NARROW else None


def _height(lowest: Minimum, here: ResponseAt | None, responses: list[ResponseAt]) -> tuple[float, float, str]:
    """Amplitude, frequency and motion at the optimum: of the peak, or of the response there if that is higher."""
    same = here is not None and abs(here.share - lowest.share) < SAME_SHARE
    solved = here.solved if same and here is not None else None
    if lowest.peak is not None and (solved is None or not solved.bound_m > lowest.height * (1.0 + AGREES)):
        higher = max(lowest.height, solved.bound_m if solved is not None else 0.0)
        return higher, lowest.peak.frequency_hz, "periodic"
    if solved is None:
        solved = min(responses, key=lambda each: abs(each.share - lowest.share)).solved
    return max(lowest.height, solved.bound_m), solved.frequency_hz, solved.motion


def _curve(piece: PeakPiece, family: ParameterFamily) -> PeakCurve:
    span = family.high - family.low
    return PeakCurve(
        value=family.low + piece.share * span,
        amplitude_m=piece.amplitude,
        frequency_hz=piece.frequency_hz,
        stable=piece.persists,
        growth_rate=np.array([point.growth_rate for point in piece.points]),
        slope=piece.rate / span,
        origin=piece.origin,
    )


def _sampled(envelope: EnvelopeOfPeaks, family: ParameterFamily) -> WorstEnvelope:
    """The envelope at values for a figure."""
    nodes = [node.share for node in envelope.nodes]
    jumps = np.array(envelope.jumps)
    marks = [*nodes, *(jumps - 2e-6), *(jumps + 2e-6)]
    shares = np.unique(np.concatenate([np.linspace(0.0, 1.0, PLOTTED), np.clip(marks, 0.0, 1.0)]))
    heights = envelope.at(shares)
    persistent = np.array([piece.persistent_at(shares) for piece in envelope.pieces]).reshape(-1, shares.size)
    persistent = np.where(np.isnan(persistent), -np.inf, persistent)
    rows = [
        _row(envelope, share, height, peaks)
        for share, height, peaks in zip(shares, heights, persistent.T, strict=True)
    ]
    errors = [error for gap, error in zip(envelope.gaps, envelope.errors, strict=True) if gap.width > NARROW]
    return WorstEnvelope(
        value=family.low + shares * (family.high - family.low),
        amplitude_m=np.where(np.isfinite(heights), heights, np.nan),
        frequency_hz=np.array([row[0] for row in rows]),
        source=np.array([row[1] for row in rows]),
        motion=np.array([row[2] for row in rows]),
        origin=np.array([row[3] for row in rows]),
        error=max(errors, default=0.0),
    )


def _row(envelope: EnvelopeOfPeaks, share: float, height: float, peaks: Array) -> tuple[float, str, str, str]:
    """Frequency, source, motion and branch of the envelope at a share; `peaks`: the persistent ones of all pieces."""
    if not np.isfinite(height):
        return float("nan"), "unknown", "periodic", ""
    if peaks.max(initial=-np.inf) >= height * (1.0 - 1e-9):
        piece = envelope.pieces[int(np.argmax(peaks))]
        return float(np.interp(share, piece.share, piece.frequency_hz)), "followed", "periodic", piece.origin
    nearest = min(envelope.responses, key=lambda each: abs(each.share - share)).solved
    return (
        nearest.frequency_hz,
        "open" if nearest.bound_m > nearest.amplitude_m else "responses",
        nearest.motion,
        nearest.origin,
    )


def motion_said(options: SolverOptions, amplitude: float, frequency: float) -> str:
    """Amplitude (m) and frequency (Hz) of the worst motion in words."""
    first = "harmonic 1 of " if options.objective == "harmonic_1" else ""
    return f"{first}{amplitude:.4g} m at {frequency:.6g} Hz"


def _remarks(search: PeakSearch, envelope: EnvelopeOfPeaks, lowest: Minimum, here: ResponseAt | None) -> list[str]:
    """What was searched and what was left open."""
    family, solved = search.family, [response.solved for response in search.responses]
    reasons = Counter(item.reason for item in solved)
    counted = ", ".join(f"{count} {reason}" for reason, count in reasons.items())
    said = [f"{len(solved)} values of {family.name} searched ({counted}); a branch between them may be missed"]
    gaps = envelope.gaps
    if gaps:
        first, last = ({family.value(gap[side].share) for gap in gaps} for side in (0, 1))
        ends = zip(sorted(first - last), sorted(last - first), strict=True)  # of gaps that follow each other, joined
        parts = ", ".join(f"{low:.4g} to {high:.4g}" for low, high in ends)
        said.append(f"no followed peak is the worst motion at {parts}: interpolated between single responses")
    errors = zip(gaps, envelope.errors, strict=True)
    rough = [error for gap, error in errors if gap.width > NARROW and error > ACCURATE]
    if rough:
        error = f"up to {100 * max(rough):.2g} %" if max(rough) < UNKNOWN else "unknown"
        spent = bool(open_gaps(envelope))
        reason = f"the limit of {search.most} responses was reached" if spent else "far above the optimum"
        said.append(f"error of the interpolation in {len(rough)} parts of it {error}: {reason}")
    if lowest.kind == "plateau":
        low, high = (family.value(share) for share in lowest.plateau)
        said.append(f"the lowest amplitude holds from {low:.6g} to {high:.6g}")
    if lowest.kind == "jump":
        jumps = ", ".join(
            f"{family.value(share):.6g}" for share in envelope.jumps if abs(share - lowest.share) < 2 * NARROW
        )
        said.append(f"the worst motion jumps at {jumps}: keep a distance")
    said += ends_said(solved)
    if here is not None and here.solved.unresolved:
        said.append(f"at the optimum: {here.solved.unresolved}")
    return said


def find_optimum(
    problem: ProblemTuple,
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
    family = ParameterFamily.over(problem, name, low, high)
    started = time.perf_counter()
    with one_blas_thread():
        found = _with_enough_harmonics(family, progress, solver, most_responses)
    return replace(found, seconds=max(0.0, time.perf_counter() - started))


def _with_enough_harmonics(
    family: ParameterFamily, progress: Callable[[str], None], solver: Solve, most: int
) -> Optimum:
    """The optimum with as many harmonics as "auto" chooses there and at the ends of the range within 10 %.

    The search begins with the fewest that "auto" chooses at both ends of the whole range and in the middle. Where
    one of the responses with its own number of harmonics is lower than the optimum, more are taken too.
    """
    known: dict[float, ResponseCurve] = {}

    def first() -> int:
        progress(f"number of harmonics at both ends and in the middle of {family.name}")
        known.update(zip(FIRST_SHARES, solver([family.at(share) for share in FIRST_SHARES]), strict=True))
        return min(map(most_harmonics, known.values()))

    def asked(found: Optimum) -> int:
        span = family.high - family.low
        shares = [float((value - family.low) / span) for value in (found.value, *found.within)]
        progress(f"number of harmonics at the optimum of {family.name} and where the worst motion is 10 % higher")
        there = solver([family.at(share) for share in shares])
        known.update(zip(shares, there, strict=True))
        limit = (1.0 - AGREES) * found.amplitude_m
        lower = [curve for curve in known.values() if _known_height(curve, family.problem.options) < limit]
        return max(map(most_harmonics, (*there, *lower)))

    def search(fixed: Problem) -> Optimum:
        return _optimum(replace(family, problem=fixed), progress, solver, most)

    found = with_enough_harmonics(family.problem, first, search, asked, progress)
    return replace(found, remarks=(_harmonics_said(family, known, found), *found.remarks)) if known else found


def _known_height(curve: ResponseCurve, options: SolverOptions) -> float:
    """Amplitude of the worst motion of a response, m; infinite where it is not known."""
    return solved_response(0.0, curve, "", options).height


def _harmonics_said(family: ParameterFamily, known: dict[float, ResponseCurve], found: Optimum) -> str:
    """How many harmonics the optimum has, and what their number changes where the envelope is least accurate."""
    said = (
        f"{found.harmonics} harmonics, as many as the tolerance asks for at the optimum and where it is 10 % higher"
    )
    values = np.array([family.value(share) for share in known])
    heights = np.array([_known_height(curve, family.problem.options) for curve in known.values()])
    with np.errstate(all="ignore"):
        change = np.abs(found.envelope.at(values) / heights - 1.0)
    change = np.where(np.isfinite(change), change, 0.0)
    worst = int(np.argmax(change))
    if change[worst] <= TOLD:
        return said
    where = f"{family.name} = {values[worst]:.6g}"
    return f"{said}; at {where} more of them change the worst motion by {100.0 * change[worst]:.2g} %"


def _optimum(family: ParameterFamily, progress: Callable[[str], None], solver: Solve, most: int) -> Optimum:
    """The optimum with a fixed number of harmonics."""
    search = PeakSearch(family, progress, solver, most)
    search.explore()
    at_end = all(response.solved.at_end for response in search.responses)
    if at_end or not (search.pieces or any(np.isfinite(each.solved.bound_m) for each in search.responses)):
        first = NO_PEAK if at_end else search.responses[0].curve.termination.message
        raise ArithmeticError(
            f"no peak to follow over {family.name} from {family.low:.6g} to {family.high:.6g}: {first}"
        )
    search.refine(RESERVE)
    lowest = lowest_of(search.envelope, search.follower)
    for _ in range(ROUNDS):
        if _confirmed(search, lowest):
            break
        search.refine(RESERVE // 2)
        lowest = lowest_of(search.envelope, search.follower)
    return described(search, lowest)


def _confirmed(search: PeakSearch, lowest: Minimum) -> bool:
    """Whether responses at the optimum and beside it are no higher than the envelope, and no lower point is left."""
    pieces, gaps = len(search.pieces), len(search.envelope.gaps)
    step = MARGIN if lowest.kind == "jump" else BESIDE
    places = [lowest.share + side * step for side in (0.0, -1.0, 1.0)]
    search.solve([share for share in places if 0.0 <= share <= 1.0], "optimum")
    envelope = search.envelope
    height = float(envelope.at(np.array([lowest.share]))[0])
    same = len(search.pieces) == pieces and len(envelope.gaps) <= gaps
    return (
        same and height <= (1.0 + AGREES) * lowest.height and lowest.height <= (1.0 + AGREES) * envelope.lowest_height
    )
