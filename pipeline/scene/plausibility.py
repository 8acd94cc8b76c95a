"""Plausibility warnings: allowed values that look like a mistake of units (mm, GPa, percent, radians)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pipeline.errors import shown
from pipeline.scene.contact_stiffness import stiff_contact_warning
from pipeline.scene.reading import Member, SceneFile, key_in_file

# dotted key -> (from, to) of usual values, and a hint what may be wrong beyond them
USUAL: dict[str, tuple[float, float, str]] = {
    "blade.hub_radius": (0.01, 10.0, "the key is in metres"),
    "blade.length": (0.005, 3.0, "the key is in metres"),
    "blade.chord": (0.001, 1.0, "the key is in metres"),
    "shroud.angle": (3.2, 180.0, "the key is in degrees"),
    "material.young_modulus": (1e8, 2e12, "the key is in Pa: steel has 2.1e11"),
    "material.density": (100.0, 30_000.0, "the key is in kg/m^3: steel has 7850"),
}
USUAL_CONTACT: dict[str, tuple[float, float, str]] = {
    "contact.friction": (0.0, 2.0, "a friction coefficient is 0.1 to 1 or so"),
    "response.damping_ratio": (0.0, 0.1, "the key is a fraction: 0.003 is 0.3 %"),
}
USUAL_BLADE_CONTACT: dict[str, tuple[float, float, str]] = {
    "contact.normal_stiffness": (1e3, 1e12, "the key is in N/m: 1 N/mm is 1000 N/m"),
    "contact.tangential_stiffness": (1e3, 1e12, "the key is in N/m: 1 N/mm is 1000 N/m"),
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
        stiff = stiff_contact_warning(member)
        if stiff is not None and not found:  # a mistake of units makes stiff what is not
            remarks.setdefault(stiff[0], f"{file.path}: {stiff[1]}")
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


def _numbers(value: Any) -> list[float]:
    values = value if isinstance(value, tuple) else (value,)
    return [v for v in values if isinstance(v, int | float)]
