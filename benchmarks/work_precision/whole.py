"""The whole pipeline: error of the peaks over all seconds from the blade to its curves, on a grid of settings."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.scene.presets import PRESETS, preset_values
from pipeline.scene.reading import read_scene
from pipeline.scene.schema import Scene
from pipeline.stages.curve_file import CURVE
from pipeline.stages.curve_summary import CurveSummary, read_summary
from pipeline.stages.solve_curve import solve_curve
from work_precision.curves import FREQUENCY, PEAK, problem_on
from work_precision.figure import PRESET_LINE
from work_precision.mesh import ORDER, REFERENCE, REFERENCE_MODES, reference_scene, reference_text
from work_precision.stages import BuiltModel, built_mesh, extrapolated, kept_model, with_values
from work_precision.study import Measured, Quantity, Study, relative_error, said

Peaks = dict[float, tuple[float, float]]  # interference, m -> amplitude, m, and frequency, Hz, of the highest peak


@dataclass(frozen=True)
class WholeSettings:
    """The grid: meshes (element, mm), modes, harmonics; interferences (m) of the curves; presets; the reference.

    `reference_harmonics`: of the reference and, before them, those that tell its uncertainty.
    """

    meshes: Sequence[tuple[str, float]]
    modes: Sequence[int]
    harmonics: Sequence[int]
    interferences: Sequence[float] = (-250e-6, -20e-6, 5e-6, 400e-6)  # free; lift-off; slip; stuck
    presets: Sequence[str] = tuple(PRESETS)
    reference: Sequence[float] = REFERENCE
    reference_modes: int = REFERENCE_MODES
    reference_harmonics: tuple[int, int] = (11, 15)


USUAL = WholeSettings(
    (("hex8", 4.0), ("hex20", 8.0), ("hex20", 6.0), ("hex20", 4.0), ("hex20", 2.8)), (5, 20), (1, 3, 5, 9)
)
FULL = WholeSettings(
    (("hex8", 4.0), ("hex8", 2.0), *(("hex20", size) for size in (8.0, 6.0, 5.0, 4.0, 3.2, 2.8, 2.4, 2.0))),
    (5, 20, 40),
    (1, 3, 5, 7, 9),
    (-250e-6, -20e-6, -5e-6, 0.0, 5e-6, 20e-6, 60e-6, 400e-6),
    reference_harmonics=(15, 21),
)


def whole_study(scene_file: Path, settings: WholeSettings, store: Path) -> Study:
    """Largest error of the peaks of a sweep over the interference, for each combination and each preset.

    Raises
    ------
    InputError : the scene cannot be read. GeometryError, MeshingError : a size does not fit the blade.
    """
    scene = read_scene(scene_file).first
    truth, unsure = _reference(scene, settings, store)
    rows: list[Measured] = []
    for element, size in settings.meshes:
        there = with_values(scene, {"mesh.element": element, "mesh.size": 1e-3 * size})
        with built_mesh(there) as mesh:
            for modes in settings.modes:
                made = mesh.reduced({"rom.modes": modes})
                for harmonics in settings.harmonics:
                    seconds = mesh.seconds + made.seconds
                    label = f"{modes} modes, H = {harmonics}"
                    values = {"response.harmonics": harmonics}
                    rows.append(
                        said(
                            _measure(
                                f"{element} {size:g} mm", label, made, values, settings.interferences, seconds, truth
                            )
                        )
                    )
    rows += (said(_preset(scene, name, settings, truth)) for name in settings.presets)
    coarse, fine = settings.reference_harmonics
    shown = ", ".join(f"{1e6 * value:g}" for value in settings.interferences)
    return Study(
        "whole",
        "The whole pipeline",
        "Seconds of meshing, assembling, reducing and solving the curves one after another as `shroud run` does, "
        "files included, with all that the response does by default (Floquet exponents, detached branches, the "
        f"estimate of the harmonics left out); largest error of the peaks at interferences of {shown} um.",
        f"{reference_text(settings.reference, settings.reference_modes)} Each peak with {fine} harmonics; what "
        f"{coarse} change is part of the uncertainty, which is that of the worst peak.",
        tuple(Quantity(name, value) for name, value in unsure.items()),
        tuple(rows),
        {},
    )


def _reference(scene: Scene, settings: WholeSettings, store: Path) -> tuple[Peaks, dict[str, float]]:
    """Peaks for vanishing element size, and their relative uncertainty by quantity."""
    coarse, fine = settings.reference_harmonics
    truth: Peaks = {}
    unsure = {PEAK: 0.0, FREQUENCY: 0.0}
    for interference in settings.interferences:
        found = []
        for size in settings.reference:
            finer = reference_scene(scene, size, settings.reference_modes)
            finer = with_values(finer, {"contact.interference": interference})
            found.append(_peak(problem_on(kept_model(store, finer), finer).solve(harmonics=fine)))
        fewer = _peak(problem_on(kept_model(store, finer), finer).solve(harmonics=coarse))
        both = []
        for place, name in enumerate((PEAK, FREQUENCY)):
            limit, spread = extrapolated(settings.reference, [peak[place] for peak in found], ORDER)
            unsure[name] = max(unsure[name], spread + relative_error(fewer[place], found[-1][place]))
            both.append(limit)
        truth[interference] = both[0], both[1]
    return truth, unsure


def _peak(curve: Any) -> tuple[float, float]:
    """Amplitude, m, and frequency, Hz, of the highest peak of a `ResponseCurve`."""
    return curve.peak.amplitude_m, curve.peak.frequency_hz


def _measure(
    series: str,
    label: str,
    made: BuiltModel,
    values: Mapping[str, Any],
    interferences: Sequence[float],
    seconds: float,
    truth: Peaks,
) -> Measured:
    """The row of a reduced model that took `seconds`, its curves solved with other values of dotted keys."""
    worst = {PEAK: 0.0, FREQUENCY: 0.0}
    missing, highest = 0, 0
    for interference in interferences:
        scene = with_values(made.scene, {**values, "contact.interference": interference})
        facts, more = _solved(made.file, scene)
        seconds += more
        missing += not facts.complete
        highest = max(highest, facts.harmonics)
        for name, value, true in zip(
            worst, (facts.peak_amplitude_m, facts.peak_frequency_hz), truth[interference], strict=True
        ):
            worst[name] = max(worst[name], relative_error(value, true))
    counts = {"dofs": int(made.facts["dofs"]), "modes": int(made.facts["modes"]), "harmonics": highest}
    return Measured(series, label, seconds, worst, counts, f"{missing} incomplete" if missing else "")


def _solved(rom: Path, scene: Scene) -> tuple[CurveSummary, float]:
    """What came of a curve, and its seconds."""
    import h5py

    with tempfile.TemporaryDirectory(prefix="shroud-bench-") as name:
        start = time.perf_counter()
        solve_curve(Path(name), rom, scene, {})
        seconds = time.perf_counter() - start
        with h5py.File(Path(name) / CURVE, "r") as file:
            return read_summary(file), seconds


def _preset(scene: Scene, name: str, settings: WholeSettings, truth: Peaks) -> Measured:
    """The row of a preset."""
    assert scene.blade is not None
    values = preset_values(name, scene.blade.chord)
    with built_mesh(with_values(scene, values)) as mesh:
        made = mesh.reduced({})
        seconds = mesh.seconds + made.seconds
        return _measure(PRESET_LINE, f'"{name}"', made, {}, settings.interferences, seconds, truth)
