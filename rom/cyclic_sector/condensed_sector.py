"""A sector condensed onto its cut faces: one real factor that serves every nodal diameter.

With the dofs i inside the sector eliminated first and those of both cut faces last, the real Schur complement S of
the faces is the same for all waves. In a wave the faces move as u_b = T_n z, so that only T_n^H S T_n changes from
one nodal diameter to the next: a dense Hermitian matrix of the size of one face.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.errors import FactorisationError
from rom.finite_elements.full_model import FullModel, floating_shift, node_dofs
from rom.linear_algebra.block_lanczos import IsotropicMatrix
from rom.linear_algebra.cholmod import COLUMNS, CholmodFactor, library
from rom.linear_algebra.factorisation import NOT_DEFINITE, nested_dissection
from rom.linear_algebra.schur_complement import SchurComplement

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True)
class CondensedSector:
    """The matrices of a sector, and its factor with the dofs of the cut faces eliminated last."""

    full: FullModel  # the full model
    faces: CyclicFaces  # the cut faces
    backend: str = "auto"  # backend of the factorisation, see `factorise`

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """Dofs (N,) that are clamped."""
        return self.faces.held(self.full)

    @cached_property
    def at_faces(self) -> NDArray[np.int64]:
        """Free dofs (b,) of the cut faces, ascending."""
        dofs = np.sort(node_dofs(self.faces.nodes).ravel())
        return dofs[~self.held[dofs]]

    @cached_property
    def inside(self) -> NDArray[np.int64]:
        """Free dofs (i,) that are not on the cut faces, ascending."""
        return np.setdiff1d(np.flatnonzero(~self.held), self.at_faces)

    @cached_property
    def mass(self) -> IsotropicMatrix | csr_matrix:
        """The mass (N, N)."""
        return IsotropicMatrix.of(self.full.mass) if self.full.isotropic_mass else self.full.mass

    @cached_property
    def shift(self) -> float:
        """Number s with K + s M definite in every wave, (rad/s)^2: 0 where disk and blade are held."""
        return floating_shift(self.full, self.faces.nodes)

    @cached_property
    def shifted_stiffness(self) -> csr_matrix:
        """K + s M, (N, N)."""
        return (self.full.stiffness + self.shift * self.full.mass).tocsr() if self.shift else self.full.stiffness

    @cached_property
    def condensed(self) -> tuple[SchurComplement, NDArray[np.float64]] | None:
        """Factor of K + s M with the faces last, and S (b, b); None without CHOLMOD, or where nothing is condensed.

        Raises FactorisationError where the sector is not stable.
        """
        if self.backend == "superlu" or library() is None or not len(self.at_faces) or not len(self.inside):
            return None
        matrix = self.shifted_stiffness
        part = matrix[self.inside][:, self.inside]
        order = nested_dissection(part, from_size=0)
        order = CholmodFactor(part).order if order is None else order
        try:
            factor = SchurComplement(matrix, self.inside[order], self.at_faces)
        except ValueError:
            return None
        schur = factor.factorise()
        if schur is None:
            raise FactorisationError(NOT_DEFINITE)
        return factor, schur

    def condense(self, forces: NDArray[np.float64]) -> CondensedForces | None:
        """Forces (N, k) condensed onto the cut faces; None where the sector is not."""
        if self.condensed is None:
            return None
        factor = self.condensed[0]
        added, work = factor.condensed(np.ascontiguousarray(forces[factor.own].T))
        return CondensedForces(forces[self.at_faces] + added.T, work)


@dataclass(frozen=True)
class CondensedForces:
    """Forces on a sector condensed onto its cut faces."""

    at_faces: NDArray[np.float64]  # (b, k), the forces on the free dofs of the faces
    work: NDArray[np.float64]  # (k,), f^T u of the static responses with the faces held


class WaveFactor:
    """Factor of T_n^H (K + s M) T_n for the motions (N, k) of one nodal diameter: inside as it is, faces z.

    The columns of T_n are those of the dofs inside, ascending, then those of the faces.
    """

    backend = "cholmod"
    block = COLUMNS // 2

    def __init__(
        self, factor: SchurComplement, schur: NDArray[np.float64], at_faces: csr_matrix, inside: Any
    ) -> None:
        from scipy.linalg import LinAlgError, cho_factor

        self._factor, self._motion = factor, at_faces
        self._own = np.searchsorted(inside, factor.own)
        try:
            self._top = cho_factor(_projected(schur, at_faces), lower=True, overwrite_a=True)
        except LinAlgError:
            raise FactorisationError(NOT_DEFINITE) from None

    def at_faces(self, forces: CondensedForces) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """Static motions (b, k) of the faces under forces, and the work f^H u of these, (k,)."""
        from scipy.linalg import cho_solve

        on_motions = self._motion.conj().T @ forces.at_faces
        found = cho_solve(self._top, on_motions)
        return self._motion @ found, forces.work + np.sum(on_motions.conj() * found, axis=0).real

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """See Factor."""
        rows = np.atleast_2d(np.asarray(rhs).T)
        kind = np.result_type(rows, self._motion.dtype)
        solution = np.empty(rows.shape, kind)
        step = COLUMNS // 2 if kind.kind == "c" else COLUMNS
        for first in range(0, len(rows), step):
            part = slice(first, first + step)
            self._solve_at_once(rows[part].astype(kind, copy=False), solution[part])
        return solution.reshape(np.shape(rhs)[::-1]).T

    def _solve_at_once(self, rows: NDArray[Any], solution: NDArray[Any]) -> None:
        from scipy.linalg import cho_solve

        inner, motion = len(self._own), self._motion
        added = _joined(self._factor.down(_parts(rows[:, self._own])), rows)
        at_faces = cho_solve(self._top, rows[:, inner:].T + motion.conj().T @ added.T)
        solution[:, inner:] = at_faces.T
        solution[:, self._own] = _joined(self._factor.up(_parts((motion @ at_faces).T)), rows)


def _parts(rows: NDArray[Any]) -> NDArray[np.float64]:
    """Real parts of complex rows (k, n) above the imaginary ones, (2k, n)."""
    return np.vstack([rows.real, rows.imag]) if np.iscomplexobj(rows) else rows


def _joined(parts: NDArray[np.float64], like: NDArray[Any]) -> NDArray[Any]:
    """Complex rows again, where those of `like` are."""
    return parts[: len(like)] + 1j * parts[len(like) :] if np.iscomplexobj(like) else parts


def _projected(schur: NDArray[np.float64], motion: csr_matrix) -> NDArray[Any]:
    """T^H S T (k, k) by columns: real products, for S may take much of the memory."""
    real = motion.real.tocsr()
    along = real.T @ (schur @ real)
    if np.isrealobj(motion.data):
        return np.asfortranarray(along)
    imaginary = motion.imag.tocsr()
    turned = schur @ imaginary
    found = np.empty(along.shape, complex, order="F")
    found.real = along + imaginary.T @ turned
    cross = real.T @ turned
    found.imag = cross - cross.T
    return found
