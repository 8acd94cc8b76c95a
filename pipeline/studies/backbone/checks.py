"""Checks of [backbone] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values


def unfit_backbone_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [backbone] that do not fit each other or the rest of a scene."""
    section = file.first.backbone
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
    yield from unfit_curves(file, "backbone", section.curves)


def unfit_curves(file: SceneFile, study: str, curves: str | Sequence[int]) -> Iterator[InputError]:
    """Numbers of curves that a study asks for and the scene does not have; a method that knows no free motions."""
    count = len(file.members)
    if not isinstance(curves, str) and max(curves) >= count:
        allowed = f'"all" or a list of numbers of curves, 0 to {count - 1}'
        yield input_error(file.path, f"{study}.curves", shown(list(curves)), allowed)
    for member in file.members:
        method = getattr(member.scene.response, "method", "coupled")  # no section where it does not obey the schema
        if method != "coupled":
            found, allowed = shown(method), f'"coupled", with [{study}]'
            yield input_error(file.path, member.key_in_file("response.method"), found, allowed)
            return
