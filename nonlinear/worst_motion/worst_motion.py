"""The worst motion of a response curve: the highest that can persist on any of its branches.

A motion persists if it is stable. The highest stable solution is the first candidate. Where no stable solution is as
high as an unstable one, the ring does something else, which may be higher than both: time integration of the ring,
started from the unstable solution with a disturbance in its worst pattern, tells what.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from nonlinear.options import SEARCH_COST, TRUNCATION_TOLERATED, SolverOptions
from nonlinear.problem import ProblemTuple
from nonlinear.response_curve import OpenKind, ResponseCurve, WorstMotion, at_range_end
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import (
    CLEARLY_HIGHER,
    COULD_MATTER,
    LONG,
    Place,
    UnstableStretch,
    branches_of,
    height_said,
    highest_persistent,
    unstable_stretches,
    without_doubtful,
)
from nonlinear.worst_motion.departure_search import SAME_AMPLITUDE, Departure, DepartureSearch, Follow, Integrate
from nonlinear.worst_motion.ring_integration import (
    EQUAL_COST,
    FLOOR,
    OBSERVED,
    USUAL_PERIODS,
    Integrated,
    RingIntegration,
    RingPatterns,
    Solution,
    recurrence,
)
from nonlinear.worst_motion.ring_starts import RingStarts
from nonlinear.worst_motion.stepped_sweep import SteppedSweep, Sweep

LEAST_BUDGET = 90_000  # of them for a curve with the standard search, 3 to 6 s: a shorter one finds too little
MOST_BUDGET = 600_000  # the same at effort 1, however long the curve
STABILITY = {
    "wave": "stability against perturbations with the symmetry of the wave only",
    "folds": "stability from folds only",
}
UNBOUNDED = "grows without bound: the contacts do not hold what the flow feeds"
STARTS = {"": "from the unstable solution", "mixed": "from blades high and low", "random": "from random states"}
FURTHER = "a larger response.effort goes further"
MOST_NAMED = 4  # frequencies in one sentence
NEVER = "mistuned blades, other residual tractions, motions that other initial conditions reach"
LEAVES = 'which response.stability = "ring" with response.search = "standard" finds'
DOUBTFUL = 50.0  # rate of decay times omega / this that no error reaches: of rings that hit it was omega / 70 at most
NOT_KNOWN = "its growth rate is not known: no motion is found with twice the harmonics"
IRREGULAR = "irregular"  # kind of a motion that has not settled
MOST_STRETCHES = 6  # unstable stretches that time integration starts from


def searched(
    curve: ResponseCurve,
    options: SolverOptions,
    n_blades: int | None,
    departures: Sequence[Departure],
    lacking: bool = False,
) -> str:
    """What was searched (branches, stability, harmonics, time integration), and what was not, by semicolons."""
    parts = [_branches(curve, options), _stability(options, n_blades), f"harmonics 0 to {curve.harmonics}"]
    starts = [each for each in departures if each.motion is not None]
    if starts:
        parts.append(_integrated(starts, [each.sweep for each in departures if each.sweep is not None]))
    else:
        unchecked = options.stability != "ring" and options.search == "off"
        left_out = lacking or departures or unchecked
        parts.append("no time integration" if left_out else "time integration not needed")
    omitted = [NEVER]
    if not options.detached:
        omitted.insert(0, "detached branches")
    if options.stability != "ring" and n_blades is not None:
        omitted.insert(0, "other nodal diameters")
    return f"searched: {'; '.join(parts)}; not searched: {', '.join(omitted)}"


def _branches(curve: ResponseCurve, options: SolverOptions) -> str:
    count = len(curve.detached)
    if count:
        text = f"main branch and {count} detached branch{'es' if count > 1 else ''}"
        left_out = curve.branches_left_out
        return f"{text} ({left_out} solutions on further branches not followed)" if left_out > 0 else text
    return "main branch, no detached branch found" if options.detached else "main branch"


def _stability(options: SolverOptions, n_blades: int | None) -> str:
    if options.stability != "ring":
        return STABILITY[options.stability]
    if n_blades is None or n_blades < 2:
        return "stability"
    return f"stability against nodal diameters 0 to {n_blades // 2}"


def _integrated(starts: Sequence[Departure], sweeps: Sequence[Sweep]) -> str:
    """Where time integration started, and with how many blades."""
    motions, places = [each.motion for each in starts if each.motion is not None], []
    for start, name in (("", "unstable solution"), ("mixed", "mixed start"), ("random", "random state")):
        if count := sum(each.start == start for each in starts):
            places.append(f"{count} {name}{'s' if count > 1 else ''}")
    rings = sorted({motion.n_blades for motion in motions})
    text = f"time integration from {', '.join(places[:-1])}{' and ' * (len(places) > 1)}{places[-1]}"
    text += f" (ring{'s' if len(rings) > 1 else ''} of {', '.join(map(str, rings))} blades)"
    stayed = sum(motion.stays for motion in motions)
    text += f", {stayed} of which the ring did not leave" if stayed else ""
    text += f", {len(sweeps)} motion{'s' if len(sweeps) > 1 else ''} followed in frequency" if sweeps else ""
    solved = sum(each.solved for each in sweeps)
    return f"{text} ({solved} by harmonic balance of several blades)" if solved else text


class Open(NamedTuple):
    """What was left open: its kind, and in words where and how high the solutions are there."""

    kind: OpenKind
    said: str


def unresolved(
    curve: ResponseCurve,
    departures: Sequence[Departure],
    left_out: Sequence[float],
    reason: str,
    height_m: float,
    share: float = COULD_MATTER,
) -> Iterator[Open]:
    """What was left open.

    Solutions below a share of the worst motion do not matter; `height_m`: of the highest stable solution.
    """
    branches = branches_of(curve)
    boundless = [Open("grows", said) for said in _unbounded(departures)]
    if departures and departures[-1].unbounded and not departures[-1].start:
        yield boundless[-1]
        return
    highest = max([height_m, *(each.new_height for each in departures)])
    least = share * highest
    left_out = [height for height in left_out if height >= least]
    yield from boundless
    if not curve.termination.complete:
        yield Open("incomplete", "the main branch is incomplete")
    broken = sum(not branch.termination.complete for branch in curve.detached)
    if broken:
        yield Open("incomplete", f"{broken} detached branch{'es are' if broken > 1 else ' is'} incomplete")
    yield from _beyond_effort(branches, least)
    if left_out:
        count = len(left_out)
        parts = f"{count} unstable part{'s' if count > 1 else ''} of the branches, up to {height_said(max(left_out))}"
        yield Open("not searched", f"{parts}, without time integration ({reason})")
    failures: dict[tuple[str, bool], dict[float, float]] = {}
    for departure in departures:
        reach = departure.reach_m or float(branches[departure.place[0]].amplitude_m[departure.place[1]])
        if departure.failure and reach >= least:
            failures.setdefault((departure.failure, departure.failed), {})[departure.frequency_hz] = reach
    for (failure, failed), places in failures.items():
        said = f"time integration at {_list(places)} {failure} (solutions up to {height_said(max(places.values()))})"
        yield Open("not searched" if failed else "effort", said)
    for said in (*_seen_higher(departures, highest), *_not_followed(departures, highest)):
        yield Open("effort", said)


def _seen_higher(departures: Sequence[Departure], highest_m: float) -> Iterator[str]:
    """What is said of motions that were seen clearly above the worst one, and not to persist."""
    higher = {each.frequency_hz: each.seen_m for each in departures if not each.open}
    higher = {at: height for at, height in higher.items() if height > (1.0 + CLEARLY_HIGHER) * highest_m}
    if higher:
        reach = height_said(max(higher.values()))
        yield f"motions up to {reach} at {_list(higher)} were not seen to persist"


def _beyond_effort(branches: Sequence[ResponseCurve], least_m: float) -> Iterator[Open]:
    """What the work of `SolverOptions.effort` left open of the branches."""
    if branches[0].branches_left_out < 0:
        yield Open("incomplete", f"detached branches were not searched for to the end: {FURTHER}")
    undecided = [
        height
        for branch in branches
        if np.isfinite(branch.growth_rate).any() or branch.bifurcations
        for height in branch.amplitude_m[np.isnan(branch.growth_rate) & ~branch.stable].tolist()
        if height >= least_m
    ]
    if undecided:
        count, reach = len(undecided), height_said(max(undecided))
        said = f"stability of {count} point{'s' if count > 1 else ''}, up to {reach}, is not decided: {FURTHER}"
        yield Open("undecided", said)


def _unbounded(departures: Sequence[Departure]) -> Iterator[str]:
    """What is said of motions that grow without bound."""
    for start in dict.fromkeys(each.start for each in departures if each.unbounded):
        places = _list(each.frequency_hz for each in departures if each.unbounded and each.start == start)
        yield f"{STARTS[start]} at {places} the motion {UNBOUNDED}"


def _not_followed(departures: Sequence[Departure], highest_m: float) -> Iterator[str]:
    """What is said of motions that were not followed to the ends of their ranges, or not at all."""
    for each in departures:
        if each.sweep is not None and not each.sweep.complete and each.sweep.amplitude_m.max() >= FLOOR * highest_m:
            low, high = each.sweep.frequency_hz[[0, -1]]
            motion = f"the motion at {each.frequency_hz:.5g} Hz, up to {height_said(each.sweep.amplitude_m.max())},"
            yield f"{motion} was followed from {low:.5g} to {high:.5g} Hz only"
    left = [each for each in departures if each.open and each.reached_m >= FLOOR * highest_m]
    if left:
        places, reached = _list(each.frequency_hz for each in left), max(each.reached_m for each in left)
        yield f"the motions at {places}, up to {height_said(reached)}, were not followed"


def _list(frequencies_hz: Iterable[float]) -> str:
    """Frequencies by name, each once, of many the first ones."""
    names = [f"{frequency:.5g} Hz" for frequency in dict.fromkeys(frequencies_hz)]
    if len(names) > MOST_NAMED:
        names = [*names[: MOST_NAMED - 1], f"{len(names) - MOST_NAMED + 1} others"]
    return ", ".join(names)


def find_worst_motion(
    problem: ProblemTuple, curve: ResponseCurve, standard: WorstMotion | None = None
) -> WorstMotion | None:
    """The highest motion that can persist on any branch of a curve.

    A thorough search goes on from a standard one, and keeps what that has found.
    """
    if curve.points == 0:
        return None
    modal, contact, excitation, options = problem
    if options.search == "thorough" and standard is None and not _why_not(options):
        standard = find_worst_motion((modal, contact, excitation, replace(options, search="standard")), curve)
    branches = branches_of(curve)
    integration = RingIntegration(Ring(modal, contact, excitation, options.output), options)
    reason = _why_not(options)
    if not reason:
        integration = integration.for_branches(branches)

    def integrate(place: Place, blade_periods: int, height_m: float) -> Integrated:
        return integration(Solution.of(branches[place[0]], place[1]), blade_periods, height_m)

    others = SteppedSweep(integration), RingStarts(integration, branches)
    most = round(affordable(branches, options) / integration.cost)
    worst = worst_of(
        curve, options, modal.n_blades, None if reason else integrate, reason, *others, blade_periods=most
    )
    if options.search == "thorough" and standard is not None and standard.amplitude_m > worst.amplitude_m:
        kept = {name: getattr(worst, name) for name in ("searched", "unresolved", "open_kinds", "not_counted")}
        worst = replace(standard, **kept)
    if worst.motion != "periodic" or worst.branch < 0 or options.method != "coupled":
        return worst
    solution = Solution.of(branches[worst.branch], worst.index)
    if options.stability == "ring":
        return worst if reason else _decided(worst, integration, solution)
    return _checked(worst, integration, solution) if modal.n_blades else worst


def _decided(worst: WorstMotion, integration: RingIntegration, solution: Solution) -> WorstMotion:
    """A worst motion; where the sign of its growth rate is within its error, as the ring decides in time."""
    ring, rate = integration.ring, solution.growth_rate
    if ring.blades_apart is not None or worst.ring_blades or rate * DOUBTFUL < -solution.omega:
        return worst
    patterns = RingPatterns(ring, integration.options, solution.omega, solution.displacement)
    error = patterns.rate_error(max(solution.nodal_diameter, 0))
    # more harmonics have the motion beside the frequency, as at a fold
    confirmed = math.isnan(error) and worst.truncation_error <= TRUNCATION_TOLERATED
    if rate + error < 0.0 or confirmed or abs(rate) * LONG < worst.frequency_hz:
        return worst
    undecided = f"its growth rate, {rate:.2g} 1/s, has an error of {error:.2g} 1/s" if error > 0.0 else NOT_KNOWN
    try:
        motion = integration.motion(solution, USUAL_PERIODS)
    except ArithmeticError as failure:
        said = f"undecided: {undecided}, and time integration failed: {failure}"
        return left_open(worst, Open("undecided", said))
    tolerance = max(SAME_AMPLITUDE, worst.truncation_error)
    near = motion.periodic and abs(motion.amplitude_m - motion.started_m) <= tolerance * motion.started_m
    if motion.stays or near:
        return worst
    said = (
        f"{undecided}, and the ring leaves it, within {motion.periods} periods for {height_said(motion.amplitude_m)}"
    )
    return left_open(replace(worst, unstable=motion.amplitude_m < worst.amplitude_m), Open("undecided", said))


def _checked(worst: WorstMotion, integration: RingIntegration, solution: Solution) -> WorstMotion:
    """A worst motion that was not looked at for all nodal diameters; marked where one of them grows."""
    ring, options = integration.ring, integration.options
    leading = RingPatterns(ring, options, solution.omega, solution.displacement).worst()
    along, at_worst = STABILITY[options.stability], f"against nodal diameters 0 to {(ring.modal.n_blades or 0) // 2}"
    worst = replace(worst, searched=worst.searched.replace(along, f"{along}, at the worst motion {at_worst}"))
    if not leading.grows(solution.omega):
        return worst
    k = leading.nodal_diameter
    said = f"unstable against nodal diameter {k}, the ring leaves it for a lower or a higher one, {LEAVES}"
    return left_open(replace(worst, unstable=True, nodal_diameter=k), Open("undecided", said))


def left_open(worst: WorstMotion, *reasons: Open) -> WorstMotion:
    """A worst motion that may be higher for further reasons, which come first; without any as it was."""
    said = "; ".join(filter(None, (*(reason.said for reason in reasons), worst.unresolved)))
    return replace(worst, unresolved=said, open_kinds=(*(reason.kind for reason in reasons), *worst.open_kinds))


def worst_of(
    curve: ResponseCurve,
    options: SolverOptions,
    n_blades: int | None,
    integrate: Integrate | None,
    reason: str = "",
    follow: Follow | None = None,
    mix: RingStarts | None = None,
    blade_periods: int | None = None,
) -> WorstMotion:
    """The worst motion with a given time integration; without one, `reason` says why.

    `blade_periods`: periods times blades that it may take; None: as many as the branches afford. In a flow the ring
    may leave any unstable solution, however low, for a high motion.
    """
    tolerance = max(options.harmonic_tolerance, TRUNCATION_TOLERATED)
    branches, doubtful = without_doubtful(branches_of(curve), tolerance)
    place = highest_persistent(branches)
    height = 0.0 if place is None else float(branches[place[0]].amplitude_m[place[1]])
    share = 0.0 if mix is not None and mix.in_flow else COULD_MATTER
    matter = [each for each in unstable_stretches(branches) if each.height_m >= share * height]
    departures: list[Departure] = []
    left_out: Sequence[UnstableStretch] = matter
    if integrate is not None:
        most = affordable(branches, options) if blade_periods is None else blade_periods
        search = DepartureSearch(branches, integrate, height, _tolerance(curve), most, follow, mix)
        for departure in search.departures(matter[:MOST_STRETCHES]):
            departures.append(departure)
            if departure.unbounded:  # nothing is higher, and what was found before is not followed
                departures = [replace(each, open=True) for each in departures]
                break
        else:
            small = mix is None or mix.random_starts  # else rings of few blades tell little
            if not small:
                departures += search.swept()
            departures += search.mixed()
            if small and (departures or options.search == "thorough"):
                departures += search.random()
                departures += search.swept()
            departures = search.followed(departures)
        left_out, reason = matter[MOST_STRETCHES:], f"the {MOST_STRETCHES} highest were integrated"
    said = searched(curve, options, n_blades, departures, bool(left_out))
    worst = replace(_highest(branches, departures, place, height), searched=said)
    heights = [stretch.height_m for stretch in left_out]
    worst = left_open(worst, *_too_short(worst), *unresolved(curve, departures, heights, reason, height, share))
    beside = [_not_counted(number, branches[number], departures) for number in doubtful if number != worst.branch]
    return _with_end(replace(worst, not_counted="; ".join(beside)), options)


def _not_counted(number: int, branch: ResponseCurve, departures: Sequence[Departure]) -> str:
    """What is said of a branch above the worst motion that more harmonics do not confirm."""
    integrated = any(each.place[0] == number and each.motion is not None for each in departures)
    why = "the ring does not stay on it" if integrated else "not checked by time integration"
    error = f"{100.0 * branch.truncation_error:.3g} %" if math.isfinite(branch.truncation_error) else "unknown"
    return f"detached branch {number}, up to {height_said(branch.amplitude_m.max())}: truncation error {error}, {why}"


def _with_end(worst: WorstMotion, options: SolverOptions) -> WorstMotion:
    """The worst motion, marked where it lies at an end of the frequency range: there it is a lower bound."""
    if not (worst.amplitude_m > 0.0 and at_range_end(worst.frequency_hz, options.frequency_hz)):
        return worst
    end = f"{worst.frequency_hz:.6g} Hz is an end of the frequency range, beyond which the response may rise further"
    return left_open(replace(worst, at_end=True), Open("end", end))


def affordable(branches: Sequence[ResponseCurve], options: SolverOptions) -> int:
    """Usual periods times blades that the time integration of a curve may take; the same on every machine."""
    coefficients = sum(int((2 * branch.kept_harmonics + 1).sum()) for branch in branches)
    most = min(max(EQUAL_COST * coefficients, LEAST_BUDGET), MOST_BUDGET)
    return round(options.effort * SEARCH_COST[options.search] * most)


def _why_not(options: SolverOptions) -> str:
    """Why there is no time integration; "" where there is."""
    if options.search == "off":
        return "switched off"
    return "the static part is frozen" if options.method == "static-first" else ""


def _tolerance(curve: ResponseCurve) -> float:
    """Relative difference of amplitudes of one motion in time and with the harmonics of the curve."""
    return float(np.nanmax([SAME_AMPLITUDE, min(curve.truncation_error, 1.0)]))


def _range(sweep: Sweep | None) -> dict[str, Any]:
    """Frequencies and heights of a motion that was followed."""
    if sweep is None:
        return {}
    return {"followed_hz": tuple(sweep.frequency_hz.tolist()), "followed_m": tuple(sweep.amplitude_m.tolist())}


def _too_short(worst: WorstMotion) -> Iterator[Open]:
    """That an irregular motion was not observed for long."""
    if worst.motion == IRREGULAR and worst.periods * worst.ring_blades < OBSERVED // 2:
        yield Open("effort", f"the irregular motion was followed for {worst.periods} periods only: {FURTHER}")


def _highest(
    branches: Sequence[ResponseCurve], departures: Sequence[Departure], place: Place | None, height_m: float
) -> WorstMotion:
    """The highest motion that the ring reached where it is above the highest stable solution, else that."""
    departure = max(departures, key=lambda one: (one.new_height, one.sweep is not None), default=None)
    if departure is not None and departure.motion is not None and departure.new_height > height_m:
        return _reached(departure, departure.motion)
    if place is None:
        return WorstMotion(float("nan"), float("nan"), -1, -1)
    holder = branches[place[0]]
    frequency_hz = float(holder.frequency_hz[place[1]])
    return WorstMotion(height_m, frequency_hz, *place, truncation_error=holder.truncation_error)


def _reached(departure: Departure, motion: RingMotion) -> WorstMotion:
    """The motion that the ring reached from an unstable solution."""
    branch, index = departure.place
    periodic = motion.periodic and motion.settled
    solved = departure.sweep is not None and departure.sweep.solved
    return WorstMotion(
        departure.new_height,
        departure.frequency_hz,
        branch if motion.stays or not periodic else -1,
        index,
        _kind(motion),
        0.0 if motion.stays else 1.0 - motion.lowest_m / motion.amplitude_m,
        motion.nodal_diameter,
        motion.n_blades,
        motion.persistence,
        1000.0 if periodic else recurrence(motion),
        **_range(departure.sweep),
        truncation_error=departure.sweep.truncation_error if departure.sweep and solved else motion.height_error,
    )


def _kind(motion: RingMotion) -> str:
    """What a motion in time is called."""
    if not (motion.periodic and motion.settled):
        return "quasi-periodic" if motion.settled else IRREGULAR
    return "periodic" if motion.repeats_after <= 1 else f"subharmonic 1:{motion.repeats_after}"
