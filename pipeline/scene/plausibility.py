"""Values that are allowed and look like a slip: of units, of percent, of radians. Said, and computed all the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from pipeline.errors import shown
from pipeline.scene.reading import Member, SceneFile, where
from pipeline.scene.schema import Scene

if TYPE_CHECKING:
    from pipeline.stages.request import RunOutcome

# dotted key -> (from, to) that nobody wonders about, and what it may have been meant for
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


def slips(file: SceneFile) -> list[str]:
    """One line for every key with a value that people seldom mean; a value of 0 always says what it says."""
    found: dict[str, str] = {}
    for member in file.members:
        for key, text in _of_member(member):
            found.setdefault(key, f"{file.path}: {text}")
    return list(found.values())


def range_remark(outcome: RunOutcome, scene: Scene) -> str:
    """A line where no natural frequency, free, sliding or stuck, lies in the range of a single-scene run; else empty.

    With none in it a curve has no resonance, which is seldom what a range was chosen for.
    """
    low, high = scene.response.frequency
    known = [hz for model in outcome.models for hz in _natural(model)]
    if not known or any(low <= hz <= high for hz in known):
        return ""
    below = max((hz for hz in known if hz < low), default=None)
    above = min((hz for hz in known if hz > high), default=None)
    nearest = " and ".join(f"{hz:.6g} Hz" for hz in (below, above) if hz is not None)
    return f"no natural frequency lies in response.frequency, {low:g} to {high:g} Hz; the nearest: {nearest}"


def _of_member(member: Member) -> Iterator[tuple[str, str]]:
    scene = member.scene
    tables = [USUAL_CONTACT] if scene.blade is None else [USUAL, USUAL_CONTACT, USUAL_BLADE_CONTACT]
    for key, (low, high, hint) in ((key, usual) for table in tables for key, usual in table.items()):
        section, _, name = key.partition(".")
        table = getattr(scene, section)
        unusual = [v for v in _numbers(getattr(table, name, None)) if v != 0.0 and not low <= v <= high]
        if unusual:
            yield key, f"{where(member, key)}: {shown(unusual[0])} is unusual; {hint}"


def _numbers(value: Any) -> list[float]:
    values = value if isinstance(value, tuple) else (value,)
    return [v for v in values if isinstance(v, int | float)]


def _natural(model: dict[str, Any]) -> Iterator[float]:
    """All natural frequencies of an entry of `models` in the summary, Hz."""
    yield from model["free_hz"]
    for joint in ("sliding_hz", "stuck_hz"):
        for values in model[joint].values():
            yield from values
