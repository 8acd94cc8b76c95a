"""Tables for people: the curves of a run and the contents of a file."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

from pipeline.scene.labels import prefixed, quantity
from pipeline.stages.request import RunOutcome
from pipeline.stages.respond import CurveResult

if TYPE_CHECKING:
    from rich.table import Table

TOLERATED = 0.05  # estimated relative error of a peak by the harmonics left out, above which people are told


def curve_table(outcome: RunOutcome) -> Table:
    """One line for every curve: swept parameters, peak, points, seconds, and what went wrong."""
    from rich.table import Table

    swept = list(outcome.curves[0].member.parameters) if outcome.curves else []
    table = Table(header_style="bold", pad_edge=False)
    table.add_column("curve", justify="right")
    for key in swept:
        table.add_column(quantity(key).axis(), justify="right")
    heights = [c.facts.peak_amplitude_m for c in outcome.curves if c.facts is not None]
    factor, unit = prefixed(max((h for h in heights if math.isfinite(h)), default=0.0), "m")
    for heading in (
        "peak\n[Hz]",
        f"peak\n[{unit}]",
        "harmonics",
        "their\nerror",
        "energy\nerror",
        "points",
        "seconds",
    ):
        table.add_column(heading, justify="right")
    for index, curve in enumerate(outcome.curves):
        values = [bare_value(key, value) for key, value in curve.member.parameters.items()]
        table.add_row(str(index), *values, *_numbers(curve, factor))
    return table


def bare_value(key: str, value: Any) -> str:
    """A value without its unit, which stands in the heading."""
    named = quantity(key)
    return named.value(value).replace(f" {named.unit}", "") if named.unit else named.value(value)


def _numbers(curve: CurveResult, factor: float) -> list[str]:
    facts = curve.facts
    if facts is None:
        return ["failed", "-", "-", "-", "-", "0", "-"]
    known = math.isfinite(facts.peak_frequency_hz)
    frequency = f"{facts.peak_frequency_hz:.6g}" if known else "-"
    amplitude = f"{facts.peak_amplitude_m * factor:.4g}" if known else "-"
    if known and not facts.peak_located:
        frequency += " (end of range)"
    mark = "" if facts.complete else " (incomplete)"
    energy = f"{facts.energy_error:.0e}" if math.isfinite(facts.energy_error) else "-"
    return [
        frequency,
        amplitude,
        str(facts.harmonics),
        share(facts.truncation_error),
        energy,
        f"{facts.points}{mark}",
        f"{facts.seconds:.2f}",
    ]


def share(error: float) -> str:
    """An estimated relative error as people read it; unknown where the peak gets lost with more harmonics."""
    if math.isnan(error):
        return "-"
    if error > 0.5:
        return "over 50 %" if math.isfinite(error) else "unknown"
    return "< 0.01 %" if error < 1e-4 else f"{100.0 * error:.2g} %"


def harmonics_warning(outcome: RunOutcome) -> str:
    """A line that says which curves want more harmonics; empty where all have enough."""
    errors = [c.facts.truncation_error for c in outcome.curves if c.facts is not None]
    lacking = [error for error in errors if error > TOLERATED]
    if not lacking:
        return ""
    return (
        f"{len(lacking)} of {len(outcome.curves)} curves: the harmonics kept may put the peak wrong by more than "
        f"{100.0 * TOLERATED:.0f} % (largest estimate: {share(max(lacking))}); raise response.harmonics"
    )


def mode_notes(outcome: RunOutcome) -> list[str]:
    """A line that says what the modes left out change in the reduced models, where it is known."""
    known = [model for model in outcome.models if model["modes_error"] is not None]
    if not known:
        return []
    kept = sorted({model["modes"] for model in known})
    number = str(kept[0]) if len(kept) == 1 else f"{kept[0]} to {kept[-1]}"
    frequency, receptance = (
        share(max(model[f"{name}_error"] for model in known)) for name in ("modes_frequency", "receptance")
    )
    return [
        f"{number} fixed-interface modes kept; those left out change natural frequencies by {frequency}, "
        f"receptances at a fixed frequency by {receptance} (estimated); the mesh: shroud verify"
    ]


def motion_notes(outcome: RunOutcome) -> list[str]:
    """Lines that say which curves have detached branches, and which lose their stability other than at a fold."""
    notes = []
    for index, curve in enumerate(outcome.curves):
        if curve.facts is None:
            continue
        for branch in curve.facts.detached:
            factor, unit = prefixed(branch["peak_amplitude_m"], "m")
            height = f"{branch['peak_amplitude_m'] * factor:.4g} {unit}"
            span = f"{branch['from_hz']:.6g} to {branch['to_hz']:.6g} Hz"
            stable = "" if branch["stable_points"] else ", unstable"
            notes.append(f"curve {index}: a detached branch, {span}, up to {height}{stable}")
        kinds = Counter(item["kind"] for item in curve.facts.bifurcations if item["kind"] != "fold")
        if kinds:
            found = ", ".join(f"{kind} ({count})" for kind, count in kinds.items())
            notes.append(f"curve {index}: the periodic motion loses its stability other than at a fold: {found}")
    return notes
