"""Systems of units of files from other programs, with their values in SI units; which of them make a blade."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from geometry.errors import OwnMeshError

_INCH, _FOOT = 0.0254, 0.3048  # m
_POUND_FORCE, _POUND = 4.4482216152605, 0.45359237  # N, kg
_KIP = 1e3 * _POUND_FORCE
BLADE_RADII = (0.002, 20.0)  # of the tip, m
_KILOGRAM_FORCE = 9.80665  # N


@dataclass(frozen=True)
class UnitSystem:
    """SI values of the units of length, force and mass of a file, and names of what follows from them.

    A system is consistent where force = mass length / time^2. Those with pounds of mass are not: their densities are
    weights per volume.
    """

    # length, force, mass: m, N and kg
    length: float
    force: float
    mass: float
    # pressure_name, density_name: what Young's modulus and density are called in
    pressure_name: str
    density_name: str

    @property
    def pressure(self) -> float:
        """Pa."""
        return self.force / self.length / self.length

    @property
    def density(self) -> float:
        """kg/m^3."""
        return self.mass / self.length / self.length / self.length


# where several fit a file equally well, the first is proposed
UNIT_SYSTEMS: Mapping[str, UnitSystem] = MappingProxyType(
    {
        "m": UnitSystem(1.0, 1.0, 1.0, "Pa", "kg/m^3"),
        "mm": UnitSystem(1e-3, 1.0, 1e3, "MPa", "t/mm^3"),
        "in": UnitSystem(_INCH, _POUND_FORCE, _POUND_FORCE / _INCH, "psi", "lbf s^2/in^4"),
        "mm-kg-s": UnitSystem(1e-3, 1e-3, 1.0, "kPa", "kg/mm^3"),
        "mm-kg-ms": UnitSystem(1e-3, 1e3, 1.0, "GPa", "kg/mm^3"),
        "mm-g-ms": UnitSystem(1e-3, 1.0, 1e-3, "MPa", "g/mm^3"),
        "mm-g-s": UnitSystem(1e-3, 1e-6, 1e-3, "Pa", "g/mm^3"),
        "mm-kgf-s": UnitSystem(1e-3, _KILOGRAM_FORCE, 1e3 * _KILOGRAM_FORCE, "kgf/mm^2", "kgf s^2/mm^4"),
        "cm-g-s": UnitSystem(1e-2, 1e-5, 1e-3, "dyn/cm^2", "g/cm^3"),
        "m-t-s": UnitSystem(1.0, 1e3, 1e3, "kPa", "t/m^3"),
        "in-lbf-lbm": UnitSystem(_INCH, _POUND_FORCE, _POUND, "psi", "lbf/in^3"),
        "in-kip-s": UnitSystem(_INCH, _KIP, _KIP / _INCH, "ksi", "kip s^2/in^4"),
        "ft-lbf-s": UnitSystem(_FOOT, _POUND_FORCE, _POUND_FORCE / _FOOT, "lbf/ft^2", "slug/ft^3"),
        "ft-lbf-lbm": UnitSystem(_FOOT, _POUND_FORCE, _POUND, "lbf/ft^2", "lbf/ft^3"),
    }
)


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
