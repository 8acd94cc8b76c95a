"""Stress on the mesh at a solved point: static part and harmonics, their cycle, and what is known of the errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.reduced_model import ReducedModel
from rom.cyclic.sector_modes import RingModes
from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel
from rom.finite_elements.loads import temperature_at_points
from rom.finite_elements.material import Materials
from rom.reduction.boundary_dofs import BoundaryChoice
from rom.stress.fatigue import StressCycle, stress_cycle
from rom.stress.hot_spots import BoundarySurface, Surroundings, point_loads, singular_vertices
from rom.stress.mesh_motion import MeshMotion, SolvedPoint
from rom.stress.stress_recovery import NodalStress, StressRecovery, von_mises

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class OperatingStress:
    """Stress at s places of a mesh: a node, or one for each material that meets at a node."""

    positions: Array  # (s, 3) places, m
    displacement: NDArray[np.complex128]  # (H+1, s, 3) displacement of the places, m
    harmonics: NDArray[np.complex128]  # (H+1, s, 6) stress xx, yy, zz, xy, yz, zx, Pa; harmonic 0 is the static part
    cycle: StressCycle  # amplitude, signed mean and largest value
    # (s,) deviation of the elements at a place from their average, summed over the harmonics from 1 on, Pa
    spread: Array
    static_spread: Array  # (s,) the same of harmonic 0, Pa
    surroundings: Surroundings  # singular places and sizes of elements
    material: IntArray  # (s,) number of the material of each place in `materials`
    materials: tuple[str, ...]  # names of the materials
    # (E, b) cell type of VTK and places of its nodes, for each block of the mesh
    cells: tuple[tuple[int, IntArray], ...]
    surface: NDArray[np.bool_]  # (s,) places at corners of the surface
    # largest difference of the harmonics from 1 on as the reduced model alone gives them, relative to their largest
    # value, outside of singular places
    expansion_error: float
    # the same of the statically corrected harmonics, which are those given, from the full model's; nan where that was
    # not solved
    model_error: float
    residual: float  # largest relative residual of the full model's solution; nan where it was not solved


def nodal_stress(
    sector: SectorMesh,
    material: Materials,
    displacement: ArrayLike,
    element: str | None = "hex20",
    temperature: float | Array | None = None,
) -> tuple[NodalStress, IntArray]:
    """Stress at the nodes of a mesh of a displacement with small strains.

    In each element the stress at the quadrature points is projected on linear functions and extrapolated to the
    nodes, then averaged over the elements at a node.

    `displacement` (n, 3): displacement of the nodes of the full model, m; complex for a harmonic. Returns `stress`:
    stress at s places; `node` (s,): node of each place.
    """
    heated = None if temperature is None else temperature_at_points(temperature, len(sector.points))
    recovery = StressRecovery.of(discretise(sector, element), material, None, heated)
    moved = np.asarray(displacement)
    return recovery.increments(moved[None])[0] if heated is None else recovery.static(moved), recovery.node


def operating_stress(
    full: FullModel,
    sector: SectorMesh,
    materials: Materials,
    reduced: tuple[ReducedModel, RingModes],
    boundary: BoundaryChoice,
    point: SolvedPoint,
    *,
    large_displacements: bool = True,
    temperature: float | Array | None = None,
    check: bool = True,
    faces: CyclicFaces | None = None,
) -> OperatingStress:
    """Stress on the mesh at a solved point of a response curve.

    `temperature` (V,): temperature above the stress-free state, K, that the static force of the loads is of.
    """
    motion = MeshMotion(full, sector, reduced, boundary, faces)
    base = motion.at_speed() if large_displacements and full.speed_rpm != 0.0 else None
    heated = None if temperature is None else temperature_at_points(temperature, len(sector.points))
    recovery = StressRecovery.of(discretise(sector, full.element), materials, base, heated)
    near = _surroundings(full, sector, motion, recovery, boundary)
    return _recovered(motion, recovery, point, near, _mesh(sector, full, recovery), check)


def _recovered(
    motion: MeshMotion,
    recovery: StressRecovery,
    point: SolvedPoint,
    near: Surroundings,
    mesh: tuple[tuple[tuple[int, IntArray], ...], NDArray[np.bool_]],
    check: bool,
) -> OperatingStress:
    """The stress of the statically corrected motion, and its errors; `mesh`: its cells, places on the surface."""
    moved = motion.corrected(point)
    static, found = recovery.static(moved[0]), recovery.increments(moved[1:])
    values = np.array([static.values, *(each.values for each in found)])
    plain = recovery.increments(motion.expanded(point)[1:])
    exact, residual = motion.solved(point, moved) if check else (moved, np.nan)
    solved = recovery.increments(exact[1:]) if check else plain
    return OperatingStress(
        positions=motion.full.positions[recovery.node],
        displacement=moved.reshape(len(moved), -1, 3)[:, recovery.node],
        harmonics=values,
        cycle=stress_cycle(values),
        spread=np.sum([each.spread for each in found] or [np.zeros(len(static.spread))], axis=0),
        static_spread=static.spread,
        surroundings=near,
        material=recovery.material,
        materials=recovery.names,
        cells=mesh[0],
        surface=mesh[1],
        expansion_error=_difference(plain, found, near.regular),
        model_error=_difference(found, solved, near.regular) if check else np.nan,
        residual=residual,
    )


def _difference(found: list[NodalStress], exact: list[NodalStress], chosen: NDArray[np.bool_]) -> float:
    """Largest von Mises stress of the differences over the largest of the exact ones, both summed over harmonics."""
    if not found or not chosen.any():
        return 0.0
    size = np.sum([von_mises(each.values) for each in exact], axis=0)[chosen].max()
    pairs = zip(found, exact, strict=True)
    off = np.sum([von_mises(one.values - other.values) for one, other in pairs], axis=0)[chosen].max()
    return float(off / size) if size > 0.0 else 0.0


def _surroundings(
    full: FullModel, sector: SectorMesh, motion: MeshMotion, recovery: StressRecovery, boundary: BoundaryChoice
) -> Surroundings:
    """Singular places of the mesh and of its point forces."""
    dofs, loads = motion.dofs, motion.loads
    vectors = [*loads.excitation.values(), *([] if loads.static is None else [loads.static])]
    loaded = [point_loads(sector, _loaded_vertices(full, vector)) for vector in vectors]
    if not loads.excitation:
        loaded.append(np.flatnonzero(full.vertex_node == dofs.nodes[dofs.loaded]))
    places: dict[str, Any] = {"loaded node": full.vertex_node[np.unique(np.concatenate(loaded))]}
    if boundary.contact_dofs == "nodal":
        places["contact node"] = dofs.nodes[: dofs.contact.sides]
    found = singular_vertices(sector)
    places |= {cause: full.vertex_node[vertices] for cause, vertices in found.items()}
    return Surroundings.of(recovery, full.positions, places)


def _loaded_vertices(full: FullModel, vector: NDArray[Any]) -> IntArray:
    """Vertices on which a vector of forces acts."""
    return np.flatnonzero(np.any(vector.reshape(-1, 3)[full.vertex_node] != 0.0, axis=1))


def _mesh(
    sector: SectorMesh, full: FullModel, recovery: StressRecovery
) -> tuple[tuple[tuple[int, IntArray], ...], NDArray[np.bool_]]:
    """The cells, and whether each place is a corner of the surface."""
    corners = full.vertex_node[np.unique(BoundarySurface.of(sector.blocks, sector.points).sides)]
    return _cells(sector, full, recovery), np.isin(recovery.node, corners)


def _cells(sector: SectorMesh, full: FullModel, recovery: StressRecovery) -> tuple[tuple[int, IntArray], ...]:
    """The elements of the mesh by their places."""
    n = len(full.positions)
    keys = recovery.material * n + recovery.node
    return tuple(
        (
            block.topology.cell_type,
            np.searchsorted(keys, recovery.names.index(block.material) * n + full.vertex_node[block.nodes]),
        )
        for block in sector.blocks
    )
