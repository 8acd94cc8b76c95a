"""Units of mesh files: lengths and the consistent units of materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from geometry.errors import OwnMeshError

_POUND_FORCE = 4.4482216152605  # N
_INCH = 0.0254  # m


@dataclass(frozen=True)
class Unit:
    """SI values of the units of a consistent system.

    Attributes
    ----------
    length, pressure, density : float
        m, Pa and kg/m^3.
    """

    length: float
    pressure: float
    density: float


UNITS = {
    "m": Unit(1.0, 1.0, 1.0),
    "mm": Unit(1e-3, 1e6, 1e12),
    "in": Unit(_INCH, _POUND_FORCE / _INCH**2, _POUND_FORCE / _INCH**4),
}
_SMALLEST, _LARGEST = 0.002, 20.0  # radius of the blade tip, m


def materials_in_si(materials: Mapping[str, Mapping[str, float]], unit: str) -> dict[str, dict[str, float]]:
    """Materials of a file in Pa and kg/m^3."""
    factor = {"young_modulus": UNITS[unit].pressure, "density": UNITS[unit].density}
    return {
        name: {key: value * factor.get(key, 1.0) for key, value in numbers.items()}
        for name, numbers in materials.items()
    }


def check_size(radius: float, unit: str) -> None:
    """Raise OwnMeshError where the outer radius (m) is not that of a blade, with the unit that would do."""
    if _SMALLEST <= radius <= _LARGEST:
        return
    other = {name: radius / UNITS[unit].length * each.length for name, each in UNITS.items()}
    fit = [f'"{name}" ({length:.4g} m)' for name, length in other.items() if _SMALLEST <= length <= _LARGEST]
    means = f"the outer radius of the mesh is then {radius:.4g} m"
    raise OwnMeshError(
        "mesh.unit",
        unit,
        f"{means}; {'with ' + ' or '.join(fit) + ' it is a blade' if fit else 'no unit makes a blade of it'}",
    )
