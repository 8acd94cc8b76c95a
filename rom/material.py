"""Linear elastic, isotropic material."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rom.errors import RomParameterError


@dataclass(frozen=True)
class Material:
    """Young's modulus [Pa], Poisson's ratio [-] and density [kg/m^3].

    Raises RomParameterError for values no stable isotropic solid can have, and for Poisson's ratios so
    near to 1/2 that displacement elements lock.
    """

    young_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        _require(self.young_modulus, "young_modulus", 0.0, math.inf, "a number above 0 (Pa)")
        _require(self.density, "density", 0.0, math.inf, "a number above 0 (kg/m^3)")
        _require(self.poisson_ratio, "poisson_ratio", -1.0, 0.4999, "between -1 and 0.4999, both excluded")

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants (lambda, mu) in Pa."""
        e, nu = self.young_modulus, self.poisson_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


def _require(value: object, name: str, low: float, high: float, allowed: str) -> None:
    """Raise unless value is a finite number strictly between low and high."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not low < float(value) < high:  # type: ignore[arg-type]
        raise RomParameterError("material", name, value, allowed)
