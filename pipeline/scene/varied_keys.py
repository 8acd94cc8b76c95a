"""Keys that a scene varies: by its sweep, and by the studies that optimise, map, tolerate or draw them at random.

What varies a key that has no effect would show the same curve under different labels: it is refused.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from pipeline.errors import InputError, input_error, shown_key
from pipeline.scene.blade_section import DAMPER, INTERFACES, OF_AIRFOIL
from pipeline.scene.contact_section import OF_INTERFACE
from pipeline.scene.dotted_keys import CONTACT, INTERFACE, interface_of, split_key
from pipeline.scene.material_section import ANISOTROPIC
from pipeline.scene.schema import Scene

if TYPE_CHECKING:
    from pipeline.scene.reading import SceneFile


class Varied(NamedTuple):
    """A key that a study varies: the place of its values in messages, the values, and differences of values."""

    place: str
    key: str
    values: tuple[Any, ...]
    widths: tuple[float, ...] = ()


def studied_keys(scene: Scene) -> Iterator[Varied]:
    """Keys that the studies of a scene vary, with their values."""
    if scene.optimum is not None:
        for key, limits in scene.optimum.ranges.items():
            yield Varied(f"optimum.over.{shown_key(key)}", key, limits)
        for key, width in scene.optimum.tolerances.items():
            yield Varied(f"optimum.tolerance.{shown_key(key)}", key, (), (width,))
    if scene.crossings is not None:
        for key, width in scene.crossings.tolerances.items():
            yield Varied(f"crossings.tolerance.{shown_key(key)}", key, (), (width,))
    if scene.map is not None:
        for key, values in scene.map.over.items():
            yield Varied(f"map.over.{shown_key(key)}", key, values)
    if scene.uncertainty is not None:
        for number, law in enumerate(scene.uncertainty.parameter):
            place = f"uncertainty.parameter[{number}]"
            yield Varied(f"{place}.key", law.key, ())
            for name in ("mean", "median", "low", "high"):
                if (value := getattr(law, name)) is not None:
                    yield Varied(f"{place}.{name}", law.key, (value,))
            if law.deviation is not None:
                yield Varied(f"{place}.deviation", law.key, (), (law.deviation,))
    if scene.wear is not None:
        for number, point in enumerate(scene.wear.duty):
            for key, value in point.values.items():
                yield Varied(f"wear.duty[{number}].{split_key(key)[1]}", key, (value,))


def unfit_varied_keys(file: SceneFile, interfaces: Collection[str] | None = None) -> Iterator[InputError]:
    """Keys that are varied without effect; `interfaces` of the model, where they are known already."""
    for key in file.swept:
        reasons = {without_effect(member.scene, key, interfaces) for member in file.members}
        if "" not in reasons:
            place = f"{file.members[0].place}.{shown_key(key)}"
            yield input_error(file.path, place, f"has no effect: {min(reasons)}", "keys that the model uses")
    for varied in {item.key: item for item in reversed(list(studied_keys(file.first)))}.values():
        if reason := without_effect(file.first, varied.key, interfaces):
            yield input_error(file.path, varied.place, f"has no effect: {reason}", "keys that the model uses")


def without_effect(scene: Scene, key: str, interfaces: Collection[str] | None = None) -> str:
    """Why a key has no effect in a scene; "" where it has one, or where that is not known."""
    known = scene.interfaces if interfaces is None else tuple(interfaces)
    table, name = split_key(key)
    if known is None:
        return _unused(scene, key)
    touching = [item for item in known if item in (scene.contact.interfaces or known)]
    if own := interface_of(key):
        touches = own in touching or (own == DAMPER and bool(set(INTERFACES[DAMPER]) & set(touching)))
        return "" if touches or own not in (*known, DAMPER) else f"{own} does not touch"
    if table == CONTACT and name in OF_INTERFACE and touching:
        tables = {scene.table_of(item) for item in touching}
        if all(item in scene.interface and name in scene.interface[item].given for item in tables):
            return " and ".join(f"{INTERFACE}.{item}.{name}" for item in sorted(tables)) + " is used"
    return _unused(scene, key)


def _unused(scene: Scene, key: str) -> str:
    """Why a key that other keys switch on is not used; "" where it is."""
    isotropic = scene.material is not None and {*ANISOTROPIC}.isdisjoint(scene.material.given)
    fixed = scene.material is not None and scene.material.axes is not None
    harmonics, at_rest = scene.response.harmonics, scene.load.speed_rpm == 0.0
    reasons = {
        "contact.samples": (scene.contact.integration == "exact", 'contact.integration = "exact" needs no samples'),
        "response.tolerance": (harmonics != "auto", f"response.harmonics = {harmonics}"),
        "load.coriolis": (at_rest, "load.speed_rpm = 0"),
        "load.equilibrium": (at_rest, "load.speed_rpm = 0"),
        "load.temperature_factor": (scene.load.temperature is None, "there is no [load.temperature]"),
        **dict.fromkeys(
            ("material.tilt", "material.turn"),
            (isotropic or fixed, "the material " + ("has axes" if fixed else "is isotropic")),
        ),
        **dict.fromkeys(
            (f"blade.{name}" for name in OF_AIRFOIL),
            (scene.blade is not None and scene.blade.sections is not None, "blade.sections give the airfoil"),
        ),
        "damper.axial_stiffness": (not scene.damper_touches, "the damper does not touch"),
        "damper.mass": (not scene.damper_touches, "the damper does not touch"),
    }
    unused, reason = reasons.get(key, (False, ""))
    table, name = split_key(key)
    if table == "material" and scene.material is not None and any(name in row.given for row in scene.material.at):
        return "material.at has it at other temperatures"
    return reason if unused else ""
