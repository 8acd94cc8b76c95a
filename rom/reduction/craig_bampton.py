"""Craig-Bampton reduction: constraint modes of the boundary dofs and a few fixed-interface modes.

Residual modes stand for the fixed-interface modes left out. Let L be the inertia of the interior under the constraint
modes and m_k = L^T phi_k. A fixed-interface mode k contributes w^4 m_k m_k^T / (w_k^2 - w^2) to the dynamic stiffness
of the boundary dofs. At low frequencies the sum over all modes left out is w^4 R with

    R = L^T K_ii^-1 L - sum over the modes at hand of m_k m_k^T / w_k^2,

which takes one static solution for each boundary dof. The vectors behind R, K_ii^-1 L orthogonalised to the modes at
hand, therefore stand for all modes left out. This is the residual flexibility of MacNeal, Rubin and Craig and Chang,
applied to the inertia forces at the fixed interface.

References
----------
R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
R. H. MacNeal, A hybrid method of component mode synthesis, Computers & Structures 1 (1971) 581-601.
S. Rubin, Improved component-mode representation for structural dynamic analysis, AIAA Journal 13 (1975) 995-1006.
R. R. Craig, C.-J. Chang, On the use of attachment modes in substructure coupling for dynamic analysis,
18th Structures, Structural Dynamics and Materials Conference (1977), AIAA 77-405.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ReducedModel
from rom.errors import RomParameterError, require_between
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.finite_elements.rotation import coriolis_acceleration
from rom.linear_algebra.block_lanczos import orthonormal_combinations
from rom.linear_algebra.cholmod import bears_threads
from rom.linear_algebra.threads import beside, one_blas_thread
from rom.reduction.boundary_dofs import AT_TIP, BoundaryChoice, with_attachment_modes
from rom.reduction.fixed_interface_modes import ModalBasis, lowest_modes, modes_up_to
from rom.reduction.substructure import HeldSector, Substructure, hold_at_boundary, load_selection, symmetric

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

MOST_AUGMENTED = 300  # boundary dofs, 48 contact nodes a face


def residual_vectors(parts: Substructure) -> NDArray[np.float64]:
    """K_ii^-1 L (3i, b): static responses of the interior to its inertia under the constraint modes, and to loads."""
    return parts.factor.solve(parts.sources)


def augmented_model(parts: Substructure, modes: ModalBasis, residual: NDArray[np.float64]) -> ReducedModel:
    """The Craig-Bampton model augmented by residual modes.

    Coordinates: boundary dofs, fixed-interface modes, residual vectors (3i, b) made orthogonal to the modes.
    """
    shapes, squared = modes.shapes, modes.omega[:, None] ** 2
    participation = parts.coupling.T @ shapes
    in_modes = (participation.T if parts.loads is None else shapes.T @ parts.sources) / squared
    remainder = residual - shapes @ in_modes
    correction = shapes.T @ (parts.interior_mass @ remainder)  # the difference may be small: orthogonalise twice
    remainder -= shapes @ correction
    before = np.sum(residual * (parts.interior_mass @ residual), axis=0)
    chosen = orthonormal_combinations(remainder.T @ (parts.interior_mass @ remainder), before)
    remainder = remainder @ chosen
    # K_ii times the remainder without K_ii: times the residual vectors it is L, times the modes w^2 M_ii times them.
    forces = (parts.sources - (parts.interior_mass @ shapes) @ (squared * (in_modes + correction))) @ chosen
    b, m = parts.boundary.size, len(modes)
    n = b + m + remainder.shape[1]
    mass, stiffness = np.eye(n), np.zeros((n, n))
    mass[:b, :b], stiffness[:b, :b] = parts.mass, parts.stiffness
    mass[:b, b:] = np.hstack([participation, parts.coupling.T @ remainder])
    mass[b:, :b] = mass[:b, b:].T
    stiffness[b : b + m, b : b + m] = np.diag(modes.omega**2)
    stiffness[b + m :, b + m :] = symmetric(remainder.T @ forces)
    return ReducedModel(
        mass=mass,
        stiffness=stiffness,
        contact_position=parts.boundary.contact.position,
        contact_area=parts.boundary.contact.area,
        contact_frame=parts.boundary.contact.frames[: parts.boundary.contact.count],
        n_blades=parts.sector.n_blades,
        **load_selection(parts, np.hstack([shapes, remainder])),
    )


@dataclass(frozen=True)
class ReductionOptions:
    """How many fixed-interface modes the reduced model has, and how it is computed.

    Attributes
    ----------
    modes : int or None
        Number of fixed-interface modes.
    frequency_limit : float or None
        All fixed-interface modes up to this frequency, Hz; takes precedence over `modes`.
    store_basis : bool
        Whether the model gets its basis, which expands shapes to the mesh and is large.
    backend : str
        Backend of the factorisation, see `factorise`.

    Raises
    ------
    RomParameterError
        A value is out of its range.

    Examples
    --------
    >>> from rom import ReductionOptions
    >>> ReductionOptions(modes=20, store_basis=False)
    ReductionOptions(modes=20, frequency_limit=None, store_basis=False, backend='auto')
    """

    modes: int | None = 30
    frequency_limit: float | None = None
    store_basis: bool = True
    backend: str = "auto"

    def __post_init__(self) -> None:
        limit, modes = self.frequency_limit, self.modes
        if limit is None and modes is None:
            raise RomParameterError("rom", "modes", modes, "give modes (a number) or frequency_limit (Hz)")
        if limit is not None:
            require_between("rom", "frequency_limit", limit, 0.0, np.inf, "must be a frequency above 0 (Hz)")
        if modes is not None:
            whole = "must be a whole number, 0 or more"
            require_between("rom", "modes", modes, -1.0, np.inf, whole)
            if int(modes) != modes:
                raise RomParameterError("rom", "modes", modes, whole)


@dataclass(frozen=True)
class Reduction:
    """A reduced model and the facts about its reduction.

    Attributes
    ----------
    model : ReducedModel
        The reduced model.
    modes : int
        Number of its fixed-interface modes.
    dofs : int
        Number of dofs of the full model.
    error : float or None
        Estimated largest relative modal truncation error, where the number of modes was chosen by it.
    augmented : ReducedModel or None
        The model augmented by residual modes, against which `reduction_errors` measures it; None where it was not
        asked for.
    highest_mode_hz : float
        Highest frequency of the fixed-interface modes in `augmented`, 0 without any.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, ReductionOptions, assemble, reduce_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(1, 1)))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> reduction = reduce_sector(full, sector, ReductionOptions(modes=4))
    >>> reduction.modes, reduction.model.n_blades, reduction.dofs == full.n_dofs
    (4, 40, True)
    """

    model: ReducedModel
    modes: int
    dofs: int
    error: float | None = None
    augmented: ReducedModel | None = None
    highest_mode_hz: float = 0.0


@one_blas_thread()
def reduce_sector(
    full: FullModel | Callable[[], FullModel],
    sector: SectorMesh,
    options: ReductionOptions,
    boundary: BoundaryChoice = AT_TIP,
    *,
    augment: bool = False,
) -> Reduction:
    """Reduce a sector to its contact, tip and loaded dofs and a few fixed-interface modes.

    Coordinates q: right contact dofs (t1, t2, n of each node), left contact dofs in their own frame, tip x, y, z,
    loaded node x, y, z if it is another one, modal coordinates. The static response of the boundary dofs to any load
    is that of the full model.

    Parameters
    ----------
    full : FullModel or callable
        The full model, or a function that makes it; then it does not stay in memory beside its factor.
    sector : SectorMesh
        The mesh of the full model.
    options : ReductionOptions
        Number of modes.
    boundary : BoundaryChoice
        Excitation and contact dofs.
    augment : bool
        Whether to make the model augmented by residual modes too, which takes one more static solution for each
        boundary dof. It is left out where there are more than 300 of those.

    Returns
    -------
    Reduction
        The model. Its excitation is 1 N; its output `tip` is the displacement of the loaded node along the
        excitation; `tip_x`, `tip_y`, `tip_z` are those of the tip.

    Raises
    ------
    RomParameterError
        The loaded node is clamped, there are too many modes, or the mesh does not have the contact dofs.
    FactorisationError
        The structure is not held or not stable.

    Examples
    --------
    Coordinates: one contact node on each face, the tip and four fixed-interface modes:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, ReductionOptions, assemble, reduce_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(1, 1)))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> reduce_sector(full, sector, ReductionOptions(modes=4)).model.size
    13
    """
    held = hold_at_boundary(full, sector, boundary, options.backend)
    augment = augment and held.boundary.size <= MOST_AUGMENTED

    def condense() -> tuple[Substructure, NDArray[np.float64] | None]:
        parts = held.condensed()
        return parts, residual_vectors(parts) if augment else None

    find_modes = partial(_fixed_interface_modes, held, options)
    modes, (parts, residual) = beside(held.size, find_modes, condense, threads=bears_threads())
    model = craig_bampton_model(parts, modes, options.store_basis)
    if residual is None:
        return Reduction(model, len(modes), parts.n_dofs)
    augmented = augmented_model(parts, modes, residual)
    return Reduction(model, len(modes), parts.n_dofs, None, augmented, modes.highest_hz)


def _fixed_interface_modes(held: HeldSector, options: ReductionOptions) -> ModalBasis:
    """As many modes as the options ask for, or those up to a frequency."""
    if options.frequency_limit is not None:
        return modes_up_to(held.interior_mass, held.factor, options.frequency_limit)
    return lowest_modes(held.interior_mass, held.factor, int(options.modes or 0))


def craig_bampton_model(parts: Substructure, modes: ModalBasis, store_basis: bool) -> ReducedModel:
    """The reduced model of a partitioned sector with fixed-interface modes.

    K = diag(K_bb, w_m^2) and M = [[M_bb, L^T Phi], [Phi^T L, I]] with the condensed K_bb, M_bb.
    """
    made_of = f"{parts.element or 'isoparametric'}, {parts.n_dofs} dofs, {len(modes)} modes"
    if parts.loads is not None:
        columns = parts.loads.columns
        modes = with_attachment_modes(modes, columns, parts.factor.solve(columns), parts.interior_mass)
    boundary = parts.boundary
    b, n = boundary.size, boundary.size + len(modes)
    stiffness, mass = np.zeros((n, n)), np.eye(n)
    stiffness[:b, :b], mass[:b, :b] = parts.stiffness, parts.mass
    stiffness[b:, b:] = np.diag(modes.omega**2)
    mass[:b, b:] = parts.coupling.T @ modes.shapes
    mass[b:, :b] = mass[:b, b:].T
    force = parts.centrifugal
    inner = force[node_dofs(parts.interior).ravel()]
    centrifugal = np.concatenate([parts.constraint.T @ inner, modes.shapes.T @ inner])
    centrifugal[:b] += boundary.rotation @ force[boundary.dofs]
    made_of = f"{made_of}, {boundary.contact.kind} contact dofs, {parts.speed_rpm:g} rpm"
    return ReducedModel(
        mass=mass,
        stiffness=stiffness,
        contact_position=boundary.contact.position,
        contact_area=boundary.contact.area,
        contact_frame=boundary.contact.frames[: boundary.contact.count],
        force_centrifugal=centrifugal,
        coriolis=_coriolis(parts, modes),
        basis=_basis(parts, modes) if store_basis else None,
        n_blades=parts.sector.n_blades,
        speed_rpm=parts.speed_rpm,
        producer=f"shroud: {made_of}, {parts.factor.backend}",
        **load_selection(parts, modes.shapes),
    )


def _coriolis(parts: Substructure, modes: ModalBasis) -> NDArray[np.float64] | None:
    """Coriolis matrix C^T (M A + A M) C / 2 (n, n) of the reduced coordinates at 1 rad/s; None at rest."""
    if parts.coriolis is None:
        return None
    acceleration = coriolis_acceleration(modes.shapes)
    mixed = parts.coupling.T @ acceleration
    if parts.coriolis_inertia is not None:
        mixed = 0.5 * (mixed - parts.coriolis_inertia.T @ modes.shapes)
    inner = modes.shapes.T @ (parts.interior_mass @ acceleration)
    return np.block([[parts.coriolis, mixed], [-mixed.T, 0.5 * (inner - inner.T)]])


def _basis(parts: Substructure, modes: ModalBasis) -> NDArray[np.float64]:
    """Mesh displacements (N, n) of the reduced coordinates; zero on the clamped root."""
    boundary, inner = parts.boundary, node_dofs(parts.interior).ravel()
    basis = np.zeros((parts.n_dofs, boundary.size + len(modes)))
    basis[inner, : boundary.size], basis[inner, boundary.size :] = parts.constraint, modes.shapes
    basis[boundary.dofs, : boundary.size] = boundary.rotation.T
    return boundary.mesh_displacements(basis)
