"""What a search for the worst motion covered and what it did not, in sentences."""

from collections.abc import Iterable, Sequence

from nonlinear.options import SolverOptions
from nonlinear.response_curve import ResponseCurve
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.time_integrated import Departure

STABILITY = {
    "wave": "stability against perturbations with the symmetry of the wave only",
    "folds": "stability from folds only",
}
MOST_NAMED = 4  # frequencies in one sentence
NEVER = "mistuned blades, other residual tractions, motions that other initial conditions reach"


def searched(
    curve: ResponseCurve,
    options: SolverOptions,
    n_blades: int | None,
    departures: Sequence[Departure],
    lacking: bool = False,
) -> str:
    """What was searched (branches, stability, harmonics, time integration), and what was not, by semicolons."""
    parts = [_branches(curve, options), _stability(options, n_blades), f"harmonics 0 to {curve.harmonics}"]
    motions = [each.motion for each in departures if each.motion is not None]
    if motions:
        parts.append(_integrated(motions))
    else:
        parts.append("no time integration" if lacking or departures else "time integration not needed")
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
        return f"{text} ({left_out} solutions on further branches not followed)" if left_out else text
    return "main branch, no detached branch found" if options.detached else "main branch"


def _stability(options: SolverOptions, n_blades: int | None) -> str:
    if options.stability != "ring":
        return STABILITY[options.stability]
    if n_blades is None or n_blades < 2:
        return "stability"
    return f"stability against nodal diameters 0 to {n_blades // 2}"


def _integrated(motions: Sequence[RingMotion]) -> str:
    """Where time integration started, and with how many blades."""
    count, rings = len(motions), sorted({motion.n_blades for motion in motions})
    text = f"time integration from {count} unstable solution{'s' if count != 1 else ''}"
    if rings:
        text += f" (ring{'s' if len(rings) > 1 else ''} of {', '.join(map(str, rings))} blades)"
    stayed = sum(motion.stays for motion in motions)
    return f"{text}, {stayed} of which the ring did not leave" if stayed else text


def unresolved(curve: ResponseCurve, departures: Sequence[Departure], left_out: Sequence[float], reason: str) -> str:
    """What was left open; "" where nothing."""
    found = []
    if not curve.termination.complete:
        found.append("the main branch is incomplete")
    broken = sum(not branch.termination.complete for branch in curve.detached)
    if broken:
        found.append(f"{broken} detached branch{'es are' if broken > 1 else ' is'} incomplete")
    if left_out:
        count = len(left_out)
        found.append(
            f"{count} unstable part{'s' if count > 1 else ''} of the branches, up to {max(left_out):.3g} m, without "
            f"time integration ({reason})"
        )
    failed: dict[str, list[float]] = {}
    for each in departures:
        if each.failure:
            failed.setdefault(each.failure, []).append(each.frequency_hz)
    found += [f"time integration at {_list(places)} {failure}" for failure, places in failed.items()]
    unsettled = [each for each in departures if each.motion and not (each.motion.settled or each.falls)]
    restless = {each.frequency_hz: each.motion for each in unsettled if each.motion}
    if restless:
        periods = max(motion.periods for motion in restless.values())
        highest = max(motion.amplitude_m for motion in restless.values())
        found.append(f"not settled within {periods} periods at {_list(restless)}, up to {highest:.3g} m until then")
    return "; ".join(found)


def _list(frequencies_hz: Iterable[float]) -> str:
    """Frequencies by name, of many the first ones."""
    names = [f"{frequency:.5g} Hz" for frequency in frequencies_hz]
    if len(names) > MOST_NAMED:
        names = [*names[: MOST_NAMED - 1], f"{len(names) - MOST_NAMED + 1} others"]
    return ", ".join(names)
