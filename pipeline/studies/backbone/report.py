"""The section of the page about nonlinear modes."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.results.worst import motion_said, with_unit
from pipeline.studies.backbone.result import (
    BackboneResult,
    CurveBackbones,
    ModeBackbone,
    PredictedResonance,
    agreement,
)
from pipeline.studies.registry import StudySection

MOST_ROWS, MOST_NOTES = 40, 8
HEADINGS = (
    "curve",
    "mode",
    "resonance [Hz]",
    "amplitude",
    "damping ratio",
    "traced peak",
    "amplitude off",
    "frequency off",
)
CAPTION = (
    "Nonlinear modes: amplitude over frequency, damping ratio and resonant force; one motion lies at one height. "
    "Thin lines: linear limits, free and stuck. Crosses: resonances under the force; circles: traced peaks. "
    "Bars and triangles: first slip and first lift-off. In the figure of the response the modes are black lines."
)


def backbone_section(result: BackboneResult) -> StudySection:
    """How well the resonances of nonlinear modes agree with the traced peaks, and where they do not."""
    rows = [row for curve in result.curves for row in _rows(curve)]
    notes = [note for curve in result.curves for note in _notes(curve)]
    left = max(len(rows) - MOST_ROWS, 0), max(len(notes) - MOST_NOTES, 0)
    more = (f"{left[0]} more resonances and {left[1]} more remarks are in backbone.json.",) if any(left) else ()
    conclusion = (*_conclusion(result), *notes[:MOST_NOTES], *more)
    return StudySection(
        "Nonlinear modes", conclusion, f"{CAPTION} Modes: {result.definition}.", HEADINGS, tuple(rows[:MOST_ROWS])
    )


def _conclusion(result: BackboneResult) -> Iterator[str]:
    """Agreement, damping, what is not predicted."""
    pairs, good, largest = agreement(result)
    if pairs:
        text = f"{good} of {pairs} resonances of the nonlinear modes lie within {100.0 * result.tolerance:g} % of a "
        text += "traced peak" + (f", {100.0 * largest:.2g} % off in amplitude at most." if good else ".")
        yield text
    else:
        yield "No resonance of the nonlinear modes lies near a traced peak."
    modes = [(curve, mode) for curve in result.curves for mode in curve.modes if len(mode.damping_ratio)]
    if modes:
        curve, mode = max(modes, key=lambda each: float(each[1].damping_ratio.max()))
        at = int(mode.damping_ratio.argmax())
        yield (
            f"The largest damping ratio is {mode.damping_ratio[at]:.3g}: {curve.label}, mode {mode.number}, "
            f"{with_unit(float(mode.amplitude_m[at]))} at {mode.frequency_hz[at]:.5g} Hz."
        )


def _rows(curve: CurveBackbones) -> Iterator[tuple[str, ...]]:
    """A row for each resonance."""
    for mode in curve.modes:
        for each in mode.resonances:
            if each.stable or each.peak is not None:
                yield curve.label, _name(curve, mode), *_cells(each)


def _notes(curve: CurveBackbones) -> Iterator[str]:
    """What does not agree, and why: resonances, modes without any, peaks without one."""
    for mode in curve.modes:
        of = f"{curve.label}, mode {_name(curve, mode)}"
        for each in mode.resonances:
            if each.reasons:
                place = f"{motion_said(each.amplitude_m, each.frequency_hz)}"
                yield f"{of}, {place}: {'; '.join(each.reasons)}."
        if not mode.resonances and mode.nodal_diameter == curve.engine_order:
            yield f"{of}: {_without(mode)}."
    for missed in curve.unpredicted:
        peak = f"{motion_said(missed.peak.amplitude_m, missed.peak.frequency_hz)}"
        yield f"{curve.label}: the peak of {peak} is near no resonance: {'; '.join(missed.reasons)}."


def _name(curve: CurveBackbones, mode: ModeBackbone) -> str:
    own = mode.nodal_diameter == curve.engine_order
    return f"{mode.number}" + ("" if own else f" (nodal diameter {mode.nodal_diameter})")


def _cells(each: PredictedResonance) -> tuple[str, ...]:
    """The cells of one resonance."""
    peak, off = "-", ("-", "-")
    if each.peak is not None:
        branch = "" if each.peak.branch == 0 else f", branch {each.peak.branch}"
        peak = f"{motion_said(each.peak.amplitude_m, each.peak.frequency_hz)}{branch}"
        off = f"{100.0 * each.amplitude_deviation:+.2g} %", f"{100.0 * each.frequency_deviation:+.2g} %"
    return (
        f"{each.frequency_hz:.5g}",
        with_unit(each.amplitude_m),
        f"{each.damping_ratio:.3g}",
        peak,
        *off,
    )


def _without(mode: ModeBackbone) -> str:
    """Why a mode has no resonance in the table."""
    if not len(mode.force_n):
        return mode.message
    low, high = float(mode.force_n.min()), float(mode.force_n.max())
    ended = "" if mode.complete else f"; {mode.message}"
    return f"no resonance in the frequency range; its resonant force is {low:.3g} to {high:.3g} N{ended}"
