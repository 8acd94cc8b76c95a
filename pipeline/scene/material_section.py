"""[material] and [materials.NAME] of a scene."""

from __future__ import annotations

from pipeline.scene.fields import POSITIVE, Number, Positive, Section, key

POISSON = "a number above -1 and below 0.4999"
EXPANSION = "a number, 0 to 0.01"


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
