"""Constants of the materials of mesh files: tables over the temperature, and orthotropic ones from a stiffness.

The keys are those of `[material]` in a scene. A material over the temperature has the constants at its lowest
temperature, `temperature`, and those at others in `at`, a row each; a constant that a row lacks lies between others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from geometry.mesh_files.file_mesh import FileMesh
from geometry.sector import FloatArray, IntArray

Row = tuple[float | None, dict[str, float]]  # temperature, None where it is not given, and constants
COUPLED = 1e-6  # of the largest stiffness: smaller ones between stretch and shear, or shears, are round-off
NINE = (
    *("young_modulus", "young_modulus_2", "young_modulus_3", "poisson_ratio", "poisson_ratio_13", "poisson_ratio_23"),
    *("shear_modulus", "shear_modulus_13", "shear_modulus_23"),
)
ISOTROPIC = ("young_modulus", "poisson_ratio")
# constants that materials with axes of their own have
ANISOTROPIC = {*NINE, "expansion_2", "expansion_3"} - {*ISOTROPIC}


def material_of_tables(tables: Sequence[Sequence[Row]]) -> dict[str, Any]:
    """A material of the tables of its properties, each a row at least."""
    constants: dict[str, Any] = {}
    rows: dict[float, dict[str, float]] = {}
    for table in tables:
        constants |= table[0][1] if table else {}
        for temperature, values in table if len(table) > 1 else ():
            rows.setdefault(temperature or 0.0, {}).update(values)
    if len(rows) < 2:
        return constants
    first, *others = sorted(rows)
    return {
        **constants,
        **rows[first],
        "temperature": first,
        "at": [{"temperature": at, **rows[at]} for at in others],
    }


def orthotropic_constants(stiffness: FloatArray) -> dict[str, float] | None:
    """The nine constants of a stiffness (6, 6), Voigt; None where it is not that of an orthotropic solid."""
    largest = np.abs(stiffness).max()
    apart = stiffness.copy()
    apart[:3, :3] = 0.0
    apart[range(3, 6), range(3, 6)] = 0.0
    if not np.isfinite(largest) or np.abs(apart).max() > COUPLED * largest:
        return None
    if not np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[0] > 0.0:
        return None
    s = np.linalg.inv(stiffness[:3, :3])
    shear = stiffness[5, 5], stiffness[4, 4], stiffness[3, 3]
    values = (*(1.0 / np.diag(s)), -s[0, 1] / s[0, 0], -s[0, 2] / s[0, 0], -s[1, 2] / s[1, 1], *shear)
    return dict(zip(NINE, map(float, values), strict=True))


def take_material(
    mesh: FileMesh, labels: IntArray, name: str, frame: str, axes: Callable[[], FloatArray | None]
) -> None:
    """The material of some elements; one with axes of its own that stands in several frames is one for each of them.

    `frame`: the system of coordinates in words; `axes`: directions of its axes, one a row, None of one that turns.
    """
    constants = mesh.materials.get(name, {})
    if ANISOTROPIC & constants.keys():
        found = axes()
        if found is None:
            mesh.unread_materials[name] = f"in {frame}, which is not rectangular"
        else:
            known, given = constants.get("axes"), [[float(x) for x in axis] for axis in found[:2]]
            name = name if known is None or np.allclose(known, given) else f"{name} in {frame}"
            mesh.materials[name] = {**constants, "axes": given}
    mesh.element_material.append((labels, name))


def symmetric(upper: Sequence[float], places: Sequence[tuple[int, int]]) -> FloatArray:
    """A symmetric matrix (6, 6) of some of its numbers at their places."""
    matrix = np.zeros((6, 6))
    for (i, j), value in zip(places, upper, strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix
