"""As many fixed-interface modes as a tolerance needs, from what is known exactly of those left out.

Every reduced model with fewer modes than are at hand is a part of the enriched model (rom/enrichment.py), and is
measured against it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rom.checks import require_between
from rom.cyclic.reduced_model import ReducedModel
from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_selection import unit_vector
from rom.reduction.craig_bampton import Reduction, craig_bampton_model, reach
from rom.reduction.fixed_interface_modes import lowest_modes
from rom.reduction.model_comparison import (
    LinearError,
    LinearOperation,
    LinearResponse,
    linear_errors,
    linear_responses,
)
from rom.reduction.residual_modes import augmented_model, residual_vectors
from rom.reduction.substructure import split

if TYPE_CHECKING:
    from geometry import SectorMesh

_FIRST_GUESS = 30
_MOST_MODES = 1000
_BEYOND = 1.5  # the modes at hand reach to this many times the highest frequency of the range
_LEAST_GROWTH, _MOST_GROWTH = 1.25, 4.0


@dataclass(frozen=True)
class _Ladder:
    """All reduced models with up to as many modes as were computed, and the answers they are measured against."""

    enriched: ReducedModel
    kept: int
    exact: tuple[tuple[LinearOperation, tuple[LinearResponse, ...]], ...]

    def error(self, modes: int) -> float:
        """Largest relative error of frequencies and receptances with so many modes."""
        model = _first_coordinates(self.enriched, self.kept + modes)
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
    *,
    excitation_direction: ArrayLike = (0.0, 1.0, 0.0),
    excitation_at: str | ArrayLike = "tip",
    store_basis: bool = True,
    backend: str = "auto",
    contact_dofs: str = "nodal",
) -> Reduction:
    """Reduce the full model of a sector with the fewest fixed-interface modes that stay within a tolerance.

    tolerance: largest relative error of the natural frequencies in the range and of the receptances of contact nodes
    and output over it, with free, sliding and stuck joints (`LinearError`), in each of the operations.
    full as in `reduction`; excitation_direction, excitation_at as in `reduce`; store_basis, backend, contact_dofs as
    in `ReductionOptions`.
    Raises RomParameterError for a tolerance that is not between 0 and 1 or that 1000 modes do not reach.
    """
    require_between("rom", "tolerance", tolerance, 0.0, 1.0, "must be a number above 0 and below 1")
    direction = unit_vector(excitation_direction)
    parts = split(full, sector, excitation_at, backend, contact_dofs)
    residual = residual_vectors(parts)
    highest = max(operation.frequency_hz[1] for operation in operations)
    count = _FIRST_GUESS
    while True:
        angular, shapes = lowest_modes(parts.inner_mass, parts.factor, count)
        if len(angular) == count and angular[-1] < 2.0 * np.pi * _BEYOND * highest:
            # what is left out must lie above the range for its sum at low frequencies to stand for it
            if count >= _MOST_MODES:
                raise RomParameterError("response", "frequency", highest, f"a range below {count} modes of the blade")
            count = min(2 * count, _MOST_MODES)
            continue
        enriched = augmented_model(sector, parts, residual, angular, shapes, direction)
        exact = tuple((operation, linear_responses(enriched, operation)) for operation in operations)
        ladder = _Ladder(enriched, parts.kept.size, exact)
        modes, error = _fewest(ladder, tolerance, len(angular))
        if error <= tolerance:
            break
        if len(angular) < count or count >= _MOST_MODES:
            allowed = f"a larger number: {len(angular)} modes leave an error of {error:.2g} in response.frequency"
            raise RomParameterError("rom", "tolerance", tolerance, allowed)
        count = min(_next_count(ladder, count, error / tolerance), _MOST_MODES)
    model = craig_bampton_model(sector, parts, angular[:modes], shapes[:, :modes], direction, store_basis)
    return Reduction(model, modes, parts.n_dofs, error, enriched, reach(angular))


def reduction_errors(
    model: ReducedModel, enriched: ReducedModel, highest_mode_hz: float, operation: LinearOperation
) -> tuple[LinearError, ...] | None:
    """Estimated errors of a reduced model in an operation by the modes left out, for each joint.

    model, enriched, highest_mode_hz: of a `Reduction`. None where modes that were left out may lie in the range, so that
    their sum at low frequencies does not stand for them.
    """
    if highest_mode_hz < _BEYOND * operation.frequency_hz[1]:
        return None
    exact = linear_responses(enriched, operation)
    return linear_errors(linear_responses(model, operation, exact), exact, operation.frequency_hz)


def _fewest(ladder: _Ladder, tolerance: float, most: int) -> tuple[int, float]:
    """Fewest modes within the tolerance and their error, by bisection; the `most` of them where all are too few."""
    enough, error = most, ladder.error(most)
    too_few = 0
    while error <= tolerance and enough - too_few > 1:
        middle = (enough + too_few) // 2
        smaller = ladder.error(middle)
        if smaller <= tolerance:
            enough, error = middle, smaller
        else:
            too_few = middle
    return enough, error


def _next_count(ladder: _Ladder, count: int, excess: float) -> int:
    """Modes to try where `count` of them leave `excess` times the tolerance, by the rate at which they got so far."""
    half = count // 2
    rate = np.log(max(ladder.error(half) / ladder.error(count), 1.1)) / np.log(count / half)
    growth = float(np.clip(1.1 * excess ** (1.0 / rate), _LEAST_GROWTH, _MOST_GROWTH))
    return int(np.ceil(growth * count))


def _first_coordinates(model: ReducedModel, count: int) -> ReducedModel:
    """The model with its first `count` coordinates only, the others held at 0."""
    assert model.contact_left is not None  # a blade has both faces
    return replace(
        model,
        mass=model.mass[:count, :count],
        stiffness=model.stiffness[:count, :count],
        contact_right=model.contact_right[:, :count],
        contact_left=model.contact_left[:, :count],
        force_excitation=model.force_excitation[:count],
        outputs={name: vector[:count] for name, vector in model.outputs.items()},
    )
