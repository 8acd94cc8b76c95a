"""The strain of a gauge: the component along a direction of the strain at a point, as a row on the displacements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import DiscreteBlock, discretise
from rom.finite_elements.full_model import FullModel, node_dofs

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

Array = NDArray[np.float64]
_CANDIDATES = 32  # elements with the nearest centres
_NEWTON_STEPS = 20
_FARTHEST = 0.01  # distance of the gauge from the mesh, of the size of the mesh


def strain_row(full: FullModel, sector: SectorMesh, at: ArrayLike, direction: ArrayLike) -> Array:
    """Row o with the strain o @ u = d . eps(u) d at a point, d of length 1; the small strain of the element there.

    `at`: the point, m; one outside of the mesh is moved to the nearest point of an element. Returns (N,): the row,
    1/m.
    """
    point, along = np.asarray(at, dtype=float), np.asarray(direction, dtype=float)
    if along.shape != (3,) or not np.all(np.isfinite(along)) or not np.any(along):
        raise RomParameterError("output", "direction", along.tolist(), "must be three finite numbers, not all 0")
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise RomParameterError("output", "at", point.tolist(), "must be three finite numbers (m)")
    along = along / np.linalg.norm(along)
    blocks = discretise(sector, full.element).blocks
    found = [_nearest(block, point) for block in blocks]
    best = min(range(len(found)), key=lambda k: found[k][0])
    distance, element, place = found[best]
    extent = float(np.ptp(full.positions, axis=0).max())
    if distance > _FARTHEST * extent:
        raise RomParameterError(
            "output", "at", point.tolist(), f"must lie on the mesh (m); the nearest element is {distance:.3g} m away"
        )
    block = blocks[best]
    _, gradients = block.reference.shape_functions(place[:, None])
    slope = np.linalg.solve(_jacobian(block, element, place).T, gradients[0].T)  # (3, b): gradients in x, y, z
    row = np.zeros(full.n_dofs)
    row[node_dofs(block.nodes[element])] = np.outer(along @ slope, along)
    return row


def _jacobian(block: DiscreteBlock, element: int, place: Array) -> Array:
    _, slopes = block.reference.geometry_functions(place[:, None])
    return np.asarray(block.geometry[element].T @ slopes[0])


def _nearest(block: DiscreteBlock, point: Array) -> tuple[float, int, Array]:
    """Distance of the nearest point of a block, its element, and its place on the reference cell."""
    centres = block.geometry.mean(axis=1)
    order = np.argsort(np.sum((centres - point) ** 2, axis=1))[:_CANDIDATES]
    found = [(*_inverted(block, int(element), point), int(element)) for element in order]
    distance, place, element = min(found, key=lambda each: each[0])
    return distance, element, place


def _inverted(block: DiscreteBlock, element: int, point: Array) -> tuple[float, Array]:
    """Distance of a point from an element and its place there: Newton's method, kept on the reference cell."""
    place = _on_cell(block, block.reference.nodes.mean(axis=0))
    best = np.inf, place
    for _ in range(_NEWTON_STEPS):
        values, _ = block.reference.geometry_functions(place[:, None])
        rest = point - values[0] @ block.geometry[element]
        distance = float(np.linalg.norm(rest))
        if distance >= best[0] * (1.0 - 1e-12):
            break
        best = distance, place
        step = np.linalg.lstsq(_jacobian(block, element, place), rest, rcond=None)[0]
        place = _on_cell(block, place + step)
    return best


def _on_cell(block: DiscreteBlock, place: Array) -> Array:
    """A place moved onto the reference cell."""
    kind = block.reference.kind
    if kind.startswith("hex"):
        return np.clip(place, 0.0, 1.0)
    flat = 3 if kind.startswith("tet") else 2
    kept = np.clip(place, 0.0, 1.0)
    total = kept[:flat].sum()
    if total > 1.0:
        kept[:flat] /= total
    return kept
