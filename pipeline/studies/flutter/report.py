"""The section of the page about limit cycles."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.results.worst import with_unit
from pipeline.studies.flutter.result import CurveFlutter, CycleFacts, FlutterResult, WaveCycles
from pipeline.studies.flutter.study import said_in_time, said_of_waves
from pipeline.studies.registry import StudySection

MOST_ROWS = 60
HEADINGS = (
    "curve",
    "nodal diameter",
    "from rest",
    "first slip",
    "cycle",
    "frequency [Hz]",
    "perturbations",
    "work of the flow",
)
CAPTION = (
    "Left: damping ratio of waves over their amplitude; below 0 the wave grows. Circles: limit cycles, filled where "
    "they last in the ring; crosses: beyond them motions grow for ever. Right: the cycles. Below, where the ring was "
    "integrated in time: amplitude of all waves from a small disturbance on, and at the end."
)


def flutter_section(result: FlutterResult) -> StudySection:
    """What becomes of the waves that the flow feeds."""
    rows = [row for curve in result.curves for row in _rows(curve)]
    said = [f"{curve.label}: {said_of_waves(curve)}." for curve in result.curves[:8]]
    said += [f"In time, {curve.label}: {said_in_time(curve.ring)}." for curve in result.curves if curve.ring]
    if more := len(rows) - MOST_ROWS:
        said += [f"{more} more cycles are in flutter.json."] if more > 0 else []
    return StudySection("Flutter and limit cycles", tuple(said), CAPTION, HEADINGS, tuple(rows[:MOST_ROWS]))


def _rows(curve: CurveFlutter) -> Iterator[tuple[str, ...]]:
    """A row for each cycle, and for each wave that grows without one."""
    for wave in curve.waves:
        for cycle in wave.cycles:
            yield curve.label, *_wave(wave), *_cycle(cycle)
        if not wave.cycles and wave.damping_ratio < 0.0:
            yield curve.label, *_wave(wave), wave.outcome, "-", "-", "-"


def _wave(wave: WaveCycles) -> tuple[str, ...]:
    limit = "never" if wave.linear_limit_m == float("inf") else with_unit(wave.linear_limit_m)
    return str(wave.nodal_diameter), f"{100.0 * wave.damping_ratio:+.3g} %", limit


def _cycle(cycle: CycleFacts) -> tuple[str, ...]:
    size = with_unit(cycle.vibration_m)
    kind = size if cycle.attracting else f"{size}, grows for ever beyond it"
    grows = cycle.growth_rate > 0.0
    said = f"{cycle.growth_rate:+.3g} 1/s at {cycle.growth_nodal_diameter:+d}" if grows else "decay"
    unknown = cycle.growth_rate != cycle.growth_rate  # NaN
    return kind, f"{cycle.frequency_hz:.5g}", "not known" if unknown else said, with_unit(cycle.flow_j, "J")
