"""Checks of [flutter] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values
from pipeline.studies.backbone.checks import unfit_curves
from pipeline.studies.flutter.section import Flutter


def unfit_flutter_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [flutter] that do not fit each other or the rest of a scene."""
    scene, section = file.first, file.first.flutter
    if section is None:
        return
    if scene.aero is None:
        yield input_error(file.path, "flutter", "given without [aero]", "with [aero], the flow that feeds the motion")
    waves = section.nodal_diameters or ()
    if len(set(waves)) < len(waves):
        allowed = allowed_values("flutter.nodal_diameters")
        yield input_error(file.path, "flutter.nodal_diameters", shown(list(waves)), allowed)
    blades = getattr(scene, "n_blades", None)
    if blades is not None and any(not -blades < 2 * n <= blades for n in waves):
        allowed = f"{-((blades - 1) // 2)} to {blades // 2}, waves of {blades} blades"
        yield input_error(file.path, "flutter.nodal_diameters", shown(list(waves)), allowed)
    yield from unfit_curves(file, "flutter", section.curves)
    if section.in_time is not None:
        yield from _unfit_in_time(file, section)


def _unfit_in_time(file: SceneFile, section: Flutter) -> Iterator[InputError]:
    """Curves to integrate in time that are not looked at, or without periods."""
    assert section.in_time is not None  # there are such curves
    known = set(range(len(file.members)) if section.curves == "all" else section.curves)
    if not set(section.in_time) <= known:
        allowed = f"numbers of curves of flutter.curves, {min(known)} to {max(known)}"
        yield input_error(file.path, "flutter.in_time", shown(list(section.in_time)), allowed)
    elif section.periods == 0:
        yield input_error(
            file.path, "flutter.in_time", "given without flutter.periods", "with flutter.periods above 0"
        )
