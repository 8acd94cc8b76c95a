"""Checks of [run_up] beyond the schema."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.loads_section import unit_vector
from pipeline.scene.reading import SceneFile
from pipeline.scene.validation_errors import allowed_values
from pipeline.studies.backbone.checks import unfit_curves

CIRCUMFERENTIAL = 0.99  # least part of a direction along the circumference


def unfit_run_up_keys(file: SceneFile, given_model: bool = False) -> Iterator[InputError]:
    """Keys of [run_up] that do not fit each other or the rest of a scene."""
    section = file.first.run_up
    if section is None:
        return
    for name in ("rate", "speed_rate"):
        rates = getattr(section, name) or ()
        if len(set(rates)) < len(rates):
            yield input_error(file.path, f"run_up.{name}", shown(list(rates)), allowed_values(f"run_up.{name}"))
    yield from unfit_curves(file, "run_up", section.curves)
    single = [item.name for item in file.first.output if not item.of_model and item.direction != "magnitude"]
    if section.output is not None and section.output not in single:
        allowed = ", ".join(f'"{name}"' for name in single) or allowed_values("run_up.output")
        yield input_error(file.path, "run_up.output", shown(section.output), allowed)
    yield from _unfit_probes(file)
    if not given_model:
        yield from _unfit_direction(file)
    for member in file.members:
        order = getattr(member.scene.excitation, "engine_order", None)
        if section.speed_rate is not None and order == 0:
            allowed = "run_up.rate: with engine order 0 the excitation does not follow the speed"
            yield input_error(file.path, "run_up.speed_rate", shown(list(section.speed_rate)), allowed)
            return
        limits = getattr(member.scene.response, "frequency", None)
        ends = section.frequency
        if ends is not None and limits is not None and not limits[0] <= ends[0] < ends[1] <= limits[1]:
            allowed = f"two numbers, the second above the first, within response.frequency = {list(limits)}"
            yield input_error(file.path, "run_up.frequency", shown(list(ends)), allowed)
            return


def _unfit_probes(file: SceneFile) -> Iterator[InputError]:
    """Probes that cannot be passed, or that do not read a displacement along the circumference."""
    scene, section = file.first, file.first.run_up
    if section is None or section.probes is None:
        return
    probes, place = section.probes, "run_up.probes"
    if probes.radius is None and scene.blade is None:
        yield input_error(file.path, f"{place}.radius", "missing", "a number above 0, as the scene has no [blade]")
    if scene.blade is not None and probes.blades > scene.blade.n_blades:
        yield input_error(file.path, f"{place}.blades", shown(probes.blades), f"1 to {scene.blade.n_blades}")
    strains = [item.name for item in scene.output if item.quantity == "strain"]
    if section.output in strains:
        yield input_error(
            file.path, "run_up.output", f"{shown(section.output)}, a strain", "a displacement, with probes"
        )
    for member in file.members:
        order = getattr(member.scene.excitation, "engine_order", 1)
        if order == 0 and not member.scene.load.speed_rpm:
            allowed = "load.speed_rpm above 0: with engine order 0 the speed does not follow the excitation"
            yield input_error(file.path, place, "a rotor at rest", allowed)
            return


def _unfit_direction(file: SceneFile) -> Iterator[InputError]:
    """An output that is not along the circumference, y of a blade that is made here, which is what probes read."""
    scene, section = file.first, file.first.run_up
    if section is None or section.probes is None or scene.blade is None or scene.model is not None:
        return
    named = {item.name: item for item in scene.output}.get(section.output or "")
    if named is not None and named.quantity == "displacement":
        place, direction = "run_up.output", named.direction
    elif section.output is None and scene.excitation is not None:
        place, direction = "excitation.direction", scene.excitation.direction
    else:
        return
    if direction != "magnitude" and unit_vector(direction)[1] < CIRCUMFERENTIAL:
        found = shown(direction if isinstance(direction, str) else list(direction))
        allowed = '"y", with probes, or run_up.output: an [[output]] with direction = "y"'
        yield input_error(file.path, place, found, allowed)
