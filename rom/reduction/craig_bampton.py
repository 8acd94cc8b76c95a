"""Craig-Bampton reduction: constraint modes of the kept dofs and a few modes with those dofs held.

R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.checks import require_between
from rom.cyclic.reduced_model import ReducedModel
from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import require_contact_dofs
from rom.reduction.boundary_selection import boundary_selection, unit_vector
from rom.reduction.fixed_interface_modes import lowest_modes, modes_up_to
from rom.reduction.residual_modes import augmented_model, residual_vectors
from rom.reduction.substructure import Substructure, split

if TYPE_CHECKING:
    from geometry import SectorMesh


MOST_ENRICHED = 300  # kept dofs, 48 contact nodes a face


@dataclass(frozen=True)
class ReductionOptions:
    """How many fixed-interface modes to keep, and what else a reduction may choose.

    modes: their number; frequency_limit [Hz]: keep all up to here instead (it goes before `modes`).
    store_basis: whether the model gets its basis, which expands shapes to the mesh and is large.
    backend: of the factorisation, see `factorise`. contact_dofs: "nodal", the displacements of the contact nodes, or
    "patch", the averages over the part of the face that each of them stands for. Raises RomParameterError.
    """

    modes: int | None = 20
    frequency_limit: float | None = None
    store_basis: bool = True
    backend: str = "auto"
    contact_dofs: str = "nodal"

    def __post_init__(self) -> None:
        limit, modes = self.frequency_limit, self.modes
        require_contact_dofs(self.contact_dofs)
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
    """A reduced model with the number of fixed-interface modes in it and of the dofs of the full one.

    error: estimated largest relative error by the modes left out, where their number was chosen by it, else None.
    enriched: the model with what stands for the modes left out, by which `reduction_errors` measures it; None where
    that was not asked for. highest_mode_hz: frequency up to which fixed-interface modes are known there, 0 without any.
    """

    model: ReducedModel
    modes: int
    dofs: int
    error: float | None = None
    enriched: ReducedModel | None = None
    highest_mode_hz: float = 0.0


@one_blas_thread()
def reduce(
    full: FullModel,
    sector: SectorMesh,
    options: ReductionOptions,
    *,
    excitation_direction: ArrayLike = (0.0, 1.0, 0.0),
    excitation_at: str | ArrayLike = "tip",
) -> ReducedModel:
    """Reduce a sector to its contact, tip and loaded dofs and a few fixed-interface modes.

    Coordinates q: right contact dofs (t1, t2, n each), left ones in their own frame, tip x, y, z, loaded
    node x, y, z if it is another one, modal coordinates. Static answers at the kept dofs to any load are
    those of the full model. The excitation is 1 N along excitation_direction (3,), of any length, at excitation_at:
    "tip" or the vertex nearest to a position (3,) [m]; output `tip` is the displacement of that node along that
    direction, `tip_x`, `tip_y`, `tip_z` are those of the tip. Raises RomParameterError for options out of range,
    FactorisationError when the structure is not held or not stable.
    """
    return reduce_sector(
        full, sector, options, excitation_direction=excitation_direction, excitation_at=excitation_at
    ).model


@one_blas_thread()
def reduce_sector(
    full: FullModel | Callable[[], FullModel],
    sector: SectorMesh,
    options: ReductionOptions,
    *,
    excitation_direction: ArrayLike = (0.0, 1.0, 0.0),
    excitation_at: str | ArrayLike = "tip",
    enrich: bool = False,
) -> Reduction:
    """As `reduce` with the same arguments, and the number of modes that were kept beside the model.

    full: the full model, or what makes one: then it does not stay in memory beside its factor. sector, options,
    excitation_direction, excitation_at: see `reduce`; it raises the same. enrich: with the means to estimate its
    errors too (`reduction_errors`), which takes one more static solution for each kept dof; left out where there are
    more than 300 of those.
    """
    direction = unit_vector(excitation_direction)
    parts = split(full, sector, excitation_at, options.backend, options.contact_dofs)
    if options.frequency_limit is not None:
        angular, modes = modes_up_to(parts.inner_mass, parts.factor, options.frequency_limit)
    else:
        angular, modes = lowest_modes(parts.inner_mass, parts.factor, int(options.modes or 0))
    model = craig_bampton_model(sector, parts, angular, modes, direction, options.store_basis)
    if not enrich or parts.kept.size > MOST_ENRICHED:
        return Reduction(model, len(angular), parts.n_dofs)
    enriched = augmented_model(sector, parts, residual_vectors(parts), angular, modes, direction)
    return Reduction(model, len(angular), parts.n_dofs, None, enriched, reach(angular))


def craig_bampton_model(
    sector: SectorMesh,
    parts: Substructure,
    angular: NDArray[np.float64],
    modes: NDArray[np.float64],
    direction: NDArray[np.float64],
    store_basis: bool,
) -> ReducedModel:
    """The reduced model of a split sector: fixed-interface modes w (m,) [rad/s], shapes (3i, m); unit load (3,)."""
    kept = parts.kept
    b, n = kept.size, kept.size + len(angular)
    stiffness, mass = np.zeros((n, n)), np.eye(n)
    stiffness[:b, :b], mass[:b, :b] = parts.stiffness, parts.mass
    stiffness[b:, b:] = np.diag(angular**2)
    mass[:b, b:] = parts.coupling.T @ modes
    mass[b:, :b] = mass[:b, b:].T
    shapes = np.hstack([parts.constraint, modes])
    force = parts.centrifugal
    centrifugal = shapes.T @ force[node_dofs(parts.interior).ravel()]
    centrifugal[:b] += kept.rotation @ force[kept.dofs]
    contact = "nodes" if kept.variables is None else "patches"
    made_of = (
        f"{parts.element}, {parts.n_dofs} dofs, {len(angular)} modes, contact {contact}, {parts.speed_rpm:g} rpm"
    )
    return ReducedModel(
        mass=mass,
        stiffness=stiffness,
        contact_position=sector.right.position,
        contact_area=sector.right.area,
        force_centrifugal=centrifugal,
        basis=_basis(parts, shapes) if store_basis else None,
        n_blades=sector.n_blades,
        producer=f"shroud: {made_of}, {parts.factor.backend}",
        **boundary_selection(parts.kept, np.eye(b, n), direction),
    )


def reach(angular: NDArray[np.float64]) -> float:
    """Highest of the fixed-interface modes (m,) [rad/s] in Hz."""
    return float(angular[-1]) / (2.0 * np.pi) if len(angular) else 0.0


def _basis(parts: Substructure, shapes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mesh displacements (N, n) of the reduced coordinates; zero on the clamped root."""
    kept = parts.kept
    basis = np.zeros((parts.n_dofs, shapes.shape[1]))
    basis[node_dofs(parts.interior).ravel()] = shapes
    basis[kept.dofs, : kept.size] = kept.rotation.T
    return kept.displacements(basis)
