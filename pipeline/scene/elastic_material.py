"""The material of the matrices from constants of a scene or of a mesh file, by the keys of [material]."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError, input_error, shown, shown_key
from pipeline.scene.material_section import ANISOTROPIC, CONSTANTS, SolidMaterial

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipeline.scene.reading import SceneFile
    from rom.finite_elements.material import AnyMaterial, Elastic


FRAME = ("axes", "along", "tilt", "turn")


def unfit_material_keys(file: SceneFile) -> Iterator[InputError]:
    """Constants that no solid has, frames and tables that are not used, temperatures that tables do not reach."""
    scene = file.first
    given: dict[str, SolidMaterial] = {} if scene.material is None else {"material": scene.material}
    given |= {f"materials.{shown_key(name)}": material for name, material in scene.materials.items()}
    if "temperature_factor" in scene.load.model_fields_set and scene.load.temperature is None:
        yield input_error(file.path, "load.temperature_factor", "given", "a table [load.temperature] beside it")
    yield from _unfit_heat(file, given)
    for table, material in given.items():
        properties = material.properties
        framed = [name for name in FRAME if name in properties]
        whole = scene.mesh_file is None or table == "material"
        if whole and (unused := unused_frame(properties)):
            yield input_error(file.path, f"{table}.{unused[0]}", *unused[1:])
        elif material.at and scene.load.temperature is None:
            allowed = "a table [load.temperature]: the material depends on the temperature"
            yield input_error(file.path, "load.temperature", "missing", allowed)
        elif all(name in properties for name in CONSTANTS[:3]) and (material.at or framed or len(material.given) > 4):
            yield from _unfit_material(file, table, properties)


def _unfit_heat(file: SceneFile, given: Mapping[str, SolidMaterial]) -> Iterator[InputError]:
    """A temperature field of a mesh made here without a file that has it, or without an effect."""
    scene = file.first
    if scene.load.temperature is None or scene.mesh_file is not None or scene.model is not None:
        return
    if scene.load.temperature.of_mesh:
        allowed = "one of uniform, linear, file: only a mesh.file has temperatures of its own"
        yield input_error(file.path, "load.temperature.of_mesh", "true", allowed)
    grows = any("expansion" in name and value for each in given.values() for name, value in each.given.items())
    if not grows and not any(each.at for each in given.values()):
        allowed = "the expansion coefficient, 1/K, for load.temperature"
        yield input_error(file.path, "material.expansion", "missing", allowed)


def unused_frame(given: Mapping[str, Any]) -> tuple[str, str, str] | None:
    """A key of the axes that a material does not use, why, and what is allowed; None where all are used."""
    framed = [name for name in FRAME if name in given]
    if framed and {*ANISOTROPIC}.isdisjoint(given):
        allowed = "shear_modulus (a cubic crystal) or other constants along axes beside it"
        return framed[0], "given for an isotropic material", allowed
    turned = [name for name in ("tilt", "turn") if name in given]
    if turned and "axes" in given:
        return turned[0], "given beside axes", "`along` in place of axes: axes are as they are"
    return None


def _unfit_material(file: SceneFile, table: str, properties: Mapping[str, Any]) -> Iterator[InputError]:
    """What is wrong with a material by itself, and at the temperatures of the scene."""
    from rom.errors import RomParameterError
    from rom.finite_elements.material import MaterialTable

    try:
        material = elastic_material(properties)
        field = file.first.load.temperature
        if isinstance(material, MaterialTable) and field is not None:
            cold, uniform = field.reference, field.reference if field.uniform is None else field.uniform
            ends = field.linear or (uniform,)
            factors = {member.scene.load.temperature_factor for member in file.members}
            for at in (cold, *(cold + factor * (end - cold) for end in ends for factor in factors)):
                material.at(at)
    except RomParameterError as error:
        key = "load.temperature" if error.parameter == "temperature" else f"{table}.{error.parameter}"
        yield input_error(file.path, key, shown(error.value), f"{error.allowed}")


def elastic_material(given: Mapping[str, Any], radial: Sequence[float] = (0.0, 0.0, 1.0)) -> AnyMaterial:
    """The material of some constants by the keys of [material], and of its other keys.

    `radial`: direction of the blade. Raises RomParameterError where no solid has these constants.
    """
    import numpy as np

    from rom.finite_elements.material import MaterialTable

    first = {name: given[name] for name in CONSTANTS if given.get(name) is not None}
    rows = sorted([{**first, "temperature": given.get("temperature", 20.0)}, *given.get("at", ())], key=_temperature)
    grid = [_temperature(row) for row in rows]
    table = {}
    for name in CONSTANTS:
        known = [(_temperature(row), row[name]) for row in rows if row.get(name) is not None]
        if known:
            table[name] = np.interp(grid, [at for at, _ in known], [value for _, value in known])
    axes = _axes(given, np.array(radial)) if {*ANISOTROPIC} & {*table} else None
    states = tuple(_state({name: float(table[name][k]) for name in table}, axes) for k in range(len(rows)))
    if len(states) == 1:
        return states[0]
    return MaterialTable(grid, states, given.get("mean_from"), bool(given.get("extended", False)))


def _temperature(row: Mapping[str, Any]) -> float:
    return float(row["temperature"])


def _state(given: Mapping[str, float], axes: NDArray[np.float64] | None) -> Elastic:
    """The material at one temperature; constants that are left out are those of the axis before."""
    from rom.finite_elements.material import AnisotropicMaterial, Material

    e, nu, density, expansion = (given.get(name, 0.0) for name in CONSTANTS[:4])
    if axes is None:
        return Material(e, nu, density, expansion)
    g = given.get("shear_modulus", e / (2.0 * (1.0 + nu)))
    second, alpha = given.get("young_modulus_2", e), given.get("expansion_2", expansion)
    return AnisotropicMaterial.from_constants(
        [e, second, given.get("young_modulus_3", second)],
        [nu, given.get("poisson_ratio_13", nu), given.get("poisson_ratio_23", nu)],
        [g, given.get("shear_modulus_13", g), given.get("shear_modulus_23", g)],
        density,
        [expansion, alpha, given.get("expansion_3", alpha)],
        axes,
    )


def _axes(given: Mapping[str, Any], radial: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axes of the material in the coordinates of the mesh, (3, 3), one a row.

    Without `axes` the direction `along` of the crystal lies along the blade, leant by `tilt` to the engine axis and
    turned by `turn`: at 0 the crystal axis that is most perpendicular to it lies towards the engine axis.
    """
    import numpy as np

    if given.get("axes") is not None:
        return _frame(*np.array(given["axes"], dtype=float))
    along = np.array(given.get("along") or (0.0, 0.0, 1.0))
    crystal = _frame(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    tilt, turn = (math.radians(given.get(name, 0.0)) for name in ("tilt", "turn"))
    engine = np.array([1.0, 0.0, 0.0])
    up, ahead = (
        math.cos(tilt) * radial + math.sin(tilt) * engine,
        math.cos(tilt) * engine - math.sin(tilt) * radial,
    )
    blade = _frame(up, math.cos(turn) * ahead + math.sin(turn) * np.cross(up, ahead))
    return np.asarray(crystal.T @ blade)


def _frame(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Three perpendicular directions of length 1, (3, 3): the first, the second made perpendicular, their product."""
    import numpy as np

    one = first / np.linalg.norm(first)
    two = second - (second @ one) * one
    two = two / np.linalg.norm(two)
    return np.array([one, two, np.cross(one, two)])
