"""Materials of a scene by the names that the elements of its mesh have: of the scene, of the mesh file or both.

What was found in a mesh file is kept beside its mesh; its system of units is told from its size and its materials.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geometry.units import BLADE_RADII, UNIT_SYSTEMS
from pipeline.errors import shown_key
from pipeline.scene.dotted_keys import split_key
from pipeline.scene.elastic_material import elastic_material, unused_frame
from pipeline.scene.fields import allowed_of
from pipeline.scene.material_section import (
    ANISOTROPIC,
    CONSTANTS,
    FORCED,
    USUAL_MATERIAL,
    WAVE_SPEED,
    NamedMaterial,
    Usual,
    wave_speed,
)

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene
    from rom.finite_elements.material import AnyMaterial
    from rom.finite_elements.material import Materials as RomMaterials


FINDINGS = "own_mesh.json"


def own_findings(folder: Path) -> dict[str, Any]:
    """What `write_findings` has written; empty for a mesh that was made here."""
    path = folder / FINDINGS
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return found


def elements_by_kind(sector: SectorMesh) -> dict[str, int]:
    """Number of elements of each kind."""
    counts: dict[str, int] = {}
    for block in sector.blocks:
        counts[block.kind] = counts.get(block.kind, 0) + len(block)
    return counts


def extent(sector: SectorMesh) -> dict[str, float]:
    """Radii of hub and tip, bounds along the axes, and the mean size of an element, m."""
    import numpy as np

    radius = np.hypot(sector.points[:, 1], sector.points[:, 2])
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    return {
        "hub_radius": float(radius.min()),
        "tip_radius": float(radius.max()),
        "size": mean_size(sector),
        **{f"{axis}_low": float(low[k]) for k, axis in enumerate("xyz")},
        **{f"{axis}_high": float(high[k]) for k, axis in enumerate("xyz")},
    }


def mean_size(sector: SectorMesh) -> float:
    """Mean length of the edges between the corners of the elements, m."""
    import numpy as np

    lengths = [
        np.linalg.norm(sector.points[block.nodes[:, b]] - sector.points[block.nodes[:, a]], axis=1)
        for block in sector.blocks
        for a, b in block.topology.edges
    ]
    return float(np.concatenate(lengths).mean())


# what most blades have; of several systems that fit, the one nearest to it is proposed
TYPICAL_RADIUS = (0.05, 3.0)  # m
TYPICAL = {"young_modulus": (4e10, 4.5e11), "density": (1500.0, 9500.0)}
LARGEST = {"m": 3.0, "in": 80.0}  # coordinates up to which a mesh without materials is in m, or else in inches
COMMON = ("m", "mm", "in")
RARE, FARTHEST = 0.3, 1.0  # orders of magnitude that the others must fit better, and may be away from most blades
Materials = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class UnitProposal:
    """The units of a mesh file."""

    unit: str  # name in `UNIT_SYSTEMS`
    why: str  # what tells it
    consistent: bool = True  # whether all numbers fit this system
    # by material: numbers that do not fit it, in the SI units that they are likely to mean
    numbers: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    stated: Mapping[str, str] = field(default_factory=dict)  # the same in words


def propose_unit(radius: float, materials: Materials, said: tuple[str, ...] = ()) -> UnitProposal:
    """The system of units that fits a mesh file best."""
    known = {name: _known(numbers) for name, numbers in materials.items() if _known(numbers)}
    names = [name for name in said if _fits(name, radius, known)] or list(UNIT_SYSTEMS)
    if not known:
        return _by_size(radius, names if said else [])
    fitting = [name for name in names if _fits(name, radius, known)]
    if fitting:
        unit = min(fitting, key=lambda name: round(_distance(name, radius, known), 6))
        return UnitProposal(unit, _reason(unit, radius, known) + (", as the file says" if unit in said else ""))
    alone = {name: {m: own for m, own in known.items() if _fits(name, radius, {m: own})} for name in names}
    most = max(map(len, alone.values()))
    if most:  # the numbers of the others stand as long as they are possible
        names = [name for name in names if len(alone[name]) == most]
        unit = min(names, key=lambda name: round(_distance(name, radius, alone[name]), 6))
        why = _reason(unit, radius, alone[unit])
    else:
        by_size = _by_size(radius, [])
        unit, why = (
            by_size.unit,
            f"{by_size.why}; no consistent system of units has both size and materials of this file",
        )
    numbers = {name: dict(_misfits(UNIT_SYSTEMS[unit].length, unit, values)) for name, values in known.items()}
    stated = {
        name: ", ".join(
            f"{key} = {value:.6g} ({known[name][key]:g} {symbol})" for key, (value, symbol) in own.items()
        )
        for name, own in numbers.items()
        if own
    }
    plain = {name: {key: value for key, (value, _) in own.items()} for name, own in numbers.items() if own}
    return UnitProposal(unit, why, most > 0 and not plain, plain, stated)


def _known(numbers: Mapping[str, float]) -> dict[str, float]:
    return {key: numbers[key] for key in TYPICAL if numbers.get(key, 0.0) > 0.0}


def _in_si(name: str, numbers: Mapping[str, float]) -> dict[str, float]:
    system = UNIT_SYSTEMS[name]
    factor = {"young_modulus": system.pressure, "density": system.density}
    return {key: value * factor[key] for key, value in numbers.items()}


def _fits(name: str, radius: float, materials: Materials) -> bool:
    """Whether size and materials are possible in a system of units."""
    in_si = [_in_si(name, numbers) for numbers in materials.values()]
    usual = all(USUAL_MATERIAL[key].is_usual(value) for numbers in in_si for key, value in numbers.items())
    return (
        usual
        and BLADE_RADII[0] <= radius * UNIT_SYSTEMS[name].length <= BLADE_RADII[1]
        and all(WAVE_SPEED.is_usual(wave_speed(numbers)) for numbers in in_si)
        and (name in COMMON or _distance(name, radius, materials) <= FARTHEST)
    )


def _distance(name: str, radius: float, materials: Materials) -> float:
    """Orders of magnitude that size and (twice) materials are away from most blades, more for rare systems."""
    numbers = [_in_si(name, values) for values in materials.values()]
    away = sum(_outside(value, TYPICAL[key]) for values in numbers for key, value in values.items()) / len(numbers)
    rare = 0.0 if name in COMMON else RARE
    return 2.0 * away + _outside(radius * UNIT_SYSTEMS[name].length, TYPICAL_RADIUS) + rare


def _outside(value: float, within: tuple[float, float]) -> float:
    return max(0.0, math.log10(within[0] / value), math.log10(value / within[1]))


def _by_size(radius: float, names: list[str]) -> UnitProposal:
    """The unit of length alone."""
    unit = names[0] if names else next((unit for unit, limit in LARGEST.items() if radius <= limit), "mm")
    metres = "" if unit == "m" else f", {UNIT_SYSTEMS[unit].length * radius:.3g} m"
    return UnitProposal(
        unit, f"the largest coordinate is {radius:.4g}{metres}" + (", as the file says" * bool(names))
    )


def _reason(unit: str, radius: float, materials: Materials) -> str:
    """`Young's modulus 2.1e+08 is 210 GPa, density 7.85e-06 is 7850 kg/m^3, ...`."""
    system, (name, numbers) = UNIT_SYSTEMS[unit], next(iter(materials.items()))
    in_si, parts = _in_si(unit, numbers), []
    if "young_modulus" in numbers:
        value = f"{numbers['young_modulus']:.4g} {system.pressure_name}"
        parts.append(f"Young's modulus {value} is {in_si['young_modulus'] / 1e9:.4g} GPa")
    if "density" in numbers:
        parts.append(f"density {numbers['density']:.4g} {system.density_name} is {in_si['density']:.5g} kg/m^3")
    of = f" of {name}" if len(materials) > 1 else ""
    return f"{', '.join(parts)}{of}, the largest coordinate {radius * system.length:.3g} m"


def _misfits(length: float, unit: str, numbers: Mapping[str, float]) -> Iterator[tuple[str, tuple[float, str]]]:
    """Numbers that no solid has in this system, in SI units, and the unit that they are likely to be in."""
    for key, value in numbers.items():
        if not USUAL_MATERIAL[key].is_nonsense(_in_si(unit, {key: value})[key]):
            continue
        units = {
            (system.pressure_name, system.pressure)
            if key == "young_modulus"
            else (system.density_name, system.density): abs(math.log(system.length / length))
            for system in UNIT_SYSTEMS.values()
        }
        symbol, factor = min(units, key=lambda each: (round(_outside(value * each[1], TYPICAL[key]), 6), units[each]))
        if _outside(value * factor, TYPICAL[key]) < RARE:
            yield key, (value * factor, symbol)


DISK = "disk"  # elements of the disk made here
NEEDED = ("young_modulus", "poisson_ratio", "density")
WORDS = {
    "young_modulus": "Young's modulus",
    "poisson_ratio": "Poisson's ratio",
    "density": "density",
    "expansion": "expansion",
    "shear_modulus": "shear modulus",
} | {name: name for name in ANISOTROPIC[1:]}
UNITS = {name: " 1/K" if "expansion" in name else " Pa" if "modulus" in name else "" for name in WORDS}
UNITS["density"] = " kg/m^3"


def scene_materials(scene: Scene, sector_file: Path, sector: SectorMesh) -> RomMaterials:
    """The material of a scene, or those of its mesh file; the disk made here has [materials.disk], or [material].

    Those that depend on the temperature come with that of the mesh.
    """
    if scene.mesh_file is None:
        assert scene.material is not None  # a scene that describes a blade has one
        of_disk = scene.materials.get(DISK, scene.material)
        given = {"": scene.material.properties, **({} if scene.disk is None else {DISK: of_disk.properties})}
    else:
        found = materials_of_file(scene, own_findings(sector_file.parent))
        check_complete(found)
        given = {name: material.properties for name, material in found.items()}
    return materials_on(scene, given, sector)


def materials_on(scene: Scene, given: Mapping[str, Mapping[str, Any]], sector: SectorMesh) -> RomMaterials:
    """Materials by name on a mesh with its temperature; one alone where only one is given for all elements."""
    from pipeline.stages.model.mesh_temperature import temperature_of_mesh
    from rom.finite_elements.material import HotMaterials, MaterialTable

    if scene.load.temperature is None:  # tables of a file that has no temperatures
        given = {name: {**properties, "at": ()} for name, properties in given.items()}
    radial = (0.0, 0.0, 1.0) if scene.mesh_file is None else radial_direction(sector)
    materials = {name: _elastic(name, properties, radial) for name, properties in given.items()}
    if any(isinstance(material, MaterialTable) for material in materials.values()):
        assert scene.load.temperature is not None
        return HotMaterials(materials, temperature_of_mesh(scene, sector), scene.load.temperature.reference)
    return materials if scene.mesh_file is not None or scene.disk is not None else materials[""]


def _elastic(name: str, properties: Mapping[str, Any], radial: Sequence[float]) -> AnyMaterial:
    from rom.errors import RomParameterError

    try:
        return elastic_material(properties, radial)
    except RomParameterError as error:
        table = f"materials.{shown_key(name)}" if name else "material"
        raise RomParameterError(table, error.parameter, error.value, error.allowed) from None


def radial_direction(sector: SectorMesh) -> tuple[float, float, float]:
    """Direction from the engine axis to the middle of the angles that a sector takes, of length 1."""
    import numpy as np

    _, y, z = sector.points.T
    about = math.atan2(y.mean(), z.mean())
    angle = np.angle(np.exp(1j * (np.arctan2(y, z) - about)))
    middle = about + 0.5 * float(angle.min() + angle.max())
    return 0.0, math.sin(middle), math.cos(middle)


@dataclass(frozen=True)
class FileMaterial:
    """The material of some elements of a mesh file."""

    name: str  # as in the file; "": elements without one
    numbers: Mapping[str, float]  # constants that are known, SI units
    source: Mapping[str, str]  # where each number comes from
    of_file: frozenset[str] = frozenset()  # the numbers that the file gives
    notes: tuple[str, ...] = ()  # what a user has to know at every run, one line each
    unread: str = ""  # what the material is where it is not one that is read
    more: Mapping[str, Any] = field(default_factory=dict)  # axes, constants at other temperatures

    @property
    def properties(self) -> dict[str, Any]:
        """All of it by the keys of [material]."""
        return {**self.numbers, **self.more}

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
        parts = [f"{', '.join(values)} ({source})" for source, values in by_source.items()]
        if rows := self.more.get("at"):
            ends = [row["temperature"] for row in (self.more, *rows) if "temperature" in row]
            parts.append(f"over the temperature, {min(ends):g} to {max(ends):g}")
        parts += ["with axes of its own"] if "axes" in self.more else []
        return f"{name}: {'; '.join(parts)}"


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
    from geometry.errors import ParameterError

    if scene.material is None or not scene.punch_key:
        return
    general = scene.material.given
    keys = "young_modulus", "poisson_ratio"
    if any(
        all(math.isclose(of.numbers[key], general[key], rel_tol=1e-3) for key in keys) for of in materials.values()
    ):
        return
    name, first = next(iter(materials.items()))
    own = " and ".join(f"{WORDS[key]} {first.numbers[key]:.6g}{UNITS.get(key, '')}" for key in keys)
    allowed = f"numbers, or [material] with {own}, as material {name} has: the punch formula takes that table"
    raise ParameterError(*split_key(scene.punch_key), "punch", allowed)


def check_complete(materials: Mapping[str, FileMaterial]) -> None:
    """Raise ParameterError for the first number that is not known, or axes that are not used."""
    from geometry.errors import ParameterError

    for name, material in materials.items():
        if unused := unused_frame(material.properties):
            raise ParameterError(f"materials.{shown_key(name)}" if name else "material", *unused)
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
        allowed = f"{allowed_of(NamedMaterial, key)}{_in(key)}: only {known} of this material {given}"
        raise ParameterError(table, key, "missing", allowed)


def _in(key: str) -> str:
    return f", in{UNITS[key]}" if key in UNITS else ""


def _named(scene: Scene, found: Mapping[str, Any]) -> dict[str, tuple[str, dict[str, Any]]]:
    """Tables [materials.NAME] by the names of the file, which are compared without regard to case."""
    from geometry.errors import ParameterError

    known = [*found["used"], *found["materials"]]
    tables: dict[str, tuple[str, dict[str, Any]]] = {}
    for name, material in scene.materials.items():
        fits = [name] if name in known else [other for other in known if other.lower() == name.lower()]
        if not fits:
            names = ", ".join(f'"{other}"' for other in dict.fromkeys(known) if other) or "none with a name"
            allowed = f"a material or an element set of the file; its materials: {names}"
            raise ParameterError("materials", shown_key(name), "unknown name", allowed)
        tables |= dict.fromkeys(fits, (f"[materials.{shown_key(name)}]", material.properties))
    return tables


def _material(name: str, scene: Scene, found: Mapping[str, Any], table: str, said: Mapping[str, Any]) -> FileMaterial:
    """The material of the elements with a name; `table`, `said`: what the scene says of it."""
    unread = found["unread_materials"].get(name, "")
    of_file = found["materials"].get(name, {})
    file = {key: of_file[key] for key in CONSTANTS if of_file.get(key) or (key in of_file and "ratio" in key)}
    file = {key: value for key, value in file.items() if key not in _replaced_tables(of_file, said)}
    given, more = {key: said[key] for key in CONSTANTS if key in said}, _more(of_file, said)
    notes = tuple(found["material_notes"].get(name, ()))
    if of_file.get("at") and scene.load.temperature is None:
        notes = (
            *notes,
            f"material {name} depends on the temperature: without [load.temperature] the first values hold",
        )
    if unread:
        whole = all(key in given for key in NEEDED)
        stands_in = f"material {name} is {unread} in the file: that of {table} is taken for it"
        source = dict.fromkeys(given, table)
        return FileMaterial(name, given, source, frozenset(), (stands_in,) * whole, unread, _more({}, said))
    if not file and not given and scene.material is not None:
        general = scene.material.given
        if name:
            notes = (*notes, f"material {name} has no numbers in the file: [material] is taken for it")
        more = _more({}, scene.material.properties)
        return FileMaterial(name, general, dict.fromkeys(general, "[material]"), frozenset(), notes, more=more)
    source = dict.fromkeys(file, "of the file") | dict.fromkeys(given, table)
    both = [WORDS[key] for key in given if key in file and given[key] != file[key]]
    if both:
        notes = (*notes, f"material {name}: {' and '.join(both)} of {table}, not of the file")
    return FileMaterial(name, {**file, **given}, source, frozenset(file) - frozenset(given), notes, more=more)


def _more(of_file: Mapping[str, Any], said: Mapping[str, Any]) -> dict[str, Any]:
    """What is known beside the constants; a constant of the scene holds at all temperatures of the file."""
    replaced = {"axes"} if "along" in said else set()
    replaced |= {"mean_from"} if "expansion" in _all_keys(said) else set()
    kept = {key: of_file[key] for key in of_file if key not in (*CONSTANTS, *replaced)}
    more = {key: value for key, value in said.items() if key not in CONSTANTS}
    return {**kept, **more, **_tables(of_file, said)}


def _tables(of_file: Mapping[str, Any], said: Mapping[str, Any]) -> dict[str, Any]:
    """Constants over the temperature: those of the scene, and those of the file that the scene does not have."""
    if not of_file.get("at"):
        return {}
    tables: list[tuple[Mapping[str, Any], set[str]]] = [(of_file, _all_keys(said))]
    tables += [(said, set())] if said.get("at") else []
    rows: dict[float, dict[str, float]] = {}
    for source, left_out in tables:
        at = source.get("temperature", 20.0)
        first = {"temperature": at, **{key: source[key] for key in CONSTANTS if key in source}}
        for row in (first, *source["at"]):
            kept = {key: value for key, value in row.items() if key not in left_out}
            rows.setdefault(row["temperature"], {}).update(kept)
    coldest, *others = sorted(rows)
    return {**rows[coldest], "at": [rows[at] for at in others]}


def _all_keys(said: Mapping[str, Any]) -> set[str]:
    """Constants that the scene has of a material at any temperature."""
    return {key for row in (said, *said.get("at", ())) for key in row} & {*CONSTANTS}


def _replaced_tables(of_file: Mapping[str, Any], said: Mapping[str, Any]) -> set[str]:
    """Constants over the temperature in the file for which the scene has others."""
    return {key for row in of_file.get("at", ()) for key in row} & _all_keys(said)


def check_plausible(
    scene: Scene, found: Mapping[str, Any], materials: Mapping[str, FileMaterial], force: bool
) -> list[str]:
    """Warnings about the numbers of a mesh file, converted to SI units, and about its units."""
    from geometry.errors import ParameterError

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
    from geometry.units import UNIT_SYSTEMS

    assert scene.mesh is not None
    system = UNIT_SYSTEMS[scene.mesh.unit]
    factor = {"young_modulus": system.pressure, "density": system.density}
    raw = {
        name: {key: numbers[key] / factor[key] for key in factor if key in numbers}
        for name, numbers in found["materials"].items()
        if name in found["used"]
    }
    proposal = propose_unit(found["tip_radius"] / system.length, raw, tuple(found["units"]))
    if proposal.consistent and proposal.unit != scene.mesh.unit:
        return f'"{proposal.unit}": {proposal.why}'
    tables = "; ".join(f"[materials.{shown_key(name)}] {text}" for name, text in proposal.stated.items())
    return f"units of one system; none fits this file: give SI numbers{', ' + tables if tables else ''}"
