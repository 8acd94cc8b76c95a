"""Linear elastic, isotropic material."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError, require_between


@dataclass(frozen=True)
class Material:
    """Linear elastic, isotropic material.

    Attributes
    ----------
    young_modulus : float
        Young's modulus, Pa.
    poisson_ratio : float
        Poisson's ratio.
    density : float
        Density, kg/m^3.
    expansion : float
        Coefficient of thermal expansion, 1/K.

    Raises
    ------
    RomParameterError
        No stable isotropic solid has these values, or Poisson's ratio is so near to 1/2 that displacement elements
        lock.

    Examples
    --------
    >>> from rom import Material
    >>> steel = Material(young_modulus=2.08e11, poisson_ratio=0.3, density=7800.0)
    >>> round(steel.lame[1] / 1e9, 6)  # shear modulus E / (2 + 2 nu), GPa
    80.0
    """

    young_modulus: float
    poisson_ratio: float
    density: float
    expansion: float = 0.0

    def __post_init__(self) -> None:
        positive = "must be a number above 0"
        require_between("material", "young_modulus", self.young_modulus, 0.0, math.inf, f"{positive} (Pa)")
        require_between("material", "density", self.density, 0.0, math.inf, f"{positive} (kg/m^3)")
        require_between(
            "material", "poisson_ratio", self.poisson_ratio, -1.0, 0.4999, "must lie between -1 and 0.4999"
        )
        require_between("material", "expansion", self.expansion, -1.0, 1.0, "must be a number between -1 and 1 (1/K)")

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants (lambda, mu) in Pa."""
        e, nu = self.young_modulus, self.poisson_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))

    @property
    def thermal_stress_modulus(self) -> float:
        """Pressure of a heated body that cannot expand, E alpha / (1 - 2 nu) in Pa/K."""
        return self.young_modulus * self.expansion / (1 - 2 * self.poisson_ratio)

    def stress(self, strain: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stress (..., 3, 3) in Pa of a strain (..., 3, 3): lambda tr(E) I + 2 mu E (Hooke, St. Venant-Kirchhoff).

        Parameters
        ----------
        strain : (..., 3, 3) array
            Small strain, or Green-Lagrange strain for the second Piola-Kirchhoff stress.
        """
        lame, shear = self.lame
        volumetric = lame * np.trace(strain, axis1=-2, axis2=-1)
        return 2 * shear * strain + volumetric[..., None, None] * np.eye(3)


Materials = Material | Mapping[str, Material]


def material_of(materials: Materials, name: str) -> Material:
    """The material of the elements whose material has a name ("": of those without one); one material is that of all.

    Raises RomParameterError where the name is not among the materials.
    """
    if isinstance(materials, Material):
        return materials
    if name in materials:
        return materials[name]
    known = ", ".join(f'"{other}"' for other in materials) or "none"
    raise RomParameterError(
        "materials", "name", name, f"must be given, elements of the mesh have it (given: {known})"
    )
