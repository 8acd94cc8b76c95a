"""Craig-Bampton reduction: constraint modes of the kept dofs and a few modes with those dofs held.

R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.checks import require_between
from rom.errors import RomParameterError
from rom.factorisation import factorise
from rom.fixed_interface import lowest_modes, modes_up_to
from rom.full_model import FullModel, node_dofs
from rom.kept_dofs import KeptDofs, choose_kept_dofs
from rom.reduced_model import ReducedModel
from rom.threads import one_blas_thread

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh


@dataclass(frozen=True)
class ReductionOptions:
    """How many fixed-interface modes to keep, and whether to store the basis (needed to expand shapes to the mesh).

    modes: their number; frequency_limit [Hz]: keep all up to here instead (it goes before `modes`).
    backend: of the factorisation, see `factorise`. Raises RomParameterError.
    """

    modes: int | None = 20
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

    Coordinates q: right contact nodes (t1, t2, n each), left ones in their own frame, tip x, y, z, loaded
    node x, y, z if it is another one, modal coordinates. Static answers at the kept dofs to any load are
    those of the full model. The excitation is 1 N along excitation_direction (3,), of any length, at "tip"
    or at the vertex nearest to a position (3,) [m]; output `tip` is the displacement of that node along that
    direction, `tip_x`, `tip_y`, `tip_z` are those of the tip.
    Raises RomParameterError for options out of range, FactorisationError when the structure is not held or
    not stable.
    """
    direction = _unit_vector(excitation_direction)
    kept = choose_kept_dofs(full, sector, excitation_at)
    interior = _interior_nodes(full, kept)
    stiffness, mass, shapes, backend = _reduced_matrices(full, kept, interior, options)
    n = len(mass)
    centrifugal = shapes.T @ full.centrifugal[node_dofs(interior).ravel()]
    centrifugal[: kept.size] += kept.rotation @ full.centrifugal[kept.dofs]
    load = direction @ kept.displacement(kept.loaded, n)
    tip = kept.displacement(kept.tip, n)
    right, left = np.eye(n)[: 6 * kept.n_contacts].reshape(2, 3 * kept.n_contacts, n)
    made_of = f"{full.element}, {full.n_dofs} dofs, {n - kept.size} modes, {full.speed_rpm:g} rpm, {backend}"
    return ReducedModel(
        mass=mass,
        stiffness=stiffness,
        contact_right=right,
        contact_left=left,
        contact_position=sector.right.position,
        contact_area=sector.right.area,
        force_excitation=load,
        force_centrifugal=centrifugal,
        outputs={"tip": load, "tip_x": tip[0], "tip_y": tip[1], "tip_z": tip[2]},
        basis=_basis(full, kept, interior, shapes) if options.store_basis else None,
        n_blades=sector.n_blades,
        producer=f"shroud: {made_of}",
    )


def _interior_nodes(full: FullModel, kept: KeptDofs) -> NDArray[np.int64]:
    """Nodes (i,) that are neither kept nor clamped."""
    inside = np.ones(len(full.positions), dtype=bool)
    inside[kept.nodes] = False
    inside[full.fixed // 3] = False
    return np.flatnonzero(inside)


def _reduced_matrices(
    full: FullModel, kept: KeptDofs, interior: NDArray[np.int64], options: ReductionOptions
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], str]:
    """Stiffness (n, n), mass (n, n), interior rows (3i, n) of the basis, name of the factorisation."""
    k_ii, k_ib, k_bb = _partition(full.stiffness, interior, kept)
    m_ii, m_ib, m_bb = _partition(full.mass, interior, kept)
    factor = factorise(k_ii, options.backend)
    if options.frequency_limit is not None:
        angular, modes = modes_up_to(k_ii, m_ii, factor, options.frequency_limit)
    else:
        angular, modes = lowest_modes(k_ii, m_ii, factor, int(options.modes or 0))
    constraint = -factor.solve(k_ib)
    loaded = m_ib + m_ii @ constraint
    b, n = kept.size, kept.size + len(angular)
    stiffness, mass = np.zeros((n, n)), np.eye(n)
    stiffness[:b, :b] = _symmetric(k_bb + k_ib.T @ constraint)
    stiffness[b:, b:] = np.diag(angular**2)
    mass[:b, :b] = _symmetric(m_bb + m_ib.T @ constraint + constraint.T @ loaded)
    mass[:b, b:] = loaded.T @ modes
    mass[b:, :b] = mass[:b, b:].T
    return stiffness, mass, np.hstack([constraint, modes]), factor.backend


def _partition(
    matrix: csr_matrix, interior: NDArray[np.int64], kept: KeptDofs
) -> tuple[csr_matrix, NDArray[np.float64], NDArray[np.float64]]:
    """Blocks (interior, interior) sparse, (interior, kept) and (kept, kept) dense, kept dofs in their frames."""
    inside, dofs, rotation = node_dofs(interior).ravel(), kept.dofs, kept.rotation
    rows = matrix[inside]
    corner = rotation @ matrix[dofs][:, dofs].toarray() @ rotation.T
    return rows[:, inside], rows[:, dofs].toarray() @ rotation.T, corner


def _basis(
    full: FullModel, kept: KeptDofs, interior: NDArray[np.int64], shapes: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mesh displacements (N, n) of the reduced coordinates; zero on the clamped root."""
    basis = np.zeros((full.n_dofs, shapes.shape[1]))
    basis[node_dofs(interior).ravel()] = shapes
    basis[kept.dofs, : kept.size] = kept.rotation.T
    return basis


def _symmetric(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Half the sum of a matrix and its transpose: takes away round-off."""
    return 0.5 * (matrix + matrix.T)


def _unit_vector(direction: ArrayLike) -> NDArray[np.float64]:
    """Direction (3,) scaled to length 1."""
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)) or not np.any(vector):
        raise RomParameterError("excitation", "direction", direction, "must be three finite numbers, not all 0")
    return vector / np.linalg.norm(vector)
