"""Checks of [flutter] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values


def unfit_flutter_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [flutter] that do not fit each other or the rest of a scene."""
    scene, section, count = file.first, file.first.flutter, len(file.members)
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
    if section.curves != "all" and max(section.curves) >= count:
        allowed = f'"all" or a list of numbers of curves, 0 to {count - 1}'
        yield input_error(file.path, "flutter.curves", shown(list(section.curves)), allowed)
    for member in file.members:
        method = getattr(member.scene.response, "method", "coupled")  # no section where it does not obey the schema
        if method != "coupled":
            found, allowed = shown(method), '"coupled", with [flutter]'
            yield input_error(file.path, member.key_in_file("response.method"), found, allowed)
            return
