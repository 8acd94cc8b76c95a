"""Few motions of the cut faces of a sector in which all its travelling waves move.

The motions of the left face in the lowest modes of a few nodal diameters, and in the static responses to forces at
the boundary dofs of the blade, to other loads and to rotation, hardly differ from each other: their singular value
decomposition leaves some dozens. With the same motions on both faces the reduced sector is real and serves every
nodal diameter; what it leaves out shows at nodal diameters between those that it was made of.

References
----------
M. P. Castanier, Y.-C. Tan, C. Pierre, Characteristic constraint modes for component mode synthesis, AIAA Journal 39
(2001) 1182-1187.
M. I. Hussein, Reduced Bloch mode expansion for periodic media band structure calculations, Proceedings of the Royal
Society A 465 (2009) 2825-2848.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry.sector import SectorMesh
from rom.cyclic_sector.condensed_sector import CondensedForces, CondensedSector
from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.cyclic_sector.cyclic_modes import CyclicModes, WaveProblem
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import AT_TIP, BoundaryChoice, InterfaceMotion, WaveReference, choose_boundary_dofs

RIGID = 1e-3  # of the shift: squared frequency of a rigid motion, round-off
BELOW_HALF = 1.4  # a nodal diameter this close to half the number of sectors is not sampled beside it
ROUGHLY = 1e-5  # of the shapes of modes of which patterns are taken
HELD = 1e-12  # relative length of a motion that counts as none


@dataclass(frozen=True)
class InterfaceOptions:
    """Of which waves the motions of the cut faces are taken, and how many."""

    # nodal diameters of the waves; None: 0, 2, 8, 32 ... and half of the number of sectors
    nodal_diameters: tuple[int, ...] | None = None
    modes: int = 20  # modes of each nodal diameter
    tolerance: float = 1e-5  # singular values, relative to the largest one, below which motions are left out
    checked: bool = True  # whether the frequencies of one more nodal diameter are computed, for `wave_errors`

    def sampled(self, n_sectors: int) -> tuple[int, ...]:
        """The nodal diameters for a number of sectors."""
        if self.nodal_diameters is not None:
            return self.nodal_diameters
        half = n_sectors // 2
        return tuple(sorted({0, half, *(2 * 4**k for k in range(20) if BELOW_HALF * 2 * 4**k < half)}))

    def unsampled(self, n_sectors: int) -> int | None:
        """The nodal diameter n farthest from the sampled ones on a scale of log(n + 1); None: all are sampled."""
        sampled = self.sampled(n_sectors)
        others = np.setdiff1d(np.arange(n_sectors // 2 + 1), sampled)
        if not len(others):
            return None
        apart = np.abs(np.log((others[:, None] + 1) / (np.array(sampled) + 1))).min(axis=1)
        return int(others[np.argmax(apart)])


@one_blas_thread()
def interface_motion(
    full: FullModel,
    sector: SectorMesh,
    faces: CyclicFaces,
    boundary: BoundaryChoice = AT_TIP,
    options: InterfaceOptions | None = None,
    *,
    backend: str = "auto",
) -> BoundaryChoice:
    """Boundary dofs of a sector with those of its cut faces, for `reduce_sector`."""
    options = options or InterfaceOptions()
    dofs = choose_boundary_dofs(full, sector, replace(boundary, interface=_untouched(faces)))
    forces = [dofs.motion(len(full.positions)).toarray().T]
    loads = None if boundary.loads is None else boundary.loads(full)
    forces += [loads.columns()] if loads is not None and loads.size else []  # the equilibrium at speed may hold all
    condensed = CondensedSector(full, faces, backend)
    motions, references = _sampled(condensed, np.hstack(forces), options)
    free = faces.left[~condensed.held.reshape(-1, 3)[faces.left].any(axis=1)]
    at_left = np.searchsorted(condensed.at_faces, node_dofs(free).ravel())
    joined = _joined(condensed, free, _principal(motions[at_left], options.tolerance))
    return replace(boundary, interface=replace(joined, references=references))


def _sampled(
    sector: CondensedSector, forces: NDArray[np.float64], options: InterfaceOptions
) -> tuple[NDArray[np.float64], tuple[WaveReference, ...]]:
    """Motions (b, k) of the faces, real and imaginary parts, in waves and static responses to forces; frequencies."""
    n_sectors, loads = sector.faces.n_sectors, sector.condense(forces)
    motions, references = [], []
    for diameter in options.sampled(n_sectors):
        wave = WaveProblem(sector, diameter)
        modes = wave.modes(options.modes, ROUGHLY)
        found = _of_unit_energy(wave, modes, forces, loads)
        motions += [found.real, found.imag]
        if diameter == 0:  # so that the static displacement of the reduced model is that of the whole mesh
            motions.append(_steady(wave))
        references.append(WaveReference(diameter, modes.frequency_hz, sampled=True))
    other = options.unsampled(n_sectors) if options.checked else None
    if other is not None:
        modes = WaveProblem(sector, other).modes(options.modes, ROUGHLY)
        references.append(WaveReference(other, modes.frequency_hz, sampled=False))
    return np.hstack(motions), tuple(references)


def _untouched(faces: CyclicFaces) -> InterfaceMotion:
    """The nodes of the faces, before their motions are known."""
    nothing = np.zeros((0, 0))
    return InterfaceMotion(faces.nodes, np.zeros((0, 3 * len(faces.nodes))), nothing, nothing)


def _of_unit_energy(
    wave: WaveProblem, modes: CyclicModes, forces: NDArray[np.float64], condensed: CondensedForces | None
) -> NDArray[Any]:
    """Motions (b, k) of the faces in modes, and in static responses to forces (N, k) without their rigid motion.

    All have the same elastic energy. Rigid motions have none: they are as large as if their frequency was the lowest
    one of the others.
    """
    shift, at_faces = wave.sector.shift, wave.sector.at_faces
    squared = modes.omega**2
    rigid = squared <= RIGID * shift
    lowest = squared[~rigid].min(initial=np.inf)
    shapes = modes.shapes[at_faces] / np.sqrt(np.where(rigid, lowest, squared))
    static, work = wave.static_at_faces(forces, condensed)
    moved, driven = modes.shapes[at_faces][:, rigid], modes.shapes[:, rigid].conj().T @ forces
    stored = squared[rigid] + shift
    static = static - (moved / stored) @ driven
    work = work - np.sum(np.abs(driven) ** 2 / stored[:, None], axis=0)
    return np.hstack([shapes, static / np.sqrt(np.where(work > 0.0, work, np.inf))])


def _steady(wave: WaveProblem) -> NDArray[Any]:
    """Motion (b, 1) of the faces under the centrifugal force, of unit elastic energy."""
    force = wave.sector.full.centrifugal[:, None]
    moved = wave.static_response(force)
    work = float(np.sum(force * moved))
    return moved[wave.sector.at_faces] / np.sqrt(work if work > 0.0 else np.inf)


def _principal(columns: NDArray[np.float64], tolerance: float) -> NDArray[np.float64]:
    """Orthonormal motions (3k, r) that hold the columns but for a part below the tolerance."""
    lengths = np.linalg.norm(columns, axis=0)
    columns = columns[:, lengths > HELD * lengths.max(initial=0.0)]
    if not columns.size:
        return np.zeros((len(columns), 0))
    vectors, values, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(vectors[:, values > tolerance * values[0]])


def _joined(sector: CondensedSector, left: NDArray[np.int64], patterns: NDArray[np.float64]) -> InterfaceMotion:
    """The motions on both faces; nodes on the axis keep all of theirs, nodes clamped on the other face have none."""
    faces = sector.faces
    right = faces.right[np.isin(faces.left, left)]
    axis = faces.axis[~sector.held.reshape(-1, 3)[faces.axis].any(axis=1)]
    clamped = np.setdiff1d(np.flatnonzero(sector.held.reshape(-1, 3).any(axis=1)), sector.full.fixed // 3)
    r, a, k = patterns.shape[1], len(axis), len(left)
    turned = np.einsum("ij,kjr->kir", faces.turn, patterns.reshape(k, 3, r)).reshape(3 * k, r)
    rows = np.zeros((2 * r + 3 * a, 3 * (2 * k + a + len(clamped))))
    rows[:r, : 3 * k], rows[r : 2 * r, 3 * k : 6 * k] = patterns.T, turned.T
    rows[2 * r :, 6 * k : 6 * k + 3 * a] = np.eye(3 * a)
    at_right, at_left = np.zeros((2, r + 3 * a, 2 * r + 3 * a))
    at_left[:r, :r] = at_right[:r, r : 2 * r] = np.eye(r)
    at_right[r:, 2 * r :], at_left[r:, 2 * r :] = np.eye(3 * a), np.kron(np.eye(a), faces.turn)
    return InterfaceMotion(np.concatenate([left, right, axis, clamped]), rows, at_right, at_left)
