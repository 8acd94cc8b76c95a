"""The error budget of a run: every known error, its size, a verdict and its meaning."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from pipeline.figures.data import PlottedCurve
from pipeline.report.many_curves import listed
from pipeline.report.report_source import ReportSource
from pipeline.results.residual_notes import change, has_bounds, is_estimate
from pipeline.results.tables import TOLERATED, TOLERATED_SAMPLING, sampling_errors
from pipeline.results.worst import share

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


def _truncation(source: ReportSource) -> ErrorRow:
    meaning = (
        "Estimated error of the peak from the neglected harmonics: the peak is solved again with more of them, and "
        "so is the way to it: with more harmonics a peak may lie on a detached branch. "
        'Where it is large, raise response.harmonics or set it to "auto".'
    )
    errors = {i: c.facts.truncation_error for i, c in enumerate(source.curves) if c.facts is not None}
    known = {number: error for number, error in errors.items() if not math.isnan(error)}
    if not known:
        return ErrorRow("truncation error", "not estimated", UNKNOWN, meaning)
    worst = max(known, key=known.__getitem__)
    verdict = _verdict(known[worst], 0.01, TOLERATED)
    where = f", curve {worst}" if len(source.curves) > 1 and known[worst] > 1e-4 else ""
    return ErrorRow("truncation error", f"{share(known[worst])} of the peak{where}", verdict, meaning)


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
    errors = {i: c.facts.energy_error for i, c in enumerate(source.curves) if c.facts is not None}
    known = {number: error for number, error in errors.items() if math.isfinite(error)}
    if not known:
        return ErrorRow("energy error", "not known", UNKNOWN, meaning)
    worst = max(known, key=known.__getitem__)
    where = f", curve {worst}" if len(source.curves) > 1 else ""
    return ErrorRow("energy error", f"{known[worst]:.0e}{where}", _verdict(known[worst], 1e-6, 1e-2), meaning)


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
    errors = [row["coriolis_error"] for row in source.model_rows]
    if not any(error is None or error > 0.0 for error in errors):
        return []  # nothing rotates
    meaning = (
        "Largest change of a natural frequency in the range by the Coriolis forces, which the response leaves out. "
        "Near resonance a relative frequency error e changes the amplitude at a fixed frequency by about e / zeta."
    )
    if None in errors:
        return [ErrorRow("Coriolis forces", "not known: the model has no Coriolis matrix", UNKNOWN, meaning)]
    worst = max(errors)
    return [ErrorRow("Coriolis forces", f"{share(worst)} of a frequency", _verdict(worst, 0.01, TOLERATED), meaning)]


def _stability(source: ReportSource, shown: Sequence[PlottedCurve]) -> ErrorRow:
    lost = [curve.index for curve in shown if curve.peak_index >= 0 and not curve.stable[curve.peak_index]]
    other = {
        curve.index: [item["kind"] for item in curve.bifurcations if item["kind"] != "fold"]
        for curve in shown
        if any(item["kind"] != "fold" for item in curve.bifurcations)
    }
    how = STABILITY[source.first.response.stability]
    findings = []
    if lost:
        curves = f"curve{'s' if len(lost) > 1 else ''} {listed(lost)}"
        findings.append(f"the peak of the main branch is unstable on {curves}")
    if other:
        kinds = ", ".join(dict.fromkeys(kind for each in other.values() for kind in each))
        curves = listed(list(other))
        findings.append(f"bifurcations other than folds ({kinds}) on curve{'s' if len(other) > 1 else ''} {curves}")
    verdict = LARGE if lost else FAIR if other else SMALL
    if not shown:
        return ErrorRow("stability", "no curve", UNKNOWN, how)
    return ErrorRow("stability", "; ".join(findings) or "every peak is stable", verdict, how)


def _verdict(error: float, small: float, fair: float) -> str:
    if math.isnan(error):
        return UNKNOWN
    return SMALL if error <= small else FAIR if error <= fair else LARGE
