"""What the study `optimum` found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OptimumResult:
    """Values of keys of a scene at which its worst motion is lowest.

    Attributes
    ----------
    ranges : mapping of str to (float, float)
        The keys with their ranges, in the units of the scene.
    values : mapping of str to float
        Their values at the optimum.
    amplitude_m, frequency_hz : float
        The worst motion there, m and Hz.
    kind : str
        "smooth", "kink", "edge" or "flat", as of `nonlinear.Optimum`.
    curvature : float
        Second derivative of the amplitude by the key at a smooth minimum, m per unit squared; NaN else.
    within : mapping of str to (float, float)
        Range of each key around the optimum in which the worst motion is at most 10 % higher.
    derivatives : mapping of str to float
        Derivatives of the amplitude with respect to keys of contact, load and damping, m per unit.
    message : str
        One line that says what was found.
    """

    ranges: Mapping[str, tuple[float, float]]
    values: Mapping[str, float]
    amplitude_m: float
    frequency_hz: float
    kind: str
    curvature: float
    within: Mapping[str, tuple[float, float]]
    derivatives: Mapping[str, float]
    message: str
