"""The error budget of a run: each known error, how large it is, and in plain words what it means."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from pipeline.figures.data import PlottedCurve
from pipeline.report.report_source import ReportSource
from pipeline.results.tables import TOLERATED, share

SMALL, FAIR, LARGE, UNKNOWN = "small", "noticeable", "large", "not known"


@dataclass(frozen=True)
class ErrorRow:
    """One source of error: the largest value found, a verdict, what it means and what to do."""

    name: str
    found: str
    verdict: str
    meaning: str


def error_rows(source: ReportSource, shown: Sequence[PlottedCurve]) -> list[ErrorRow]:
    """Harmonics, energy, modes, mesh, stability."""
    return [_harmonics(source), _energy(source), *_model(source), _stability(source, shown)]


def _harmonics(source: ReportSource) -> ErrorRow:
    meaning = (
        "What harmonics left out would change at the peak: it is solved again with more of them. Where this is "
        'large, raise response.harmonics or set it to "auto".'
    )
    errors = {i: c.facts.truncation_error for i, c in enumerate(source.curves) if c.facts is not None}
    known = {number: error for number, error in errors.items() if not math.isnan(error)}
    if not known:
        return ErrorRow("harmonics left out", "not estimated", UNKNOWN, meaning)
    worst = max(known, key=known.__getitem__)
    verdict = _verdict(known[worst], 0.01, TOLERATED)
    where = f", curve {worst}" if len(source.curves) > 1 and known[worst] > 1e-4 else ""
    return ErrorRow("harmonics left out", f"{share(known[worst])} of the peak{where}", verdict, meaning)


def _energy(source: ReportSource) -> ErrorRow:
    meaning = (
        "Work that the excitation puts in over a cycle against what damping and friction take out, at every point. "
        "A solution has the two equal; what is left is round-off or, with sampled contact, the sampling."
    )
    errors = {i: c.facts.energy_error for i, c in enumerate(source.curves) if c.facts is not None}
    known = {number: error for number, error in errors.items() if math.isfinite(error)}
    if not known:
        return ErrorRow("energy", "not known", UNKNOWN, meaning)
    worst = max(known, key=known.__getitem__)
    where = f", curve {worst}" if len(source.curves) > 1 else ""
    return ErrorRow("energy", f"{known[worst]:.0e}{where}", _verdict(known[worst], 1e-6, 1e-2), meaning)


def _model(source: ReportSource) -> list[ErrorRow]:
    modes_mean = (
        "Natural frequencies and receptances of the reduced model against the whole one. Where this is large, "
        'raise rom.modes or set it to "auto".'
    )
    mesh_mean = (
        "Natural frequencies against a finer mesh. Where this is large, lower mesh.size. Amplitudes under the same "
        "force follow the stiffness of the loaded point, which a mesh tells less well than a frequency."
    )
    not_measured = f"not measured; shroud verify {source.scene_file.name} does it"
    errors = [each for _, each in source.measured]
    left_out = _estimated(source)
    if errors:
        left_out = max(each.modes_frequency for each in errors), max(each.receptance for each in errors)
    modes = ErrorRow("vibration modes left out", not_measured, UNKNOWN, modes_mean)
    if left_out is not None:
        found = f"{share(left_out[0])} of a frequency, {share(left_out[1])} of a receptance"
        modes = replace(modes, found=found, verdict=_verdict(max(left_out), 0.01, TOLERATED))
    if not errors:
        return [modes, ErrorRow("mesh", not_measured, UNKNOWN, mesh_mean)]
    known = [each.mesh_frequency for each in errors if not math.isnan(each.mesh_frequency)]
    mesh = max(known, default=math.nan)
    return [
        modes,
        ErrorRow(
            "mesh",
            f"{share(mesh)} of a frequency" if known else f"not known ({errors[0].reason})",
            _verdict(mesh, 0.01, TOLERATED) if known else UNKNOWN,
            mesh_mean,
        ),
    ]


def _estimated(source: ReportSource) -> tuple[float, float] | None:
    """Errors of frequencies and receptances that every run estimates; None where one of its models has none."""
    rows = source.model_rows
    if not rows or any(row["modes_error"] is None for row in rows):
        return None
    return max(row["modes_frequency_error"] for row in rows), max(row["receptance_error"] for row in rows)


def _stability(source: ReportSource, shown: Sequence[PlottedCurve]) -> ErrorRow:
    lost = [curve.index for curve in shown if curve.peak_index >= 0 and not curve.stable[curve.peak_index]]
    other = {
        curve.index: [item["kind"] for item in curve.bifurcations if item["kind"] != "fold"]
        for curve in shown
        if any(item["kind"] != "fold" for item in curve.bifurcations)
    }
    if source.first.response.stability == "floquet":
        how = (
            "Floquet exponents say whether a small disturbance of the motion dies out. A machine does not stay on an "
            "unstable (dashed) part of a curve. Only disturbances in the pattern of the travelling wave are seen."
        )
    else:
        how = "From folds only: between two of them a curve is unstable; other losses of stability are not seen."
    said = []
    if lost:
        said.append(f"the peak is unstable on curve{'s' if len(lost) > 1 else ''} {', '.join(map(str, lost))}")
    if other:
        kinds = ", ".join(dict.fromkeys(kind for each in other.values() for kind in each))
        curves = ", ".join(map(str, other))
        said.append(f"a steady vibration gives way to another motion ({kinds}) somewhere on curves {curves}")
    verdict = LARGE if lost else FAIR if other else SMALL
    if not shown:
        return ErrorRow("stability", "no curve", UNKNOWN, how)
    return ErrorRow("stability", "; ".join(said) or "every peak is stable", verdict, how)


def _verdict(error: float, small: float, fair: float) -> str:
    if math.isnan(error):
        return UNKNOWN
    return SMALL if error <= small else FAIR if error <= fair else LARGE
