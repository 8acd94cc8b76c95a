"""Checks of [map] beyond the schema: keys that can have a range, and values that they can have."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from pipeline.errors import InputError, input_error, shown, shown_key
from pipeline.scene.reading import IGNORED_WITH_MODEL, WITHOUT_EFFECT_ON_MODEL, SceneFile
from pipeline.scene.sweep import swept_keys, takes_fractions
from pipeline.scene.validation_errors import unknown_key
from pipeline.studies.map.section import LOGARITHMIC

PLACE = "map.over"
LEAST_STEP = 1e-9  # relative


def unfit_map_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [map] that cannot be mapped, and values that the scene does not allow."""
    from pipeline.scene.reading import derived_member

    section = file.first.map
    for key, values in () if section is None else section.over.items():
        error = _unfit_key(file, key, given_model) or _unfit_values(file, key, values)
        if error is not None:
            yield error
            continue
        for end in (values[0], values[-1]):
            try:
                derived_member(file, {key: end}, PLACE, given_model)
            except InputError as refused:
                yield refused
                break
    if section is not None:
        for key in section.logarithmic:
            if key not in section.over or section.over[key][0] <= 0.0:
                yield input_error(file.path, "map.logarithmic", shown(list(section.logarithmic)), LOGARITHMIC)
                return


def _unfit_key(file: SceneFile, key: str, given_model: bool) -> InputError | None:
    """The error of a key that is unknown, takes whole numbers or words only, or is not of this scene."""
    place, section = f"{PLACE}.{shown_key(key)}", key.partition(".")[0]
    if key not in (known := swept_keys(key)):
        return unknown_key(file.path, key, known, PLACE)
    if not takes_fractions(key):
        return input_error(file.path, place, "cannot be mapped", "keys of numbers with a fraction")
    if given_model and (section in IGNORED_WITH_MODEL or key in WITHOUT_EFFECT_ON_MODEL):
        allowed = "keys of load, contact, excitation and response"
        return input_error(file.path, place, "has no effect on a given reduced model", allowed)
    if getattr(file.first, section) is None:
        return input_error(file.path, place, f"the scene has no [{section}]", "keys of sections that it has")
    return None


def _unfit_values(file: SceneFile, key: str, values: tuple[float, ...]) -> InputError | None:
    """The error of values that do not ascend, or of two that are the same to nine digits."""
    if all(high - low > LEAST_STEP * max(abs(low), abs(high)) for low, high in pairwise(values)):
        return None
    return input_error(file.path, f"{PLACE}.{shown_key(key)}", shown(list(values)), "ascending numbers")
