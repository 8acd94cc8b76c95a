"""Labels of the quantities of a scene: symbol, unit and a factor that keeps numbers short."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from pipeline.scene.contact_section import FaceField
from pipeline.scene.dotted_keys import interface_of, of_contact, split_key
from pipeline.scene.mesh_section import MAIN_INTERFACE
from pipeline.scene.reading import Member
from pipeline.scene.schema import Scene, meaning_of


@dataclass(frozen=True)
class Quantity:
    """Symbol, unit and the factor from SI to that unit."""

    symbol: str
    unit: str = ""
    factor: float = 1.0

    def value(self, number: Any) -> str:
        """A number with its unit; lists by their first and last element."""
        if isinstance(number, tuple | list):
            if len(number) > 3:
                return f"[{self.value(number[0])} ... {self.value(number[-1])}]"
            return "[" + ", ".join(self.value(n) for n in number) + "]"
        if isinstance(number, FaceField | Mapping):
            parts = number if isinstance(number, Mapping) else number.model_dump()
            shapes = [f"{name} {self.value(parts[name])}" for name in ("tilt", "crown") if any(parts.get(name, ()))]
            return " ".join([self.value(parts["mean"]), *shapes])
        if isinstance(number, str | bool):
            return str(number)
        text = f"{number * self.factor:.6g}"
        return f"{text} {self.unit}" if self.unit else text

    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.symbol} [{self.unit}]" if self.unit else self.symbol


_PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
SHOWN = {"m": ("mm", 1e3), "degrees": ("°", 1.0), "kg/m^3": ("kg/m³", 1.0)}  # in place of SI units


def quantity(key: str) -> Quantity:
    """The quantity of a dotted key; its last word where there is no better name, behind that of its interface."""
    found = _quantity(key)
    return replace(found, symbol=f"{name} {found.symbol}") if (name := interface_of(key)) else found


def _quantity(key: str) -> Quantity:
    """The quantity of a dotted key, whatever interface it is of."""
    known = meaning_of(key)
    if not known.symbol:
        return Quantity(split_key(key)[1].replace("_", " "))
    return Quantity(known.symbol, *(known.shown or SHOWN.get(known.unit, (known.unit, 1.0))))


def value_label(key: str, value: Any) -> str:
    """`v0 = 3 µm`, `engine order 30`, `snubber v0 = 3 µm`."""
    joint = " = " if len(_quantity(key).symbol) <= 2 else " "
    return f"{quantity(key).symbol}{joint}{quantity(key).value(value)}"


def member_label(member: Member) -> str:
    """The swept parameters of a member, or its scene's name where nothing is swept."""
    parts = [value_label(key, value) for key, value in member.parameters.items()]
    return ", ".join(parts) if parts else member.scene.name


def fixed_values(scene: Scene, swept: Collection[str]) -> dict[str, Any]:
    """Engine order, force, speed, shroud angle, friction as in summary.json; None: swept, or not one number."""
    wave, shroud, frictions = scene.excitation, scene.shroud, {face.friction for face in scene.contacts.values()}
    friction = frictions.pop() if len(frictions) == 1 else None
    if MAIN_INTERFACE not in (scene.contact.interfaces or (MAIN_INTERFACE,)):
        shroud = None  # it does not touch
    keys = {
        "engine_order": (wave.engine_order, "excitation.engine_order"),
        "force_n": (wave.force, "excitation.force"),
        "speed_rpm": (scene.load.speed_rpm, "load.speed_rpm"),
        "shroud_angle": (None if shroud is None else shroud.angle, "shroud.angle", "mesh.file"),
        "friction": (friction if isinstance(friction, float) else None, "contact.friction"),
    }
    known = {of_contact(key) for key in swept}
    found = {name: None if {*by} & known else value for name, (value, *by) in keys.items()}
    return {**found, "at_tip": wave.at == "tip" and not wave.load}


def values_said(values: Mapping[str, Any]) -> str:
    """`EO 6 (nodal diameter 6), 2 N at the tip, 5000 rev/min, shroud 70°, friction 0.3`, as far as they are known."""
    diameter = values.get("nodal_diameter")
    forms = {
        "engine_order": "EO {:g}" + (f" (nodal diameter {diameter})" if diameter is not None else ""),
        "force_n": "{:g} N" + " at the tip" * values["at_tip"],
        "speed_rpm": "{:g} rev/min",
        "shroud_angle": "shroud {:g}°",
        "friction": "friction {:g}",
    }
    return ", ".join(form.format(values[name]) for name, form in forms.items() if values[name] is not None)


_OF_BLADES = (1e-8, 1e-2)  # displacements, m, that all have one unit, um


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Factor and prefixed unit that bring a number between 1 and 1000; a displacement of a blade is always in um."""
    if unit == "m" and _OF_BLADES[0] <= largest < _OF_BLADES[1]:
        return 1e6, "µm"
    size, prefix = _PREFIXES[0] if largest > 0.0 else (1.0, "")
    for candidate, name in _PREFIXES:
        if largest >= candidate:
            size, prefix = candidate, name
    return 1.0 / size, prefix + unit
