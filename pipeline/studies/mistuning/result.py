"""What the study `mistuning` found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.stages.curve.curve_summary import CurveSummary

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class SampledRing:
    """The nonlinear response of one mistuned ring."""

    seed: int  # seed of its deviations
    # `frequency_hz`, `amplitude_m`: the highest amplitude of any blade, and its frequency; NaN without a solution
    frequency_hz: float
    amplitude_m: float
    blade: int  # number of that blade, from 0
    factor: float  # amplification factor: this amplitude over the tuned peak
    points: int  # solved points
    complete: bool  # whether the curve spans the range
    message: str  # how the curve ended
    seconds: float  # what it took, s


@dataclass(frozen=True)
class RingCurve:
    """The curve of the ring with the highest amplitude."""

    seed: int  # seed of its deviations
    # `frequency_hz`, `envelope_m`: (P,), frequency, and largest amplitude of any blade
    frequency_hz: Numbers
    envelope_m: Numbers
    # (N_b,), amplitudes of all blades at the highest one, and the largest amplitude that each blade reaches anywhere
    blade_amplitude_m: Numbers
    # (N_b,), amplitudes of all blades at the highest one, and the largest amplitude that each blade reaches anywhere
    peak_m: Numbers
    frequency_deviation: Numbers  # (N_b,), relative deviations of the natural frequencies of the blades


@dataclass(frozen=True)
class TunedCurve:
    """The response of the tuned ring with the same harmonics."""

    # `frequency_hz`, `amplitude_m`: (P,), frequency and amplitude of the vibration about its mean
    frequency_hz: Numbers
    amplitude_m: Numbers
    # `peak_hz`, `peak_m`: its highest amplitude
    peak_hz: float
    peak_m: float
    complete: bool  # whether it spans the range


@dataclass(frozen=True)
class FactorQuantile:
    """A quantile of the amplification factor over rings."""

    level: float  # probability of a smaller factor
    value: float  # quantile of the samples
    # ends of the interval that holds that of all rings with a probability of 95 % or more; None: the samples do not
    # tell
    low: float | None
    # ends of the interval that holds that of all rings with a probability of 95 % or more; None: the samples do not
    # tell
    high: float | None


@dataclass(frozen=True)
class LinearRings:
    """Rings with linear contacts."""

    state: str  # "stuck" or "free"
    # `tuned_hz`, `tuned_m`: peak of the tuned ring
    tuned_hz: float
    tuned_m: float
    factor: Numbers  # (S,), amplification factors of the rings
    quantiles: tuple[FactorQuantile, ...]  # their quantiles
    seconds: float  # what they took, s


@dataclass(frozen=True)
class MistuningResult:
    """Responses of mistuned rings."""

    # `n_blades`, `engine_order`, `harmonics`: blades of the ring, engine order and number of harmonics
    n_blades: int
    engine_order: int
    harmonics: int
    output: str  # name of the output
    drawn: bool  # whether the deviations were drawn at random
    bound: float  # whitehead's bound of the factor of a linear ring, (1 + sqrt N_b) / 2
    tuned: TunedCurve  # the tuned ring
    rings: tuple[SampledRing, ...]  # the mistuned rings, in the order of their seeds
    quantiles: tuple[FactorQuantile, ...]  # quantiles of their factors
    highest: RingCurve  # the ring with the highest amplitude
    worst: CurveSummary  # its largest displacements: worst motion, stability, other branches, truncation error
    linear: LinearRings | None  # rings with linear contacts; None where none were asked for
