"""Plausibility: values that look like a mistake of units (mm, GPa, percent) are warned of, nonsense is refused.

Stiff contacts are warned of by an estimate, without a mesh. Two things make stuck frequencies too low. Equal springs
at n equal parts of an edge lose 1/n^2 of the rotational stiffness of the face. And the face deforms between contact
nodes, the more the stiffer the springs are against the elastic stiffness of the face, some E sqrt(A). The numbers are
fitted to measured errors of the first five stuck frequencies of three blades at 70 to 180 degrees, the largest over
several engine orders.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Any

from pipeline.errors import InputError, input_error, shown, shown_key
from pipeline.scene.contact_section import Contact, FaceField, mean_of
from pipeline.scene.dotted_keys import CONTACT, INTERFACE, of_contact, split_key
from pipeline.scene.geometry_parameters import airfoil_of
from pipeline.scene.material_section import (
    FORCED,
    USUAL_MATERIAL,
    WAVE_SPEED,
    Material,
    MaterialState,
    Usual,
    wave_speed,
)
from pipeline.scene.mesh_section import MAIN_INTERFACE, Mesh
from pipeline.scene.reading import Member, SceneFile
from pipeline.scene.response_section import Response, Rom
from pipeline.scene.schema import MEANINGS, Scene
from pipeline.scene.size_limits import speed_warning, tip_speed
from pipeline.scene.varied_keys import studied_keys

LARGEST = 0.01  # relative error of a stuck frequency without a warning
GRIDS = ((3, 3), (4, 4), (6, 6))  # that are proposed
CURVE_81_NODES = 37.0  # processor time of a curve of the default blade with 9 x 9 contact nodes and 3 harmonics, s
LONG = 1.5  # minutes of processor time from which a curve is said to take long


@dataclass(frozen=True)
class StiffContact:
    """A stiffness that the contact dofs resolve badly: its key, its value in N/m, the estimated error, the cure."""

    key: str
    stiffness: float
    error: float
    cure: str


def stiff_contact(scene: Scene) -> StiffContact | None:
    """The stiffness of a scene that its contact dofs resolve worst, if above 1 %; None also without a blade."""
    if scene.blade is None or scene.shroud is None or scene.material is None or scene.mesh is None:
        return None
    sides = scene.shroud.contact_length, scene.shroud.thickness
    punch = _punch(scene.material, sides)
    normal, tangential = _whole_face(scene.contact_of(MAIN_INTERFACE), punch)
    key = "normal_stiffness" if normal >= tangential else "tangential_stiffness"
    stiffness = max(normal, tangential)
    ratio = stiffness / (scene.material.young_modulus * math.sqrt(sides[0] * sides[1]))
    error = estimated_error(scene.rom.contact_dofs, scene.mesh.contact_grid, sides, ratio)
    if error <= LARGEST:
        return None
    own = scene.interface.get(MAIN_INTERFACE)
    table = CONTACT if own is None or getattr(own, key) is None else f"{INTERFACE}.{MAIN_INTERFACE}"
    return StiffContact(f"{table}.{key}", stiffness, error, _cure(scene.rom, scene.mesh, sides, ratio, max(punch)))


def estimated_error(kind: str, grid: tuple[int, int], sides: tuple[float, float], ratio: float) -> float:
    """Largest relative error of a stuck frequency, as a rule."""
    longest = max(sides)
    errors = []
    for count, side in zip(grid, sides, strict=True):
        if kind != "mortar" or count == 1:  # lost rotational stiffness, and what it can do at most
            most = 1.6 if kind == "nodal" else 0.45
            errors.append((side / longest / count) ** 2 * min(25.0 * ratio, most))
        else:  # polynomials of degree 1 and 2 do equally well, so do 3 and 4
            even = 2.0 * (count // 2) * longest / side
            errors.append(min(0.01 * ratio / 10.0 ** (even / 2.0 - 1.0), 0.16 / even))
    return max(errors)


def stiff_contact_warning(member: Member) -> tuple[str, str] | None:
    """Key and text of the warning about a stiffness that the contact dofs resolve badly."""
    scene = member.scene
    found = stiff_contact(scene)
    if found is None:
        return None
    assert scene.mesh is not None
    along, radial = scene.mesh.contact_grid
    kind, percent = scene.rom.contact_dofs, float(f"{100.0 * found.error:.1g}")
    text = (
        f"{member.key_in_file(found.key)}: {found.stiffness:.3g} N/m is stiff for {along} x {radial} contact nodes "
        f"({kind}): stuck natural frequencies up to some {percent:g} % too low "
        f"(an estimate, shroud verify measures it); {found.cure}"
    )
    return found.key, text


def many_nodes_warning(member: Member) -> tuple[str, str] | None:
    """Key and text of the warning about contact nodes that are so many that a curve takes long."""
    mesh = member.scene.mesh
    if mesh is None:
        return None
    along, radial = mesh.contact_grid
    minutes = CURVE_81_NODES * (along * radial / 81.0) ** 3 / 60.0
    if minutes < LONG:
        return None
    key = "mesh.contact_grid"
    nodal = member.scene.rom.contact_dofs == "nodal"
    enough = "" if nodal else "; [5, 5] has the same peaks unless contacts are stiff"
    return key, (
        f"{member.key_in_file(key)}: with {along} x {radial} contact nodes a curve takes some {minutes:.0f} minutes "
        f"of processor time (it grows with the third power of their number), the model some minutes too{enough}"
    )


def _cure(rom: Rom, mesh: Mesh, sides: tuple[float, float], ratio: float, punch: float) -> str:
    """What to change in the scene; `punch` is the stiffness of a punch, N/m, the rest as in `estimated_error`."""
    changes = [] if rom.contact_dofs == "mortar" else ['rom.contact_dofs = "mortar"']
    for grid in (mesh.contact_grid, *GRIDS):
        if estimated_error("mortar", grid, sides, ratio) <= LARGEST:
            if grid != mesh.contact_grid:
                changes.append(f"mesh.contact_grid = [{grid[0]}, {grid[1]}]")
            return f"set {' and '.join(changes)}"
    return f"lower it: the deformation of the blades is in the mesh, and a punch has {punch:.2g} N/m"


def _punch(material: Material, sides: tuple[float, float]) -> tuple[float, float]:
    """Stiffness kn, kt of a punch of the size of the face, N/m."""
    from nonlinear.contact.parameters import punch_stiffness

    return punch_stiffness(material.young_modulus, material.poisson_ratio, sides[0] * sides[1])


def _whole_face(contact: Contact, punch: tuple[float, float]) -> tuple[float, float]:
    """Stiffness kn, kt of the whole face, N/m."""
    values = []
    for given, computed in zip((contact.normal_stiffness, contact.tangential_stiffness), punch, strict=True):
        values.append(
            sum(given) if isinstance(given, tuple) else computed if isinstance(given, str) else mean_of(given)
        )
    return values[0], values[1]


USUAL = {key: meaning.usual for key, meaning in MEANINGS.items() if meaning.usual is not None}
USUAL_RATIO = USUAL["response.damping_ratio"].high
SPEED = "load.speed_rpm"
RANGE = "response.frequency"
FIRST_BENDING = 0.1615  # 1.8751^2 / (2 pi sqrt(12)), of a clamped beam of rectangular section
LOW_RANGE = 5.0  # Hz; no blade has its first mode below
SLOW_TIP = 20.0  # m/s; tips of turbines move at 100 to 600


def plausibility_warnings(file: SceneFile) -> list[str]:
    """One line for every key with an unusual value, computed all the same; a value of 0 is never unusual.

    A stiffness that the contact dofs resolve badly counts among them.
    """
    found: dict[str, str] = {}
    remarks: dict[str, str] = {}
    for member in file.members:
        for key, text in _unusual_values(member):
            found.setdefault(key, f"{file.path}: {text}")
        if found:  # a mistake of units makes contacts stiff, and modes high, that are not
            continue
        if stiff := stiff_contact_warning(member):
            remarks.setdefault(stiff[0], f"{file.path}: {stiff[1]}")
        if low := _too_low_range(member):
            remarks.setdefault(RANGE, f"{file.path}: {member.key_in_file(RANGE)}: {low}")
        if (many := many_nodes_warning(member)) is not None:
            remarks.setdefault(many[0], f"{file.path}: {many[1]}")
        for key, text in _unusual_states(member):
            remarks.setdefault(key, f"{file.path}: {member.key_in_file(key)}: {text}")
    if not found and (slow := _too_slow(file)):
        remarks.setdefault(SPEED, f"{file.path}: {slow}")
    return [*found.values(), *remarks.values()]


def far_beyond(file: SceneFile, broken: Mapping[int, AbstractSet[str]]) -> Iterator[InputError]:
    """Values of a blade that are beyond all experience; models without units of their own have none."""
    for member in file.members:
        if not _has_units(member):
            continue
        for key, value, usual in _checked(member):
            if usual.is_nonsense(value) and key.partition(".")[0] not in broken.get(member.index, ()):
                allowed = f"{usual.low:g} to {usual.high:g}; {usual.hint}; {FORCED}"
                yield input_error(file.path, member.key_in_file(key), shown(value), allowed)
        for key, numbers in _moduli(member):
            if WAVE_SPEED.is_nonsense(wave_speed(numbers)) and not _is_nonsense(numbers):
                # of the two the one that is unusual by itself
                name = "young_modulus" if USUAL_MATERIAL["density"].is_usual(numbers["density"]) else "density"
                place = member.key_in_file(key.replace("young_modulus", name))
                allowed = f"another one: {unusual_wave_speed(numbers)}; {FORCED}"
                yield input_error(file.path, place, shown(numbers[name]), allowed)


def _has_units(member: Member) -> bool:
    """Whether the values of a scene are in SI units: those of a blade are, matrices may be in any."""
    return member.scene.blade is not None or member.scene.mesh_file is not None


def _checked(member: Member) -> Iterator[tuple[str, float, Usual]]:
    """Numbers of a scene with what is usual; of a list of numbers each."""
    scene = member.scene
    in_si = _has_units(member)
    known = {key: usual for key, usual in USUAL.items() if in_si or usual.any_units}
    for key, usual in known.items():
        section, name = split_key(key)
        yield from ((key, value, usual) for value in _numbers(getattr(getattr(scene, section), name, None)))
    for varied in studied_keys(scene) if member.index == 0 else ():
        if (same := of_contact(varied.key)) in known:
            yield from ((varied.place, value, known[same]) for value in _numbers(varied.values))
            yield from ((varied.place, width, known[same].of_widths) for width in varied.widths)
    for name, material in scene.materials.items():
        for key, usual in USUAL_MATERIAL.items():
            place = f"materials.{shown_key(name)}.{key}"
            yield from ((place, value, usual) for value in _numbers(getattr(material, key)))
    for place, rows in (("material", scene.material.at if scene.material else ()), *_rows_of(scene)):
        for number, row in enumerate(rows):
            given = {key: value for key, value in row.given.items() if key in USUAL_MATERIAL}
            yield from ((f"{place}.at[{number}].{key}", value, USUAL_MATERIAL[key]) for key, value in given.items())
    for name, interface in scene.interface.items():
        for key, given in interface.given.items():
            place = f"{INTERFACE}.{shown_key(name)}.{key}"
            if (same := f"{CONTACT}.{key}") in known:
                yield from ((place, value, known[same]) for value in _numbers(given))


def _rows_of(scene: Scene) -> Iterator[tuple[str, tuple[MaterialState, ...]]]:
    """Materials by name at other temperatures."""
    yield from ((f"materials.{shown_key(name)}", material.at) for name, material in scene.materials.items())


def _moduli(member: Member) -> Iterator[tuple[str, dict[str, float]]]:
    """Key of Young's modulus of each material of a scene, and the numbers of the material."""
    if member.scene.material is not None:
        yield "material.young_modulus", member.scene.material.model_dump()
    for name, material in member.scene.materials.items():
        yield f"materials.{shown_key(name)}.young_modulus", material.given


def _is_nonsense(numbers: Mapping[str, float]) -> bool:
    """Whether a number of a material is nonsense by itself."""
    return any(usual.is_nonsense(numbers.get(key, 0.0)) for key, usual in USUAL_MATERIAL.items())


def _unusual_values(member: Member) -> Iterator[tuple[str, str]]:
    scene = member.scene
    said = set()
    for key, value, usual in _checked(member):
        if not usual.is_usual(value) and key not in said:
            said.add(key)
            yield key, f"{member.key_in_file(key)}: {shown(value)} is unusual; {usual.hint}"
    for modulus, numbers in _moduli(member) if _has_units(member) else ():
        alone = not {modulus, modulus.replace("young_modulus", "density")} & said
        if alone and (unusual := unusual_wave_speed(numbers)):
            yield modulus, f"{member.key_in_file(modulus)}: {shown(numbers['young_modulus'])} is unusual; {unusual}"
    if (damped := rayleigh_ratio(member.scene.response)) > USUAL_RATIO:
        key, ratios = "response.rayleigh", shown(list(scene.response.rayleigh or ()))
        damping = f"it damps modes of the range by up to {damped:.2g} of critical"
        yield key, f"{member.key_in_file(key)}: {ratios} is unusual; {damping}"
    if strained := speed_warning(member):
        yield SPEED, f"{member.key_in_file(SPEED)}: {strained}"


def unusual_wave_speed(numbers: Mapping[str, float]) -> str:
    """What is unusual about Young's modulus and density together; empty where nothing is."""
    speed = wave_speed(numbers)
    if WAVE_SPEED.is_usual(speed):
        return ""
    return f"with density {numbers['density']:g} sqrt(E / rho) is {speed:.3g} m/s; {WAVE_SPEED.hint}"


def hints_first(file: SceneFile, errors: Sequence[InputError]) -> list[InputError]:
    """Errors behind hints on values in other units, of which they may come; an error of such a value has the hint."""
    hints = {hint.key: hint for hint in _unit_hints(file).values()}
    for error in errors:
        if error.key in hints:
            unit = str(hints[error.key]).rpartition("; ")[2]
            hints[error.key] = error if unit in str(error) else InputError(f"{error}; {unit}")
            hints[error.key].source, hints[error.key].key = error.source, error.key
    return [*hints.values(), *(error for error in errors if error.key not in hints)]


def _unit_hints(file: SceneFile) -> dict[str, InputError]:
    """Hints on values that may be in another unit, by key; also of scenes with broken sections."""
    found: dict[str, InputError] = {}
    for member in filter(_has_units, file.members):
        for key, value, usual in _checked(member):
            if not usual.is_usual(value) and key not in found:
                place = member.key_in_file(key)
                allowed = f"usually {usual.low:g} to {usual.high:g}; {usual.hint}"
                found[key] = input_error(file.path, place, f"{shown(value)} is unusual", allowed)
    return found


def _too_low_range(member: Member) -> str:
    """What is said of a frequency range far below the first mode of the blade, a clamped beam, as kHz would be."""
    blade, material, (low, high) = member.scene.blade, member.scene.material, member.scene.response.frequency
    asked = f"{shown([low, high])} is unusual; the key is in Hz"
    meant = f"{shown([float(f'{1e3 * value:.12g}') for value in (low, high)])} where kHz are meant"
    if blade is None or material is None:
        of_file = member.scene.mesh_file is not None and high < LOW_RANGE
        return f"{asked}: {meant}" if of_file else ""
    speed, airfoil = math.sqrt(material.young_modulus / material.density), airfoil_of(member.scene)
    depth = 0.5 * (airfoil.thickness + (airfoil.tip_thickness or airfoil.thickness))
    first = FIRST_BENDING * speed * depth / blade.length**2
    said = f"{asked}, and the first mode of such a blade is near {float(f'{first:.2g}'):g} Hz"
    if high >= 0.1 * first:
        return ""
    return f"{said}: {meant}" if 1e3 * low < 3.0 * first < 9e3 * high else said


def _unusual_states(member: Member) -> Iterator[tuple[str, str]]:
    """Keys with values that are allowed, but often meant otherwise."""
    scene, order = member.scene, member.scene.excitation.engine_order
    for table, contact in scene.contacts.items():
        if not any(_numbers(contact.normal_stiffness) or [1.0]) and not any(_numbers(contact.preload)):
            key = f"{table}.normal_stiffness"
            yield key, "0 without a preload: the faces pass through each other, without a normal force or friction"
    if scene.n_blades is not None and order > scene.n_blades:
        wave = (order + scene.n_blades // 2) % scene.n_blades - scene.n_blades // 2
        text = f"{order} is above the {scene.n_blades} blades: the wave has {abs(wave)} nodal diameters"
        yield "excitation.engine_order", text


def _too_slow(file: SceneFile) -> str:
    """What is said of speeds at which tips hardly move, as those in rad/s would be."""
    member = max(file.members, key=lambda member: member.scene.load.speed_rpm)
    speed, tip = member.scene.load.speed_rpm, tip_speed(member.scene)
    if not 0.0 < tip < SLOW_TIP:
        return ""
    meant = f"{speed:g} rad/s are {speed * 30.0 / math.pi:.4g} rev/min"
    return f"{member.key_in_file(SPEED)}: {shown(speed)} is unusual; the tip moves at {tip:.2g} m/s; {meant}"


def rayleigh_ratio(response: Response) -> float:
    """Largest damping ratio of the frequency range, a / (2 w) + b w / 2 at one of its ends; 0 without `rayleigh`."""
    if response.rayleigh is None:
        return 0.0
    mass, stiffness = response.rayleigh
    omegas = [2.0 * math.pi * frequency for frequency in response.frequency]
    return max(mass / (2.0 * omega) + stiffness * omega / 2.0 for omega in omegas)


def _numbers(value: Any) -> list[float]:
    """Numbers of a value: of a list, of the materials of a table, of a field the mean and the ends on its side."""
    if isinstance(value, FaceField):
        return [value.mean, *(end for end in value.ends if end * value.mean >= 0.0)]
    values = value if isinstance(value, tuple) else value.values() if isinstance(value, Mapping) else (value,)
    return [v for v in values if isinstance(v, int | float)]
