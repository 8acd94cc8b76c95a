"""Which system of units a mesh file is in, told from its size and from the materials of solids."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from geometry import BLADE_RADII, UNIT_SYSTEMS
from pipeline.scene.material_section import USUAL_MATERIAL, WAVE_SPEED, wave_speed

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
    unit = _by_size(radius, []).unit
    numbers = {name: dict(_misfits(UNIT_SYSTEMS[unit].length, unit, values)) for name, values in known.items()}
    stated = {
        name: ", ".join(
            f"{key} = {value:.6g} ({known[name][key]:g} {symbol})" for key, (value, symbol) in own.items()
        )
        for name, own in numbers.items()
        if own
    }
    plain = {name: {key: value for key, (value, _) in own.items()} for name, own in numbers.items() if own}
    why = f"{_by_size(radius, []).why}; no consistent system of units has both size and materials of this file"
    return UnitProposal(unit, why, False, plain, stated)


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
    """Numbers that are none of a solid in this system, in SI units, and the unit that they are likely to be in."""
    for key, value in numbers.items():
        inside = _outside(_in_si(unit, {key: value})[key], TYPICAL[key]) == 0.0
        if inside:
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
