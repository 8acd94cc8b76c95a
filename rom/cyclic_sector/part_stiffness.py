"""Elastic stiffness of a part of a sector, its disk or its blade; rows that tell the families of its modes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.mode_families import ModeFamilies, section_motion, shroud_height, wing_vertices
from rom.finite_elements.assembly import elastic_matrices
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.finite_elements.material import Materials
from rom.linear_algebra.threads import one_blas_thread

if TYPE_CHECKING:
    from geometry.sector import SectorMesh


_NONE = 1e-14  # of the largest eigenvalue of a stiffness: no strain
_ON_RIM = 1e-6  # of the radius of the rim


def within_rim(full: FullModel, rim_radius: float) -> NDArray[np.bool_]:
    """Which nodes lie on the rim or within it, (n_nodes,)."""
    inside: NDArray[np.bool_] = np.hypot(full.positions[:, 1], full.positions[:, 2]) <= (1.0 + _ON_RIM) * rim_radius
    return inside


def part_stiffness(
    full: FullModel,
    sector: SectorMesh,
    material: Materials,
    basis: NDArray[np.float64],
    inside: NDArray[np.bool_],
    *,
    disk: bool,
) -> NDArray[np.float64]:
    """Elastic stiffness of the elements of the disk or of the blade in reduced coordinates, (n, n).

    Shapes: `inside` (n_nodes,).
    """
    mesh = discretise(sector, full.element)
    chosen = [(block, inside[block.nodes].all(axis=1) == disk) for block in mesh.blocks]
    blocks = tuple(
        replace(block, nodes=block.nodes[rows], vertices=block.vertices[rows], geometry=block.geometry[rows])
        for block, rows in chosen
        if rows.any()
    )
    if not blocks:  # cut faces up to the tip: all is disk
        return np.zeros((basis.shape[1], basis.shape[1]))
    used = np.unique(np.concatenate([block.nodes.ravel() for block in blocks]))
    dofs = node_dofs(used).ravel()
    stiffness = elastic_matrices(replace(mesh, blocks=blocks), material)[0][dofs][:, dofs]
    moved = basis[dofs]
    found: NDArray[np.float64] = moved.T @ (stiffness @ moved)
    return (found + found.T) / 2


def strain_rows(stiffness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows whose squares add up to the strain energy of a part: S with S^T S = K.

    `stiffness` (n, n): stiffness K of the part, symmetric, with no negative eigenvalues but round-off. Returns (r,
    n): S; motions without strain have no row.
    """
    values, vectors = np.linalg.eigh((stiffness + stiffness.T) / 2.0)
    kept = values > _NONE * values[-1]
    rows: NDArray[np.float64] = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    return rows


@one_blas_thread()
def blade_stiffness(
    full: FullModel, sector: SectorMesh, material: Materials, basis: NDArray[np.float64], rim_radius: float
) -> NDArray[np.float64]:
    """The elastic stiffness of the blade in the reduced coordinates of a sector of a disk.

    With (1 + delta)^2 times this part the frequencies of the blade, clamped at the rim and at rest, are (1 + delta)
    times as high: a mistuned blade.

    `basis` (N, n): mesh displacements of the reduced coordinates, `ReducedModel.basis`. Returns (n, n): the
    stiffness, N/m for coordinates in m.
    """
    return part_stiffness(full, sector, material, basis, within_rim(full, rim_radius), disk=False)


@one_blas_thread()
def mode_families(
    full: FullModel, sector: SectorMesh, material: Materials, basis: NDArray[np.float64], rim_radius: float
) -> ModeFamilies:
    """Rows of a reduced model that tell the families of its modes.

    `basis` (N, n): mesh displacements of the reduced coordinates, `ReducedModel.basis`; `rim_radius`: outer radius of
    the disk, m: its elements have no node beyond it. The airfoil is what stands on it, up to the contact faces.
    """
    positions = full.positions
    inside = within_rim(full, rim_radius)
    airfoil = np.flatnonzero(~inside & (positions[:, 2] < shroud_height(sector)))
    airfoil = np.setdiff1d(airfoil, full.vertex_node[wing_vertices(sector)])
    displacement = basis.T.reshape(basis.shape[1], -1, 3)
    sections = section_motion(positions[airfoil], displacement[:, airfoil])
    rows = strain_rows(part_stiffness(full, sector, material, basis, inside, disk=True))
    return ModeFamilies(sections.reshape(len(sections), -1).T.copy(), rows)
