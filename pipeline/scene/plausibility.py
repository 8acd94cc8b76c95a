"""Plausibility: values that look like a mistake of units (mm, GPa, percent) are warned of, nonsense is refused."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.centrifugal_strain import speed_warning
from pipeline.scene.contact_stiffness import many_nodes_warning, stiff_contact_warning
from pipeline.scene.material_section import FORCED, USUAL_MATERIAL, WAVE_SPEED, Usual, wave_speed
from pipeline.scene.reading import Member, SceneFile, key_in_file
from pipeline.scene.validation_errors import shown_key

USUAL_RATIO = 0.1
SPEED = "load.speed_rpm"
RANGE = "response.frequency"
FIRST_BENDING = 0.1615  # 1.8751^2 / (2 pi sqrt(12)), of a clamped beam of rectangular section
LOW_RANGE = 5.0  # Hz; no blade has its first mode below


METRES = "the key is in metres"
USUAL: dict[str, Usual] = {
    "blade.hub_radius": Usual(0.01, 10.0, METRES, most=100.0),
    "blade.length": Usual(0.005, 3.0, METRES, most=30.0),
    "blade.chord": Usual(0.001, 1.0, METRES, most=10.0),
    "blade.thickness": Usual(1e-4, 0.5, METRES, most=2.0),
    "blade.tip_thickness": Usual(1e-4, 0.5, METRES, most=2.0),
    "shroud.thickness": Usual(1e-4, 0.5, METRES, most=2.0),
    "shroud.axial_width": Usual(0.001, 2.0, METRES, most=20.0),
    "shroud.contact_length": Usual(1e-4, 1.0, METRES, most=10.0),
    "shroud.angle": Usual(3.2, 180.0, "the key is in degrees"),
    **{f"material.{key}": usual for key, usual in USUAL_MATERIAL.items()},
    "rom.frequency_limit": Usual(1.0, 1e7, "the key is in Hz"),
    "excitation.engine_order": Usual(0, 1000, "it is the number of force maxima around the ring"),
    "excitation.force": Usual(1e-6, 1e5, "the key is in N, the force on one blade", most=1e10),
    "response.frequency": Usual(0.1, 1e6, "the key is in Hz", most=1e9),
}
USUAL_CONTACT: dict[str, Usual] = {
    "contact.friction": Usual(0.0, 2.0, "a friction coefficient is 0.1 to 1 or so", most=10.0),
    "response.damping_ratio": Usual(0.0, USUAL_RATIO, "the key is a fraction: 0.003 is 0.3 %"),
}
USUAL_BLADE_CONTACT: dict[str, Usual] = {
    "contact.normal_stiffness": Usual(1e3, 1e12, "the key is in N/m: 1 N/mm is 1000 N/m"),
    "contact.tangential_stiffness": Usual(1e3, 1e12, "the key is in N/m: 1 N/mm is 1000 N/m"),
    "contact.preload": Usual(0.0, 1e6, "the key is in N for each node"),
    "contact.interference": Usual(
        -1e-3, 1e-3, "the key is in metres: 1e-6 is 1 um, above 0 pressed together", -0.05, 0.05
    ),
}


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
            remarks.setdefault(RANGE, f"{file.path}: {key_in_file(member, RANGE)}: {low}")
        if (many := many_nodes_warning(member)) is not None:
            remarks.setdefault(many[0], f"{file.path}: {many[1]}")
    return [*found.values(), *remarks.values()]


def far_beyond(file: SceneFile, broken: Mapping[int, AbstractSet[str]]) -> Iterator[InputError]:
    """Values of a blade that are beyond all experience; models without units of their own have none."""
    for member in file.members:
        if not _has_units(member):
            continue
        for key, value, usual in _checked(member):
            if usual.is_nonsense(value) and key.partition(".")[0] not in broken.get(member.index, ()):
                allowed = f"{usual.low:g} to {usual.high:g}; {usual.hint}; {FORCED}"
                yield input_error(file.path, key_in_file(member, key), shown(value), allowed)
        for key, numbers in _moduli(member):
            if WAVE_SPEED.is_nonsense(wave_speed(numbers)) and not _is_nonsense(numbers):
                # of the two the one that is unusual by itself
                name = "young_modulus" if USUAL_MATERIAL["density"].is_usual(numbers["density"]) else "density"
                place = key_in_file(member, key.replace("young_modulus", name))
                allowed = f"another one: {unusual_wave_speed(numbers)}; {FORCED}"
                yield input_error(file.path, place, shown(numbers[name]), allowed)


def _has_units(member: Member) -> bool:
    """Whether the values of a scene are in SI units: those of a blade are, matrices may be in any."""
    return member.scene.blade is not None or member.scene.mesh_file is not None


def _checked(member: Member) -> Iterator[tuple[str, float, Usual]]:
    """Numbers of a scene with what is usual; of a list of numbers each."""
    scene = member.scene
    tables = [USUAL, USUAL_CONTACT, USUAL_BLADE_CONTACT] if _has_units(member) else [USUAL_CONTACT]
    for key, usual in ((key, usual) for table in tables for key, usual in table.items()):
        section, _, name = key.partition(".")
        yield from ((key, value, usual) for value in _numbers(getattr(getattr(scene, section), name, None)))
    for name, material in scene.materials.items():
        for key, usual in USUAL_MATERIAL.items():
            place = f"materials.{shown_key(name)}.{key}"
            yield from ((place, value, usual) for value in _numbers(getattr(material, key)))


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
            yield key, f"{key_in_file(member, key)}: {shown(value)} is unusual; {usual.hint}"
    for modulus, numbers in _moduli(member) if _has_units(member) else ():
        alone = not {modulus, modulus.replace("young_modulus", "density")} & said
        if alone and (unusual := unusual_wave_speed(numbers)):
            yield modulus, f"{key_in_file(member, modulus)}: {shown(numbers['young_modulus'])} is unusual; {unusual}"
    if (damped := _rayleigh_ratio(member)) > USUAL_RATIO:
        key, ratios = "response.rayleigh", shown(list(scene.response.rayleigh or ()))
        damping = f"it damps modes of the range by up to {damped:.2g} of critical"
        yield key, f"{key_in_file(member, key)}: {ratios} is unusual; {damping}"
    if strained := speed_warning(member):
        yield SPEED, f"{key_in_file(member, SPEED)}: {strained}"


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
                place = key_in_file(member, key)
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
    speed = math.sqrt(material.young_modulus / material.density)
    depth = 0.5 * (blade.thickness + (blade.tip_thickness or blade.thickness))
    first = FIRST_BENDING * speed * depth / blade.length**2
    said = f"{asked}, and the first mode of such a blade is near {float(f'{first:.2g}'):g} Hz"
    if high >= 0.1 * first:
        return ""
    return f"{said}: {meant}" if 1e3 * low < 3.0 * first < 9e3 * high else said


def _rayleigh_ratio(member: Member) -> float:
    """The largest damping ratio, a / (2 w) + b w / 2, at the ends of the frequency range."""
    response = member.scene.response
    if response.rayleigh is None:
        return 0.0
    mass, stiffness = response.rayleigh
    omegas = [2.0 * math.pi * frequency for frequency in response.frequency]
    return max(mass / (2.0 * omega) + stiffness * omega / 2.0 for omega in omegas)


def _numbers(value: Any) -> list[float]:
    values = value if isinstance(value, tuple) else (value,)
    return [v for v in values if isinstance(v, int | float)]
