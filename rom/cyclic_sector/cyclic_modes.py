"""Modes of a full sector in a travelling wave: all nodes of the mesh, no reduction.

In a wave with n nodal diameters each sector moves as the last one, turned by the pitch and ahead by the phase
n phi = 2 pi n / N. With the rotation Q by one pitch the right cut face follows from the left one,

    u_R = exp(i n phi) Q u_L,    so u = T_n z,

and K_n = T_n^H K T_n, M_n = T_n^H M T_n are Hermitian; for n = 0 and N / 2 they are real. Their eigenvectors are
found as real vectors (Re z, Im z) of twice the length, where each eigenvalue appears twice.

References
----------
D. L. Thomas, Dynamics of rotationally periodic structures, International Journal for Numerical Methods in Engineering
14 (1979) 81-102.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.block_lanczos import lowest_eigenpairs
from rom.linear_algebra.factorisation import Factor, factorise
from rom.linear_algebra.threads import one_blas_thread

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

SHIFT = 1e-9  # of the largest ratio of stiffness to mass: makes the stiffness of a disk that nothing holds definite
TOLERANCE = 1e-9  # of the shapes
INDEPENDENT = 0.5  # of the Gram matrix of pairs: its eigenvalues are 2, 1 where only one of a pair was found, and 0
_SEED = 20261123


@dataclass(frozen=True)
class CyclicModes:
    """Modes of a sector with n nodal diameters.

    Attributes
    ----------
    nodal_diameter : int
        Number of nodal diameters n; the wave runs towards +y.
    omega : (m,) array
        Natural frequencies, rad/s, ascending; rigid motions have 0.
    shapes : (N, m) array
        Displacements of the nodes, node-major x, y, z, with the mass of a sector normalised to 1; complex but for
        n = 0 and half the number of sectors.

    Examples
    --------
    >>> from rom import CyclicModes
    >>> modes = CyclicModes(3, np.array([2e3 * np.pi]), np.zeros((6, 1), complex))
    >>> modes.frequency_hz.round(6).tolist()
    [1000.0]
    """

    nodal_diameter: int
    omega: NDArray[np.float64]
    shapes: NDArray[Any]

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Natural frequencies, Hz, (m,)."""
        return self.omega / (2.0 * np.pi)


@one_blas_thread()
def cyclic_modes(
    full: FullModel, faces: CyclicFaces, nodal_diameter: int, count: int, *, backend: str = "auto"
) -> CyclicModes:
    """Lowest modes of a sector that is joined to its neighbours at its cut faces.

    Parameters
    ----------
    full : FullModel
        The full model of the sector; a disk that nothing holds has rigid motions.
    faces : CyclicFaces
        The cut faces.
    nodal_diameter : int
        Number of nodal diameters n, from 0 to half the number of sectors.
    count : int
        Number of modes.
    backend : str
        Backend of the factorisation, see `factorise`.

    Returns
    -------
    CyclicModes
        The modes.

    Raises
    ------
    RomParameterError
        There is no such nodal diameter.
    FactorisationError
        The structure is not stable.

    Examples
    --------
    A ring of shrouds in one piece: neighbours in opposite phase are stiffer than all in phase.

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, cyclic_faces, cyclic_modes
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(1, 1)))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> faces = cyclic_faces(full, sector, "face_right", "face_left")
    >>> low, high = (cyclic_modes(full, faces, n, 2).frequency_hz[0] for n in (0, 20))
    >>> bool(low < high)
    True
    """
    return WaveProblem(full, faces, nodal_diameter, backend).modes(count)


@dataclass(frozen=True)
class WaveProblem:
    """The eigenvalue problem of one nodal diameter, and its static solutions.

    Attributes
    ----------
    full : FullModel
        The full model.
    faces : CyclicFaces
        The cut faces.
    nodal_diameter : int
        Number of nodal diameters.
    backend : str
        Backend of the factorisation.
    """

    full: FullModel
    faces: CyclicFaces
    nodal_diameter: int
    backend: str = "auto"

    def __post_init__(self) -> None:
        """Check the nodal diameter."""
        most = self.faces.n_sectors // 2
        if not 0 <= self.nodal_diameter <= most:
            allowed = f"must be a whole number, 0 to {most} for {self.faces.n_sectors} sectors"
            raise RomParameterError("disk", "nodal_diameter", self.nodal_diameter, allowed)

    @property
    def phase(self) -> float:
        """Phase from one sector to the next, rad."""
        return 2.0 * np.pi * self.nodal_diameter / self.faces.n_sectors

    @cached_property
    def constraint(self) -> csr_matrix:
        """T_n (N, k): displacements of all nodes for those that are free and not on the right face."""
        from scipy.sparse import coo_matrix, csr_matrix, hstack, kron

        faces, n = self.faces, len(self.full.positions)
        held = faces.held(self.full)
        kept = ~held
        kept.reshape(-1, 3)[faces.right] = False
        kept.reshape(-1, 3)[faces.axis] = False
        columns = np.flatnonzero(kept)
        own = csr_matrix((np.ones(len(columns)), (columns, np.arange(len(columns)))), shape=(3 * n, len(columns)))
        pairs = coo_matrix((np.ones(len(faces.left)), (faces.right, faces.left)), shape=(n, n))
        phase = np.exp(1j * self.phase)
        factor = phase.real if 2 * self.nodal_diameter % faces.n_sectors == 0 else phase
        followed = kron(pairs, factor * faces.turn).tocsr()[:, columns]
        followed = followed.multiply((~held)[:, None])
        return hstack([own + followed, self._axis_motion(factor, held)], format="csr")

    def _axis_motion(self, factor: complex, held: NDArray[np.bool_]) -> csr_matrix:
        """Motions (N, j) that nodes on the axis can have: u = exp(i n phi) Q u."""
        from scipy.linalg import null_space
        from scipy.sparse import csr_matrix, kron

        nodes = self.faces.axis[~held.reshape(-1, 3)[self.faces.axis].any(axis=1)]
        motion = null_space(np.eye(3) - factor * self.faces.turn, rcond=1e-9)
        n = len(self.full.positions)
        rows = csr_matrix((np.ones(len(nodes)), (nodes, np.arange(len(nodes)))), shape=(n, len(nodes)))
        return kron(rows, motion, format="csr")

    @cached_property
    def matrices(self) -> tuple[csr_matrix, csr_matrix]:
        """K_n and M_n, (k, k)."""
        t = self.constraint
        adjoint = t.conj().T.tocsr()
        stiffness, mass = ((adjoint @ matrix @ t).tocsr() for matrix in (self.full.stiffness, self.full.mass))
        for matrix in (stiffness, mass):
            matrix.sum_duplicates()
        return stiffness, mass

    @cached_property
    def shift(self) -> float:
        """Number s with K_n + s M_n definite: 0 where the disk is held."""
        if self.full.fixed.size:
            return 0.0
        stiffness, mass = (matrix.diagonal().real for matrix in self.matrices)
        return SHIFT * float((stiffness / mass).max())

    @cached_property
    def factor(self) -> Factor:
        """Factor of K_n + s M_n."""
        stiffness, mass = self.matrices
        return factorise((stiffness + self.shift * mass).tocsr() if self.shift else stiffness, self.backend)

    def static_response(self, forces: NDArray[np.float64]) -> NDArray[Any]:
        """Displacements (N, k) under forces (N, k) in this wave; of K_n + s M_n where nothing holds the disk."""
        t = self.constraint
        return np.asarray(t @ self.factor.solve(np.ascontiguousarray(t.conj().T @ forces)))

    def modes(self, count: int) -> CyclicModes:
        """The lowest modes."""
        mass = self.matrices[1]
        count = min(count, mass.shape[0])
        found = self._real_modes(count) if np.isrealobj(mass.data) else self._complex_modes(count)
        squared, vectors = found
        omega = np.sqrt(np.maximum(squared - self.shift, 0.0))
        return CyclicModes(self.nodal_diameter, omega, self.constraint @ vectors)

    def _real_modes(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        mass = self.matrices[1]
        start = np.random.default_rng(_SEED).standard_normal((self.factor.block, mass.shape[0]))
        squared, rows = lowest_eigenpairs(lambda b: self.factor.solve(b.T).T, mass, start, count, TOLERANCE)
        return squared, rows.T

    def _complex_modes(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
        from scipy.sparse import bmat

        mass = self.matrices[1]
        n = mass.shape[0]
        doubled = bmat([[mass.real, -mass.imag], [mass.imag, mass.real]], format="csr")

        def solve(rows: NDArray[np.float64]) -> NDArray[np.float64]:
            found = self.factor.solve((rows[:, :n] + 1j * rows[:, n:]).T).T
            return np.hstack([found.real, found.imag])

        start = np.random.default_rng(_SEED).standard_normal((self.factor.block, 2 * n))
        _, rows = lowest_eigenpairs(solve, doubled, start, min(2 * count, 2 * n), TOLERANCE)
        return self._without_copies((rows[:, :n] + 1j * rows[:, n:]).T, count)

    def _without_copies(
        self, vectors: NDArray[np.complex128], count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
        """Eigenvalues and vectors, once each: of (Re z, Im z) and (-Im z, Re z) both are found."""
        stiffness, mass = self.matrices
        gram = vectors.conj().T @ (mass @ vectors)
        sizes, combinations = np.linalg.eigh(gram)
        kept = sizes > INDEPENDENT
        basis = vectors @ (combinations[:, kept] / np.sqrt(sizes[kept]))
        squared, small = np.linalg.eigh(basis.conj().T @ (stiffness @ basis))
        return squared[:count] + self.shift, basis @ small[:, :count]
