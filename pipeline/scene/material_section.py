"""[material], [materials.NAME], [stress] and [fatigue] of a scene, and the checks of stress and fatigue."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from pipeline.errors import InputError, input_error, shown
from pipeline.scene.fields import (
    POSITIVE,
    STRENGTH,
    Meaning,
    Number,
    Positive,
    Section,
    Truth,
    Usual,
    Whole,
    allowed_of,
    key,
    meaning_in,
    optional,
)

if TYPE_CHECKING:
    from pipeline.scene.reading import SceneFile


BY_MATERIAL = f"{POSITIVE}, or a table of such numbers by the name of the material"
Limit = Positive | Annotated[dict[str, Positive], Field(min_length=1)]
BelowTensile = Annotated[Limit, f"{BY_MATERIAL}, not above the tensile strength"]


class Stress(Section):
    """[stress]: stress on the mesh at the worst motion. Not computed unless this section or [fatigue] is there."""

    curves: (
        Truth
        | Literal["all"]
        | Annotated[tuple[Annotated[Whole, Field(ge=0)], ...], Field(min_length=1, max_length=20)]
    ) = key(
        'true for the curves with the highest and the lowest worst motion, "all", false, or their numbers from 0',
        True,
        allowed='true, false, "all" or a list of {count} numbers of curves, the first is 0',
    )
    hot_spots: Whole = key("number of hot spots listed, outside of singular places and at them", 5, ge=1, le=50)
    check: Truth = key(
        "whether the harmonics are compared with a solution of the full model under the same forces", True
    )


class Fatigue(Section):
    """[fatigue]: limits of the material, for the margins of the stress cycles."""

    endurance_limit: Annotated[BelowTensile, STRENGTH] = key(
        "amplitude of a fully reversed cycle that is endured, Pa"
    )
    tensile_strength: Annotated[Limit, STRENGTH] = key(
        "ultimate tensile strength, Pa: end of the Goodman line", allowed=BY_MATERIAL
    )
    yield_strength: Annotated[BelowTensile | None, STRENGTH] = key("yield strength, Pa; none: no yield line", None)
    factor: Number = key(
        "margin that is required; a run warns where it is less outside of singular places", 1.0, ge=0.1, le=100.0
    )

    def limits_of(self, material: str) -> tuple[float, float, float | None] | None:
        """Endurance limit, tensile and yield strength of a material; None where there are none for it."""
        found = [_of(value, material) for value in (self.endurance_limit, self.tensile_strength, self.yield_strength)]
        if found[0] is None or found[1] is None:
            return None
        return found[0], found[1], found[2]

    @property
    def named(self) -> tuple[str, ...]:
        """Materials that have limits of their own; "" stands for all others."""
        tables = [
            v for v in (self.endurance_limit, self.tensile_strength, self.yield_strength) if isinstance(v, dict)
        ]
        return ("", *dict.fromkeys(name for table in tables for name in table))


def _of(value: Limit | None, material: str) -> float | None:
    return value.get(material) if isinstance(value, dict) else value


def unfit_stress_keys(file: SceneFile) -> Iterator[InputError]:
    """Keys of [stress] and [fatigue] that do not fit the rest of a scene."""
    scene, count = file.first, len(file.members)
    for section in ("stress", "fatigue"):
        if scene.model is not None and getattr(scene, section) is not None:
            yield input_error(file.path, section, "given beside [model]", "a scene with a mesh: matrices have none")
    curves = () if scene.stress is None or isinstance(scene.stress.curves, (bool, str)) else scene.stress.curves
    if curves and max(curves) >= count:
        allowed = f'true, false, "all" or a list of numbers of curves, 0 to {count - 1}'
        yield input_error(file.path, "stress.curves", shown(list(curves)), allowed)
    if scene.fatigue is None:
        return
    for material in scene.fatigue.named:
        limits = scene.fatigue.limits_of(material)
        if limits is None:
            continue
        of = f".{material}" if material else ""
        for name, value in (("endurance_limit", limits[0]), ("yield_strength", limits[2])):
            if value is not None and value > limits[1]:
                yield input_error(file.path, f"fatigue.{name}{of}", shown(value), allowed_of(Fatigue, name))


Poisson = Annotated[Number, Field(gt=-1.0, lt=0.4999), "a number above {low} and below {high}"]
Expansion = Annotated[Number, Field(ge=0.0, le=0.01)]

FORCED = "to use it anyway: --force (in Python: force=True)"


# sqrt(E / rho), m/s
WAVE_SPEED = Usual(1500.0, 15_000.0, "metals have 4000 to 6500 m/s", 200.0, 1e5)


class Material(Section):
    """[material]: linear elastic, isotropic."""

    young_modulus: Annotated[
        Positive,
        Meaning(
            "Pa",
            "Young's modulus",
            Usual(1e8, 2e12, "the key is in Pa: steel has 2.1e11", 1e6, 1e13),
            words="e young youngsmodulus elasticmodulus modulus",
            shown=("GPa", 1e-9),
            searched="decade",
        ),
    ] = key("Young's modulus, Pa")
    poisson_ratio: Annotated[
        Poisson, Meaning(usual=Usual(0.0, 0.5, "metals have 0.25 to 0.35"), words="nu poisson poissonsratio")
    ] = key("Poisson's ratio")
    density: Annotated[
        Positive,
        Meaning(
            "kg/m^3", "density", Usual(100.0, 3e4, "the key is in kg/m^3: steel has 7850", 1.0, 2e5), words="rho"
        ),
    ] = key("density, kg/m^3")
    expansion: Expansion = key("coefficient of thermal expansion, 1/K", 0.0)


USUAL_MATERIAL = {
    name: usual for name in Material.model_fields if (usual := meaning_in(Material, name).usual) is not None
}


class NamedMaterial(Section):
    """[materials.NAME]: as [material]; what a material of a mesh file has may be left out."""

    young_modulus: Positive | None = optional(Material, "young_modulus")
    poisson_ratio: Poisson | None = optional(Material, "poisson_ratio")
    density: Positive | None = optional(Material, "density")
    expansion: Expansion | None = optional(Material, "expansion")

    @property
    def given(self) -> dict[str, float]:
        """The numbers that are given, by key."""
        found: dict[str, float] = self.model_dump(exclude_none=True)
        return found


def wave_speed(numbers: Mapping[str, float]) -> float:
    """The speed sqrt(E / rho) of waves in a bar, m/s; 0 where one of the two is not known."""
    modulus, density = numbers.get("young_modulus", 0.0), numbers.get("density", 0.0)
    return math.sqrt(modulus / density) if modulus > 0.0 and density > 0.0 else 0.0
