"""Modes of a full sector in a travelling wave, and its motion under a steady load: all nodes, no reduction.

In a wave with n nodal diameters each sector moves as the last one, turned by the pitch and ahead by the phase
n phi = 2 pi n / N. With the rotation Q by one pitch the right cut face follows from the left one,

    u_R = exp(i n phi) Q u_L,    so u = T_n z,

and K_n = T_n^H K T_n, M_n = T_n^H M T_n are Hermitian; for n = 0 and N / 2 they are real. One real factor of the
inside of the sector serves them all (`CondensedSector`). Under a steady load all sectors move alike, n = 0.

References
----------
D. L. Thomas, Dynamics of rotationally periodic structures, International Journal for Numerical Methods in Engineering
14 (1979) 81-102.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic_sector.condensed_sector import CondensedForces, CondensedSector, WaveFactor
from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.linear_algebra.block_lanczos import IsotropicMatrix, lowest_eigenpairs
from rom.linear_algebra.factorisation import Factor, factorise
from rom.linear_algebra.threads import one_blas_thread

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


TOLERANCE = 1e-9  # of the shapes
_SEED = 20261123


@dataclass(frozen=True)
class CyclicModes:
    """Modes of a sector with n nodal diameters."""

    # number of nodal diameters n. Sector j + 1 is ahead of sector j by the phase n phi: with exp(i w t) the wave runs
    # towards -y, against the rotation
    nodal_diameter: int
    omega: NDArray[np.float64]  # (m,) natural frequencies, rad/s, ascending; rigid motions have 0
    # (N, m) displacements of the nodes, node-major x, y, z, with the mass of a sector normalised to 1; complex but
    # for n = 0 and half the number of sectors
    shapes: NDArray[Any]

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Natural frequencies, Hz, (m,)."""
        return self.omega / (2.0 * np.pi)


def cyclic_modes(full: FullModel, faces: CyclicFaces, nodal_diameter: int, count: int) -> CyclicModes:
    """Lowest modes of a sector that is joined to its neighbours at its cut faces."""
    return modes_by_nodal_diameter(full, faces, (nodal_diameter,), count)[0]


def modes_by_nodal_diameter(
    full: FullModel, faces: CyclicFaces, nodal_diameters: Sequence[int], count: int, *, backend: str = "auto"
) -> tuple[CyclicModes, ...]:
    """Lowest modes of a sector at several nodal diameters, with one factor of its inside: see `cyclic_modes`."""
    with one_blas_thread():
        sector = CondensedSector(full, faces, backend)
        return tuple(WaveProblem(sector, diameter).modes(count) for diameter in nodal_diameters)


@dataclass(frozen=True)
class WaveProblem:
    """The eigenvalue problem of one nodal diameter, and its static solutions."""

    sector: CondensedSector  # the sector, the same for all nodal diameters
    nodal_diameter: int  # number of nodal diameters

    def __post_init__(self) -> None:
        """Check the nodal diameter."""
        most = self.sector.faces.n_sectors // 2
        if not 0 <= self.nodal_diameter <= most:
            allowed = f"must be a whole number, 0 to {most} for {self.sector.faces.n_sectors} sectors"
            raise RomParameterError("disk", "nodal_diameter", self.nodal_diameter, allowed)

    @property
    def mass(self) -> IsotropicMatrix | csr_matrix:
        """The mass (N, N)."""
        return self.sector.mass

    @property
    def shift(self) -> float:
        """Number s with K + s M definite: 0 where the disk is held."""
        return self.sector.shift

    @property
    def is_real(self) -> bool:
        """Whether neighbours move in phase or in opposite phase."""
        return 2 * self.nodal_diameter % self.sector.faces.n_sectors == 0

    @property
    def _follows(self) -> complex:
        """exp(i n phi): the motion of a sector over that of the last one."""
        value = complex(np.exp(2j * np.pi * self.nodal_diameter / self.sector.faces.n_sectors))
        return round(value.real) if self.is_real else value

    @cached_property
    def constraint(self) -> csr_matrix:
        """T_n (N, k): displacements of all nodes for those inside, of the left face and on the axis, in order."""
        from scipy.sparse import coo_matrix, csr_matrix, hstack, kron

        sector, faces = self.sector, self.sector.faces
        left = np.setdiff1d(sector.at_faces, node_dofs(np.concatenate([faces.right, faces.axis])))
        columns, size = np.concatenate([sector.inside, left]), len(sector.held)
        own = csr_matrix((np.ones(len(columns)), (columns, np.arange(len(columns)))), shape=(size, len(columns)))
        pairs = coo_matrix((np.ones(len(faces.left)), (faces.right, faces.left)), shape=(size // 3, size // 3))
        followed = kron(pairs, self._follows * faces.turn).tocsr()[:, columns]
        return hstack([own + followed, self._axis_motion()], format="csr")

    def _axis_motion(self) -> csr_matrix:
        """Motions (N, j) that nodes on the axis can have: u = exp(i n phi) Q u."""
        from scipy.linalg import null_space
        from scipy.sparse import csr_matrix, kron

        faces, held = self.sector.faces, self.sector.held
        nodes = faces.axis[~held.reshape(-1, 3)[faces.axis].any(axis=1)]
        motion = null_space(np.eye(3) - self._follows * faces.turn, rcond=1e-9)
        n = len(held) // 3
        rows = csr_matrix((np.ones(len(nodes)), (nodes, np.arange(len(nodes)))), shape=(n, len(nodes)))
        return kron(rows, motion, format="csr")

    @cached_property
    def factor(self) -> Factor:
        """Factor of T_n^H (K + s M) T_n, of the whole matrix where the sector is not condensed."""
        sector, motion = self.sector, self.constraint
        if sector.condensed is None:
            matrix = (motion.conj().T @ sector.shifted_stiffness @ motion).tocsr()
            matrix.sum_duplicates()
            return factorise(matrix, sector.backend)
        at_faces = motion[sector.at_faces][:, len(sector.inside) :]
        return WaveFactor(*sector.condensed, at_faces, sector.inside)

    def static_at_faces(
        self, forces: NDArray[np.float64], condensed: CondensedForces | None
    ) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """Motions (b, k) of the cut faces under forces (N, k) in this wave, and the work f^H u of these, (k,).

        Of K + s M where nothing holds the disk; `condensed` are the same forces as the sector condenses them.
        """
        if condensed is not None and isinstance(self.factor, WaveFactor):
            return self.factor.at_faces(condensed)
        moved = self.static_response(forces)
        return moved[self.sector.at_faces], np.sum(forces * moved, axis=0).real

    def static_response(self, forces: NDArray[Any]) -> NDArray[Any]:
        """Displacements (N, k) under forces (N, k) in this wave; of K + s M where nothing holds the disk."""
        t = self.constraint
        return np.asarray(t @ self.factor.solve(np.ascontiguousarray(t.conj().T @ forces)))

    def modes(self, count: int, tolerance: float = TOLERANCE) -> CyclicModes:
        """The lowest modes, their shapes to a relative tolerance."""
        mass = WaveMass(self.sector.mass, self.constraint)
        size = mass.shape[0]
        rng = np.random.default_rng(_SEED)
        start = rng.standard_normal((self.factor.block, size))
        if not self.is_real:
            start = start + 1j * rng.standard_normal(start.shape)
        solve = self.factor.solve
        squared, rows = lowest_eigenpairs(lambda b: solve(b.T).T, mass, start, min(count, size), tolerance)
        omega = np.sqrt(np.maximum(squared - self.sector.shift, 0.0))
        return CyclicModes(self.nodal_diameter, omega, self.constraint @ rows.T)


class WaveMass:
    """T_n^H M T_n (k, k): a product is that of the real M with the motions of all nodes."""

    def __init__(self, mass: IsotropicMatrix | csr_matrix, motion: csr_matrix) -> None:
        self._mass, self._motion, self._adjoint = mass, motion, motion.conj().T.tocsr()
        self.shape = self._adjoint.shape[0], motion.shape[1]

    def __matmul__(self, columns: NDArray[Any]) -> NDArray[Any]:
        """The product with columns (k, p)."""
        moved = np.ascontiguousarray(self._motion @ columns)
        forces = np.asarray(self._mass @ moved.view(float)).view(moved.dtype)
        return np.asarray(self._adjoint @ forces)


def static_motion(full: FullModel, faces: CyclicFaces) -> csr_matrix:
    """Displacements u = T z of a sector that moves as its neighbours do, turned by the pitch: nodal diameter 0.

    A disk that nothing holds is supported without reactions: a load alike on all sectors, without a force along the
    axis or a moment about it, cannot move it, and one node is held along x and y.
    """
    sector = CondensedSector(full, faces)
    motion = WaveProblem(sector, 0).constraint
    if full.fixed.size:
        return motion
    inside = np.flatnonzero(np.isin(sector.inside % 3, 0))  # columns of motions along x, one for each node inside
    highest = inside[np.argmax(np.abs(full.positions[sector.inside[inside] // 3, 2]))]
    return motion[:, np.delete(np.arange(motion.shape[1]), [highest, highest + 1])]
