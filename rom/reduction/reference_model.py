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

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

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
    face = spread_over_face(full, sector) if with_face else None
    loads = None if boundary.loads is None else boundary.loads(full)
    given = dofs, loads if loads is not None and loads.size else None
    return _reference(full, sector.n_blades, highest_hz, given, face)


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


def _reference(
    full: FullModel,
    n_blades: int,
    highest_hz: float,
    boundary: tuple[BoundaryDofs, LoadVectors | None],
    face: tuple[ContactDofs, Grid] | None,
) -> FullReference:
    """The reference with these boundary dofs, and with contact dofs `face` on a mortar of the grid beside it."""
    dofs, loads = boundary
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    parts = _Matrices(*(matrix[free][:, free] for matrix in (full.stiffness, full.mass)))
    motion = dofs.motion(len(full.positions))[:, free]
    factor = factorise(parts.held(floating_shift(full)))
    forces = motion.T.toarray()
    if loads is not None:
        forces = np.hstack([forces, loads.columns()[free]])
    static = factor.solve(forces)
    modes = _modes_beyond(parts.mass, factor, highest_hz)
    basis = _basis(parts.mass, factor, modes, _without_modes(static, forces, modes))
    contact = 3 * dofs.contact.sides

    def selected(basis: NDArray[np.float64]) -> dict[str, Any]:
        found = boundary_selection(dofs, motion @ basis)
        return found if loads is None else loads.selection(found, lambda vector: basis.T @ vector[free])

    model = ReducedModel(
        contact_position=dofs.contact.position,
        contact_area=dofs.contact.area,
        contact_frame=dofs.contact.frames[: dofs.contact.count],
        n_blades=n_blades,
        producer=f"shroud: {full.element or 'isoparametric'}, {full.n_dofs} dofs, {len(modes)} free modes "
        "and static responses",
        **parts.projected(basis),
        **selected(basis),
    )
    flexibility = None if full.floating else dofs.contact.flexibility((motion @ static)[:contact, :contact])
    reference = FullReference(model, flexibility, len(modes))
    if face is None:
        return reference
    forces = face[0].motion[:, free].T.toarray()
    added = _added(_without_modes(factor.solve(forces), forces, modes), basis, parts.mass)
    basis = np.hstack([basis, added])
    changes = parts.projected(basis) | selected(basis)
    return replace(reference, face=_on_face(model, face[0], forces.T @ basis, changes), face_grid=face[1])


def _on_face(
    model: ReducedModel, contact: ContactDofs, motion: NDArray[np.float64], changes: dict[str, Any]
) -> ReducedModel:
    """A model with other coordinates, in which `changes` are given, and other contact dofs, motion (3 m, n)."""
    right, left = contact.relative(motion)
    nodes = {"contact_position": contact.position, "contact_area": contact.area, "interfaces": contact.interfaces}
    nodes["contact_frame"] = contact.frames[: contact.count]
    return replace(model, **(changes | nodes | {"contact_right": right, "contact_left": left}))


@dataclass(frozen=True)
class _Matrices:
    """Stiffness and mass (n, n) of the free dofs."""

    stiffness: csr_matrix
    mass: csr_matrix

    def held(self, shift: float) -> csr_matrix:
        """K + s M, definite where a body floats: in place of K it gives a basis as good."""
        return (self.stiffness + shift * self.mass).tocsr() if shift else self.stiffness

    def projected(self, basis: NDArray[np.float64]) -> dict[str, Any]:
        """Both projected on a basis (n, m), by argument of `ReducedModel`."""
        return {
            "mass": symmetric(basis.T @ (self.mass @ basis)),
            "stiffness": symmetric(basis.T @ (self.stiffness @ basis)),
        }


def _without_modes(
    static: NDArray[np.float64], forces: NDArray[np.float64], modes: ModalBasis
) -> NDArray[np.float64]:
    """Static responses (n, k) to forces (n, k) less the part of the modes."""
    return static - modes.shapes @ ((modes.shapes.T @ forces) / modes.omega[:, None] ** 2)


def _basis(mass: csr_matrix, factor: Factor, modes: ModalBasis, first: NDArray[np.float64]) -> NDArray[np.float64]:
    """Modes, the rest (n, k) of static responses, and the quasi-static responses to their inertia, orthonormal."""
    second = factor.solve(mass @ first)
    second -= modes.shapes @ (modes.shapes.T @ (mass @ second))
    vectors = np.hstack([modes.shapes, first, second])
    return vectors @ orthonormal_combinations(vectors.T @ (mass @ vectors))


def _added(vectors: NDArray[np.float64], basis: NDArray[np.float64], mass: csr_matrix) -> NDArray[np.float64]:
    """What vectors (n, k) add to an orthonormal basis (n, m), orthonormal."""
    before = np.sum(vectors * (mass @ vectors), axis=0)
    for _ in range(2):  # little may be left: orthogonal to round-off
        vectors = vectors - basis @ (basis.T @ (mass @ vectors))
    return vectors @ orthonormal_combinations(vectors.T @ (mass @ vectors), before)


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


def _modes_beyond(mass: csr_matrix, factor: Factor, highest_hz: float) -> ModalBasis:
    """The lowest free modes, up to three times the highest frequency of interest at least."""
    count = FIRST_GUESS
    while True:
        modes = lowest_modes(mass, factor, count)
        if len(modes) < count or modes.omega[-1] > 2.0 * np.pi * BEYOND * highest_hz:
            return modes
        if count >= MOST_MODES:
            raise RomParameterError("response", "frequency", highest_hz, f"a range below {count} modes of the blade")
        count *= 2


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
