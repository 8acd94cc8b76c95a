"""The worst motion over one key of a scene with all that was followed and solved, in the unit of the key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from nonlinear import Optimum, PeakCurve, SolvedResponse, WorstEnvelope


@dataclass(frozen=True)
class OptimumCurves:
    """The worst motion over one key; values in the unit of the key.

    Attributes
    ----------
    key : str
        Dotted key.
    envelope : WorstEnvelope
        The worst motion.
    peaks : tuple of PeakCurve
        The peaks followed.
    responses : tuple of SolvedResponse
        The responses solved.
    elasticities : mapping of str to float
        Relative derivatives of the worst motion at the optimum by dotted keys, in % per %; empty where it is no
        followed peak.
    """

    key: str
    envelope: WorstEnvelope
    peaks: tuple[PeakCurve, ...]
    responses: tuple[SolvedResponse, ...]
    elasticities: Mapping[str, float]


def optimum_curves(found: Optimum, keys: Mapping[str, str], factor: float) -> OptimumCurves:
    """What there is to show of an optimum.

    Parameters
    ----------
    found : Optimum
        The optimum.
    keys : mapping of str to str
        Dotted keys by the names of the parameters of `nonlinear`.
    factor : float
        Value of the key for each unit of the parameter: a stiffness of the scene is that of the whole face.
    """
    return OptimumCurves(
        key=keys[found.name],
        envelope=replace(found.envelope, value=found.envelope.value * factor),
        peaks=tuple(replace(each, value=each.value * factor, slope=each.slope / factor) for each in found.curves),
        responses=tuple(replace(each, value=each.value * factor) for each in found.responses),
        elasticities={keys[name]: size for name, size in found.elasticities.items()},
    )
