"""SI units of the keys of a scene, and names of columns that carry them."""

from __future__ import annotations

UNITS = {
    "blade.hub_radius": "m",
    "blade.length": "m",
    "blade.chord": "m",
    "blade.thickness": "m",
    "blade.tip_thickness": "m",
    "blade.twist": "degrees",
    "blade.root_stagger": "degrees",
    "blade.fillet_radius": "m",
    "blade.camber": "degrees",
    "shroud.angle": "degrees",
    "shroud.thickness": "m",
    "shroud.axial_width": "m",
    "shroud.contact_length": "m",
    "shroud.gap": "m",
    "shroud.edge_angle": "degrees",
    "shroud.fillet_radius": "m",
    "disk.bore_radius": "m",
    "disk.rim_width": "m",
    "disk.bore_width": "m",
    "disk.profile": "m",
    "disk.size": "m",
    "material.young_modulus": "Pa",
    "material.density": "kg/m^3",
    "mesh.size": "m",
    "rom.frequency_limit": "Hz",
    "load.speed_rpm": "rev/min",
    "model.speed_rpm": "rev/min",
    "contact.normal_stiffness": "N/m",
    "contact.tangential_stiffness": "N/m",
    "contact.interference": "m",
    "contact.preload": "N",
    "excitation.force": "N",
    "excitation.at": "m",
    "response.frequency": "Hz",
    "backbone.amplitudes": "m",
    "fatigue.endurance_limit": "Pa",
    "fatigue.tensile_strength": "Pa",
    "fatigue.yield_strength": "Pa",
    "uncertainty.limit": "m",
    "mistuning.interference_deviation": "m",
    "mistuning.frequency_range": "Hz",
}
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
    return UNITS.get(key, "")


def column_name(key: str) -> str:
    """Name of the column of a dotted key, which ends with its unit: `contact.interference_m`, `load.speed_rpm`."""
    return with_unit(key, key_unit(key))


def with_unit(name: str, unit: str) -> str:
    """A name that ends with its unit; unchanged where it does so already, or where there is none."""
    ending = f"_{_ENDINGS[unit]}" if unit else ""
    return name if not ending or name.endswith(ending) else name + ending


def unit_of(column: str) -> str:
    """The unit that the name of a column ends with; "" where it ends with none."""
    return next((unit for unit, ending in _ENDINGS.items() if column.endswith(f"_{ending}")), "")
