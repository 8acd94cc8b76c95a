"""The worst motion of a response curve: the highest that can persist on any of its branches.

A motion persists if it is stable. The highest stable solution is the first candidate. Where no stable solution is as
high as an unstable one, the ring does something else, which may be higher than both: time integration of the ring,
started from the unstable solution with a disturbance in its worst pattern, tells what.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from nonlinear.branches.worst_motion import WorstMotion
from nonlinear.contact.parameters import ContactParameters
from nonlinear.options import Excitation, SolverOptions
from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import (
    Place,
    UnstableStretch,
    branches_of,
    highest_persistent,
    unstable_stretches,
)
from nonlinear.worst_motion.ring_integration import Integrated, RingIntegration, Solution
from nonlinear.worst_motion.search_statement import searched, unresolved
from nonlinear.worst_motion.time_integrated import SAME_AMPLITUDE, Departure, DepartureSearch, Integrate
from rom import RingModes

Problem = tuple[RingModes, ContactParameters, Excitation, SolverOptions]
COULD_MATTER = 0.3  # of the highest motion known: lower unstable solutions are left alone; see docs/method.md
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
    """The worst motion with a given time integration; without one, `reason` says why.

    Parameters
    ----------
    curve : ResponseCurve
        The solved curve with its detached branches, with points.
    options : SolverOptions
        Options of the curve.
    n_blades : int or None
        Number of blades of the ring.
    integrate : callable or None
        Integrates the ring from a point, given as branch and index.
    reason : str
        Why there is no time integration.
    """
    branches = branches_of(curve)
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
        return _reached(found, found.motion, spoken)
    if place is None:
        return WorstMotion(float("nan"), float("nan"), -1, -1, **spoken)
    frequency_hz = float(branches[place[0]].frequency_hz[place[1]])
    return WorstMotion(height, frequency_hz, *place, **spoken)


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
    )
