"""Keys of the scene to change for a tolerance: the last line of `shroud verify`.

An advised mesh is built, so that it exists and its dofs are counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pipeline.scene.geometry_parameters import sector_of
from pipeline.scene.labels import quantity
from pipeline.scene.response_section import Rom
from pipeline.scene.schema import Scene
from pipeline.verify.model_errors import ORDER, ModelErrors

if TYPE_CHECKING:
    from geometry.sector import SectorMesh


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
    return sector_of(scene, size=size, contact_grid=grid)


def _distinct(groups: np.ndarray) -> int:
    """Number of different groups of vertices (k, 2 or 4), in any order."""
    return len(np.unique(np.sort(groups, axis=1), axis=0))


_MORE_MODES = 1.15  # on another mesh the decisive mode may have a somewhat higher number


@dataclass(frozen=True)
class AdvisedContacts:
    """Contact nodes of a mortar, along the segment and along the radius, and the error expected with them."""

    grid: tuple[int, int]
    error: float


@dataclass(frozen=True)
class Remedies:
    """What was found to help; None where nothing is to be changed or nothing is known."""

    contacts: AdvisedContacts | None = None  # contact dofs
    mesh: AdvisedMesh | None = None  # mesh
    modes: int | None = None  # fixed-interface modes that the tolerance needs on this mesh
    no_mesh: str = ""  # why there is no other mesh, otherwise ""


def within(errors: Sequence[ModelErrors], tolerance: float) -> bool:
    """Whether all errors are known and none is above the tolerance.

    The error of contact dofs is not known, and does not count, where a stiffness is given node by node.
    """
    return all(
        max(each.modes_frequency, each.receptance) <= tolerance
        and each.mesh_frequency <= tolerance
        and not each.contact_frequency > tolerance
        for each in errors
    )


def worst_mesh(errors: Sequence[ModelErrors]) -> int:
    """Which of the errors has the largest mesh error; an unknown one (no other mesh) ranks below any known one."""
    known = [-1.0 if math.isnan(each.mesh_frequency) else each.mesh_frequency for each in errors]
    return known.index(max(known))


def advice(
    errors: Sequence[ModelErrors], rom: Rom, tolerance: float, remedies: Remedies, file: str | None = None
) -> str:
    """The errors of the natural frequencies, and the keys to change so that all errors stay within the tolerance."""
    changes, limits = _contact_changes(errors, rom, tolerance, remedies.contacts)
    mesh_changes, mesh_limits = _mesh_changes(errors[worst_mesh(errors)], tolerance, remedies, file)
    needed = remedies.modes
    if (changes or mesh_changes) and needed is not None:
        needed = math.ceil(_MORE_MODES * needed)
    changes += mesh_changes + _mode_changes(errors, rom, tolerance, needed)
    todo = " and ".join(changes) or ("nothing helps" if limits + mesh_limits else "nothing to do")
    return f"{_dominant(errors, tolerance)}; for a tolerance of {100.0 * tolerance:.3g} %: " + "; ".join(
        [todo, *limits, *mesh_limits]
    )


def percent(error: float) -> str:
    """A relative error in percent."""
    return "unknown" if math.isnan(error) else f"{100.0 * abs(error):.2g} %"


def _dominant(errors: Sequence[ModelErrors], tolerance: float) -> str:
    """Mesh error, modal truncation error and error of the contact dofs of the natural frequencies, largest first."""
    worst = errors[worst_mesh(errors)]
    found = [(max(each.modes_frequency for each in errors), "modal truncation error")]
    contact = [each.contact_frequency for each in errors if not math.isnan(each.contact_frequency)]
    if contact:
        found.append((max(contact), "error of the contact dofs"))
    if not math.isnan(worst.mesh_frequency):
        found.append((worst.mesh_frequency, f"mesh error{_order(worst, tolerance)}"))
    (first, *others) = sorted(found, key=lambda each: -each[0])
    said = [f"{first[1]} {percent(first[0])} of a frequency", *(f"{name} {percent(error)}" for error, name in others)]
    if math.isnan(worst.mesh_frequency):
        said.append(f"mesh error not known ({worst.reason})")
    return ", ".join(said)


def _order(errors: ModelErrors, tolerance: float) -> str:
    """The order of convergence behind the mesh error, in words; "" where nothing follows from it."""
    if errors.other is None or errors.other.element != errors.element:
        return ""
    if errors.third is None:
        return " (order 1 assumed)" if errors.mesh_frequency > tolerance else ""
    if errors.worst_order == ORDER:
        return " (order 1: three meshes show none above it)"
    return f" (order {errors.worst_order:.2g} from three meshes)"


def _contact_changes(
    errors: Sequence[ModelErrors], rom: Rom, tolerance: float, contacts: AdvisedContacts | None
) -> tuple[list[str], list[str]]:
    """Changes of the contact dofs, and what they cannot do."""
    if contacts is None:
        return [], []
    changes = [] if rom.contact_dofs == "mortar" else ['set rom.contact_dofs = "mortar"']
    grid = f"[{contacts.grid[0]}, {contacts.grid[1]}]"
    if contacts.grid != errors[0].contact_grid:
        changes.append(f"set mesh.contact_grid = {grid}")
    if contacts.error <= tolerance:
        return changes, []
    limit = f"contact nodes {grid} leave an error of {percent(contacts.error)}: no grid tried has less"
    return changes, [f"{limit}, lower the contact stiffness"]


def _mesh_changes(
    errors: ModelErrors, tolerance: float, remedies: Remedies, file: str | None
) -> tuple[list[str], list[str]]:
    """Changes of the mesh, and what they cannot do."""
    mesh = remedies.mesh
    if remedies.no_mesh:
        return [], [f"no finer mesh ({remedies.no_mesh})"]
    if mesh is None:
        return [], []
    if mesh.element != errors.element:
        return [f'set mesh.element = "{mesh.element}" ({mesh.dofs} dofs)'], []
    size = quantity("mesh.size")
    limits = []
    if mesh.error > tolerance:
        reached = f"a mesh of {mesh.dofs} dofs leaves an error of some {percent(mesh.error)}"
        limits = [f"{reached}: the tolerance takes more dofs than are practical"]
    if mesh.size >= errors.size:
        return [], limits
    if file is not None:
        edges = f"edges of {1e3 * mesh.size:.2g} mm on average in place of {1e3 * errors.size:.2g} mm"
        return [f"refine {file}: {edges} (about {mesh.dofs} dofs)"], limits
    return [f"lower mesh.size from {size.value(errors.size)} to {size.value(mesh.size)} ({mesh.dofs} dofs)"], limits


def _mode_changes(errors: Sequence[ModelErrors], rom: Rom, tolerance: float, needed: int | None) -> list[str]:
    receptance = max(each.receptance for each in errors)
    frequency = max(each.modes_frequency for each in errors)
    if max(receptance, frequency) <= tolerance:
        return []
    worst = "receptance" if receptance > frequency else "frequency"
    because = f"({worst} error {percent(max(receptance, frequency))})"
    if rom.modes == "auto":
        return [f"lower rom.tolerance from {rom.tolerance:g} to {tolerance:g} {because}"]
    if needed is None:
        return [f'set rom.modes = "auto" and a larger rom.tolerance: this one needs over 1000 modes {because}']
    if needed <= errors[0].modes:  # with a disk: the motions of the cut faces
        return [f"name the excited nodal diameters in rom.nodal_diameters {because}"]
    if rom.frequency_limit is not None:
        return [f"set rom.modes = {needed} in place of rom.frequency_limit {because}"]
    return [f"raise rom.modes from {errors[0].modes} to {needed} {because}"]
