"""As few fixed-interface modes as a tolerance allows, by an exact estimate of the modal truncation error.

Every reduced model with fewer modes than were computed is a part of the augmented model (`residual_modes`), and is
measured against it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rom.cyclic.reduced_model import ReducedModel
from rom.errors import RomParameterError, require_between
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import AT_TIP, BoundaryChoice
from rom.reduction.craig_bampton import Reduction, augmented_model, craig_bampton_model, residual_vectors
from rom.reduction.fixed_interface_modes import ModalBasis, lowest_modes
from rom.reduction.model_comparison import (
    LinearError,
    LinearOperation,
    LinearResponse,
    linear_errors,
    linear_responses,
)
from rom.reduction.substructure import Substructure, partition_at_boundary

if TYPE_CHECKING:
    from geometry.sector import SectorMesh

_FIRST_GUESS = 30
_MOST_MODES = 1000
_BEYOND = 1.5  # highest mode computed over the highest frequency of the range, at least
_LEAST_GROWTH, _MOST_GROWTH = 1.25, 4.0


@dataclass(frozen=True)
class _NestedModels:
    """All reduced models with up to as many modes as were computed, and the responses they are measured against.

    The first `boundary` coordinates of the augmented model are boundary dofs, the next ones fixed-interface modes.
    """

    augmented: ReducedModel
    boundary: int
    exact: tuple[tuple[LinearOperation, tuple[LinearResponse, ...]], ...]

    def error(self, modes: int) -> float:
        """Largest relative error of frequencies and receptances with so many modes."""
        model = _first_coordinates(self.augmented, self.boundary + modes)
        worst = 0.0
        for operation, exact in self.exact:
            found = linear_responses(model, operation, exact)
            worst = max(worst, *(error.worst for error in linear_errors(found, exact, operation.frequency_hz)))
        return worst


@one_blas_thread()
def reduce_to_tolerance(
    full: FullModel | Callable[[], FullModel],
    sector: SectorMesh,
    tolerance: float,
    operations: Sequence[LinearOperation],
    boundary: BoundaryChoice = AT_TIP,
    *,
    store_basis: bool = True,
) -> Reduction:
    """Reduce a sector with the fewest fixed-interface modes whose truncation error stays within a tolerance."""
    require_between("rom", "tolerance", tolerance, 0.0, 1.0, "must be a number above 0 and below 1")
    parts = partition_at_boundary(full, sector, boundary)
    residual = residual_vectors(parts)
    highest = max(operation.frequency_hz[1] for operation in operations)
    count = _FIRST_GUESS
    while True:
        modes, count = _modes_beyond(parts, highest, count)
        augmented = augmented_model(parts, modes, residual)
        exact = tuple((operation, linear_responses(augmented, operation)) for operation in operations)
        models = _NestedModels(augmented, parts.boundary.size, exact)
        number, error = _fewest(models, tolerance, len(modes))
        if error <= tolerance:
            break
        if len(modes) < count or count >= _MOST_MODES:
            allowed = f"a larger number: {len(modes)} modes leave an error of {error:.2g} in response.frequency"
            raise RomParameterError("rom", "tolerance", tolerance, allowed)
        count = min(_next_count(models, count, error / tolerance), _MOST_MODES)
    model = craig_bampton_model(parts, modes.first(number), store_basis)
    return Reduction(model, number, parts.n_dofs, error, augmented, modes.highest_hz)


def _modes_beyond(parts: Substructure, highest: float, count: int) -> tuple[ModalBasis, int]:
    """The lowest `count` fixed-interface modes, or more where these end too near to `highest` (Hz), and their count.

    Residual modes stand for the modes left out only if those lie above the range.
    """
    while True:
        modes = lowest_modes(parts.interior_mass, parts.factor, count)
        if len(modes) < count or modes.omega[-1] >= 2.0 * np.pi * _BEYOND * highest:
            return modes, count
        if count >= _MOST_MODES:
            raise RomParameterError("response", "frequency", highest, f"a range below {count} modes of the blade")
        count = min(2 * count, _MOST_MODES)


def reduction_errors(
    model: ReducedModel, augmented: ReducedModel, highest_mode_hz: float, operation: LinearOperation
) -> tuple[LinearError, ...] | None:
    """Estimated modal truncation errors of a reduced model in each contact condition of an operation.

    `highest_mode_hz`: of the same `Reduction`, Hz. Returns one for each contact condition; None where modes that were
    left out may lie in the range, so that residual modes do not stand for them.
    """
    if highest_mode_hz < _BEYOND * operation.frequency_hz[1]:
        return None
    exact = linear_responses(augmented, operation)
    return linear_errors(linear_responses(model, operation, exact), exact, operation.frequency_hz)


def _fewest(models: _NestedModels, tolerance: float, most: int) -> tuple[int, float]:
    """Fewest modes within the tolerance and their error, by bisection; `most` of them where all are too few."""
    enough, error = most, models.error(most)
    too_few = 0
    while error <= tolerance and enough - too_few > 1:
        middle = (enough + too_few) // 2
        smaller = models.error(middle)
        if smaller <= tolerance:
            enough, error = middle, smaller
        else:
            too_few = middle
    return enough, error


def _next_count(models: _NestedModels, count: int, excess: float) -> int:
    """Modes to try where `count` of them leave `excess` times the tolerance, by the rate of convergence so far."""
    half = count // 2
    rate = np.log(max(models.error(half) / models.error(count), 1.1)) / np.log(count / half)
    growth = float(np.clip(1.1 * excess ** (1.0 / rate), _LEAST_GROWTH, _MOST_GROWTH))
    return int(np.ceil(growth * count))


def _first_coordinates(model: ReducedModel, count: int) -> ReducedModel:
    """The model with its first `count` coordinates only, the others held at 0."""
    left = model.contact_left
    return replace(
        model,
        mass=model.mass[:count, :count],
        stiffness=model.stiffness[:count, :count],
        contact_right=model.contact_right[:, :count],
        contact_left=None if left is None else left[:, :count],
        force_excitation=model.force_excitation[:count],
        outputs={name: vector[:count] for name, vector in model.outputs.items()},
        force_harmonics={h: vector[:count] for h, vector in model.force_harmonics.items()},
        force_static=None if model.force_static is None else model.force_static[:count],
        cyclic_right=None if model.cyclic_right is None else model.cyclic_right[:, :count],
        cyclic_left=None if model.cyclic_left is None else model.cyclic_left[:, :count],
    )
