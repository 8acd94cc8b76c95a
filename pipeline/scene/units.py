"""SI units of the keys of a scene, and names of columns that carry them."""

from __future__ import annotations

import math
import re

from pipeline.scene.schema import meaning_of

# SI unit -> units that a user may write beside a number, in terms of it
_SCALES = {
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "in": 0.0254},
    "Pa": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N/mm^2": 1e6, "N/mm2": 1e6, "GPa": 1e9},
    "kg/m^3": {"kg/m^3": 1.0, "kg/m3": 1.0, "g/cm^3": 1e3, "g/cm3": 1e3, "t/mm^3": 1e12, "t/mm3": 1e12},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "rev/min": {"rev/min": 1.0, "rpm": 1.0},
    "N/m": {"N/m": 1.0, "kN/m": 1e3, "N/mm": 1e3, "kN/mm": 1e6},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "degrees": {"degrees": 1.0, "deg": 1.0, "°": 1.0, "rad": math.degrees(1.0)},
    "kg": {"kg": 1.0, "g": 1e-3},
    "m^2": {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6},
    "": {"%": 1e-2},
}
_TEXT_NUMBER = re.compile(r"([+-]?\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?)\s*(\S*)")
_ENDINGS = {
    "degrees": "deg",
    "Pa": "pa",
    "kg/m^3": "kg_per_m3",
    "Hz": "hz",
    "rev/min": "rpm",
    "N/m": "n_per_m",
    "N": "n",
    "J": "j",
    "rad": "rad",
    "m": "m",
    "s": "s",
    "1/s": "per_s",
}


def key_unit(key: str) -> str:
    """The unit of a dotted key, "" where its value has none."""
    return meaning_of(key).unit


def number_in_text(unit: str, text: str) -> str:
    """What text such as "150 mm" or "0,15" is in a unit, in words; "" where it is no number."""
    found = _TEXT_NUMBER.fullmatch(text.strip())
    scales = _SCALES.get(unit, {})
    if found is None or (found[2] and found[2] not in scales):
        return ""
    value = float(found[1].replace(",", ".")) * (scales[found[2]] if found[2] else 1.0)
    return f"a number without quotes and unit{f', in {unit}' if unit else ''}: {value:.12g}"


def column_name(key: str) -> str:
    """Name of the column of a dotted key, which ends with its unit: `contact.interference_m`, `load.speed_rpm`."""
    return with_unit(key, key_unit(key))


def with_unit(name: str, unit: str) -> str:
    """A name that ends with its unit; unchanged where it does so already, or where none ends with that unit."""
    ending = f"_{_ENDINGS[unit]}" if unit in _ENDINGS else ""
    return name if not ending or name.endswith(ending) else name + ending


def unit_of(column: str) -> str:
    """The unit that the name of a column ends with; "" where it ends with none."""
    return next((unit for unit, ending in _ENDINGS.items() if column.endswith(f"_{ending}")), "")
