"""What was followed and solved in the search for an optimum over one key, in the unit of the key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pipeline.scene.optimum_checks import SOLVER_KEYS

if TYPE_CHECKING:
    from nonlinear import PeakCurve, SolvedResponse, WorstEnvelope
    from pipeline.studies.optimum.optimum_result import OptimumResult


@dataclass(frozen=True)
class OptimumCurves:
    """The worst motion over one key; values in the unit of the key."""

    key: str  # dotted key
    envelope: WorstEnvelope  # the worst motion
    peaks: tuple[PeakCurve, ...]  # the peaks followed
    responses: tuple[SolvedResponse, ...]  # the responses solved
    # relative derivatives of the worst motion at the optimum by dotted keys, in % per %; those of parameters that are
    # 0 are left out, and all where it is no followed peak
    elasticities: Mapping[str, float]


def optimum_curves(result: OptimumResult) -> OptimumCurves | None:
    """What there is to show of an optimum; None where no peaks were followed."""
    found, factor = result.search, result.per_unit
    if found is None:
        return None
    return OptimumCurves(
        key=next(key for key, name in SOLVER_KEYS.items() if name == found.name),
        envelope=replace(found.envelope, value=found.envelope.value * factor),
        peaks=tuple(replace(each, value=each.value * factor, slope=each.slope / factor) for each in found.curves),
        responses=tuple(replace(each, value=each.value * factor) for each in found.responses),
        elasticities=elasticities_of(result),
    )


def elasticities_of(result: OptimumResult) -> dict[str, float]:
    """Relative derivatives of the worst motion by dotted keys, in % per %, without parameters that are 0."""
    found = result.search if result.search is not None else result.joint
    keys = {name: key for key, name in SOLVER_KEYS.items()}
    return {} if found is None else {keys[name]: size for name, size in found.elasticities.items() if size != 0.0}
