"""What a run prints at its end: the table of its curves, and notes on errors, branches and bifurcations."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

from pipeline.scene.labels import prefixed, quantity
from pipeline.stages.request import RunOutcome
from pipeline.stages.respond import CurveResult

if TYPE_CHECKING:
    from rich.table import Table

TOLERATED = 0.05  # truncation error of a peak above which a run warns


def curve_table(outcome: RunOutcome) -> Table:
    """One row a curve: swept parameters, peak, its two error estimates, points and seconds."""
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
        "truncation\nerror",
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
    """A value without its unit, which the heading has."""
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
    """A relative error in percent; "unknown" where it is infinite: the peak disappears with more harmonics."""
    if math.isnan(error):
        return "-"
    if error > 0.5:
        return "over 50 %" if math.isfinite(error) else "unknown"
    return "< 0.01 %" if error < 1e-4 else f"{100.0 * error:.2g} %"


def harmonics_warning(outcome: RunOutcome) -> str:
    """A line on the curves whose truncation error is too large; "" where there are none."""
    errors = [c.facts.truncation_error for c in outcome.curves if c.facts is not None]
    lacking = [error for error in errors if error > TOLERATED]
    if not lacking:
        return ""
    return (
        f"{len(lacking)} of {len(outcome.curves)} curves: truncation error of the peak above "
        f"{100.0 * TOLERATED:.0f} % (largest estimate: {share(max(lacking))}); raise response.harmonics"
    )


def mode_notes(outcome: RunOutcome) -> list[str]:
    """A line on the modal truncation error of the reduced models, where it is known."""
    known = [model for model in outcome.models if model["modes_error"] is not None]
    if not known:
        return []
    modes = sorted({model["modes"] for model in known})
    number = str(modes[0]) if len(modes) == 1 else f"{modes[0]} to {modes[-1]}"
    frequency, receptance = (
        share(max(model[f"{name}_error"] for model in known)) for name in ("modes_frequency", "receptance")
    )
    return [
        f"{number} fixed-interface modes: modal truncation error {frequency} in natural frequencies, "
        f"{receptance} in receptances at a fixed frequency (estimated); mesh error: shroud verify"
    ]


def coriolis_notes(outcome: RunOutcome) -> list[str]:
    """A line on what leaving out the Coriolis forces costs, where a model is at speed."""
    errors = [model["coriolis_error"] for model in outcome.models]
    if None in errors:
        return ["Coriolis forces are neglected, effect not known: the reduced model has no dataset coriolis"]
    if not any(errors):
        return []
    return [f"Coriolis forces are neglected: they change natural frequencies in the range by {share(max(errors))}"]


def motion_notes(outcome: RunOutcome) -> list[str]:
    """A line for every detached branch, and for every curve with bifurcations other than folds."""
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
            notes.append(f"curve {index}: bifurcations other than folds: {found}")
    return notes
