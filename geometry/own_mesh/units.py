"""Units of mesh files: materials in SI units, and whether the size is that of a blade."""

from __future__ import annotations

from collections.abc import Mapping

from geometry.errors import OwnMeshError
from geometry.units import BLADE_RADII, UNIT_SYSTEMS


def materials_in_si(materials: Mapping[str, Mapping[str, float]], unit: str) -> dict[str, dict[str, float]]:
    """Materials of a file in Pa and kg/m^3."""
    factor = {"young_modulus": UNIT_SYSTEMS[unit].pressure, "density": UNIT_SYSTEMS[unit].density}
    return {
        name: {key: value * factor.get(key, 1.0) for key, value in numbers.items()}
        for name, numbers in materials.items()
    }


def check_size(radius: float, unit: str) -> None:
    """Raise OwnMeshError where the outer radius (m) is not that of a blade, with the unit that would do."""
    smallest, largest = BLADE_RADII
    if smallest <= radius <= largest:
        return
    lengths: dict[float, str] = {}  # the first system with each unit of length
    for name, system in UNIT_SYSTEMS.items():
        lengths.setdefault(radius / UNIT_SYSTEMS[unit].length * system.length, name)
    fit = [f'"{name}" ({length:.4g} m)' for length, name in lengths.items() if smallest <= length <= largest]
    means = f"the outer radius of the mesh is then {radius:.4g} m"
    raise OwnMeshError(
        "mesh.unit",
        unit,
        f"{means}; {'with ' + ' or '.join(fit) + ' it is a blade' if fit else 'no unit makes a blade of it'}",
    )
