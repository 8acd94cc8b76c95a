"""The section of the page about sweeps of the excitation."""

from __future__ import annotations

from pipeline.results.worst import with_unit
from pipeline.studies.registry import StudySection
from pipeline.studies.run_up.result import CurveRunUps, RunUpResult, SweepFacts
from pipeline.studies.run_up.study import sweep_said

HEADINGS = (
    "curve",
    "rate [Hz/s]",
    "peak",
    "at [Hz]",
    "of the steady peak [%]",
    "later by [half bandwidths]",
)
CAPTION = (
    "Above: largest displacement of any blade in sweeps up and down, beside the steady curve. Below: shares of "
    "contacts and time that slip and that are open, of the slowest sweep."
)


def run_up_section(result: RunUpResult) -> StudySection:
    """What a sweep shows of the steady peaks."""
    pairs = [(curve, sweep) for curve in result.curves for sweep in curve.sweeps if not sweep.message]
    said = [f"{sweep_said(curve, sweep)}." for curve in result.curves for sweep in curve.sweeps if sweep.message]
    if pairs:
        least = min(pairs, key=lambda pair: pair[0].share(pair[1]))
        said.insert(0, f"Lowest beside its steady peak: {sweep_said(*least)}.")
    return StudySection(
        "Sweeps of the excitation", tuple(said), CAPTION, HEADINGS, tuple(_row(*pair) for pair in pairs)
    )


def _row(curve: CurveRunUps, sweep: SweepFacts) -> tuple[str, ...]:
    share, lag = f"{100.0 * curve.share(sweep):.3g}", f"{curve.lag_bands(sweep):.3g}"
    return (
        curve.label,
        f"{sweep.rate_hz_per_s:+.4g}",
        with_unit(sweep.peak_m, curve.unit),
        f"{sweep.peak_hz:.5g}",
        share,
        lag,
    )
