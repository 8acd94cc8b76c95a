"""What a reader wants first: what was computed, the worst motion, the best value, and how sure this is.

The error budget lists every known error with its size, a verdict and its meaning. Tables of many curves stay readable
as quantiles and as the best and the worst curves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from nonlinear.options import TRUNCATION_TOLERATED as TOLERATED
from pipeline.figures.data import PlottedCurve, SweepKey, SweepPoint, sweep_keys
from pipeline.report.report_source import ReportSource
from pipeline.results.best_design import (
    BestDesign,
    DesignPoint,
    best_design,
    compares_designs,
    condition_keys,
    values_label,
)
from pipeline.results.certainty import error_sentences, has_coriolis, search_sentences
from pipeline.results.overview import MOST_ROWS
from pipeline.results.tables import (
    TOLERATED_SAMPLING,
    amplitude_scale,
    change,
    has_bounds,
    is_estimate,
    sampling_errors,
)
from pipeline.results.worst import NOTICEABLE, motion_said, share, unstable_peaks, with_unit
from pipeline.scene.fields import NOTHING_MORE
from pipeline.scene.labels import quantity
from pipeline.scene.schema import MEANINGS
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.stages.curve.respond import CurveResult

ENDS = 8  # rows of the lowest and of the highest worst motions, and of curves that failed, where there are more
MOST_NOTES = 12
LEVELS = (0.0, 0.1, 0.5, 0.9, 1.0)


@dataclass(frozen=True)
class QuantileRow:
    """A quantity and its quantiles over the curves, at `LEVELS`, as text."""

    name: str
    values: tuple[str, ...]


def shown_rows(points: Sequence[SweepPoint], curves: Sequence[CurveResult]) -> list[int]:
    """Numbers of the curves with a row: all, or the lowest and the highest worst motions and those that failed."""
    if len(curves) <= MOST_ROWS:
        return list(range(len(curves)))
    order = sorted((p for p in points if math.isfinite(p.facts.height)), key=lambda p: p.facts.height)
    failed = [number for number, curve in enumerate(curves) if not curve.complete]
    return [*dict.fromkeys([*(p.index for p in [*order[:ENDS], *order[-ENDS:]]), *failed[:ENDS]])]


def quantile_rows(curves: Sequence[CurveResult]) -> list[QuantileRow]:
    """Quantiles over all curves; none where every curve has a row."""
    if len(curves) <= MOST_ROWS:
        return []
    facts = [curve.facts for curve in curves if curve.facts is not None]
    factor, unit = amplitude_scale(curves)
    columns: list[tuple[str, Callable[[CurveSummary], float], Callable[[float], str]]] = [
        (f"worst motion [{unit}]", lambda f: f.worst_amplitude_m * factor, "{:.4g}".format),
        ("worst motion [Hz]", lambda f: f.worst_frequency_hz, "{:.5g}".format),
        (f"peak of main branch [{unit}]", lambda f: f.peak_amplitude_m * factor, "{:.4g}".format),
        ("peak of main branch [Hz]", lambda f: f.peak_frequency_hz, "{:.5g}".format),
        ("truncation error", lambda f: f.truncation_error, share),
        ("energy error", lambda f: f.energy_error, "{:.0e}".format),
        ("seconds", lambda f: f.seconds, "{:.2f}".format),
    ]
    rows = []
    for name, value, text in columns:
        known = np.array([value(each) for each in facts])
        known = known[np.isfinite(known)]
        if known.size:
            rows.append(QuantileRow(name, tuple(text(float(q)) for q in np.quantile(known, LEVELS))))
    return rows


def first_few(lines: Sequence[str], most: int = MOST_NOTES) -> list[str]:
    """The first lines, and how many more there are."""
    rest = len(lines) - most
    return list(lines) if rest <= 0 else [*lines[:most], f"and {rest} more"]


def listed(numbers: Sequence[Any], most: int = 12) -> str:
    """Numbers in a sentence, at most a dozen."""
    shown = ", ".join(map(str, numbers[:most]))
    return shown if len(numbers) <= most else f"{shown} and {len(numbers) - most} more"


SMALL, FAIR, LARGE, UNKNOWN = "small", "noticeable", "large", "not known"

EXPONENTS = (
    "Floquet exponents tell whether a small perturbation of the motion dies out. The motion of an unstable (dashed) "
    "part of a curve does not persist: the worst motion is sought among those that do."
)
STABILITY = {
    "ring": f"{EXPONENTS} Perturbations of every nodal diameter that the ring allows are included.",
    "wave": f"{EXPONENTS} Only perturbations with the inter-blade phase of the travelling wave are included.",
    "folds": "From folds only: a curve counts as unstable between two folds; other bifurcations are not detected.",
}


@dataclass(frozen=True)
class ErrorRow:
    """One error: the largest value found, a verdict, what it means and what reduces it."""

    name: str
    found: str
    verdict: str
    meaning: str


def error_rows(source: ReportSource, shown: Sequence[PlottedCurve]) -> list[ErrorRow]:
    """Truncation, sampling, energy and modal truncation error, contact dofs, mesh, Coriolis forces, stability."""
    peaks = [_truncation(source), _sampling(source), _energy(source)]
    return [*peaks, *_residual(source), *_model(source), *_coriolis(source), _stability(source, shown)]


def _largest(source: ReportSource, error_of: Callable[[CurveSummary], float]) -> tuple[float, str] | None:
    """The largest error of a kind over the curves, and of which of several it is; None where none is known."""
    errors = [(error_of(c.facts), number) for number, c in enumerate(source.curves) if c.facts is not None]
    known = [each for each in errors if not math.isnan(each[0])]
    if not known:
        return None
    error, number = max(known, key=itemgetter(0))
    return error, f", curve {number}" if len(source.curves) > 1 else ""


def _truncation(source: ReportSource) -> ErrorRow:
    meaning = (
        "Estimated error of the peak from the neglected harmonics: the peak is solved again with more of them, and "
        "so is the way to it: with more harmonics a peak may lie on a detached branch. "
        'Where it is large, raise response.harmonics or set it to "auto".'
    )
    worst = _largest(source, lambda facts: facts.truncation_error)
    if worst is None:
        return ErrorRow("truncation error", "not estimated", UNKNOWN, meaning)
    error, where = worst
    found = f"{share(error)} of the peak{where if error > 1e-4 else ''}"
    return ErrorRow("truncation error", found, _verdict(error, 0.01, TOLERATED), meaning)


def _sampling(source: ReportSource) -> ErrorRow:
    meaning = (
        "Estimated error of the peak from the time samples of the contact force: the peak is solved again with "
        'event-driven integration. Where it is large, raise contact.samples or set contact.integration = "exact".'
    )
    known = sampling_errors(source.curves)
    if not known:
        exact = source.first.contact.integration == "exact"
        found, verdict = ("none: no samples", SMALL) if exact else ("not estimated", UNKNOWN)
        return ErrorRow("sampling error", found, verdict, meaning)
    worst = max(known, key=lambda number: max(known[number]))
    amplitude, frequency = known[worst]
    where = f", curve {worst}" if len(source.curves) > 1 else ""
    found = f"{share(amplitude)} of the amplitude, {share(frequency)} of the frequency of the peak{where}"
    return ErrorRow("sampling error", found, _verdict(max(known[worst]), 1e-3, TOLERATED_SAMPLING), meaning)


def _energy(source: ReportSource) -> ErrorRow:
    meaning = (
        "Relative mismatch of work input and dissipation per cycle, the largest over all points. It shows how "
        "exactly the balance is solved with the harmonics, the contact integration and the model chosen. It does not "
        "contain the errors of these choices: it can be small although the truncation or sampling error is large."
    )
    worst = _largest(source, lambda facts: facts.energy_error)
    if worst is None:
        return ErrorRow("energy error", "not known", UNKNOWN, meaning)
    error, where = worst
    return ErrorRow("energy error", f"{error:.0e}{where}", _verdict(error, 1e-6, 1e-2), meaning)


def _residual(source: ReportSource) -> list[ErrorRow]:
    """What friction leaves open at the peaks; no row where nothing sticks all the time at any of them."""
    facts = {number: curve.facts for number, curve in enumerate(source.curves) if curve.facts is not None}
    meaning = (
        "Friction determines the static traction of a contact node that sticks all the time only within limits, and "
        "so the vibration. The peaks are those of sliders that start unloaded. "
    )
    known = {n: (item.residual_lowest_m, item.residual_highest_m) for n, item in facts.items() if has_bounds(item)}
    if known:
        meaning += (
            "The bounds are the lowest and the highest peak found over all tractions within the friction limits, of "
            "the displacement as a whole, since tractions deflect the blade too; the notes give the vibration alone."
        )
        if any(is_estimate(source.curves[number]) for number in known):
            meaning += " With the friction cone they are estimates: some tractions may lead a little beyond them."
        worst = max(known, key=lambda n: (known[n][1] - known[n][0]) / max(facts[n].peak_amplitude_m, 1e-300))
        low, high, peak = *known[worst], facts[worst].peak_amplitude_m
        where = f", curve {worst}" if len(source.curves) > 1 else ""
        share_of_peak = max(high / peak - 1.0, 1.0 - low / peak) if peak > 0.0 else 0.0
        found = f"{change(low, peak)} to {change(high, peak)} of the peak{where}"
        return [ErrorRow("residual tractions", found, _verdict(share_of_peak, 0.01, TOLERATED), meaning)]
    free = [number for number, item in facts.items() if item.free_nodes > 0]
    if not free:
        return []
    meaning += 'response.residual_tractions = "bounds" gives the lowest and the highest peak that they allow.'
    found = f"not bounded; nodes stick along t1 or t2 at the peak of {len(free)} of {len(facts)} curves"
    return [ErrorRow("residual tractions", found, UNKNOWN, meaning)]


def _model(source: ReportSource) -> list[ErrorRow]:
    modes_mean = (
        "Error of the natural frequencies and receptances of the reduced model from the neglected fixed-interface "
        'modes. Where it is large, raise rom.modes or set it to "auto".'
    )
    mesh_mean = (
        "Error of the natural frequencies, estimated with a second mesh. Where it is large, lower mesh.size, or "
        "refine the mesh of the file. The amplitude under a given force depends on the compliance of the loaded "
        "point, which converges more slowly."
    )
    not_measured = f"not measured; run: shroud verify {source.scene_file.name}"
    errors = [each for _, each in source.verified]
    truncation = _estimated(source)
    if errors:
        truncation = max(each.modes_frequency for each in errors), max(each.receptance for each in errors)
    modes = ErrorRow("modal truncation error", not_measured, UNKNOWN, modes_mean)
    if truncation is not None:
        found = f"{share(truncation[0])} of a frequency, {share(truncation[1])} of a receptance"
        modes = replace(modes, found=found, verdict=_verdict(max(truncation), 0.01, TOLERATED))
    contact_mean = (
        "Error of the natural frequencies from the contact nodes: against springs spread over the face. Where it is "
        'large, set rom.contact_dofs = "mortar" or raise mesh.contact_grid.'
    )
    if not errors:
        rows = (("contact dofs", contact_mean), ("mesh error", mesh_mean))
        return [modes, *_waves(source), *(ErrorRow(name, not_measured, UNKNOWN, meaning) for name, meaning in rows)]
    contact = [each.contact_frequency for each in errors if not math.isnan(each.contact_frequency)]
    known = [each.mesh_frequency for each in errors if not math.isnan(each.mesh_frequency)]
    mesh = max(known, default=math.nan)
    return [
        modes,
        *_waves(source),
        ErrorRow(
            "contact dofs",
            f"{share(max(contact))} of a frequency" if contact else "not known (stiffness node by node)",
            _verdict(max(contact), 0.01, TOLERATED) if contact else UNKNOWN,
            contact_mean,
        ),
        ErrorRow(
            "mesh error",
            f"{share(mesh)} of a frequency" if known else f"not known ({errors[0].reason})",
            _verdict(mesh, 0.01, TOLERATED) if known else UNKNOWN,
            mesh_mean,
        ),
    ]


def _waves(source: ReportSource) -> list[ErrorRow]:
    """The error of the motions kept of a disk's cut faces; no row for blades that are clamped at their roots."""
    known = [row for row in source.model_rows if "wave_error" in row]
    if not known:
        return []
    worst = max(known, key=lambda row: float(row["wave_error"]))
    waves = ", ".join(str(number) for number in sorted(worst["wave_error_at"]))
    meaning = (
        "Largest error of six natural frequencies of a wave, against the whole mesh of the sector, from the motions "
        "kept of the disk's cut faces and the neglected fixed-interface modes. Where it is large, raise rom.modes or "
        "name the excited nodal diameters in rom.nodal_diameters."
    )
    error = float(worst["wave_error"])
    found = f"{share(error)} of a frequency, at nodal diameters {waves}"
    return [ErrorRow("disk: motions of the cut faces", found, _verdict(error, 0.01, TOLERATED), meaning)]


def _estimated(source: ReportSource) -> tuple[float, float] | None:
    """Modal truncation errors of frequencies and receptances that a run estimates; None where a model has none."""
    rows = source.model_rows
    if not rows or any(row["modes_error"] is None for row in rows):
        return None
    return max(row["modes_frequency_error"] for row in rows), max(row["receptance_error"] for row in rows)


def _coriolis(source: ReportSource) -> list[ErrorRow]:
    left_out = [row["coriolis_error"] for row in source.model_rows if not has_coriolis(row)]
    acting = [row["coriolis_error"] for row in source.model_rows if has_coriolis(row)]
    meaning = (
        "Largest change of a natural frequency in the range by the Coriolis forces, which the response leaves out. "
        "Near resonance a relative frequency error e changes the amplitude at a fixed frequency by about e / zeta."
    )
    if None in left_out:
        return [ErrorRow("Coriolis forces", "not known: the model has no Coriolis matrix", UNKNOWN, meaning)]
    if (worst := max(left_out, default=0.0)) > 0.0:
        verdict = _verdict(worst, 0.01, TOLERATED)
        return [ErrorRow("Coriolis forces", f"{share(worst)} of a frequency", verdict, meaning)]
    if not acting:
        return []  # nothing rotates
    meaning = f"Without them a natural frequency in the range would change by at most {share(max(acting))}."
    return [ErrorRow("Coriolis forces", "included", SMALL, meaning)]


def _stability(source: ReportSource, shown: Sequence[PlottedCurve]) -> ErrorRow:
    lost = unstable_peaks({curve.index: curve.facts for curve in shown})
    worst = [curve.index for curve in shown if curve.facts.worst_unstable and curve.index not in lost]
    kinds_of = {c.index: [e.kind.value for e in c.response.bifurcations if e.kind.value != "fold"] for c in shown}
    other = {index: kinds for index, kinds in kinds_of.items() if kinds}
    how = STABILITY[source.first.response.stability]
    findings = []
    if lost:
        curves = f"curve{'s' if len(lost) > 1 else ''} {listed(lost)}"
        findings.append(f"the peak of the main branch is unstable on {curves}")
    if worst:
        findings.append(
            f"the highest solution found is unstable on curve{'s' if len(worst) > 1 else ''} {listed(worst)}"
        )
    if other:
        kinds = ", ".join(dict.fromkeys(kind for each in other.values() for kind in each))
        curves = listed(list(other))
        findings.append(f"bifurcations other than folds ({kinds}) on curve{'s' if len(other) > 1 else ''} {curves}")
    verdict = "unstable" if lost or worst else FAIR if other else "stable"
    looked_at = source.first.response.stability == "ring"
    none = "every peak is stable" if looked_at else "no unstable peak found by what was looked at"
    if not shown:
        return ErrorRow("stability", "no curve", UNKNOWN, how)
    return ErrorRow("stability", "; ".join(findings) or none, verdict, how)


def _verdict(error: float, small: float, fair: float) -> str:
    if math.isnan(error):
        return UNKNOWN
    return SMALL if error <= small else FAIR if error <= fair else LARGE


MANY = 24  # values


def story(source: ReportSource, points: Sequence[SweepPoint], errors: Sequence[ErrorRow]) -> list[tuple[str, str]]:
    """Headings and a sentence or two for each."""
    told = [("Computed", _computed(source, points))]
    known = [point for point in points if math.isfinite(point.worst[1])]
    if known:
        told.append(("Worst motion", _worst(known, len(source.curves))))
    if len(known) > 1 and compares_designs(known[0].parameters):
        told.append(("Best design" if condition_keys(known[0].parameters) else "Best value", _best(known)))
    facts = {number: curve.facts for number, curve in enumerate(source.curves) if curve.facts is not None}
    told.append(("How sure", _how_sure(source, facts, errors, [p.index for p in known if p.worst_open])))
    if searched := search_sentences(facts):
        told.append(("Search", " ".join(first_few(searched))))
    return told


def swept_range(key: SweepKey) -> str:
    """The range of a swept key: `interference v0 from -250 to 400 µm (8 values)`."""
    name = MEANINGS.get(key.name, NOTHING_MORE).name or quantity(key.name).symbol
    first, last = key.values[0], key.values[-1]
    if not key.numeric:
        return f"{name} {', '.join(key.text(value) for value in key.values[:6])}{' ...' * (len(key.values) > 6)}"
    unit = quantity(key.name).unit
    low, high = key.text(first), key.text(last)
    if len(key.values) > MANY:  # sampled, with more digits than anybody reads
        low, high = f"{key.position(first):.3g}", f"{key.position(last):.3g}"
    return f"{name} from {low} to {high}{f' {unit}' if unit else ''} ({len(key.values)} values)"


def _computed(source: ReportSource, points: Sequence[SweepPoint]) -> str:
    scene, count = source.first, len(source.curves)
    low, high = scene.response.frequency
    of = ""
    if scene.blade is not None:
        disk = " on a disk" if scene.disk is not None else ""
        of = f" of a ring of {scene.blade.n_blades} blades{disk}"
        of += "" if scene.shroud is None else f", shroud angle {scene.shroud.angle:g}°"
    elif scene.model is not None:
        of = f" of a ring of {scene.model.n_blades} blades, matrices of another program"
    elif scene.mesh_file is not None:
        of = f" of a ring of {scene.n_blades} blades, mesh {Path(scene.mesh_file).name}"
    if "shroud.angle" in source.swept or "mesh.file" in source.swept:
        of = of.partition(", ")[0]
    curves = f"{count} response curves" if count > 1 else "One response curve"
    load = [f"{scene.excitation.force:g} N"] * ("excitation.force" not in source.swept)
    orders = [scene.excitation.engine_order * item.order for item in scene.excitation.harmonic if item.order > 1]
    besides = f" and its multiples {', '.join(map(str, orders))}" if orders else ""
    order = f"engine order {scene.excitation.engine_order}{besides}"
    load += [order] * ("excitation.engine_order" not in source.swept)
    excited = f", excited by {' at '.join(load)}" if load else ""
    keys = sweep_keys(points)
    over = f". Swept: {'; '.join(swept_range(key) for key in keys)}" if keys else ""
    failed = count - len(points)
    missing = f" {failed} of them could not be computed." if failed else ""
    return f"{curves}{of}, {low:g} to {high:g} Hz{excited}{over}.{missing}"


def _worst(known: Sequence[SweepPoint], count: int) -> str:
    highest = max(known, key=lambda point: point.worst[1])
    where = f", with {highest.label}" if highest.parameters else ""
    text = f"{'At least ' * highest.worst_open}{_place(highest)}{where}."
    if count > 1:
        text += f" It is the highest of {len(known)} curves{_open_of(known)}."
    if highest.facts.mean:
        text += f" Of this, {with_unit(highest.facts.mean)} is the static mean."
    if highest.peak[1] > NOTICEABLE * highest.worst[1]:
        text += f" The main branch reaches {with_unit(highest.peak[1])}, but that motion is unstable."
    elif highest.worst[1] > NOTICEABLE * highest.peak[1]:
        text += f" The main branch alone reaches {with_unit(highest.peak[1])}."
    return text


def _open_of(known: Sequence[SweepPoint]) -> str:
    """How many of some curves may be higher than found."""
    count = sum(point.worst_open for point in known)
    return f", {'all' if count == len(known) else count} of which may be higher than found" if count else ""


def compared_designs(points: Sequence[SweepPoint]) -> BestDesign | str:
    """The best design of the curves of a report."""
    return best_design([DesignPoint(p.parameters, p.worst[1], not p.worst_open) for p in points])


def _best(known: Sequence[SweepPoint]) -> str:
    best, conditions = compared_designs(known), condition_keys(known[0].parameters)
    if isinstance(best, str):
        return f"{best[:1].upper()}{best[1:]} (see the remarks of the table)."
    lowest, highest = known[best.highest], max(known, key=lambda point: point.worst[1])
    if conditions:
        at, mildest = values_label(lowest.parameters, design=False), known[best.lowest]
        return (
            f"{values_label(lowest.parameters, design=True)}: over all conditions the worst motion is at most "
            f"{_place(lowest)} ({at}). The lowest single curve has {_place(mildest)}, with {mildest.label}."
        )
    text = f"{lowest.label}, with a worst motion of {_place(lowest)}"
    if highest.worst[1] > NOTICEABLE * lowest.worst[1] > 0.0:
        text += f"; the highest is {highest.worst[1] / lowest.worst[1]:.3g} times as high"
    unsure = [point for point in known if point.worst_open and point.worst[1] < lowest.worst[1]]
    if unsure:
        curves, which = ("curve has", "it") if len(unsure) == 1 else ("curves have", "they")
        text += f". {len(unsure)} {curves} a lower one so far, but {which} may be higher than found"
    return f"{text}."


def _how_sure(
    source: ReportSource, facts: Mapping[int, CurveSummary], errors: Sequence[ErrorRow], unsure: Sequence[int]
) -> str:
    """The error budget in sentences, what is too large or not known first, and the curves that may be higher."""
    sentences = []
    if unsure:
        which = f"curve{'s' if len(unsure) > 1 else ''} {listed(unsure)}" if len(facts) > 1 else "this curve"
        sentences.append(f"The worst motion of {which} may be higher than found (>=), for the reasons below its row.")
    sentences += error_sentences(facts, source.model_rows)
    of_mesh = {row.name: row for row in errors if row.name in ("mesh error", "contact dofs")}
    for name, row in of_mesh.items():
        said = {"mesh error": "The mesh error", "contact dofs": "The error of the contact nodes"}[name]
        sentences.append(f"{said} {'was' if row.verdict == UNKNOWN else 'is'} {row.found}.")
    return " ".join(sentences)


def _place(point: SweepPoint) -> str:
    return f"{motion_said(point.worst[1], point.worst[0])}{point.mark}"
