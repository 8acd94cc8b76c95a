"""Materials of a scene by the names that the elements of its mesh have: of the scene, of the mesh file or both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.scene.material_section import FORCED, USUAL_MATERIAL, WAVE_SPEED, Usual, wave_speed
from pipeline.scene.validation_errors import allowed_values, shown_key
from pipeline.stages.mesh_findings import own_findings
from pipeline.stages.mesh_units import propose_unit

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from rom import Material

DISK = "disk"  # elements of the disk made here
NEEDED = ("young_modulus", "poisson_ratio", "density")
WORDS = {
    "young_modulus": "Young's modulus",
    "poisson_ratio": "Poisson's ratio",
    "density": "density",
    "expansion": "expansion",
}
UNITS = {"young_modulus": " Pa", "density": " kg/m^3", "expansion": " 1/K"}


def scene_materials(scene: Scene, sector_file: Path) -> Material | dict[str, Material]:
    """The material of a scene, or those of its mesh file; the disk made here has [materials.disk], or [material]."""
    from rom import Material

    general = None if scene.material is None else Material(**scene.material.model_dump())
    if scene.mesh_file is None:
        assert general is not None  # a scene that describes a blade has one
        if scene.disk is None:
            return general
        return {"": general, DISK: Material(**scene.materials[DISK].given) if DISK in scene.materials else general}
    found = materials_of_file(scene, own_findings(sector_file.parent))
    check_complete(found)
    return {name: Material(**material.numbers) for name, material in found.items()}


@dataclass(frozen=True)
class FileMaterial:
    """The material of some elements of a mesh file."""

    name: str  # as in the file; "": elements without one
    numbers: Mapping[str, float]  # what is known, SI units
    source: Mapping[str, str]  # where each number comes from
    of_file: frozenset[str] = frozenset()  # the numbers that the file gives
    notes: tuple[str, ...] = ()  # what a user has to know at every run, one line each
    unread: str = ""  # what the material is where it is not isotropic

    @property
    def missing(self) -> tuple[str, ...]:
        """Numbers that are not known."""
        return tuple(key for key in NEEDED if key not in self.numbers)

    @property
    def line(self) -> str:
        """The numbers with where they come from."""
        by_source: dict[str, list[str]] = {}
        for key, value in self.numbers.items():
            by_source.setdefault(self.source[key], []).append(f"{WORDS[key]} {value:.6g}{UNITS.get(key, '')}")
        name = f"material {self.name}" if self.name else "elements without a material"
        return f"{name}: " + "; ".join(f"{', '.join(values)} ({source})" for source, values in by_source.items())


def materials_of_file(scene: Scene, found: Mapping[str, Any]) -> dict[str, FileMaterial]:
    """The material of each kind of elements: numbers of [materials.NAME], then those of the file, nothing else.

    [material] is for elements without a material, and for those whose material has no number at all in the file.
    """
    named = _named(scene, found)
    return {name: _material(name, scene, found, *named.get(name, ("", {}))) for name in found["used"]}


def check_materials(scene: Scene, found: Mapping[str, Any], force: bool) -> list[str]:
    """What a user has to know at every run about the materials of a mesh file."""
    materials = materials_of_file(scene, found)
    check_complete(materials)
    _check_punch(scene, materials)
    notes = [line for material in materials.values() for line in material.notes]
    return [*notes, *check_plausible(scene, found, materials, force)]


def _check_punch(scene: Scene, materials: Mapping[str, FileMaterial]) -> None:
    """Refuse "punch" where no elements have the elasticity of [material], which its formula takes."""
    from geometry import ParameterError

    if scene.material is None or not scene.contact.uses_punch:
        return
    general = scene.material.model_dump()
    keys = "young_modulus", "poisson_ratio"
    if any(
        all(math.isclose(of.numbers[key], general[key], rel_tol=1e-3) for key in keys) for of in materials.values()
    ):
        return
    name, first = next(iter(materials.items()))
    own = " and ".join(f"{WORDS[key]} {first.numbers[key]:.6g}{UNITS.get(key, '')}" for key in keys)
    allowed = f"numbers, or [material] with {own}, as material {name} has: the punch formula takes that table"
    raise ParameterError("contact", "normal_stiffness", "punch", allowed)


def check_complete(materials: Mapping[str, FileMaterial]) -> None:
    """Raise ParameterError for the first number that is not known."""
    from geometry import ParameterError

    for name, material in materials.items():
        if not material.missing:
            continue
        if not name:
            raise ParameterError("material", "", "missing", "a table [material]: elements of the file have none")
        table = f"materials.{shown_key(name)}"
        if material.unread:
            allowed = (
                f"all of {', '.join(NEEDED)}, or an isotropic material in the file: this one is {material.unread}"
            )
            raise ParameterError(
                "materials", shown_key(name), "given in part" if material.numbers else "missing", allowed
            )
        if not material.numbers:
            allowed = f"a table [{table}] or [material]: the file has no numbers of this material"
            raise ParameterError("materials", shown_key(name), "missing", allowed)
        key = material.missing[0]
        known = " and ".join(WORDS[key] for key in material.numbers)
        given = "is given" if len(material.numbers) == 1 else "are given"
        allowed = f"{allowed_values(f'material.{key}')}{_in(key)}: only {known} of this material {given}"
        raise ParameterError(table, key, "missing", allowed)


def _in(key: str) -> str:
    return f", in{UNITS[key]}" if key in UNITS else ""


def _named(scene: Scene, found: Mapping[str, Any]) -> dict[str, tuple[str, dict[str, float]]]:
    """Tables [materials.NAME] by the names of the file, which are compared without regard to case."""
    from geometry import ParameterError

    known = [*found["used"], *found["materials"]]
    tables: dict[str, tuple[str, dict[str, float]]] = {}
    for name, material in scene.materials.items():
        fits = [name] if name in known else [other for other in known if other.lower() == name.lower()]
        if not fits:
            names = ", ".join(f'"{other}"' for other in dict.fromkeys(known) if other) or "none with a name"
            allowed = f"a material or an element set of the file; its materials: {names}"
            raise ParameterError("materials", shown_key(name), "unknown name", allowed)
        tables |= dict.fromkeys(fits, (f"[materials.{shown_key(name)}]", material.given))
    return tables


def _material(
    name: str, scene: Scene, found: Mapping[str, Any], table: str, given: Mapping[str, float]
) -> FileMaterial:
    """The material of the elements with a name; `table`, `given`: what the scene says of it."""
    unread = found["unread_materials"].get(name, "")
    file = {key: value for key, value in found["materials"].get(name, {}).items() if value or key == "poisson_ratio"}
    notes = tuple(found["material_notes"].get(name, ()))
    if unread:
        whole = all(key in given for key in NEEDED)
        stands_in = f"material {name} is {unread} in the file: the isotropic one of {table} is taken for it"
        return FileMaterial(name, given, dict.fromkeys(given, table), frozenset(), (stands_in,) * whole, unread)
    if not file and not given and scene.material is not None:
        general = scene.material.model_dump()
        if name:
            notes = (*notes, f"material {name} has no numbers in the file: [material] is taken for it")
        return FileMaterial(name, general, dict.fromkeys(general, "[material]"), frozenset(), notes)
    source = dict.fromkeys(file, "of the file") | dict.fromkeys(given, table)
    both = [WORDS[key] for key in given if key in file and given[key] != file[key]]
    if both:
        notes = (*notes, f"material {name}: {' and '.join(both)} of {table}, not of the file")
    return FileMaterial(name, {**file, **given}, source, frozenset(file) - frozenset(given), notes)


def check_plausible(
    scene: Scene, found: Mapping[str, Any], materials: Mapping[str, FileMaterial], force: bool
) -> list[str]:
    """Warnings about the numbers of a mesh file, converted to SI units, and about its units."""
    from geometry import ParameterError

    assert scene.mesh is not None
    unit, warnings, nonsense = scene.mesh.unit, [], []
    if found["units"] and unit not in found["units"]:
        warnings.append(f'the file says that it is in {" or ".join(found["units"])}, mesh.unit is "{unit}"')
    for material in materials.values():
        if not material.of_file & {"young_modulus", "density"}:
            continue
        for said, value, usual in _judged(material):
            if usual.is_nonsense(value):
                nonsense.append(said)
            elif not usual.is_usual(value):
                warnings.append(f'with unit = "{unit}" {said}')
    if nonsense and not force:
        allowed = f"{_other_unit(scene, found)} (with {unit} {nonsense[0]}); {FORCED}"
        raise ParameterError("mesh", "unit", unit, allowed)
    return [*warnings, *(f'with unit = "{unit}" {said}' for said in nonsense)]


def _judged(material: FileMaterial) -> list[tuple[str, float, Usual]]:
    """What there is to say of each number of a material of the file, the number, and what is usual."""
    lines = []
    for key, usual in USUAL_MATERIAL.items():
        if key in material.of_file:
            value = material.numbers[key]
            said = f"{WORDS[key]} of material {material.name} is {value:.4g}{UNITS.get(key, '')}"
            lines.append((f"{said}, usual are {usual.low:g} to {usual.high:g}", value, usual))
    if all(usual.is_usual(value) for _, value, usual in lines):
        speed = wave_speed(material.numbers)
        said = f"sqrt(E / rho) of material {material.name} is {speed:.3g} m/s, usual are {WAVE_SPEED.low:g} to"
        lines.append((f"{said} {WAVE_SPEED.high:g}", speed, WAVE_SPEED))
    return lines


def _other_unit(scene: Scene, found: Mapping[str, Any]) -> str:
    """The unit that would do, or what to do where none does."""
    from geometry import UNIT_SYSTEMS

    assert scene.mesh is not None
    system = UNIT_SYSTEMS[scene.mesh.unit]
    factor = {"young_modulus": system.pressure, "density": system.density}
    raw = {
        name: {key: value / factor.get(key, 1.0) for key, value in numbers.items()}
        for name, numbers in found["materials"].items()
        if name in found["used"]
    }
    proposal = propose_unit(found["tip_radius"] / system.length, raw, tuple(found["units"]))
    if proposal.consistent and proposal.unit != scene.mesh.unit:
        return f'"{proposal.unit}": {proposal.why}'
    tables = "; ".join(f"[materials.{shown_key(name)}] {text}" for name, text in proposal.stated.items())
    return f"units of one system; none fits this file: give SI numbers{', ' + tables if tables else ''}"
