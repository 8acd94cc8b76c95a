"""Consistent systems of units of files from other programs, by their unit of length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

_INCH = 0.0254  # m
_POUND_FORCE = 4.4482216152605  # N


@dataclass(frozen=True)
class UnitSystem:
    """SI values of the units of a consistent system with the second as unit of time.

    Attributes
    ----------
    length, force : float
        m and N.

    Examples
    --------
    Steel in N, mm, s, t:

    >>> from geometry import UNIT_SYSTEMS
    >>> print(f"{210e3 * UNIT_SYSTEMS['mm'].pressure:.4g} Pa, {7.85e-9 * UNIT_SYSTEMS['mm'].density:.4g} kg/m^3")
    2.1e+11 Pa, 7850 kg/m^3
    """

    length: float
    force: float

    @property
    def pressure(self) -> float:
        """Pa."""
        return self.force / self.length / self.length

    @property
    def density(self) -> float:
        """kg/m^3."""
        return self.pressure / self.length / self.length


UNIT_SYSTEMS: Mapping[str, UnitSystem] = MappingProxyType(
    {"m": UnitSystem(1.0, 1.0), "mm": UnitSystem(1e-3, 1.0), "in": UnitSystem(_INCH, _POUND_FORCE)}
)
