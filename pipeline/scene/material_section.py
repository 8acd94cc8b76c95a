"""[material] and [materials.NAME] of a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from pipeline.scene.fields import POSITIVE, Number, Positive, Section, key

POISSON = "a number above {low} and below {high}"
EXPANSION = "a number, {bounds}"

FORCED = "--force (in Python: force=True) takes it"


class Usual(NamedTuple):
    """Usual values of a key, what may be wrong beyond them, and the values beyond which it is wrong."""

    low: float
    high: float
    hint: str
    least: float = -math.inf
    most: float = math.inf

    def is_usual(self, value: float) -> bool:
        """Whether a value needs no warning; 0 never does."""
        return value == 0.0 or self.low <= value <= self.high

    def is_nonsense(self, value: float) -> bool:
        """Whether a value is far beyond all experience."""
        return value != 0.0 and not self.least <= value <= self.most


USUAL_MATERIAL = {
    "young_modulus": Usual(1e8, 2e12, "the key is in Pa: steel has 2.1e11", 1e6, 1e13),
    "poisson_ratio": Usual(0.0, 0.5, "metals have 0.25 to 0.35"),
    "density": Usual(100.0, 30_000.0, "the key is in kg/m^3: steel has 7850", 1.0, 2e5),
}
# sqrt(E / rho), m/s
WAVE_SPEED = Usual(1500.0, 15_000.0, "metals have 4000 to 6500 m/s", 200.0, 1e5)


class Material(Section):
    """[material]: linear elastic, isotropic."""

    young_modulus: Positive = key("Young's modulus, Pa", POSITIVE)
    poisson_ratio: Number = key("Poisson's ratio", POISSON, gt=-1.0, lt=0.4999)
    density: Positive = key("density, kg/m^3", POSITIVE)
    expansion: Number = key("coefficient of thermal expansion, 1/K", EXPANSION, 0.0, ge=0.0, le=0.01)


class NamedMaterial(Section):
    """[materials.NAME]: as [material]; what a material of a mesh file has may be left out."""

    young_modulus: Positive | None = key("Young's modulus, Pa", POSITIVE, None)
    poisson_ratio: Number | None = key("Poisson's ratio", POISSON, None, gt=-1.0, lt=0.4999)
    density: Positive | None = key("density, kg/m^3", POSITIVE, None)
    expansion: Number | None = key("coefficient of thermal expansion, 1/K", EXPANSION, None, ge=0.0, le=0.01)

    @property
    def given(self) -> dict[str, float]:
        """The numbers that are given, by key."""
        found: dict[str, float] = self.model_dump(exclude_none=True)
        return found


def wave_speed(numbers: Mapping[str, float]) -> float:
    """The speed sqrt(E / rho) of waves in a bar, m/s; 0 where one of the two is not known."""
    modulus, density = numbers.get("young_modulus", 0.0), numbers.get("density", 0.0)
    return math.sqrt(modulus / density) if modulus > 0.0 and density > 0.0 else 0.0
