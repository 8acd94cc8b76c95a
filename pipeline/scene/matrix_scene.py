"""Checks of a scene with [model]: what does not go with matrices, and whether their files are there."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import InputError, input_error, shown, shown_file, system_reason
from pipeline.scene.reading import Member, SceneFile, key_in_file
from pipeline.scene.validation_errors import allowed_values

_BESIDE = ("blade", "shroud", "disk", "materials", "mesh")


def unfit_beside_matrices(file: SceneFile) -> Iterator[InputError]:
    """Sections and keys that do not go with matrices, of the first member."""
    scene = file.first
    for section in _BESIDE:
        if getattr(scene, section):
            yield input_error(file.path, section, "given beside [model]", "one of the two")
    if scene.contact.uses_punch and scene.material is None:
        allowed = "numbers (the punch formula needs [material])"
        yield input_error(file.path, "contact.normal_stiffness", '"punch"', allowed)
    if "equilibrium" in scene.load.model_fields_set:
        allowed = "nothing with [model]: without elements no static equilibrium is computed"
        yield input_error(file.path, "load.equilibrium", shown(scene.load.equilibrium), allowed)


def unfit_matrix_keys(path: Path, member: Member) -> Iterator[InputError]:
    """Keys of a member that do not fit its matrices, and files that are not there."""
    scene, model = member.scene, member.scene.model
    assert model is not None
    rom = scene.rom
    if "contact_dofs" in rom.model_fields_set and rom.contact_dofs != "nodal":
        allowed = '"nodal" with [model]: averages over a face need its elements'
        yield input_error(path, key_in_file(member, "rom.contact_dofs"), shown(rom.contact_dofs), allowed)
    if model.transformation is not None and not model.reduced:
        allowed = "nothing without reduced = true"
        yield input_error(path, key_in_file(member, "model.transformation"), shown(model.transformation), allowed)
    if model.reduced:
        yield from _unfit_loads_of_superelement(path, member)
    speed = scene.load.speed_rpm
    if speed != 0.0 and speed != model.speed_rpm:
        other = f" or {model.speed_rpm:g}" if model.speed_rpm else ""
        allowed = f"0{other}, the speed that the stiffness of [model] holds at (model.speed_rpm)"
        yield input_error(path, key_in_file(member, "load.speed_rpm"), shown(speed), allowed)
    for name, file in model.files.items():
        if problem := _problem(Path(file)):
            key = f"model.{name}"
            yield input_error(path, key_in_file(member, key), f"{shown_file(file)}: {problem}", allowed_values(key))


def _unfit_loads_of_superelement(path: Path, member: Member) -> Iterator[InputError]:
    """Loads and outputs on nodes, whose displacements a superelement may not have."""
    scene, allowed = member.scene, "nothing with model.reduced: the force at excitation.at, or forces on modes"
    given = {
        "excitation.load": any(load.mode is None for load in scene.excitation.load),
        "load.force": bool(scene.load.force),
        "load.pressure": bool(scene.load.pressure),
        "load.temperature": scene.load.temperature is not None,
        "output": any(not output.of_model for output in scene.output),
    }
    for key, is_given in given.items():
        if is_given:
            yield input_error(path, key, "loads or outputs on nodes", allowed)


def _problem(file: Path) -> str:
    """What is wrong with a file; empty for one that can be opened."""
    try:
        found = file.exists()
    except (OSError, ValueError) as error:  # a name that is too long, or with a zero byte
        return f"cannot be read: {system_reason(error) if isinstance(error, OSError) else error}"
    if not found:
        near = difflib.get_close_matches(file.name, _names(file.parent), n=1, cutoff=0.5)
        return "no such file" + (f", did you mean {near[0]}?" if near else "")
    if not file.is_file():
        return "not a file"
    try:
        with file.open("rb"):
            return ""
    except OSError as error:
        return f"cannot be read: {system_reason(error)}"


def _names(folder: Path) -> list[str]:
    return os.listdir(folder) if folder.is_dir() else []
