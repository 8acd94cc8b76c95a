"""Checks of [backbone] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values


def unfit_backbone_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [backbone] that do not fit each other or the rest of a scene."""
    section, count = file.first.backbone, len(file.members)
    if section is None:
        return
    for name in ("modes", "nodal_diameters"):
        numbers = getattr(section, name) or ()
        if len(set(numbers)) < len(numbers):
            yield input_error(file.path, f"backbone.{name}", shown(list(numbers)), allowed_values(f"backbone.{name}"))
    limits = section.amplitudes
    if limits is not None and not limits[0] < limits[1]:
        yield input_error(
            file.path, "backbone.amplitudes", shown(list(limits)), allowed_values("backbone.amplitudes")
        )
    if section.curves != "all" and max(section.curves) >= count:
        allowed = f'"all" or a list of numbers of curves, 0 to {count - 1}'
        yield input_error(file.path, "backbone.curves", shown(list(section.curves)), allowed)
    for member in file.members:
        method = getattr(member.scene.response, "method", "coupled")  # no section where it does not obey the schema
        if method != "coupled":
            found, allowed = shown(method), '"coupled", with [backbone]'
            yield input_error(file.path, member.key_in_file("response.method"), found, allowed)
            return
