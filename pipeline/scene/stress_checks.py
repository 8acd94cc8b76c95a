"""Checks of [stress] and [fatigue] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values


def unfit_stress_keys(file: SceneFile) -> Iterator[InputError]:
    """Keys of [stress] and [fatigue] that do not fit the rest of a scene."""
    scene, count = file.first, len(file.members)
    for section in ("stress", "fatigue"):
        if scene.model is not None and getattr(scene, section) is not None:
            yield input_error(file.path, section, "given beside [model]", "a scene with a mesh: matrices have none")
    curves = () if scene.stress is None or isinstance(scene.stress.curves, bool) else scene.stress.curves
    if curves and max(curves) >= count:
        allowed = f"true, false or a list of numbers of curves, 0 to {count - 1}"
        yield input_error(file.path, "stress.curves", shown(list(curves)), allowed)
    if scene.fatigue is None:
        return
    for material in scene.fatigue.named:
        limits = scene.fatigue.limits_of(material)
        if limits is None:
            continue
        of = f".{material}" if material else ""
        for name, value in (("endurance_limit", limits[0]), ("yield_strength", limits[2])):
            if value is not None and value > limits[1]:
                yield input_error(file.path, f"fatigue.{name}{of}", shown(value), allowed_values(f"fatigue.{name}"))
