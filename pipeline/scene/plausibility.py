"""Plausibility warnings: allowed values that look like a mistake of units (mm, GPa, percent, radians)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from pipeline.errors import InputError, shown
from pipeline.scene.centrifugal_strain import speed_warning
from pipeline.scene.contact_stiffness import many_nodes_warning, stiff_contact_warning
from pipeline.scene.reading import Member, SceneFile, key_in_file

USUAL_RATIO = 0.1
SPEED = "load.speed_rpm"
RANGE = "response.frequency"
FIRST_BENDING = 0.1615  # 1.8751^2 / (2 pi sqrt(12)), of a clamped beam of rectangular section
LOW_RANGE = 5.0  # Hz; no blade has its first mode below
# dotted key -> (from, to) of usual values, and a hint what may be wrong beyond them
USUAL: dict[str, tuple[float, float, str]] = {
    "blade.hub_radius": (0.01, 10.0, "the key is in metres"),
    "blade.length": (0.005, 3.0, "the key is in metres"),
    "blade.chord": (0.001, 1.0, "the key is in metres"),
    "blade.thickness": (1e-4, 0.5, "the key is in metres"),
    "blade.tip_thickness": (1e-4, 0.5, "the key is in metres"),
    "shroud.thickness": (1e-4, 0.5, "the key is in metres"),
    "shroud.axial_width": (0.001, 2.0, "the key is in metres"),
    "shroud.contact_length": (1e-4, 1.0, "the key is in metres"),
    "shroud.angle": (3.2, 180.0, "the key is in degrees"),
    "material.young_modulus": (1e8, 2e12, "the key is in Pa: steel has 2.1e11"),
    "material.poisson_ratio": (0.0, 0.5, "metals have 0.25 to 0.35"),
    "material.density": (100.0, 30_000.0, "the key is in kg/m^3: steel has 7850"),
    "rom.frequency_limit": (1.0, 1e7, "the key is in Hz"),
    "excitation.engine_order": (0, 1000, "it is the number of force maxima around the ring"),
    "excitation.force": (1e-6, 1e5, "the key is in N, the force on one blade"),
    "response.frequency": (0.1, 1e6, "the key is in Hz"),
}
USUAL_CONTACT: dict[str, tuple[float, float, str]] = {
    "contact.friction": (0.0, 2.0, "a friction coefficient is 0.1 to 1 or so"),
    "response.damping_ratio": (0.0, USUAL_RATIO, "the key is a fraction: 0.003 is 0.3 %"),
}
USUAL_BLADE_CONTACT: dict[str, tuple[float, float, str]] = {
    "contact.normal_stiffness": (1e3, 1e12, "the key is in N/m: 1 N/mm is 1000 N/m"),
    "contact.tangential_stiffness": (1e3, 1e12, "the key is in N/m: 1 N/mm is 1000 N/m"),
    "contact.preload": (0.0, 1e6, "the key is in N for each node"),
    "contact.interference": (-1e-3, 1e-3, "the key is in metres: 1e-6 is 1 um, above 0 pressed together"),
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


def _unusual_values(member: Member) -> Iterator[tuple[str, str]]:
    scene = member.scene
    tables = [USUAL_CONTACT] if scene.blade is None else [USUAL, USUAL_CONTACT, USUAL_BLADE_CONTACT]
    for key, (low, high, hint) in ((key, usual) for table in tables for key, usual in table.items()):
        section, _, name = key.partition(".")
        table = getattr(scene, section)
        unusual = [v for v in _numbers(getattr(table, name, None)) if v != 0.0 and not low <= v <= high]
        if unusual:
            yield key, f"{key_in_file(member, key)}: {shown(unusual[0])} is unusual; {hint}"
    if (damped := _rayleigh_ratio(member)) > USUAL_RATIO:
        key, value = "response.rayleigh", shown(list(scene.response.rayleigh or ()))
        damping = f"it damps modes of the range by up to {damped:.2g} of critical"
        yield key, f"{key_in_file(member, key)}: {value} is unusual; {damping}"
    if said := speed_warning(member):
        yield SPEED, f"{key_in_file(member, SPEED)}: {said}"


def hints_first(file: SceneFile, errors: Sequence[InputError]) -> list[InputError]:
    """Errors behind hints on values in other units, of which they may come; an error of such a value has the hint.

    Parameters
    ----------
    file : SceneFile
        The scene.
    errors : sequence of InputError
        Its errors.
    """
    hints = {hint.key: hint for hint in _unit_hints(file).values()}
    for error in errors:
        if error.key in hints:
            unit = str(hints[error.key]).rpartition("; ")[2]
            hints[error.key] = error if unit in str(error) else InputError(f"{error}; {unit}")
            hints[error.key].source, hints[error.key].key = error.source, error.key
    return [*hints.values(), *(error for error in errors if error.key not in hints)]


def _unit_hints(file: SceneFile) -> dict[str, InputError]:
    """Hints on values of a blade in another unit, by key."""
    found: dict[str, InputError] = {}
    for member in file.members:
        for key, usual in USUAL.items() if member.scene.blade is not None else ():
            section, _, name = key.partition(".")
            for value in _numbers(getattr(getattr(member.scene, section), name, None)):
                if value != 0.0 and not usual[0] <= value <= usual[1] and key not in found:
                    place = key_in_file(member, key)
                    hint = found[key] = InputError(f"{file.path}: {place}: {shown(value)} is unusual; {usual[2]}")
                    hint.source, hint.key = str(file.path), place
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
