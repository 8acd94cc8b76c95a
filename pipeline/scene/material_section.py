"""[material], [materials.NAME], [stress] and [fatigue] of a scene, and the checks of stress and fatigue."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

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
    Vector,
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
        "true: those with the highest and the lowest worst motion",
        True,
        allowed='true, false, "all" or a list of {count} numbers of curves, the first is 0',
    )
    hot_spots: Whole = key("number of hot spots listed, outside of singular places and at them", 5, ge=1, le=50)
    check: Truth = key(
        "whether the harmonics are compared with a solution of the full model under the same forces", True
    )


Temperature = Annotated[Number, Field(ge=-1e6, le=1e6)]
LIMITS = ("endurance_limit", "tensile_strength", "yield_strength")


class LimitState(Section):
    """[[fatigue.at]]: limits at another temperature; one that is left out lies between those of other rows."""

    temperature: Temperature = key("temperature, in the unit of load.temperature")
    endurance_limit: Annotated[Limit | None, STRENGTH] = key("as above, Pa", None, allowed=BY_MATERIAL)
    tensile_strength: Annotated[Limit | None, STRENGTH] = key("as above, Pa", None, allowed=BY_MATERIAL)
    yield_strength: Annotated[Limit | None, STRENGTH] = key("as above, Pa", None, allowed=BY_MATERIAL)


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

    temperature: Temperature = key("temperature at which these limits hold, where there are others in `at`", 20.0)
    at: Annotated[tuple[LimitState, ...], Meaning(swept=False)] = key(
        "limits at other temperatures, straight lines between; beyond them there is no margin",
        (),
        allowed="tables [[fatigue.at]], each at another temperature than the rest and `temperature`",
    )

    @field_validator("at")
    @classmethod
    def _different_temperatures(cls, value: Any, info: ValidationInfo) -> Any:
        return distinct_temperatures(value, info, "fatigue")

    @property
    def temperatures(self) -> list[float]:
        """The temperatures of the table, ascending."""
        return sorted((self.temperature, *(row.temperature for row in self.at)))

    def limits_of(self, material: str, temperature: float | None = None) -> tuple[float, float, float | None] | None:
        """Endurance limit, tensile and yield strength of a material; None where there are none for it.

        At a temperature, that of the keys by default; None where the table does not reach it.
        """
        states: tuple[Fatigue | LimitState, ...] = (self, *self.at)
        rows, found = sorted(states, key=lambda row: row.temperature), []
        at = self.temperature if temperature is None else temperature
        if self.at and not rows[0].temperature <= at <= rows[-1].temperature:
            return None
        for name in LIMITS:
            known = [
                (row.temperature, value) for row in rows if (value := _of(getattr(row, name), material)) is not None
            ]
            found.append(_between(known, at))
        return None if found[0] is None or found[1] is None else (found[0], found[1], found[2])

    @property
    def named(self) -> tuple[str, ...]:
        """Materials that have limits of their own; "" stands for all others."""
        given = (getattr(row, name) for row in (self, *self.at) for name in LIMITS)
        tables = [value for value in given if isinstance(value, dict)]
        return ("", *dict.fromkeys(name for table in tables for name in table))


def _between(known: list[tuple[float, float]], at: float) -> float | None:
    """The value at a temperature on the lines between some, the first or the last one beyond; None of none."""
    if not known:
        return None
    after = next((k for k, (temperature, _) in enumerate(known) if temperature >= at), len(known) - 1)
    (low, first), (high, second) = known[max(after - 1, 0)], known[after]
    share = 1.0 if high == low else min((at - low) / (high - low), 1.0)
    return first + share * (second - first)


def distinct_temperatures(value: Any, info: ValidationInfo, table: str) -> Any:
    """The rows of a table, each at another temperature."""
    known = [info.data.get("temperature", 20.0), *(row.temperature for row in value)]
    if len(set(known)) < len(known):
        raise ValueError(f"tables [[{table}.at]], each at another temperature than the rest and `temperature`")
    return value


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
    if scene.fatigue.at and scene.load.temperature is None:
        yield input_error(file.path, "load.temperature", "missing", "a table [load.temperature], for fatigue.at")
    places = [(material, at) for material in scene.fatigue.named for at in scene.fatigue.temperatures]
    for material, at in places:
        limits = scene.fatigue.limits_of(material, at)
        if limits is None:
            continue
        of = (f".{material}" if material else "") + (f" at {at:g}" if scene.fatigue.at else "")
        for name, value in (("endurance_limit", limits[0]), ("yield_strength", limits[2])):
            if value is not None and value > limits[1]:
                yield input_error(file.path, f"fatigue.{name}{of}", shown(value), allowed_of(Fatigue, name))


Poisson = Annotated[Number, Field(gt=-1.0, lt=0.4999), "a number above {low} and below {high}"]
Expansion = Annotated[Number, Field(ge=0.0, le=0.01)]
Modulus = Annotated[Positive, POSITIVE, Meaning("Pa")]
Density = Annotated[Positive, POSITIVE, Meaning("kg/m^3")]
SomeRatio = Annotated[Number, Field(gt=-1.0, lt=1.0), "a number above {low} and below {high}"]
Angle = Annotated[Number, Field(ge=-360.0, le=360.0)]
STIFFNESS = "c11, c12, c44 with c11 > c12 and c11 + 2 c12 > 0, without young_modulus, poisson_ratio and shear_modulus"
Stiffness = Annotated[tuple[Number, Number, Number], STIFFNESS, Meaning("Pa")]
SHORTEST = 1e-6  # component of a direction
PERPENDICULAR = 1e-3  # largest cosine between two axes
CUBIC = ("young_modulus", "poisson_ratio", "shear_modulus")
ANISOTROPIC = (
    *("shear_modulus", "young_modulus_2", "young_modulus_3", "poisson_ratio_13", "poisson_ratio_23"),
    *("shear_modulus_13", "shear_modulus_23", "expansion_2", "expansion_3"),
)
CONSTANTS = ("young_modulus", "poisson_ratio", "density", "expansion", *ANISOTROPIC)

FORCED = "to use it anyway: --force (in Python: force=True)"


# sqrt(E / rho), m/s
WAVE_SPEED = Usual(1500.0, 15_000.0, "metals have 4000 to 6500 m/s", 200.0, 1e5)


class Elastic(Section):
    """Constants of a material at one temperature; those along further axes are those of the axis before."""

    young_modulus: Modulus | None = key("Young's modulus, Pa; of a cubic crystal that along its axes", None)
    poisson_ratio: SomeRatio | None = key("Poisson's ratio", None)
    density: Density | None = key("density, kg/m^3", None)
    expansion: Expansion | None = key("coefficient of thermal expansion, 1/K; 0 where it is given nowhere", None)
    shear_modulus: Modulus | None = key("shear modulus G, Pa: of a cubic crystal, or G12 (orthotropic)", None)
    stiffness: Stiffness | None = key("c11, c12, c44 of a cubic crystal, Pa, in place of E, nu and G", None)
    young_modulus_2: Modulus | None = key("E2, Pa; as E1 where it is left out", None)
    young_modulus_3: Modulus | None = key("E3, Pa; as E2", None)
    poisson_ratio_13: SomeRatio | None = key("nu13: contraction along axis 3 by a stress along axis 1; as nu12", None)
    poisson_ratio_23: SomeRatio | None = key("nu23; as nu12", None)
    shear_modulus_13: Modulus | None = key("G13, Pa; as G12", None)
    shear_modulus_23: Modulus | None = key("G23, Pa; as G12", None)
    expansion_2: Expansion | None = key("expansion along axis 2, 1/K; as along axis 1", None)
    expansion_3: Expansion | None = key("expansion along axis 3, 1/K; as along axis 2", None)

    @model_validator(mode="before")
    @classmethod
    def _constants_of_stiffness(cls, given: Any) -> Any:
        """E, nu and G of the stiffnesses of a cubic crystal, which stand in their place."""
        if not isinstance(given, Mapping) or "stiffness" not in given or not {*CUBIC}.isdisjoint(given):
            return given
        cubic = cubic_constants(given["stiffness"]) or (1.0, 0.0, 1.0)  # some, to refuse the stiffness alone
        return {**given, **dict(zip(CUBIC, cubic, strict=True))}

    @field_validator("stiffness")
    @classmethod
    def _of_a_solid(cls, value: Any) -> Any:
        if value is not None and cubic_constants(value) is None:
            raise ValueError(STIFFNESS)
        return value

    @property
    def given(self) -> dict[str, float]:
        """The constants that are given, by key."""
        found: dict[str, float] = self.model_dump(include={*CONSTANTS}, exclude_none=True)
        return found


class MaterialState(Elastic):
    """[[material.at]]: constants at another temperature; one that is left out lies between those of other rows."""

    temperature: Temperature = key("temperature, in the unit of load.temperature")


class SolidMaterial(Elastic):
    """What [material] and [materials.NAME] have in common beside the constants that all materials have."""

    temperature: Temperature = key(
        "temperature of these numbers, in the unit of `[load.temperature]`; of use with `at`", 20.0
    )
    at: Annotated[tuple[MaterialState, ...], Meaning(swept=False)] = key(
        "constants at other temperatures, straight lines between", (), allowed="tables [[material.at]]"
    )
    mean_from: Temperature | None = key(
        "`expansion` is the mean one from this temperature on, as data sheets give it; none: that at its temperature",
        None,
    )
    extended: Truth = key(
        "whether the first and the last row hold beyond them; else a temperature there is an error", False
    )
    axes: Annotated[tuple[Vector, Vector] | None, Meaning(swept=False)] = key(
        "directions of axes 1 and 2 of the material",
        None,
        allowed="two lists of three numbers, -1000 to 1000, perpendicular",
    )
    along: Annotated[Vector | None, Meaning(swept=False)] = key(
        "in place of `axes`: direction of the crystal that lies along the blade (radially); [0, 0, 1] without both",
        None,
        allowed="three numbers, -1000 to 1000, not all 0, and nothing beside axes",
    )
    tilt: Annotated[Angle, Meaning("degrees", uncertain=True)] = key(
        "angle by which the direction `along` leans from the radial one towards the engine axis (x), degrees; not "
        "beside `axes`",
        0.0,
    )
    turn: Annotated[Angle, Meaning("degrees", uncertain=True)] = key(
        "rotation of the crystal about that direction, degrees; 0: its axis that is most perpendicular to the "
        "direction points along the engine axis; not beside `axes`",
        0.0,
    )

    @field_validator("at")
    @classmethod
    def _different_temperatures(cls, value: Any, info: ValidationInfo) -> Any:
        return distinct_temperatures(value, info, "material")

    @field_validator("axes")
    @classmethod
    def _perpendicular(cls, value: Any) -> Any:
        if value is not None:
            size = math.sqrt(math.prod(sum(x * x for x in axis) for axis in value))
            if not size > 0.0 or abs(sum(x * y for x, y in zip(*value, strict=True))) > PERPENDICULAR * size:
                raise ValueError("two lists of three numbers, -1000 to 1000, perpendicular")
        return value

    @field_validator("along")
    @classmethod
    def _one_frame(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None and (max(map(abs, value)) < SHORTEST or info.data.get("axes") is not None):
            raise ValueError("three numbers, -1000 to 1000, not all 0, and nothing beside axes")
        return value

    @property
    def properties(self) -> dict[str, Any]:
        """The constants and what else is given, by key."""
        rows = [{"temperature": row.temperature, **row.given} for row in self.at]
        names = self.model_fields_set - {*CONSTANTS, "stiffness", "at"}
        more = {name: value for name in sorted(names) if (value := getattr(self, name)) is not None}
        return {**self.given, **more, **({"at": rows} if rows else {})}

    @model_validator(mode="after")
    def _stiffness_alone(self) -> Any:
        for state in (self, *self.at):
            cubic = None if state.stiffness is None else cubic_constants(state.stiffness)
            if cubic is not None and cubic != tuple(state.given.get(name) for name in CUBIC):
                raise ValueError(STIFFNESS)
        return self


class Material(SolidMaterial):
    """[material]: linear elastic; isotropic, or with its axes."""

    young_modulus: Annotated[  # type: ignore[assignment]
        Positive,
        Meaning(
            "Pa",
            "Young's modulus",
            Usual(1e8, 2e12, "the key is in Pa: steel has 2.1e11", 1e6, 1e13),
            words="e young youngsmodulus elasticmodulus modulus",
            shown=("GPa", 1e-9),
            searched="decade",
        ),
    ] = key("Young's modulus, Pa; of a cubic crystal that along its axes; `stiffness` replaces it")
    poisson_ratio: Annotated[  # type: ignore[assignment]
        Poisson, Meaning(usual=Usual(0.0, 0.5, "metals have 0.25 to 0.35"), words="nu poisson poissonsratio")
    ] = key("Poisson's ratio")
    density: Annotated[  # type: ignore[assignment]
        Positive,
        Meaning(
            "kg/m^3", "density", Usual(100.0, 3e4, "the key is in kg/m^3: steel has 7850", 1.0, 2e5), words="rho"
        ),
    ] = key("density, kg/m^3")


USUAL_MATERIAL = {
    name: usual for name in Material.model_fields if (usual := meaning_in(Material, name).usual) is not None
}


class NamedMaterial(SolidMaterial):
    """[materials.NAME]: as [material]; what a material of a mesh file has may be left out."""

    young_modulus: Positive | None = optional(Material, "young_modulus")
    poisson_ratio: Poisson | None = optional(Material, "poisson_ratio")
    density: Positive | None = optional(Material, "density")
    expansion: Expansion | None = optional(Material, "expansion")


def cubic_constants(stiffness: Any) -> tuple[float, float, float] | None:
    """E and nu along the axes of a cubic crystal and G, of c11, c12 and c44; None where no solid has these."""
    try:
        c11, c12, c44 = map(float, stiffness)
    except (TypeError, ValueError):
        return None
    if not (c11 > abs(c12) and c11 + 2.0 * c12 > 0.0 and c44 > 0.0):
        return None
    return (c11 - c12) * (c11 + 2.0 * c12) / (c11 + c12), c12 / (c11 + c12), c44


def wave_speed(numbers: Mapping[str, float]) -> float:
    """The speed sqrt(E / rho) of waves in a bar, m/s; 0 where one of the two is not known."""
    modulus, density = numbers.get("young_modulus", 0.0), numbers.get("density", 0.0)
    return math.sqrt(modulus / density) if modulus > 0.0 and density > 0.0 else 0.0
