"""Cells and words that screen, `shroud info` and report share: values, errors, static contact, bounds."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipeline.results.worst import MOST_NAMED, share
from pipeline.scene.labels import prefixed, quantity, value_label
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.stages.curve.respond import CurveResult

if TYPE_CHECKING:
    from rich.table import Table

    from nonlinear.response_curve import StaticContact


def branch_remarks(branch: Mapping[str, Any]) -> str:
    """Remarks on an entry of `detached` in summary.json, each after a comma: how it was found where it was carried,
    and between which values of swept parameters it ends.
    """
    return "".join(f", {remark}" for remark in _remarks(branch))


def _remarks(branch: Mapping[str, Any]) -> Iterator[str]:
    if branch["origin"].startswith("carried"):
        yield branch["origin"]
    for end in branch["born_between"]:
        key = end["parameter"]
        yield f"ends between {value_label(key, end['exists'])} and {quantity(key).value(end['missing'])}"


_SAME = 1e-9  # of the peak: bounds that differ by less are one


def has_bounds(facts: CurveSummary) -> bool:
    """Whether the bounds over residual tractions are known."""
    return math.isfinite(facts.residual_lowest_m) and math.isfinite(facts.residual_highest_m)


def is_estimate(curve: CurveResult) -> bool:
    """Whether the bounds are estimates only: with the friction cone the search is not exact."""
    return "cone" in curve.member.scene.laws


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


def listed(numbers: Sequence[int]) -> str:
    """Numbers of curves, with ranges in place of long lists, or how many they are."""
    if len(numbers) > 2 and list(numbers) == list(range(numbers[0], numbers[-1] + 1)):
        return f"curves {numbers[0]} to {numbers[-1]}"
    if len(numbers) > MOST_NAMED:
        return f"{len(numbers)} curves"
    return f"curve{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"


TOLERATED_SAMPLING = 0.01  # the same of the sampling error of its amplitude or frequency


def amplitude_scale(curves: Sequence[CurveResult]) -> tuple[float, str]:
    """Factor and unit for the peaks and the worst motions of the curves."""
    facts = [c.facts for c in curves if c.facts is not None]
    heights = [height for f in facts for height in (f.peak_amplitude_m, f.worst_amplitude_m)]
    return prefixed(max((h for h in heights if math.isfinite(h)), default=0.0), "m")


def is_sampled(curve: CurveResult) -> bool:
    """Whether the contact force of a curve is sampled in time."""
    return curve.member.scene.contact.integration == "sampled"


def sampling_errors(curves: Sequence[CurveResult]) -> dict[int, tuple[float, float]]:
    """Sampling errors of the peak's amplitude and frequency of the sampled curves, by number of the curve."""
    return {
        number: (curve.facts.sampling_error, curve.facts.sampling_frequency_error)
        for number, curve in enumerate(curves)
        if curve.facts is not None and is_sampled(curve) and not math.isnan(curve.facts.sampling_error)
    }


def bare_value(key: str, value: Any) -> str:
    """A value without its unit, which the heading has."""
    named = quantity(key)
    return named.value(value).replace(f" {named.unit}", "") if named.unit else named.value(value)


def short_value(key: str, value: Any) -> str:
    """A value without its unit, a number with four digits: sampled values have many."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value * quantity(key).factor:.4g}" if number else bare_value(key, value)


def has_static_load(curve: CurveResult) -> bool:
    """Whether rotation or other static loads deform the blade of a curve."""
    load = curve.member.scene.load
    return bool(load.speed_rpm or load.force or load.pressure or load.temperature)


def static_cells(static: StaticContact | None) -> tuple[str, str, str]:
    """Static normal force of an interface, N, its open share, and the range of v, um (above 0 pressed together)."""
    if static is None:
        return "-", "-", "-"
    low, high = (f"{1e6 * v:.3g}" for v in (static.lowest_m, static.highest_m))
    span = low if low == high else f"{low} to {high}"
    return f"{static.force_n:.4g}", f"{100.0 * static.open_share:.3g} %", span


def static_text(static: StaticContact) -> str:
    """The static contact of an interface in words."""
    force, share_open, span = static_cells(static)
    opened = ", closed at rest and opened by static forces" * static.opened
    return f"normal force {force} N, {share_open} open, v = {span} µm{opened}"


def static_said(curve: CurveResult) -> str:
    """The static contact of a curve in words, by interface; "" where it is not known."""
    known = {} if curve.facts is None else curve.facts.static_contacts
    if not known:
        return ""
    speed = curve.member.scene.load.speed_rpm
    at = f"at {speed:g} rev/min" if speed else "at rest"
    parts = (f"{name}: {static_text(static)}" if name else static_text(static) for name, static in known.items())
    return f"static contact {at}, {'; '.join(parts)} (v < 0: gap)"


def truncation_cell(error: float, branch: str) -> str:
    """A truncation error in percent, with a word where the peak detaches or is lost with more harmonics."""
    return share(error) if branch in ("", "kept") else f"{share(error)} ({branch})"


def measured_errors(models: Sequence[Mapping[str, Any]]) -> tuple[float, float] | None:
    """Largest modal truncation error of receptances and of natural frequencies; None: not known."""
    known = [model for model in models if model.get("modes_error") is not None]
    if not known:
        return None
    receptance, frequency = (
        max(model[f"{name}_error"] for model in known) for name in ("receptance", "modes_frequency")
    )
    return receptance, frequency


def screen_table(
    headings: Sequence[str], rows: Iterable[Sequence[str] | None], left: Collection[str] = (), **shape: Any
) -> Table:
    """A table for a terminal, in which the columns `left` start at the left; None in place of a row is a line."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(header_style="bold", pad_edge=False, **shape)
    for name in headings:
        table.add_column(escape(name), justify="left" if name in left else "right")
    for row in rows:
        if row is None:
            table.add_section()
        else:
            table.add_row(*map(escape, row))
    return table
