"""The whole pipeline: error of the peaks over all seconds from the blade to its curves, on a grid of settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from problems import BuiltModel, built_mesh, cached_model, curve_of_run, curve_problem, scene_with

from pipeline.scene.presets import PRESETS, preset_values
from pipeline.scene.schema import Scene
from work_precision.curve_studies import FREQUENCY, PEAK
from work_precision.figure import PRESET_SERIES
from work_precision.mesh import REFERENCE, REFERENCE_MODES, extrapolated, reference_scene, reference_text
from work_precision.study import Measured, Study, announced, relative_error

Peaks = dict[float, dict[str, float]]  # interference, m -> amplitude, m, and frequency, Hz, of the highest peak


@dataclass(frozen=True)
class WholeSettings:
    """The grid: meshes (element, mm), modes, harmonics; interferences (m) of the curves; presets; the reference.

    `reference_harmonics` are those of the reference and, before them, those that tell its uncertainty.
    """

    meshes: Sequence[tuple[str, float]]
    modes: Sequence[int]
    harmonics: Sequence[int]
    interferences: Sequence[float] = (-250e-6, -20e-6, 5e-6, 400e-6)  # free; lift-off; slip; stuck
    presets: Sequence[str] = tuple(PRESETS)
    reference: Sequence[float] = REFERENCE
    reference_modes: int = REFERENCE_MODES
    reference_harmonics: tuple[int, int] = (11, 15)


DEFAULT = WholeSettings((("hex8", 4.0), ("hex20", 8.0), ("hex20", 4.0), ("hex20", 2.8)), (30,), (1, 3, 9))


def whole_study(scene_file: Path, settings: WholeSettings, store: Path) -> Study:
    """Largest error of the peaks of a sweep over the interference, for each combination and each preset."""
    scene = scene_with(scene_file, {})
    truth, uncertainty = _reference(scene, settings, store)
    rows: list[Measured] = []
    for element, size in settings.meshes:
        with built_mesh(scene_with(scene, {"mesh.element": element, "mesh.size": 1e-3 * size})) as mesh:
            for modes in settings.modes:
                made = mesh.reduced({"rom.modes": modes})
                for harmonics in settings.harmonics:
                    values = {"response.harmonics": harmonics}
                    counts, seconds, errors, note = _sweep(made, values, truth)
                    name, label = f"{element} {size:g} mm", f"{modes} modes, H = {harmonics}"
                    seconds += mesh.seconds + made.seconds
                    rows.append(announced(Measured(name, label, seconds, errors, counts, note)))
    for preset in settings.presets:
        assert scene.blade is not None
        with built_mesh(scene_with(scene, preset_values(preset, scene.blade.chord))) as mesh:
            made = mesh.reduced()
            counts, seconds, errors, note = _sweep(made, {}, truth)
            seconds += mesh.seconds + made.seconds
            rows.append(announced(Measured(PRESET_SERIES, f'"{preset}"', seconds, errors, counts, note)))
    coarser, finest = settings.reference_harmonics
    shown = ", ".join(f"{1e6 * value:g}" for value in settings.interferences)
    return Study(
        "whole",
        "The whole pipeline",
        "Seconds of meshing, assembling, reducing and solving the curves one after another as `shroud run` does, "
        "files included, with all that the response has by default (Floquet exponents, detached branches, "
        f"truncation error); largest error of the peaks at interferences of {shown} um.",
        f"{reference_text(settings.reference, settings.reference_modes)} Each peak with {finest} harmonics; the "
        f"change from {coarser} is part of the uncertainty, which is that of the worst peak.",
        uncertainty,
        tuple(rows),
    )


def _reference(scene: Scene, settings: WholeSettings, store: Path) -> tuple[Peaks, dict[str, float]]:
    """Peaks for vanishing element size, and their relative uncertainty by quantity."""
    coarser, finest = settings.reference_harmonics
    truth: Peaks = {}
    uncertainty = {PEAK: 0.0, FREQUENCY: 0.0}
    for interference in settings.interferences:
        problems = []
        for size in settings.reference:
            finer = reference_scene(scene, size, settings.reference_modes)
            finer = scene_with(finer, {"contact.interference": interference})
            problems.append(curve_problem(cached_model(store, finer), finer))
        found = [_peak(problem.solve(harmonics=finest)) for problem in problems]
        fewer = _peak(problems[-1].solve(harmonics=coarser))
        truth[interference] = {}
        for name in (PEAK, FREQUENCY):
            limit, spread = extrapolated(settings.reference, [peak[name] for peak in found])
            uncertainty[name] = max(uncertainty[name], spread + relative_error(fewer[name], found[-1][name]))
            truth[interference][name] = limit
    return truth, uncertainty


def _peak(curve: Any) -> dict[str, float]:
    """Amplitude, m, and frequency, Hz, of the highest peak of a `ResponseCurve`."""
    return {PEAK: curve.peak.amplitude_m, FREQUENCY: curve.peak.frequency_hz}


def _sweep(
    made: BuiltModel, values: Mapping[str, Any], truth: Peaks
) -> tuple[dict[str, int], float, dict[str, float], str]:
    """Sizes, seconds, largest errors and a note on the curves of a reduced model with other values of dotted keys."""
    worst = {PEAK: 0.0, FREQUENCY: 0.0}
    seconds, incomplete, highest = 0.0, 0, 0
    for interference, true in truth.items():
        summary, more = curve_of_run(
            made.file, scene_with(made.scene, {**values, "contact.interference": interference})
        )
        seconds += more
        incomplete += not summary.complete
        highest = max(highest, summary.harmonics)
        found = {PEAK: summary.peak_amplitude_m, FREQUENCY: summary.peak_frequency_hz}
        worst = {name: max(worst[name], relative_error(found[name], true[name])) for name in worst}
    counts = {"dofs": int(made.facts["dofs"]), "modes": int(made.facts["modes"]), "harmonics": highest}
    return counts, seconds, worst, f"{incomplete} incomplete" if incomplete else ""
