"""The study `backbone`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.results.worst import motion_said
from pipeline.stages.curve.respond import CurveResult
from pipeline.studies.backbone.curve_backbones import curve_backbones
from pipeline.studies.backbone.result import BackboneResult, CurveBackbones, PredictedResonance, agreement
from pipeline.studies.study import StudyError

if TYPE_CHECKING:
    from pipeline.studies.study import StudyContext


MOST_CURVES = 24
MOST_LINES = 12  # at a terminal


class BackboneStudy:
    """Nonlinear modes of the curves of a scene, as `Study`."""

    name = "backbone"
    result = BackboneResult

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """The curves that it is about: each file is named after all that the curve depends on."""
        return {"curves": [[number, file.parent.name] for number, _, file, _ in _curves(context)]}

    def compute(self, context: StudyContext) -> BackboneResult:
        """The modes of one curve after another."""
        section = context.scene.backbone
        assert section is not None  # the study is asked for
        found: list[CurveBackbones] = []
        for number, result, file, rom in _curves(context):
            found.append(curve_backbones(number, result, file, rom, section))
            context.progress(_computed(found[-1]))
        if not found:
            raise StudyError("there is no curve with points whose nonlinear modes could be computed")
        return BackboneResult(section.tolerance, tuple(found), section.damping)

    def lines(self, result: BackboneResult) -> Sequence[str]:
        """How many resonances agree with peaks, and what does not."""
        pairs, good, largest = agreement(result)
        said = [f"{good} of {pairs} resonances within {100.0 * result.tolerance:g} % of the traced peaks"]
        said[0] += f", {100.0 * largest:.2g} % at most" if good else ""
        said[0] += f"; {result.definition}"
        said += [line for curve in result.curves for line in _told(curve)]
        more = len(said) - MOST_LINES
        said = said if more <= 1 else [*said[:MOST_LINES], f"{more} more in backbone.json"]
        return [f"backbone: {line}" for line in said]


def _curves(context: StudyContext) -> Iterator[tuple[int, CurveResult, Path, Path]]:
    """Number, result, file and model file of the curves asked for that have points."""
    section, curves = context.scene.backbone, context.outcome.curves
    assert section is not None
    known = [n for n, curve in enumerate(curves) if curve.file and curve.rom and curve.facts and curve.facts.points]
    chosen = known if section.curves == "all" else [n for n in known if n in section.curves]
    if section.curves == "all" and len(known) > MOST_CURVES:
        order = sorted(known, key=lambda n: _height(curves[n]))
        chosen = sorted({order[0], order[-1]})
    for number in chosen:
        file, rom = curves[number].file, curves[number].rom
        if file is not None and rom is not None:
            yield number, curves[number], file, rom


def _height(curve: CurveResult) -> float:
    facts = curve.facts
    assert facts is not None
    known = facts.worst_amplitude_m == facts.worst_amplitude_m  # not NaN
    return facts.worst_amplitude_m if known else facts.peak_amplitude_m


def _computed(curve: CurveBackbones) -> str:
    seconds = sum(mode.seconds for mode in curve.modes)
    return f"backbone, {curve.label}: {len(curve.modes)} nonlinear modes, {seconds:.2f} s"


def _told(curve: CurveBackbones) -> Iterator[str]:
    """One line for each mode that ends early, each resonance that deviates, and each peak without one."""
    for mode in curve.modes:
        name = f"{curve.label}, mode {mode.number}"
        if not mode.complete:
            yield f"{name}: {mode.message}"
        for each in mode.resonances:
            if each.reasons and each.stable:
                said = "" if each.peak is None else _deviations(each)
                yield f"{name}, {motion_said(each.amplitude_m, each.frequency_hz)}, {said}{'; '.join(each.reasons)}"
    for missed in curve.unpredicted:
        place = motion_said(missed.peak.amplitude_m, missed.peak.frequency_hz)
        yield f"{curve.label}: peak {place} is near no resonance: {'; '.join(missed.reasons)}"


def _deviations(resonance: PredictedResonance) -> str:
    amplitude, frequency = 100.0 * resonance.amplitude_deviation, 100.0 * resonance.frequency_deviation
    return f"amplitude {amplitude:+.2g} %, frequency {frequency:+.2g} %: "
