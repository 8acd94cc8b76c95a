"""Checks beyond the schema: keys that must agree with each other and with the geometry. Cheap: nothing is built.

`check_scene` raises the first error, `all_errors` lists every one in the order of the lines (`shroud validate`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Set
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nonlinear.options import least_samples
from pipeline.errors import InputError, input_error, shown, shown_file, shown_key
from pipeline.scene.aero_section import unfit_aero
from pipeline.scene.blade_section import DAMPER, INTERFACES
from pipeline.scene.contact_section import PER_NODE, FaceField, Interface
from pipeline.scene.dotted_keys import CONTACT, INTERFACE, interface_of, of_contact
from pipeline.scene.elastic_material import unfit_material_keys
from pipeline.scene.fields import LEAST_DAMPING
from pipeline.scene.geometry_parameters import SECTIONS_KEY, geometry_parameters
from pipeline.scene.input_files import file_problem
from pipeline.scene.loads_section import SETS, files_of, force_table, temperature_table
from pipeline.scene.material_section import USUAL_MATERIAL, unfit_stress_keys
from pipeline.scene.mesh_section import MAIN_INTERFACE, check_mesh_file
from pipeline.scene.model_section import unfit_beside_matrices, unfit_matrix_keys
from pipeline.scene.plausibility import far_beyond, hints_first, rayleigh_ratio
from pipeline.scene.presets import SIZE
from pipeline.scene.reading import Member, SceneFile, parameter_error, scene_of_tables
from pipeline.scene.schema import SECTIONS, Scene
from pipeline.scene.size_limits import check_balance, check_modes, check_size, check_speed, check_sweep
from pipeline.scene.sweep import SHIFTED, read_sweep
from pipeline.scene.toml_text import key_lines, line_of, load_tables, plain_key, with_line
from pipeline.scene.validation_errors import MOST_ERRORS, allowed_values
from pipeline.scene.varied_keys import studied_keys, unfit_varied_keys

if TYPE_CHECKING:
    from pipeline.scene.reading import Member, SceneFile
    from pipeline.scene.schema import Scene


def unfit_beside_disk(file: SceneFile) -> Iterator[InputError]:
    """A disk that nothing holds has no static response, which stresses need."""
    scene, name = file.first, free_bore(file.first)
    if name and scene.with_stress:
        section = "fatigue" if scene.stress is None else "stress"
        yield input_error(file.path, section, f'given with {name}.bore = "free"', f'{name}.bore = "clamped"')


def free_bore(scene: Scene) -> str | None:
    """Section of the disk that nothing holds; None where there is no such disk."""
    parts = (("disk", scene.disk), ("mesh", scene.mesh))
    return next((name for name, part in parts if part is not None and part.bore == "free"), None)


def unfit_disk_keys(path: Path, member: Member) -> Iterator[InputError]:
    """Keys of a member that do not fit a disk."""
    scene = member.scene
    waves = scene.rom.nodal_diameters
    if waves is None:
        return
    place = member.key_in_file("rom.nodal_diameters")
    if scene.disk is None and scene.mesh_file is None:
        yield input_error(path, place, shown(list(waves)), "nothing without a disk")
    elif scene.n_blades is not None and max(waves) > scene.n_blades // 2:
        allowed = f"whole numbers, 0 to {scene.n_blades // 2} with {scene.n_blades} blades"
        yield input_error(path, place, shown(list(waves)), allowed)


LEAST_FLANK_ANGLE = 1.0  # degrees
PARTS = ("blade", "shroud", "snubber", "platform", "damper", "disk")  # of a blade made here
BLADE_SECTIONS = ("blade", "shroud", "material", "mesh")
Unfit = Iterator[InputError]


def check_scene(file: SceneFile, force: bool = False) -> None:
    """Check every member of a scene that describes a blade."""
    for error in unfit_keys(file, {}, force):
        raise _after_hint(file, error)


def _after_hint(file: SceneFile, error: InputError) -> InputError:
    """An error, behind the hint on a value in another unit where there is one: the error may come of it."""
    first, *others = hints_first(file, [error])
    if not others or first is error:
        return first
    found = InputError(f"{first} ({str(error).removeprefix(f'{file.path}: ')})")
    found.source, found.key = first.source, first.key
    return found


def unfit_keys(file: SceneFile, broken: Mapping[int, Set[str]], force: bool = False) -> Unfit:
    """Every key of a scene that is missing or does not fit the others."""
    if not force:
        yield from far_beyond(file, broken)
    if not broken.get(0):
        yield from _raised(_check_pictured_curves, file)
        yield from unfit_stress_keys(file)
        yield from unfit_material_keys(file)
        yield from unfit_beside_disk(file)
        yield from _unfit_studies(file)
    if not any(broken.values()):
        yield from unfit_varied_keys(file)
    has_matrices = file.first.model is not None or "model" in broken.get(0, ())
    absent = set() if has_matrices else _absent_sections(file.first) - set(broken.get(0, ()))
    for section in BLADE_SECTIONS:
        if section in absent:
            allowed = f"a table [{section}] (only `shroud respond --rom` does without)"
            yield input_error(file.path, section, "missing", allowed)
    if not broken.get(0):
        yield from unfit_beside_matrices(file) if has_matrices else _unfit_beside_mesh(file)
    if has_matrices:
        yield from _unfit_members_with_matrices(file, broken)
        return
    if "blade" not in broken.get(0, ()) and file.first.blade is not None and file.first.blade.sections is not None:
        sections = file.first.blade.sections
        if problem := file_problem(Path(sections), "a CSV file", (".csv",)):
            yield input_error(file.path, SECTIONS_KEY, f"{shown_file(sections)}: {problem}")
            return
    if not absent and not any(broken.values()):
        yield from _raised(check_sweep, file)
    checked_shapes: set[object] = set()  # a sweep has few different ones
    for member in file.members:
        wrong = absent | broken.get(member.index, set())
        yield from _unfit_keys(file.path, member, wrong)
        if "mesh" not in wrong and member.scene.mesh_file is not None:
            yield from _raised(check_mesh_file, file.path, member)
        elif not wrong & {*PARTS, "mesh"}:
            shape = tuple(getattr(member.scene, name) for name in (*PARTS, "mesh"))
            if shape not in checked_shapes:
                yield from _raised(_check_geometry, file.path, member)
            checked_shapes.add(shape)
        yield from _unfit_sizes(file.path, member, wrong)


def _unfit_members_with_matrices(file: SceneFile, broken: Mapping[int, Set[str]]) -> Unfit:
    """Keys of scenes with [model], where the files alone tell the number of contact nodes."""
    for member in file.members:
        wrong = broken.get(member.index, set())
        yield from _unfit_keys(file.path, member, wrong)
        if not wrong & {"model", "rom", "load", "excitation", "output"}:
            yield from unfit_matrix_keys(file.path, member)


def _absent_sections(scene: Scene) -> set[str]:
    """The sections of a blade that a scene lacks; a mesh from a file or matrices take the place of all others."""
    if scene.model is not None:
        return set()
    needed: tuple[str, ...] = ("mesh",) if scene.mesh_file is not None else BLADE_SECTIONS
    if scene.snubber is not None or (scene.platform is not None and scene.has_damper):
        needed = tuple(name for name in needed if name != "shroud")
    return {name for name in needed if getattr(scene, name) is None}


def _unfit_beside_mesh(file: SceneFile) -> Unfit:
    """Sections that describe a blade beside a mesh from a file, materials by name without one."""
    scene = file.first
    if scene.mesh_file is None:
        if others := set(scene.materials) - ({"disk"} if scene.disk is not None else set()):
            allowed = "a table [material]" if scene.disk is None else "tables [material] and [materials.disk]"
            name = "materials" if scene.disk is None else f"materials.{min(others)}"
            yield input_error(file.path, name, "given without mesh.file", allowed)
        elif scene.disk is not None and "disk" in scene.materials:
            for key in USUAL_MATERIAL:
                if key not in scene.materials["disk"].given:
                    yield input_error(
                        file.path, f"materials.disk.{key}", "missing", allowed_values(f"material.{key}")
                    )
        return
    for section in PARTS:
        if getattr(scene, section) is not None:
            yield input_error(file.path, section, "given beside mesh.file", "one of the two")
    if scene.punch_key and scene.material is None:
        allowed = "numbers (the punch formula needs [material])"
        yield input_error(file.path, scene.punch_key, '"punch"', allowed)


def _unfit_sizes(path: Path, member: Member, wrong: Set[str]) -> Unfit:
    """Keys that make the model too large, or that do not fit its numbers of contact nodes and modes."""
    if not wrong & {"blade", "shroud", "mesh", "excitation"}:
        yield from _raised(check_size, path, member)
    if not wrong & {"blade", "material", "load"}:
        yield from _raised(check_speed, path, member)
    if not wrong & {"blade", "disk", "mesh", "rom"}:
        yield from unfit_disk_keys(path, member)
    if "mesh" in wrong:
        return
    assert member.scene.mesh is not None  # checked above; for the type checker
    along, radial = member.scene.mesh.contact_grid
    names, damper = member.scene.interfaces or (MAIN_INTERFACE,), member.scene.damper
    of_damper = along if damper is not None and damper.form == "cylinder" else along * radial
    of_grid = {name: of_damper if name in INTERFACES[DAMPER] else along * radial for name in names}
    if damper is not None and not wrong & {"platform", "damper"}:
        yield from _unfit_damper(path, member, radial)
    n_contacts = sum(of_grid.values())
    if not wrong & {CONTACT, INTERFACE}:
        if member.scene.interfaces is not None:
            yield from unfit_interfaces(path, member, member.scene.interfaces)
        if not member.scene.mesh.interface:  # of which the mesh alone tells the patches
            yield from unfit_node_lists(path, member, of_grid)
    if not wrong & {"rom", "excitation", "response", "render"}:
        yield from _raised(check_modes, path, member, n_contacts)
    if "response" not in wrong:
        yield from _raised(check_balance, path, member, n_contacts)


def _unfit_damper(path: Path, member: Member, rows: int) -> Unfit:
    """A damper without flanks to lie on, or with flanks that it cannot lie on."""
    damper, platform, mesh = member.scene.damper, member.scene.platform, member.scene.mesh
    assert damper is not None
    assert mesh is not None  # the checks see to both
    if platform is None:
        yield input_error(path, "platform", "missing", "a table [platform], under whose flanks the damper lies")
    elif platform.flank_angle < LEAST_FLANK_ANGLE:
        place, allowed = member.key_in_file("platform.flank_angle"), f"{LEAST_FLANK_ANGLE:g} or more with [damper]"
        yield input_error(path, place, shown(platform.flank_angle), f"{allowed}: the flanks face the same way")
    elif damper.form == "wedge" and rows == 1:
        place, allowed = (
            member.key_in_file("mesh.contact_grid"),
            'two rows or more: on one a wedge rolls as a "cylinder"',
        )
        yield input_error(path, place, shown(list(mesh.contact_grid)), allowed)
    elif damper.form == "cylinder" and rows % 2 == 0:
        grid, allowed = (
            list(mesh.contact_grid),
            "an odd second number: a cylinder touches the middle row",
        )
        yield input_error(path, member.key_in_file("mesh.contact_grid"), shown(grid), allowed)


def _raised(check: Callable[..., Any], *arguments: Any) -> Unfit:
    """The error that a check raises, if any."""
    try:
        check(*arguments)
    except InputError as error:
        yield error


def check_scene_for_model(
    file: SceneFile, interfaces: Mapping[str, int], n_blades: int | None, has_area: bool, has_frame: bool
) -> None:
    """Check every member of a scene that runs on a given reduced model, whose `interfaces` have so many nodes."""
    for error in _unfit_studies(file, given_model=True):
        raise error
    for member in file.members:
        for error in _unfit_keys(file.path, member, {"aero"}):
            raise error
        if member.scene.aero is not None:
            for error in unfit_aero(file.path, member.scene.aero, member.scene, n_blades):
                raise error
        check_contacts(file, member, interfaces)
        if (key := member.scene.punch_key) and (member.scene.material is None or not has_area):
            allowed = "numbers (the punch formula needs [material] and contact/area in the reduced model)"
            raise input_error(file.path, key, '"punch"', allowed)
        for key, _ in _fields(member.scene) if not has_frame else ():
            allowed = "a number or a list (a field needs contact/frame in the reduced model)"
            raise input_error(file.path, member.key_in_file(key), "a table", allowed)


def _fields(scene: Scene) -> Iterator[tuple[str, FaceField]]:
    """Keys whose values are fields over a contact face, with the fields."""
    tables = {CONTACT: scene.contact} | {f"{INTERFACE}.{name}": table for name, table in scene.interface.items()}
    for table, section in tables.items():
        for name in PER_NODE:
            if isinstance(value := getattr(section, name), FaceField):
                yield f"{table}.{name}", value


def check_contacts(file: SceneFile, member: Member, interfaces: Mapping[str, int]) -> None:
    """Refuse what does not fit the contact interfaces of a model, which have so many nodes."""
    path = file.path
    for error in unfit_interfaces(path, member, interfaces):
        raise error
    for error in unfit_varied_keys(file, interfaces) if member is file.members[0] else ():
        raise error
    chosen = member.scene.contact.interfaces
    touching = {name: count for name, count in interfaces.items() if chosen is None or name in chosen}
    for error in unfit_node_lists(path, member, touching):
        raise error
    check_balance(path, member, sum(touching.values()))


def unfit_interfaces(path: Path, member: Member, known: Collection[str]) -> Unfit:
    """Names of contact interfaces that the model does not have."""
    scene, allowed = member.scene, f"contact interfaces of the model: {', '.join(known)}"
    for name in scene.contact.interfaces or ():
        if name not in known:
            yield input_error(path, member.key_in_file("contact.interfaces"), shown(name), allowed)
    for name in set(scene.interface) - ({DAMPER} if set(INTERFACES[DAMPER]) <= set(known) else set()):
        if name not in known:
            swept = next((key for key in member.parameters if interface_of(key) == name), "")
            key = member.key_in_file(swept) if swept else f"{INTERFACE}.{shown_key(name)}"
            yield input_error(path, key, "unknown name", allowed)
    for varied in studied_keys(scene):
        if (name := interface_of(varied.key)) and name not in known:
            yield input_error(path, varied.place, f"{shown(varied.key)}, unknown name {shown_key(name)}", allowed)


def _unfit_studies(file: SceneFile, given_model: bool = False) -> Unfit:
    """Keys of the sections of studies that do not fit the scene; each study has its checks in its folder."""
    for name in file.first.studies:
        yield from getattr(import_module(f"pipeline.studies.{name}.checks"), f"unfit_{name}_keys")(file, given_model)


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


def unfit_node_lists(path: Path, member: Member, interfaces: Mapping[str, int]) -> Unfit:
    """Lists that go node by node and have not one number for each node of an interface."""
    scene = member.scene
    for interface, count in interfaces.items():
        contact, named = scene.contact_of(interface), scene.table_of(interface)
        own = scene.interface.get(named, Interface())
        for name in PER_NODE:
            value = getattr(contact, name)
            if isinstance(value, tuple) and len(value) != count:
                table = CONTACT if getattr(own, name) is None else f"{INTERFACE}.{named}"
                of = f" of {interface}" if len(interfaces) > 1 else ""
                found, allowed = f"a list of {len(value)}", f"a number or a list of {count}, the nodes{of}"
                yield input_error(path, member.key_in_file(f"{table}.{name}"), found, allowed)


def _unfit_keys(path: Path, member: Member, wrong: Set[str]) -> Unfit:
    """Keys that do not fit each other, of the sections that obey the schema."""
    scene = member.scene
    if "response" not in wrong:
        yield from _unfit_response(path, member)
    for key, field in _fields(scene) if not wrong & {CONTACT, INTERFACE} else ():
        if field.ends[0] < 0.0 and of_contact(key) not in SHIFTED:
            found = f"a field that falls to {field.ends[0]:g}"
            yield input_error(path, member.key_in_file(key), found, "a field that is nowhere below 0")
    if "rom" not in wrong and scene.rom.modes is not None and scene.rom.frequency_limit is not None:
        yield input_error(path, "rom.frequency_limit", "given beside modes", "one of the two")
    if "excitation" not in wrong:
        yield from _unfit_excitation(path, member)
    if not wrong & {"excitation", "load", "output"}:
        yield from _unfit_files(path, scene)
        yield from _unfit_sets(path, scene)
    if not wrong & {"excitation", "response"} and isinstance(scene.response.harmonics, int):
        highest = scene.excitation.highest_harmonic
        if scene.response.harmonics < highest:
            allowed = f'{highest} or more, the highest harmonic of the excitation, or "auto"'
            yield input_error(path, member.key_in_file("response.harmonics"), str(scene.response.harmonics), allowed)
    if "aero" not in wrong and scene.aero is not None:
        yield from unfit_aero(path, scene.aero, scene, scene.n_blades)
    if not wrong & {"response", "contact"}:
        harmonics = scene.response.harmonics
        least = least_samples(1 if harmonics == "auto" else harmonics)
        if scene.contact.samples < least:
            allowed = f"{least} or more with {harmonics} harmonics"
            yield input_error(path, member.key_in_file("contact.samples"), shown(scene.contact.samples), allowed)


def _unfit_excitation(path: Path, member: Member) -> Unfit:
    """A direction or a force that is zero."""
    wave = member.scene.excitation
    if not any(wave.unit_direction):
        yield _refused(path, member, "excitation.direction", list(wave.direction))
    factors = {item.order: item.amplitude for item in wave.harmonic}
    amplitudes = [(item.harmonic, item.amplitude) for item in wave.load] or [(h, 1.0) for h in {1, *factors}]
    if not any(amplitude * factors.get(harmonic, 1.0) for harmonic, amplitude in amplitudes):
        place = "excitation.load" if wave.load else "excitation.harmonic"
        yield input_error(path, place, "amplitudes that are all 0", "a force other than 0")


def _unfit_files(path: Path, scene: Scene) -> Unfit:
    """CSV files of loads that are not there, or that cannot be read."""
    for file in files_of(scene.excitation.load, scene.load.force):
        yield from _raised(force_table, file, scene.contents)
    for file in files_of(scene.load.temperature):
        yield from _raised(temperature_table, file, scene.contents)


def _unfit_sets(path: Path, scene: Scene) -> Unfit:
    """Sets and surfaces of loads and outputs that a blade made here does not have."""
    if scene.blade is None or scene.mesh_file is not None or scene.model is not None:
        return
    parts = [names for section, names in SETS.items() if not section or getattr(scene, section) is not None]
    known = sorted(name for names in parts for name in names)
    places = [
        *((f"excitation.load[{k}]", each) for k, each in enumerate(scene.excitation.load)),
        *((f"load.force[{k}]", each) for k, each in enumerate(scene.load.force)),
        *((f"load.pressure[{k}]", each) for k, each in enumerate(scene.load.pressure)),
        *((f"output[{k}]", each) for k, each in enumerate(scene.output)),
    ]
    for place, each in places:
        for key in ("set", "surface"):
            name = getattr(each, key, None)
            if name is not None and name.lower() not in known:
                yield input_error(path, f"{place}.{key}", shown(name), f"one of {', '.join(known)}")


def _unfit_response(path: Path, member: Member) -> Unfit:
    response = member.scene.response
    low, high = response.frequency
    if not low < high:
        yield _refused(path, member, "response.frequency", [low, high])
    if response.rayleigh is not None and not any(response.rayleigh):
        yield _refused(path, member, "response.rayleigh", list(response.rayleigh))
    elif response.rayleigh is not None and (ratio := rayleigh_ratio(response)) < LEAST_DAMPING:
        place, allowed = member.key_in_file("response.rayleigh"), f"{LEAST_DAMPING:g} or more: round-off is larger"
        yield input_error(path, place, f"{ratio:.2g} of critical damping in the range", allowed)
    if response.damping_ratio is not None and response.rayleigh is not None:
        yield input_error(path, "response.rayleigh", "given beside damping_ratio", "one of the two")
    if response.damping_ratio is None and response.rayleigh is None:
        yield input_error(path, "response.damping_ratio", "missing", allowed_values("response.damping_ratio"))
    if response.residual_tractions == "bounds" and response.method != "coupled":
        allowed = '"projected" with response.method = "static-first"'
        yield input_error(path, member.key_in_file("response.residual_tractions"), '"bounds"', allowed)


def _check_geometry(path: Path, member: Member) -> None:
    from geometry.blade.checks import check_parameters
    from geometry.errors import GeometryError

    try:
        check_parameters(**geometry_parameters(member.scene))
    except GeometryError as error:
        raise parameter_error(path, member, error) from None


def _refused(path: Path, member: Member, key: str, value: Any) -> InputError:
    return input_error(path, member.key_in_file(key), shown(value), allowed_values(key))


OF_A_FILE = {
    "n_blades",
    "unit",
    "axis",
    "axis_point",
    "tolerance",
    "bore",
    "sets",
    "interface",
}  # keys of [mesh] beside its file
_MEANT = re.compile(r"did you mean (\S+)\?")


class _EnoughError(Exception):
    """As many errors as are shown."""


class _Found:
    """The first error of each key."""

    def __init__(self) -> None:
        self.errors: dict[str, InputError] = {}
        self.broken: dict[int, set[str]] = {}

    def add(self, error: InputError) -> None:
        self.errors.setdefault(error.key or str(error), error)
        if len(self.errors) >= MOST_ERRORS:
            raise _EnoughError

    def add_of_member(self, index: int, errors: list[InputError]) -> None:
        self.broken[index] = {_section(error.key) for error in errors}
        for error in errors:
            self.add(error)


def all_errors(path: Path, force: bool = False) -> tuple[SceneFile | None, list[str]]:
    """Read and check a scene that describes a blade, going on after errors."""
    tables, text = load_tables(path)
    found, file = _Found(), None
    try:
        sweep = _good_part(path, tables.get("sweep", {}), found)
        file = scene_of_tables(path, {**tables, "sweep": sweep}, text, broken=found.add_of_member)
        for error in unfit_keys(file, found.broken, force):
            found.add(error)
    except InputError as error:  # nothing to go on with
        found.errors.setdefault(error.key or str(error), error)
    except _EnoughError:
        pass
    if not found.errors:
        return file, []
    lines = key_lines(text)
    explained = _without_explained(path, found.errors.values(), tables)
    errors = sorted(explained, key=lambda error: line_of(error, lines))
    return None, [with_line(error, lines) for error in (errors if file is None else hints_first(file, errors))]


def _good_part(path: Path, sweep: Any, found: _Found) -> Any:
    """The keys of [sweep] that are right; errors of the others are added."""
    try:
        read_sweep(path, sweep)
    except InputError as error:
        if not isinstance(sweep, Mapping):
            found.add(error)
            return {}
        before, good = len(found.errors), {}
        for key, values in sweep.items():
            try:
                read_sweep(path, {key: values})
                good[key] = values
            except InputError as own:
                found.add(own)
        if len(found.errors) == before:  # none is wrong by itself
            found.add(error)
            return {}
        return good
    return sweep


def _of_a_file(tables: Mapping[str, Any], meant: Collection[str]) -> bool:
    """Whether the mesh is that of a file, so that no blade and no shroud are missing, whatever is wrong in [mesh]."""
    mesh: Any = tables.get("mesh")
    of_file = isinstance(mesh, Mapping) and ("file" in mesh or not OF_A_FILE.isdisjoint(mesh))
    return of_file and ("file" in mesh or "mesh.file" in meant or "blade" not in tables)


def _without_explained(path: Path, found: Collection[InputError], tables: Mapping[str, Any]) -> list[InputError]:
    """The errors but those about a missing key that another error explains.

    That is one that an unknown key or table stands for, that a misspelt preset gives, or that a mesh from a file does
    without. Keys that are missing with their whole table are one error.
    """
    errors = list(found)
    meant = {each[1] for error in errors if (each := _MEANT.search(str(error)))}
    if any(error.key == "accuracy" for error in errors) or "accuracy" in meant:
        meant.add(SIZE)
    if any(error.key == "materials" for error in errors):  # for [material], or of several materials
        meant.add("material")
    if _of_a_file(tables, meant):
        meant |= {"blade", "shroud", "material", SIZE}
        if "file" not in tables["mesh"]:
            errors = [error for error in errors if error.key.removeprefix("mesh.") not in OF_A_FILE]
            errors += [] if "mesh.file" in meant else [_missing(path, "mesh.file", allowed_values("mesh.file"))]
    absent: dict[str, list[str]] = {}
    for error in errors:
        section, _, name = error.key.partition(".")
        if name and section not in tables and f"{error.key}: missing" in str(error):
            absent.setdefault(section, []).append(name)
    for section, names in absent.items():
        if len(names) > 1:
            errors = [error for error in errors if error.key.partition(".")[0] != section]
            errors.append(_missing(path, section, f"a table [{section}] with {', '.join(names)}"))
    return [error for error in errors if not _explained(error, meant)]


def _explained(error: InputError, meant: Collection[str]) -> bool:
    """Whether a key is missing that another error names, itself or its table."""
    return f"{error.key}: missing" in str(error) and not {error.key, error.key.partition(".")[0]}.isdisjoint(meant)


def _missing(path: Path, key: str, allowed: str) -> InputError:
    return input_error(path, key, "missing", allowed)


def _section(key: str) -> str:
    """The section of a key as it stands in a message, in its table or in [sweep]."""
    parts = plain_key(key).split(".")
    return next((part for part in parts if part in SECTIONS or part == INTERFACE), parts[0])
