"""What a run prints at its end: the table of its curves, and notes on errors, branches, bifurcations and friction."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nonlinear import TRUNCATION_TOLERATED as TOLERATED
from pipeline.results.worst import END_MARK, MOST_NAMED, branch_said, share, worst_cells
from pipeline.scene.labels import prefixed, quantity, value_label
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.stages.curve.respond import CurveResult
from pipeline.stages.request import RunOutcome

if TYPE_CHECKING:
    from rich.table import Table


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


TOLERATED_SAMPLING = 0.01  # the same of the sampling error of its amplitude or frequency


def curve_table(outcome: RunOutcome, most: int | None = None) -> Table:
    """One row a curve: swept parameters, worst motion, peak of the main branch, static contact, errors, seconds.

    `most` is the number of curves, the first ones, that have a row; None: all.
    """
    from rich.markup import escape
    from rich.table import Table

    swept = list(outcome.curves[0].member.parameters) if outcome.curves else []
    table = Table(header_style="bold", pad_edge=False)
    table.add_column("curve", justify="right")
    for key in swept:
        table.add_column(escape(quantity(key).axis()), justify="right")
    factor, unit = amplitude_scale(outcome.curves)
    sampled = any(is_sampled(c) for c in outcome.curves)
    errors = ("trunc.\nerror", *(("sampling\nerror",) * sampled), "energy\nerror")
    worst = ("worst\n[Hz]", f"worst\n[{unit}]", "on\nbranch")
    peak = ("main\npeak [Hz]", f"main\npeak [{unit}]")
    loaded = any(has_static_load(c) for c in outcome.curves)  # otherwise it follows from the interference
    static = ("static\nforce [N]", "open", "static\nv [µm]") if loaded else ()
    for heading in (*worst, *peak, *static, "har-\nmonics", *errors, "points", "seconds"):
        table.add_column(escape(heading), justify="right")
    for index, curve in enumerate(outcome.curves[:most]):
        text = bare_value if most is None else short_value
        values = [text(key, value) for key, value in curve.member.parameters.items()]
        table.add_row(str(index), *values, *_numbers(curve, factor, sampled, loaded))
    return table


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


def _numbers(curve: CurveResult, factor: float, sampled: bool, loaded: bool) -> list[str]:
    """Cells of a curve.

    With `sampled` there is one of the sampling error, the larger of amplitude and frequency; with `loaded` those of
    the static contact.
    """
    facts = curve.facts
    if facts is None:
        return ["failed", *(["-"] * (6 + 3 * loaded + sampled)), "-", "0", "-"]
    known = math.isfinite(facts.peak_frequency_hz)
    frequency = f"{facts.peak_frequency_hz:.6g}" if known else "-"
    amplitude = f"{facts.peak_amplitude_m * factor:.4g}" if known else "-"
    if known and not facts.peak_located:
        frequency += END_MARK
    mark = "" if facts.complete else " (incomplete)"
    energy = f"{facts.energy_error:.0e}" if math.isfinite(facts.energy_error) else "-"
    return [
        *worst_cells(facts, factor),
        frequency,
        amplitude,
        *(static_cells(facts) if loaded else ()),
        str(facts.harmonics),
        truncation_cell(facts.truncation_error, facts.truncation_branch),
        *([_sampling(curve)] * sampled),
        energy,
        f"{facts.points}{mark}",
        f"{facts.seconds:.2f}",
    ]


def static_cells(facts: CurveSummary) -> tuple[str, str, str]:
    """Static normal force of a face, N, its open share, and the range of v, um (above 0 pressed together)."""
    if not math.isfinite(facts.static_force_n):
        return "-", "-", "-"
    low, high = (f"{1e6 * v:.3g}" for v in (facts.static_lowest_m, facts.static_highest_m))
    span = low if low == high else f"{low} to {high}"
    return f"{facts.static_force_n:.4g}", f"{100.0 * facts.static_open_share:.3g} %", span


def static_said(curve: CurveResult) -> str:
    """The static contact of a curve in words; "" where it is not known."""
    facts = curve.facts
    if facts is None or not math.isfinite(facts.static_force_n):
        return ""
    force, share_open, span = static_cells(facts)
    speed = curve.member.scene.load.speed_rpm
    at = f"at {speed:g} rev/min" if speed else "at rest"
    return f"static contact {at}: {force} N on a face, {share_open} of it open, v = {span} µm (below 0: gap)"


def opened_warning(outcome: RunOutcome) -> str:
    """A line on the curves whose contacts are closed at rest and open in static equilibrium; "" without any."""
    opened = [n for n, c in enumerate(outcome.curves) if c.facts is not None and c.facts.static_opened]
    if not opened:
        return ""
    first = opened[0]
    return (
        f"{len(opened)} of {len(outcome.curves)} curves: nodes that are closed at rest are open before the blade "
        f"vibrates; centrifugal load and other static forces take the faces apart. Curve {first}: "
        f"{static_said(outcome.curves[first])}"
    )


def _sampling(curve: CurveResult) -> str:
    assert curve.facts is not None
    worst = max(curve.facts.sampling_error, curve.facts.sampling_frequency_error)
    return share(worst) if is_sampled(curve) else "none"


def truncation_cell(error: float, branch: str) -> str:
    """A truncation error in percent, with a word where the peak detaches or is lost with more harmonics."""
    return share(error) if branch in ("", "kept") else f"{share(error)} ({branch})"


def branch_warning(outcome: RunOutcome) -> str:
    """A line on the curves whose peak is not known to stay on its branch with more harmonics; "" without any."""
    branches = [c.facts.truncation_branch for c in outcome.curves if c.facts is not None]
    detached, lost = branches.count("detached"), branches.count("lost")
    parts = [
        f"{detached} of {len(outcome.curves)} curves: with more harmonics the peak lies on a detached branch, and "
        "the truncation error compares with what the main branch reaches (detached)",
        f"{lost} of {len(outcome.curves)} curves: the peak could not be followed to more harmonics on its branch, "
        "and the truncation error may be larger than estimated (lost)",
    ]
    said = "; ".join(part for part, count in zip(parts, (detached, lost), strict=True) if count)
    return f"{said}; raise response.harmonics" if said else ""


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


def sampling_warning(outcome: RunOutcome) -> str:
    """A line on the curves whose sampling error is too large; "" where there are none."""
    lacking = [pair for pair in sampling_errors(outcome.curves).values() if max(pair) > TOLERATED_SAMPLING]
    if not lacking:
        return ""
    amplitude, frequency = (share(max(errors)) for errors in zip(*lacking, strict=True))
    return (
        f"{len(lacking)} of {len(outcome.curves)} curves: sampling error of the peak above "
        f"{100.0 * TOLERATED_SAMPLING:.0f} % (largest estimates: {amplitude} of the amplitude, {frequency} of the "
        'frequency); raise contact.samples or set contact.integration = "exact"'
    )


def measured_errors(outcome: RunOutcome) -> tuple[float, float] | None:
    """Largest modal truncation error of receptances and of natural frequencies; None: not known."""
    known = [model for model in outcome.models if model["modes_error"] is not None]
    if not known:
        return None
    receptance, frequency = (
        max(model[f"{name}_error"] for model in known) for name in ("receptance", "modes_frequency")
    )
    return receptance, frequency


def mode_notes(outcome: RunOutcome) -> list[str]:
    """A line on the modal truncation error of the reduced models, where it is known."""
    known = [model for model in outcome.models if model["modes_error"] is not None]
    if not known:
        return []
    modes = sorted({model["modes"] for model in known})
    number = str(modes[0]) if len(modes) == 1 else f"{modes[0]} to {modes[-1]}"
    measured = measured_errors(outcome)
    assert measured is not None
    receptance, frequency = map(share, measured)
    on_a_mesh = any(model["mesh"] is not None and "wave_error" not in model for model in known)
    return [
        f"{number} fixed-interface modes: modal truncation error {frequency} in natural frequencies, "
        f"{receptance} in receptances at a fixed frequency (estimated)" + "; mesh error: shroud verify" * on_a_mesh
    ]


def wave_notes(outcome: RunOutcome) -> list[str]:
    """A line on the error of the motions kept of a disk's cut faces, where there are any."""
    known = [model for model in outcome.models if "wave_error" in model]
    if not known:
        return []
    worst = max(known, key=lambda model: float(model["wave_error"]))
    waves = ", ".join(str(number) for number in sorted(worst["wave_error_at"]))
    return [
        f"disk: {worst['cut_face_motions']} motions of a cut face; largest error of six frequencies "
        f"{share(worst['wave_error'])}, against the whole mesh at nodal diameters {waves}"
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
            stable = "" if branch["stable_points"] else ", unstable"
            notes.append(f"curve {index}: a detached branch, {branch_said(branch)}{stable}{branch_remarks(branch)}")
        kinds = Counter(item["kind"] for item in curve.facts.bifurcations if item["kind"] != "fold")
        if kinds:
            found = ", ".join(f"{kind} ({count})" for kind, count in kinds.items())
            notes.append(f"curve {index}: bifurcations other than folds: {found}")
    return notes
