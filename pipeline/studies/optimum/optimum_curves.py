"""The worst motion over one key of a scene, as figure and report show it: in the unit of the key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from nonlinear import Optimum, PeakCurve, SolvedResponse, WorstEnvelope


@dataclass(frozen=True)
class OwnMotion:
    """The worst motion at the value that the scene has.

    Attributes
    ----------
    value : float
        The key in the scene, in its unit.
    amplitude_m, frequency_hz : float
        The worst motion there, m and Hz; NaN where it is not known.
    """

    value: float
    amplitude_m: float
    frequency_hz: float


@dataclass(frozen=True)
class OptimumCurves:
    """An optimum over one key of a scene with all that was followed and solved; values in the unit of the key.

    Attributes
    ----------
    key : str
        Dotted key.
    value, amplitude_m, frequency_hz : float
        The key at the optimum, and the worst motion there, m and Hz.
    kind : str
        Kind of the optimum, as of `nonlinear.Optimum`.
    within : (float, float)
        Range of the key around it in which the worst motion is at most 10 % higher.
    own : OwnMotion or None
        The value of the scene; None where it lies outside of the range, or is not known.
    envelope : WorstEnvelope
        The worst motion over the key.
    peaks : tuple of PeakCurve
        The peaks followed.
    responses : tuple of SolvedResponse
        The responses solved.
    elasticities : mapping of str to float
        Relative derivatives of the worst motion at the optimum by dotted keys, in % per %.
    """

    key: str
    value: float
    amplitude_m: float
    frequency_hz: float
    kind: str
    within: tuple[float, float]
    own: OwnMotion | None
    envelope: WorstEnvelope
    peaks: tuple[PeakCurve, ...]
    responses: tuple[SolvedResponse, ...]
    elasticities: Mapping[str, float]


def optimum_curves(found: Optimum, keys: Mapping[str, str], factor: float, own_value: float) -> OptimumCurves:
    """What to show of an optimum.

    Parameters
    ----------
    found : Optimum
        The optimum.
    keys : mapping of str to str
        Dotted keys by the names of the parameters of `nonlinear`.
    factor : float
        Value of the key for each unit of the parameter: a stiffness of the scene is that of the whole face.
    own_value : float
        The key in the scene; NaN where it has no single one.
    """
    return OptimumCurves(
        key=keys[found.name],
        value=found.value * factor,
        amplitude_m=found.amplitude_m,
        frequency_hz=found.frequency_hz,
        kind=found.kind,
        within=(found.within[0] * factor, found.within[1] * factor),
        own=_own(found.envelope, own_value, factor),
        envelope=replace(found.envelope, value=found.envelope.value * factor),
        peaks=tuple(replace(each, value=each.value * factor, slope=each.slope / factor) for each in found.curves),
        responses=tuple(replace(each, value=each.value * factor) for each in found.responses),
        elasticities={keys[name]: size for name, size in found.elasticities.items()},
    )


def _own(envelope: WorstEnvelope, value: float, factor: float) -> OwnMotion | None:
    """The worst motion at a value of the key, from the envelope."""
    place = value / factor
    amplitude = float(envelope.at(np.array([place]))[0])
    if not np.isfinite(amplitude):
        return None
    known = np.isfinite(envelope.frequency_hz)
    return OwnMotion(value, amplitude, float(np.interp(place, envelope.value[known], envelope.frequency_hz[known])))
