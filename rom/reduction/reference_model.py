"""A model of a few hundred coordinates that responds like the full one: the reference of reduced models.

Its basis holds free natural modes of the full model far beyond the frequencies of interest, the static responses to
forces at the boundary dofs (attachment modes), and the quasi-static responses to the inertia of those. It shares
nothing with the Craig-Bampton basis. The receptance at the boundary dofs is exact to the third power of
(w / w_next)^2, w_next the first mode left out, and this error is squared because the space holds both the response
and its adjoint.

References
----------
R. R. Craig, C.-J. Chang, On the use of attachment modes in substructure coupling for dynamic analysis,
18th Structures, Structural Dynamics and Materials Conference (1977), AIAA 77-405.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.cyclic_symmetry import in_wave
from rom.cyclic.reduced_model import ReducedModel
from rom.errors import ReducedModelError, RomParameterError
from rom.finite_elements.full_model import FullModel, floating_shift
from rom.linear_algebra.block_lanczos import orthonormal_combinations
from rom.linear_algebra.factorisation import Factor, factorise
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import AT_TIP, BoundaryChoice, BoundaryDofs, LoadVectors, choose_boundary_dofs
from rom.reduction.contact_dofs import ContactDofs, averaged_dofs
from rom.reduction.fixed_interface_modes import ModalBasis, lowest_modes
from rom.reduction.mortar_dofs import Grid, coarser_mortar, contact_grid, orthonormal
from rom.reduction.substructure import boundary_selection, symmetric

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import SectorMesh

FIRST_GUESS = 24
MOST_MODES = 384
# Mortar that stands for springs spread over the face, along t1 and along the radius: on a steel face of 12 x 5 mm its
# frequencies are within 0.02 % of those with the shape functions of all nodes up to kn = 1e10 N/m, tied within 0.1 %.
_LEAST_ON_FACE = (8, 6)
COLUMNS = 64  # of motions at once
BEYOND = 3.0  # highest mode over the highest frequency of interest, at least


@dataclass(frozen=True)
class FullReference:
    """Reference for the reduced models of one full model."""

    model: ReducedModel  # responds like the full model at the boundary dofs
    # (6 n_c, 6 n_c) displacements of right, then left contact dofs for unit forces there, m/N; solved on the mesh
    # itself. Of a sector of a disk those in the wave of the reference, complex; None where nothing holds a body.
    # Inside a sector and against the ground as in `ContactInterface.rows`; (3 n_c, 3 n_c) where no interface is
    # between neighbours
    flexibility: NDArray[Any] | None
    modes: int  # free natural modes of the full model in `model`
    # the same with other contact dofs: a mortar so fine that its springs are as good as spread over the face. None
    # where it was not asked for or the mesh has no node sets of the faces
    face: ReducedModel | None = None
    face_grid: Grid = (0, 0)  # contact nodes of each pair of faces of `face` along t1 and along the radius

    def with_mortar(self, grid: Grid) -> ReducedModel:
        """The model of `face` with a mortar of another, coarser grid."""
        if self.face is None:
            raise ReducedModelError("face: missing, allowed: a reference made with it")
        rows, shares = coarser_mortar(self.face_grid, grid)
        fine, left = int(np.prod(self.face_grid)), self.face.contact_left
        pairs, area = np.eye(self.face.n_contacts // fine), self.face.contact_area
        nodes = np.kron(pairs, rows)
        each = np.kron(nodes, np.eye(3))
        return replace(
            self.face,
            contact_right=each @ self.face.contact_right,
            contact_left=None if left is None else each @ left,
            contact_position=nodes @ self.face.contact_position,
            contact_frame=None if (frame := self.face.contact_frame) is None else orthonormal(nodes, frame),
            contact_area=None
            if area is None
            else np.concatenate([shares * float(part.sum()) for part in np.split(area, len(pairs))]),
            interfaces={name: count // fine * len(shares) for name, count in self.face.interfaces.items()},
        )


@one_blas_thread()
def full_reference(
    full: FullModel,
    sector: SectorMesh,
    highest_hz: float,
    boundary: BoundaryChoice = AT_TIP,
    *,
    with_face: bool = False,
) -> FullReference:
    """The reference of a full model for frequencies up to `highest_hz`."""
    require_at_rest(full)
    dofs = choose_boundary_dofs(full, sector, boundary)
    space = ResponseSpace.of(BladeProblem(full), full, dofs, boundary, highest_hz)

    def model(basis: NDArray[np.float64], contact: ContactDofs) -> ReducedModel:
        selected = boundary_selection(dofs, space.motion @ basis)
        if space.loads is not None:
            selected = space.loads.selection(selected, lambda vector: basis.T @ vector)
        right, left = contact.relative(contact.motion @ basis)
        selected |= {"contact_right": right, "contact_left": left, "interfaces": contact.interfaces}
        mass, stiffness = (symmetric(inner(basis, matrix, basis)) for matrix in (full.mass, full.stiffness))
        return ReducedModel(
            mass,
            stiffness,
            contact_position=contact.position,
            contact_area=contact.area,
            contact_frame=contact.frames[: contact.count],
            n_blades=sector.n_blades,
            producer=f"shroud: {full.element or 'isoparametric'}, {full.n_dofs} dofs, {len(space.modes.omega)} free "
            "modes and static responses",
            **selected,
        )

    return space.reference(model, spread_over_face(full, sector) if with_face else None)


def require_at_rest(full: FullModel, joined: ArrayLike = ()) -> None:
    """Refuse a reference at a speed with bodies that contacts alone hold: without contacts these are unstable.

    `joined`: nodes of cut faces. Raises RomParameterError.
    """
    if full.speed_rpm and any(not np.isin(joined, nodes).any() for nodes in full.floating):
        allowed = "0 to measure a model with bodies that contacts alone hold against the whole mesh"
        raise RomParameterError("load", "speed_rpm", full.speed_rpm, allowed)


@one_blas_thread()
def held_frequencies(full: FullModel, count: int) -> NDArray[np.float64]:
    """The lowest natural frequencies of a full model that is held at its root, with free contacts.

    Returns (count,): natural frequencies, Hz, ascending.
    """
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    stiffness, mass = (matrix[free][:, free] for matrix in (full.stiffness, full.mass))
    modes = lowest_modes(mass, factorise(stiffness), count)
    return np.asarray(modes.omega / (2.0 * np.pi))


class Problem(Protocol):
    """The undamped equations of a full model with free contacts, by displacements (N, k) of all nodes."""

    @property
    def mass(self) -> Any:
        """The mass (N, N)."""

    @property
    def shift(self) -> float:
        """Number s with K + s M definite: 0 where every body is held."""

    def modes(self, count: int) -> Any:
        """The lowest modes, with `omega` (m,) and `shapes` (N, m)."""

    def static_response(self, forces: NDArray[Any]) -> NDArray[Any]:
        """Displacements (N, k) under forces (N, k) of K + s M."""


@dataclass(frozen=True)
class BladeProblem:
    """A full model without neighbours: clamped dofs do not move."""

    full: FullModel

    @property
    def mass(self) -> csr_matrix:
        """The mass (N, N)."""
        return self.full.mass

    @cached_property
    def shift(self) -> float:
        """Number s with K + s M definite: where a body floats this gives a basis as good as K."""
        return floating_shift(self.full)

    @cached_property
    def _free(self) -> NDArray[np.int64]:
        return np.setdiff1d(np.arange(self.full.n_dofs), self.full.fixed)

    @cached_property
    def _factor(self) -> Factor:
        shifted = self.full.stiffness + self.shift * self.full.mass if self.shift else self.full.stiffness
        return factorise(shifted[self._free][:, self._free].tocsr())

    def modes(self, count: int) -> ModalBasis:
        """The lowest modes with free contacts, of K + s M."""
        modes = lowest_modes(self.mass[self._free][:, self._free], self._factor, count)
        return replace(modes, shapes=self._at_all(modes.shapes))

    def static_response(self, forces: NDArray[Any]) -> NDArray[Any]:
        """Displacements (N, k) under forces (N, k), of K + s M."""
        return self._at_all(self._factor.solve(np.ascontiguousarray(forces[self._free])))

    def _at_all(self, moved: NDArray[Any]) -> NDArray[Any]:
        found = np.zeros((self.full.n_dofs, moved.shape[1]))
        found[self._free] = moved
        return found


@dataclass(frozen=True)
class ResponseSpace:
    """Motions (N, m) of all nodes that hold the responses of a full model up to a frequency."""

    problem: Problem
    n_nodes: int
    dofs: BoundaryDofs
    loads: LoadVectors | None
    highest_hz: float

    @classmethod
    def of(
        cls, problem: Problem, full: FullModel, dofs: BoundaryDofs, boundary: BoundaryChoice, highest_hz: float
    ) -> ResponseSpace:
        """The space of responses to forces at the boundary dofs and to the loads of a choice."""
        loads = None if boundary.loads is None else boundary.loads(full)
        given = loads if loads is not None and loads.size else None
        return cls(problem, len(full.positions), dofs, given, highest_hz)

    @cached_property
    def motion(self) -> csr_matrix:
        """Boundary dofs (b, N) of the motions."""
        return self.dofs.motion(self.n_nodes).tocsr()

    @cached_property
    def modes(self) -> Any:
        """The lowest free modes, up to three times the highest frequency of interest at least."""
        count = FIRST_GUESS
        while True:
            modes = self.problem.modes(count)
            if len(modes.omega) < count or modes.omega[-1] > 2.0 * np.pi * BEYOND * self.highest_hz:
                return modes
            if count >= MOST_MODES:
                allowed = f"a range below {count} modes of the full model"
                raise RomParameterError("response", "frequency", self.highest_hz, allowed)
            count *= 2

    @cached_property
    def _static(self) -> NDArray[Any]:
        """Responses (N, k) to forces at the boundary dofs, then to the loads; of K + s M where nothing holds."""
        forces = self.motion.T.toarray()
        if self.loads is not None:
            forces = np.hstack([forces, self.loads.columns()])
        return self.problem.static_response(forces)

    @property
    def flexibility(self) -> NDArray[Any] | None:
        """Motions (6 n_c, 6 n_c) of the contact dofs for unit forces there, m/N; None where a body floats."""
        if self.problem.shift:
            return None
        contact, rows = self.dofs.contact, 3 * self.dofs.contact.sides
        return contact.flexibility(self.motion[:rows] @ self._static[:, :rows])

    @cached_property
    def basis(self) -> NDArray[Any]:
        """Modes, the rest of static responses, quasi-static responses to their inertia, orthonormal (N, m)."""
        mass = self.problem.mass
        first = self._without_modes(self._static)
        second = self._without_modes(self.problem.static_response(_product(mass, first)))
        vectors = np.hstack([self.modes.shapes, first, second])
        return np.asarray(vectors @ orthonormal_combinations(inner(vectors, mass, vectors)))

    def extended(self, contact: ContactDofs) -> NDArray[Any]:
        """The basis, and behind it what the responses to forces at other contact dofs add."""
        mass, basis = self.problem.mass, self.basis
        vectors = self._without_modes(self.problem.static_response(contact.motion.toarray().T))
        before = np.diag(inner(vectors, mass, vectors)).real
        for _ in range(2):  # little may be left: orthogonal to round-off
            vectors -= basis @ inner(basis, mass, vectors)
        return np.hstack([basis, vectors @ orthonormal_combinations(inner(vectors, mass, vectors), before)])

    def _without_modes(self, vectors: NDArray[Any]) -> NDArray[Any]:
        shapes = self.modes.shapes
        return np.asarray(vectors - shapes @ inner(shapes, self.problem.mass, vectors))

    def reference(
        self, model: Callable[[NDArray[Any], ContactDofs], ReducedModel], face: tuple[ContactDofs, Grid] | None
    ) -> FullReference:
        """The reference of models in a basis with some contact dofs; `face`: those of a fine mortar, and its grid."""
        reference = FullReference(model(self.basis, self.dofs.contact), self.flexibility, len(self.modes.omega))
        if face is None:
            return reference
        return replace(reference, face=model(self.extended(face[0]), face[0]), face_grid=face[1])


def _product(matrix: Any, columns: NDArray[Any]) -> NDArray[Any]:
    """A product of a real matrix (N, N) with real or complex columns (N, k)."""
    columns = np.ascontiguousarray(columns)
    return np.asarray(matrix @ columns.view(float)).view(columns.dtype)


def inner(left: NDArray[Any], matrix: Any, right: NDArray[Any]) -> NDArray[Any]:
    """U^H A V (m, k) of motions U (N, m) and V (N, k) by columns of V: motions take much of the memory."""
    found = np.empty((left.shape[1], right.shape[1]), np.result_type(left, right))
    for first in range(0, right.shape[1], COLUMNS):
        part = slice(first, first + COLUMNS)
        found[:, part] = (left.T @ _product(matrix, right[:, part]).conj()).conj()
    return found


def spread_over_face(full: FullModel, sector: SectorMesh) -> tuple[ContactDofs, Grid] | None:
    """Contact dofs of a mortar finer than the contact grid, and its grid; None where the mesh has no faces for it."""
    try:
        along, radial = np.max(
            [contact_grid(view.right.position, view.right.frame) for view in sector.views.values()], axis=0
        ).tolist()
        grid = max(_LEAST_ON_FACE[0], 2 * ((along + 1) // 2) + 2), max(_LEAST_ON_FACE[1], 2 * ((radial + 1) // 2) + 2)
        return averaged_dofs(sector, full.element, "mortar", grid), grid
    except RomParameterError:
        return None


def static_error(model: ReducedModel, flexibility: NDArray[Any], phase: float = 0.0) -> float:
    """Relative error of the static contact flexibility of a model, in the Frobenius norm.

    Only round-off for a reduced model whose boundary dofs hold the contact dofs.

    `flexibility` (6 n_c, 6 n_c): the exact flexibility, m/N, as in `FullReference`; `phase`: inter-blade phase angle,
    rad, of a sector of a disk.
    """
    left = model.contact_left
    rows: NDArray[Any] = model.contact_right if left is None else np.vstack([model.contact_right, left])
    stiffness, wave = model.stiffness, model.wave(phase)
    if wave is not None:
        rows, stiffness = rows @ wave, in_wave(stiffness, wave)
    found = rows @ np.linalg.solve(stiffness, rows.conj().T)
    return float(np.linalg.norm(found - flexibility) / np.linalg.norm(flexibility))
