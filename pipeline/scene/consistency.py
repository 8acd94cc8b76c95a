"""Checks beyond the schema: keys that must agree with each other and with the geometry. Cheap: nothing is built."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nonlinear import least_samples
from pipeline.errors import InputError, input_error, shown
from pipeline.scene.centrifugal_strain import check_speed
from pipeline.scene.geometry_parameters import geometry_parameters
from pipeline.scene.reading import Member, SceneFile, key_in_file
from pipeline.scene.schema import SECTIONS
from pipeline.scene.size_limits import check_balance, check_modes, check_size, check_sweep
from pipeline.scene.validation_errors import allowed_values

PER_NODE = ("normal_stiffness", "tangential_stiffness", "friction", "interference", "preload")
BLADE_SECTIONS = ("blade", "shroud", "material", "mesh")


def check_scene(file: SceneFile) -> None:
    """Check every member of a scene that describes a blade.

    Raises
    ------
    InputError
        The first key that is missing or does not fit.
    """
    _check_pictured_curves(file)
    checked_shapes: set[object] = set()  # a sweep has few different ones
    for member in file.members:
        for section in BLADE_SECTIONS:
            if getattr(member.scene, section) is None:
                allowed = f"a table [{section}] (only `shroud respond --rom` does without)"
                raise input_error(file.path, section, "missing", allowed)
    check_sweep(file)
    for member in file.members:
        scene = member.scene
        _check_keys(file.path, member)
        shape = scene.blade, scene.shroud, scene.mesh
        if shape not in checked_shapes:
            _check_geometry(file.path, member)
            checked_shapes.add(shape)
        check_size(file.path, member)
        check_speed(file.path, member)
        assert scene.mesh is not None  # checked above; for the type checker
        n_contacts = scene.mesh.contact_grid[0] * scene.mesh.contact_grid[1]
        check_node_lists(file.path, member, n_contacts)
        check_modes(file.path, member, n_contacts)
        check_balance(file.path, member, n_contacts)


def check_scene_for_model(file: SceneFile, n_contacts: int, has_area: bool) -> None:
    """Check every member of a scene that runs on a given reduced model with `n_contacts` nodes on a face.

    Raises
    ------
    InputError
        The first key that does not fit the model.
    """
    for member in file.members:
        _check_keys(file.path, member)
        check_node_lists(file.path, member, n_contacts)
        check_balance(file.path, member, n_contacts)
        if member.scene.contact.uses_punch and (member.scene.material is None or not has_area):
            allowed = "numbers (the punch formula needs [material] and contact/area in the reduced model)"
            raise input_error(file.path, "contact.normal_stiffness", '"punch"', allowed)


def _check_pictured_curves(file: SceneFile) -> None:
    """Curves whose motion is to be drawn must be among those of the sweep."""
    render = file.first.render
    if render is None or isinstance(render.operating, bool):
        return
    last = len(file.members) - 1
    for number in render.operating:
        if number > last:
            allowed = f"true, false or a list of numbers of curves, 0 to {last}"
            raise input_error(file.path, "render.operating", shown(list(render.operating)), allowed)


def check_node_lists(path: Path, member: Member, n_contacts: int) -> None:
    """Lists that go node by node must have one number for each of the `n_contacts` nodes of a face.

    Raises
    ------
    InputError
        A list of another length.
    """
    for name in PER_NODE:
        value = getattr(member.scene.contact, name)
        if isinstance(value, tuple) and len(value) != n_contacts:
            found = f"a list of {len(value)}"
            raise input_error(
                path, key_in_file(member, f"contact.{name}"), found, f"a number or a list of {n_contacts}"
            )


def _check_keys(path: Path, member: Member) -> None:
    scene = member.scene
    response = scene.response
    low, high = response.frequency
    if not low < high:
        raise _refused(path, member, "response.frequency", [low, high])
    if response.rayleigh is not None and not any(response.rayleigh):
        raise _refused(path, member, "response.rayleigh", list(response.rayleigh))
    if response.damping_ratio is not None and response.rayleigh is not None:
        raise input_error(path, "response.rayleigh", "given beside damping_ratio", "one of the two")
    if response.damping_ratio is None and response.rayleigh is None:
        raise input_error(path, "response.damping_ratio", "missing", allowed_values("response.damping_ratio"))
    if response.residual_tractions == "bounds" and response.method != "coupled":
        allowed = '"projected" with response.method = "static-first"'
        raise input_error(path, key_in_file(member, "response.residual_tractions"), '"bounds"', allowed)
    if scene.rom.modes is not None and scene.rom.frequency_limit is not None:
        raise input_error(path, "rom.frequency_limit", "given beside modes", "one of the two")
    if not any(scene.excitation.unit_direction):
        raise _refused(path, member, "excitation.direction", list(scene.excitation.direction))
    least = least_samples(1 if response.harmonics == "auto" else response.harmonics)
    if scene.contact.samples < least:
        allowed = f"{least} or more with {response.harmonics} harmonics"
        raise input_error(path, key_in_file(member, "contact.samples"), shown(scene.contact.samples), allowed)


def _check_geometry(path: Path, member: Member) -> None:
    from geometry import GeometryError, check_parameters

    blade, shroud, mesh = geometry_parameters(member.scene)
    try:
        check_parameters(blade, shroud, mesh)
    except GeometryError as error:
        raise parameter_error(path, member, error) from None


def parameter_error(path: Path, member: Member, error: Any) -> InputError:
    """The one line for an exception that carries `table`, `parameter`, `value` and `allowed`."""
    key = f"{error.table}.{error.parameter}"
    known = error.table in SECTIONS and error.parameter in SECTIONS[error.table].model_fields
    return input_error(path, key_in_file(member, key) if known else key, shown(error.value), str(error.allowed))


def _refused(path: Path, member: Member, key: str, value: Any) -> InputError:
    return input_error(path, key_in_file(member, key), shown(value), allowed_values(key))
