"""What the study `mistuning` found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class SampledRing:
    """The nonlinear response of one mistuned ring.

    Attributes
    ----------
    seed : int
        Seed of its deviations.
    frequency_hz, amplitude_m : float
        The highest amplitude of any blade, and its frequency; NaN without a solution.
    blade : int
        Number of that blade, from 0.
    factor : float
        Amplification factor: this amplitude over the tuned peak.
    points : int
        Solved points.
    complete : bool
        Whether the curve spans the range.
    message : str
        How the curve ended.
    seconds : float
        What it took, s.
    """

    seed: int
    frequency_hz: float
    amplitude_m: float
    blade: int
    factor: float
    points: int
    complete: bool
    message: str
    seconds: float


@dataclass(frozen=True)
class RingCurve:
    """The curve of the ring with the highest amplitude.

    Attributes
    ----------
    seed : int
        Seed of its deviations.
    frequency_hz, envelope_m : (P,) array
        Frequency, and largest amplitude of any blade.
    blade_amplitude_m, peak_m : (N_b,) array
        Amplitudes of all blades at the highest one, and the largest amplitude that each blade reaches anywhere.
    frequency_deviation : (N_b,) array
        Relative deviations of the natural frequencies of the blades.
    """

    seed: int
    frequency_hz: Numbers
    envelope_m: Numbers
    blade_amplitude_m: Numbers
    peak_m: Numbers
    frequency_deviation: Numbers


@dataclass(frozen=True)
class TunedCurve:
    """The response of the tuned ring with the same harmonics.

    Attributes
    ----------
    frequency_hz, amplitude_m : (P,) array
        Frequency and amplitude of the vibration about its mean.
    peak_hz, peak_m : float
        Its highest amplitude.
    complete : bool
        Whether it spans the range.
    """

    frequency_hz: Numbers
    amplitude_m: Numbers
    peak_hz: float
    peak_m: float
    complete: bool


@dataclass(frozen=True)
class FactorQuantile:
    """A quantile of the amplification factor over rings.

    Attributes
    ----------
    level : float
        Probability of a smaller factor.
    value : float
        Quantile of the samples.
    low, high : float or None
        Ends of the interval that holds that of all rings with a probability of 95 % or more; None: the samples do not
        tell.
    """

    level: float
    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class LinearRings:
    """Rings with linear contacts.

    Attributes
    ----------
    state : str
        "stuck" or "free".
    tuned_hz, tuned_m : float
        Peak of the tuned ring.
    factor : (S,) array
        Amplification factors of the rings.
    quantiles : tuple of FactorQuantile
        Their quantiles.
    seconds : float
        What they took, s.
    """

    state: str
    tuned_hz: float
    tuned_m: float
    factor: Numbers
    quantiles: tuple[FactorQuantile, ...]
    seconds: float


@dataclass(frozen=True)
class MistuningResult:
    """Responses of mistuned rings.

    Attributes
    ----------
    n_blades, engine_order, harmonics : int
        Blades of the ring, engine order and number of harmonics.
    output : str
        Name of the output.
    drawn : bool
        Whether the deviations were drawn at random.
    bound : float
        Whitehead's bound of the factor of a linear ring, (1 + sqrt N_b) / 2.
    tuned : TunedCurve
        The tuned ring.
    rings : tuple of SampledRing
        The mistuned rings, in the order of their seeds.
    quantiles : tuple of FactorQuantile
        Quantiles of their factors.
    highest : RingCurve
        The ring with the highest amplitude.
    linear : LinearRings or None
        Rings with linear contacts; None where none were asked for.
    """

    n_blades: int
    engine_order: int
    harmonics: int
    output: str
    drawn: bool
    bound: float
    tuned: TunedCurve
    rings: tuple[SampledRing, ...]
    quantiles: tuple[FactorQuantile, ...]
    highest: RingCurve
    linear: LinearRings | None
