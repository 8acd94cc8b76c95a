"""Checks of [mistuning] beyond the schema: what fits the ring and the response of a scene."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values


def unfit_mistuning_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [mistuning] that do not fit the rest of a scene."""
    scene = file.first
    section, blades = scene.mistuning, scene.n_blades
    if section is None:
        return
    if section.frequency is not None and blades is not None and len(section.frequency) != blades:
        found, allowed = f"a list of {len(section.frequency)}", f"a list of {blades} numbers, one for each blade"
        yield input_error(file.path, "mistuning.frequency", found, allowed)
    limits = section.frequency_range
    if limits is not None and not limits[0] < limits[1]:
        allowed = allowed_values("mistuning.frequency_range")
        yield input_error(file.path, "mistuning.frequency_range", shown(list(limits)), allowed)
    highest = scene.excitation.highest_harmonic
    if section.harmonics < highest:
        allowed = f"{highest} or more, the highest harmonic of the excitation"
        yield input_error(file.path, "mistuning.harmonics", str(section.harmonics), allowed)
    if scene.response.method != "coupled":
        allowed = '"coupled", with [mistuning]'
        yield input_error(file.path, "response.method", shown(scene.response.method), allowed)
