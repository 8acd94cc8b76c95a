"""The worst motion of a response curve: the highest that can persist on any of its branches.

A motion persists if it is stable. The highest stable solution is the first candidate. Where no stable solution is as
high as an unstable one, the ring does something else, which may be higher than both: time integration of the ring,
started from the unstable solution with a disturbance in its worst pattern, tells what.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nonlinear.branches.peaks import at_range_end
from nonlinear.branches.worst_motion import WorstMotion
from nonlinear.contact.parameters import ContactParameters
from nonlinear.options import TRUNCATION_TOLERATED, Excitation, SolverOptions
from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import (
    Place,
    UnstableStretch,
    branches_of,
    highest_persistent,
    unstable_stretches,
    without_doubtful,
)
from nonlinear.worst_motion.ring_integration import Integrated, RingIntegration, Solution
from nonlinear.worst_motion.search_statement import searched, unresolved
from nonlinear.worst_motion.time_integrated import SAME_AMPLITUDE, Departure, DepartureSearch, Integrate
from rom import RingModes

Problem = tuple[RingModes, ContactParameters, Excitation, SolverOptions]
COULD_MATTER = (
    0.3  # of the highest motion known: lower unstable solutions are left alone; see docs/developers/method.md
)
MOST_STRETCHES = 6  # unstable stretches that time integration starts from


def find_worst_motion(problem: Problem, curve: ResponseCurve) -> WorstMotion | None:
    """The highest motion that can persist on any branch of a curve.

    Parameters
    ----------
    problem : tuple
        Modal model, contact, excitation and options of the curve, as for `forced_response`.
    curve : ResponseCurve
        The solved curve with its detached branches.

    Returns
    -------
    WorstMotion or None
        None for a curve without points. Its amplitude is NaN where no solution is stable and there is no time
        integration.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import find_worst_motion
    >>> find_worst_motion((modal, contact, excitation, options), curve).motion
    'periodic'
    """
    if curve.points == 0:
        return None
    modal, contact, excitation, options = problem
    branches = branches_of(curve)
    integration = RingIntegration(Ring(modal, contact, excitation, options.output), options)

    def integrate(place: Place, blade_periods: int, height_m: float) -> Integrated:
        return integration(Solution.of(branches[place[0]], place[1]), blade_periods, height_m)

    reason = _why_not(options)
    return worst_of(curve, options, modal.n_blades, None if reason else integrate, reason)


def worst_of(
    curve: ResponseCurve, options: SolverOptions, n_blades: int | None, integrate: Integrate | None, reason: str = ""
) -> WorstMotion:
    """The worst motion with a given time integration; without one, `reason` says why."""
    tolerance = max(options.harmonic_tolerance, TRUNCATION_TOLERATED)
    branches, doubtful = without_doubtful(branches_of(curve), tolerance)
    place = highest_persistent(branches)
    height = 0.0 if place is None else float(branches[place[0]].amplitude_m[place[1]])
    matter = [each for each in unstable_stretches(branches) if each.height_m >= COULD_MATTER * height]
    departures: list[Departure] = []
    left_out: Sequence[UnstableStretch] = matter
    if integrate is not None:
        search = DepartureSearch(branches, integrate, height, _tolerance(curve), options.blade_periods)
        departures = list(search.departures(matter[:MOST_STRETCHES]))
        left_out, reason = matter[MOST_STRETCHES:], f"the {MOST_STRETCHES} highest were integrated"
    spoken: dict[str, Any] = {
        "searched": searched(curve, options, n_blades, departures, bool(left_out)),
        "unresolved": unresolved(curve, departures, [stretch.height_m for stretch in left_out], reason),
    }
    found = max(departures, key=lambda departure: departure.new_height, default=None)
    if found is not None and found.motion is not None and found.new_height > height:
        worst = _reached(found, found.motion, spoken)
    elif place is None:
        worst = WorstMotion(float("nan"), float("nan"), -1, -1, **spoken)
    else:
        holder = branches[place[0]]
        error = holder.truncation_error
        worst = WorstMotion(height, float(holder.frequency_hz[place[1]]), *place, **spoken, truncation_error=error)
    beside = [_not_counted(number, branches[number], departures) for number in doubtful if number != worst.branch]
    return _with_end(replace(worst, not_counted="; ".join(beside)), options)


def _not_counted(number: int, branch: ResponseCurve, departures: Sequence[Departure]) -> str:
    """What is said of a branch above the worst motion that more harmonics do not confirm."""
    integrated = any(each.place[0] == number and each.motion is not None for each in departures)
    why = "the ring does not stay on it" if integrated else "not checked by time integration"
    error = f"{100.0 * branch.truncation_error:.3g} %" if math.isfinite(branch.truncation_error) else "unknown"
    return f"detached branch {number}, up to {branch.amplitude_m.max():.4g} m: truncation error {error}, {why}"


def _with_end(worst: WorstMotion, options: SolverOptions) -> WorstMotion:
    """The worst motion, marked where it lies at an end of the frequency range: there it is a lower bound."""
    if not (worst.amplitude_m > 0.0 and at_range_end(worst.frequency_hz, options.frequency_hz)):
        return worst
    end = f"{worst.frequency_hz:.6g} Hz is an end of the frequency range, beyond which the response may rise further"
    return replace(worst, at_end=True, unresolved="; ".join(filter(None, (end, worst.unresolved))))


def _why_not(options: SolverOptions) -> str:
    """Why there is no time integration; "" where there is."""
    if not options.time_integration:
        return "switched off"
    return "the static part is frozen" if options.method == "static-first" else ""


def _tolerance(curve: ResponseCurve) -> float:
    """Relative difference of amplitudes of one motion in time and with the harmonics of the curve."""
    return float(np.nanmax([SAME_AMPLITUDE, min(curve.truncation_error, 1.0)]))


def _reached(departure: Departure, motion: RingMotion, spoken: dict[str, Any]) -> WorstMotion:
    """The motion that the ring reached from an unstable solution."""
    branch, index = departure.place
    periodic = motion.periodic and motion.settled
    return WorstMotion(
        departure.new_height,
        departure.frequency_hz,
        branch if motion.stays or not periodic else -1,
        index,
        "periodic" if periodic else "quasi-periodic",
        0.0 if motion.stays else 1.0 - motion.lowest_m / motion.amplitude_m,
        motion.nodal_diameter,
        motion.n_blades,
        **spoken,
        truncation_error=0.0,
    )
