"""The mesh that `shroud verify` advises: it is built, so that it exists and its dofs are counted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pipeline.scene.geometry_parameters import disk_parameters, geometry_parameters
from pipeline.scene.schema import Scene
from pipeline.verify.model_errors import ModelErrors

if TYPE_CHECKING:
    from geometry import SectorMesh

MOST_DOFS = 500_000  # a minute and 5 GB to reduce
_MARGIN = (
    0.8  # the advised size aims below the tolerance: the order is fitted to few meshes, and meshes change in steps
)
_STEP = 0.5  # from one size to the next that is built on the way: how dofs grow is not known far ahead
_HALVINGS = 3  # of the interval with the finest mesh that is not too large
_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
_SIDES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


@dataclass(frozen=True)
class AdvisedMesh:
    """A mesh that exists: element size in m, element, dofs, and its expected relative error (NaN: not known)."""

    size: float
    element: str
    dofs: int
    error: float


def advised_mesh(scene: Scene, errors: ModelErrors, tolerance: float, grid: tuple[int, int]) -> AdvisedMesh:
    """The mesh whose expected error is within a tolerance, or else the finest one of at most half a million dofs."""
    assert errors.other is not None
    if scene.mesh_file is not None:
        return _of_file(errors, tolerance)
    element = errors.other.element

    def dofs(size: float) -> int:
        return mesh_dofs(_mesh(scene, size, grid), element)

    if element != errors.element:
        return AdvisedMesh(errors.size, element, dofs(errors.size), math.nan)
    target = finer_size(errors, tolerance)
    size, count = errors.size, errors.dofs
    while size > target:
        smaller = max(target, rounded_down(_STEP * size))
        there = dofs(smaller)
        if there > MOST_DOFS:
            size, count = _finest(dofs, (size, count), smaller)
            break
        size, count = smaller, there
    return AdvisedMesh(size, element, count, errors.mesh_frequency * (size / errors.size) ** errors.worst_order)


def _of_file(errors: ModelErrors, tolerance: float) -> AdvisedMesh:
    """Element size of a mesh from a file, and about how many dofs it makes: they grow as the cube of its inverse."""
    size = finer_size(errors, tolerance)
    size = max(size, rounded_down(errors.size * (errors.dofs / MOST_DOFS) ** (1.0 / 3.0)))
    dofs = round(errors.dofs * (errors.size / size) ** 3)
    return AdvisedMesh(size, errors.element, dofs, errors.mesh_frequency * (size / errors.size) ** errors.worst_order)


def finer_size(errors: ModelErrors, tolerance: float) -> float:
    """Element size in m, two digits, whose estimated error is within the tolerance."""
    return rounded_down(errors.size * (_MARGIN * tolerance / errors.mesh_frequency) ** (1.0 / errors.worst_order))


def rounded_down(size: float) -> float:
    """A size in m with two digits, not larger."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit + 1e-9) * unit:.2g}")


def mesh_dofs(sector: SectorMesh, element: str) -> int:
    """Degrees of freedom of a mesh with an element: three for each vertex, edge, side and centre that has a node."""
    hexahedra = sector.hexahedra
    nodes = len(sector.points)
    if element != "hex8":
        nodes += _distinct(hexahedra[:, _EDGES].reshape(-1, 2))
    if element == "hex27":
        nodes += _distinct(hexahedra[:, _SIDES].reshape(-1, 4)) + len(hexahedra)
    return 3 * nodes


def _finest(dofs: Callable[[float], int], fitting: tuple[float, int], too_fine: float) -> tuple[float, int]:
    """Size and dofs of the finest mesh found between one that fits and a size that does not."""
    for _ in range(_HALVINGS):
        middle = float(f"{math.sqrt(fitting[0] * too_fine):.2g}")
        if not too_fine < middle < fitting[0]:
            break
        count = dofs(middle)
        if count > MOST_DOFS:
            too_fine = middle
        else:
            fitting = middle, count
    return fitting


def _mesh(scene: Scene, size: float, grid: tuple[int, int]) -> SectorMesh:
    from geometry import build_sector

    blade, shroud, mesh = geometry_parameters(scene)
    return build_sector(blade, shroud, replace(mesh, size=size, contact_grid=grid), disk_parameters(scene))


def _distinct(groups: np.ndarray) -> int:
    """Number of different groups of vertices (k, 2 or 4), in any order."""
    return len(np.unique(np.sort(groups, axis=1), axis=0))
