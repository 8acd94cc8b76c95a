"""Checks of [wear] beyond the schema: one life, a duty, limits that a face can reach."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values
from pipeline.studies.wear.section import Wear

PLACE = "wear.duty"


def unfit_wear_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [wear] that do not fit each other or the rest of a scene."""
    scene, section = file.first, file.first.wear
    if section is None:
        return
    if (section.hours is None) == (section.cycles is None):
        found = "missing" if section.hours is None else f"{section.hours:g} beside cycles"
        yield input_error(file.path, "wear.hours", found, "hours or cycles, one of the two")
    if scene.response.method != "coupled":
        yield input_error(file.path, "response.method", shown(scene.response.method), '"coupled", with [wear]')
    if isinstance(section.coefficient, dict) and scene.interfaces is not None:
        known = {*scene.interfaces, *map(scene.table_of, scene.interfaces)}
        allowed = ", ".join(scene.interfaces) or "a number: the scene has no interface by name"
        for name in section.coefficient:
            if name not in known:
                place = f"wear.coefficient.{name}"
                yield input_error(file.path, place, "no such interface", allowed)
    if section.margin_limit is not None and (scene.fatigue is None or given_model):
        yield input_error(file.path, "wear.margin_limit", f"{section.margin_limit:g}", "a scene with [fatigue]")
    if scene.shroud is not None and (section.depth_limit or 0.0) > scene.shroud.contact_length:
        allowed = f"{scene.shroud.contact_length:g} m at most, the length of the face"
        yield input_error(file.path, "wear.depth_limit", f"{section.depth_limit:g}", allowed)
    yield from _unfit_duty(file, section, given_model)
    yield from _unfit_samples(file, section)


def _unfit_samples(file: SceneFile, section: Wear) -> Iterator[InputError]:
    """Samples without a limit or without a distribution, and distributions without samples."""
    laws = () if file.first.uncertainty is None else file.first.uncertainty.parameter
    if section.samples is None:
        if section.coefficient_factor is not None:
            found = f"{section.coefficient_factor:g} without samples"
            yield input_error(file.path, "wear.coefficient_factor", found, "beside wear.samples")
        return
    if section.amplitude_limit is None and section.depth_limit is None:
        allowed = "a scene with wear.amplitude_limit or wear.depth_limit"
        yield input_error(file.path, "wear.samples", str(section.samples), allowed)
    if section.coefficient_factor is None and not laws:
        allowed = "a scene with wear.coefficient_factor or [uncertainty]"
        yield input_error(file.path, "wear.samples", str(section.samples), allowed)
    for number, item in enumerate(laws):
        if item.correlation_length is not None:
            place = f"uncertainty.parameter[{number}].correlation_length"
            yield input_error(file.path, place, shown(item.correlation_length), "nothing with wear.samples")


def _unfit_duty(file: SceneFile, section: Wear, given_model: bool) -> Iterator[InputError]:
    """A duty that sums to nothing, frequencies beyond the range, values that the scene does not allow."""
    from pipeline.scene.reading import derived_member

    if not sum(point.share for point in section.points) > 0.0:
        shares = shown([point.share for point in section.duty])
        yield input_error(file.path, PLACE, f"shares {shares}", allowed_values(PLACE))
    low, high = file.first.response.frequency
    for number, point in enumerate(section.duty):
        if point.frequency is not None and not low <= point.frequency <= high:
            place, allowed = f"{PLACE}[{number}].frequency", f"{low:g} to {high:g}, response.frequency"
            yield input_error(file.path, place, f"{point.frequency:g}", allowed)
        try:
            derived_member(file, point.values, PLACE, given_model)
        except InputError as refused:
            yield refused
