"""Knobs of a scene: its keys that can be turned, with labels as figures have them and ranges that make sense."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

from pipeline.scene.contact_section import PER_NODE, Law
from pipeline.scene.dotted_keys import CONTACT, interface_of, of_contact, split_key
from pipeline.scene.labels import SHOWN, Quantity, quantity
from pipeline.scene.schema import meaning_of
from pipeline.scene.sweep import key_value
from pipeline.scene.units import key_unit
from pipeline.scene.varied_keys import without_effect
from pipeline.stages.engine_orders import SPEED
from pipeline.studies.optimum.checks import OPTIMISED_KEYS

if TYPE_CHECKING:
    from pipeline.scene.reading import SceneFile
    from pipeline.scene.schema import Scene

Kind = Literal["number", "whole", "choice"]
LIMITS = {"response.damping_ratio": (1e-6, 0.5)}
MOST_ORDER = 100  # engine orders of a structure whose number of blades is not known
HARMONICS = (1, 3, 5, 7, 9, 11, 15, "auto")
SHARE = 0.2  # of the value on each side, for what has no better range
STEPS, CLOSELY = 200, 1000  # of a range, and of that of an interference, or some more
Range = tuple[float, float]


@dataclass(frozen=True)
class Knob:
    """A key that can be turned. Numbers are in SI units; shown ones are `factor` times as large, in `unit`."""

    key: str  # dotted key: "contact.friction", "interface.NAME.friction"
    label: str  # as the axis of a figure has it: "v0 [µm]"
    kind: Kind
    value: Any  # of the scene as it stands; of a list node by node its mean, of stiffnesses their sum
    low: float = (
        -math.inf
    )  # `low`, `high`: ends of the range that makes sense; other allowed values are taken as well
    high: float = math.inf
    step: float = 0.0  # of a slider, for scales that are not logarithmic
    log: bool = False  # whether the scale is logarithmic
    choices: tuple[Any, ...] = ()  # allowed values, of a choice
    unit: str = ""
    factor: float = 1.0
    remeshes: bool = False  # whether another value needs another reduced model, which is built behind a button
    seconds: float = 0.0  # what building it takes, from the models made before; 0 where it is not known or nothing

    def position(self, value: float) -> float:
        """Place of a number on the scale from 0 to 1."""
        low, high = (math.log(self.low), math.log(self.high)) if self.log else (self.low, self.high)
        at = math.log(value) if self.log else value
        return min(max((at - low) / (high - low), 0.0), 1.0) if high > low else 0.0

    def at(self, position: float) -> float | int:
        """The number at a place from 0 to 1 of the scale, rounded to whole steps."""
        if self.log:
            value = math.exp(math.log(self.low) + position * (math.log(self.high) - math.log(self.low)))
            return float(f"{value:.4g}")
        value = self.low + position * (self.high - self.low)
        value = round(value / self.step) * self.step if self.step else value
        return round(value) if self.kind == "whole" else float(f"{value:.12g}")


def knobs_of(
    file: SceneFile,
    scene: Scene,
    static: Mapping[str, Range],
    punch: Mapping[str, float],
    costs: Mapping[str, float],
    stored: Sequence[float] = (),
) -> tuple[Knob, ...]:
    """The knobs of a scene, those that are turned at once first.

    `static`: ranges of interference and preload from linear responses. `punch`: stiffnesses that are computed from
    the face. `costs`: seconds that another model takes, by key, 0 for no time; keys that are missing need none.
    `stored`: several speeds of which there are models, between which is chosen.
    """
    found = []
    for key in (key for key in turned_keys(scene) if key != SPEED or not stored):
        value = punch.get(key, key_value(scene, key))
        if value is not None:
            limits = _range(file, scene, key, value, static)
            if limits[0] < limits[1]:
                found.append(_number(key, value, limits, costs.get(key)))
    found += _choices(scene, stored)
    return tuple(sorted(found, key=lambda knob: knob.remeshes))


def turned_keys(scene: Scene) -> Iterator[str]:
    """The keys of a scene that are numbers and can be turned."""
    tables = [CONTACT, *(table for table in scene.contacts if table != CONTACT)]
    for table in tables:
        yield from (f"{table}.{name}" for name in _own_keys(scene, table))
    yield from ("excitation.force", "excitation.engine_order")
    if scene.response.damping_ratio is not None:
        yield "response.damping_ratio"
    if scene.damper_touches:
        yield "damper.mass"
    for key in OPTIMISED_KEYS:
        table = split_key(key)[0]
        if table in ("contact", "excitation", "response") or key == "damper.mass":
            continue
        if scene.model is not None or getattr(scene, table) is None or (key == SPEED and not scene.load.speed_rpm):
            continue
        if not without_effect(scene, key):
            yield key


def _own_keys(scene: Scene, table: str) -> list[str]:
    """The parameters of a table of contacts that are used: those of [contact] only where an interface has none."""
    if table != CONTACT:
        own = scene.interface[interface_of(f"{table}.")]
        return list(own.given)
    names = scene.contact.interfaces or scene.interfaces
    if names is None:
        return list(PER_NODE)
    tables = [scene.interface.get(scene.table_of(name)) for name in names]
    return [key for key in PER_NODE if any(each is None or key not in each.given for each in tables)]


def _range(file: SceneFile, scene: Scene, key: str, value: float, static: Mapping[str, Range]) -> Range:
    """The range of a number, which has the value of the scene and those of its sweep in it."""
    same = of_contact(key)
    swept = [key_value(member.scene, key) for member in file.members] if key in file.swept else []
    values = [value, *(each for each in swept if each is not None)]
    known = meaning_of(key)
    if known.decades:
        low, high = value * 10.0**-known.decades, value * 10.0**known.decades
        least, most = LIMITS.get(same, (0.0, math.inf))
        limits = max(low, least), min(high, most)
    elif known.turned is not None:
        low, high = static.get(key, known.turned)
        limits = (low if known.turned[0] else 0.0), high  # what may be 0 can be turned to it
    elif key == "excitation.engine_order":
        limits = 0.0, float((scene.n_blades or 2 * MOST_ORDER) // 2)
    else:
        low, high = sorted(((1.0 - SHARE) * value, (1.0 + SHARE) * value))
        limits = low, min(high, 180.0) if key.endswith("angle") else high
    return min(limits[0], *values), max(limits[1], *values)


def _number(key: str, value: float, limits: Range, cost: float | None) -> Knob:
    named, whole = _named(key), key == "excitation.engine_order"
    log = meaning_of(key).decades > 0.0 and limits[0] > 0.0
    step = 1.0 if whole else _round_step(limits, CLOSELY if meaning_of(key).sign else STEPS)
    return Knob(
        key,
        named.axis(),
        "whole" if whole else "number",
        int(value) if whole else value,
        *limits,
        step=0.0 if log else step,
        log=log,
        unit=named.unit,
        factor=named.factor,
        remeshes=cost is not None and cost > 0.0,
        seconds=cost or 0.0,
    )


def _named(key: str) -> Quantity:
    """The quantity of a key as figures have it; of one that they do not have, its section, name and unit."""
    found, unit = quantity(key), key_unit(key)
    if found.unit or not unit:
        return found
    table, name = split_key(key)
    shown, factor = SHOWN.get(unit, (unit, 1.0))
    return Quantity(f"{table.replace('.', ' ')} {name}".replace("_", " "), shown, factor)


def _round_step(limits: Range, count: int) -> float:
    """1, 2 or 5 times a power of ten: about so many steps in the range."""
    rough = (limits[1] - limits[0]) / count
    if rough <= 0.0:
        return 0.0
    power = 10.0 ** math.floor(math.log10(rough))
    return float(f"{next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= rough * (1.0 - 1e-9)):.12g}")


def _choices(scene: Scene, stored: Sequence[float]) -> Iterator[Knob]:
    """Harmonics, law of friction, and the speeds of which there are models, where there are several."""
    now = scene.response.harmonics
    least = scene.excitation.highest_harmonic
    numbers = {
        *(each for each in HARMONICS if isinstance(each, int) and each >= least),
        *([now] if now != "auto" else []),
    }
    yield Knob(
        "response.harmonics", "harmonics", "choice", now, choices=(*sorted(n for n in numbers if n != "auto"), "auto")
    )
    for table, face in scene.contacts.items():
        if table == CONTACT or scene.interface[interface_of(f"{table}.")].law is not None:
            name = " ".join(filter(None, (interface_of(f"{table}."), "friction law")))
            yield Knob(f"{table}.law", name, "choice", face.law, choices=get_args(Law))
    if stored:
        named = quantity(SPEED)
        yield Knob(SPEED, named.axis(), "choice", scene.load.speed_rpm, choices=tuple(stored), unit=named.unit)
