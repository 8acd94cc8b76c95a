"""What friction leaves undetermined at the peaks, in words: notes of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pipeline.results.worst import MOST_NAMED
from pipeline.scene.labels import prefixed
from pipeline.stages.curve_summary import CurveSummary
from pipeline.stages.respond import CurveResult

_SAME = 1e-9  # of the peak: bounds that differ by less are one
ESTIMATED = "; an estimate with the friction cone: some tractions may lead a little beyond it"


def residual_notes(curves: Sequence[CurveResult]) -> list[str]:
    """The bounds of the peaks over residual tractions; without them, one line on the peaks that are not unique."""
    facts = {number: curve.facts for number, curve in enumerate(curves) if curve.facts is not None}
    notes = [
        f"curve {number}: {bounds_text(item)}{ESTIMATED if is_estimate(curves[number]) else ''}"
        for number, item in facts.items()
        if has_bounds(item)
    ]
    open_ = [number for number, item in facts.items() if item.free_nodes > 0 and not has_bounds(item)]
    failed = [number for number in open_ if curves[number].member.scene.response.residual_tractions == "bounds"]
    notes += [f"curve {number}: residual tractions: no bounds found" for number in failed]
    open_ = [number for number in open_ if number not in failed]
    if not open_:
        return notes
    numbers = f"{_listed(open_)}: " if len(curves) > 1 else ""
    return [
        *notes,
        f"{numbers}some contact nodes stick all the time along t1 or t2 at the peak, and friction leaves the static "
        'traction there undetermined; response.residual_tractions = "bounds" gives the lowest and the highest peak',
    ]


def has_bounds(facts: CurveSummary) -> bool:
    """Whether the bounds over residual tractions are known."""
    return math.isfinite(facts.residual_lowest_m) and math.isfinite(facts.residual_highest_m)


def is_estimate(curve: CurveResult) -> bool:
    """Whether the bounds are estimates only: with the friction cone the search is not exact."""
    return curve.member.scene.contact.law == "cone"


def bounds_text(facts: CurveSummary) -> str:
    """The bounds of a peak in words: of the displacement as a whole and of the vibration, each with its own mean."""
    low, high, peak = facts.residual_lowest_m, facts.residual_highest_m, facts.peak_amplitude_m
    least, most = facts.residual_least_vibration_m, facts.residual_most_vibration_m
    if max(high - low, most - least) <= _SAME * peak:
        return "residual tractions: no influence on the peak"
    factor, unit = prefixed(high, "m")

    def bound(value: float, **others: float) -> str:
        rest = ", ".join(f"{name} {other * factor:.4g}" for name, other in others.items())
        return f"{value * factor:.4g} {unit} ({rest})"

    lowest = bound(low, vibration=facts.residual_lowest_vibration_m, mean=facts.residual_lowest_static_m)
    highest = bound(high, vibration=facts.residual_highest_vibration_m, mean=facts.residual_highest_static_m)
    text = (
        f"residual tractions: displacement as a whole at the peak between {lowest} and {highest}, "
        f"{change(low, peak)} to {change(high, peak)}; its vibration alone "
    )
    if most - least <= _SAME * peak:
        return f"{text}is {most * factor:.4g} {unit} whatever the tractions"
    of_least = {
        "mean": facts.residual_least_vibration_static_m,
        "as a whole": facts.residual_least_vibration_displacement_m,
    }
    of_most = {
        "mean": facts.residual_most_vibration_static_m,
        "as a whole": facts.residual_most_vibration_displacement_m,
    }
    return f"{text}between {bound(least, **of_least)} and {bound(most, **of_most)}"


def change(value: float, reference: float) -> str:
    """A relative change in percent, with its sign."""
    relative = value / reference - 1.0 if reference > 0.0 else math.nan
    return "0 %" if abs(relative) < 5e-6 else f"{100.0 * relative:+.2g} %"


def _listed(numbers: Sequence[int]) -> str:
    """Numbers of curves, with ranges in place of long lists, or how many they are."""
    if len(numbers) > 2 and list(numbers) == list(range(numbers[0], numbers[-1] + 1)):
        return f"curves {numbers[0]} to {numbers[-1]}"
    if len(numbers) > MOST_NAMED:
        return f"{len(numbers)} curves"
    return f"curve{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"
