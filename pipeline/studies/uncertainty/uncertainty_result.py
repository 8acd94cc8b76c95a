"""What the study `uncertainty` found: plain frozen data, as in uncertainty.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.marginal import Marginal
from pipeline.studies.uncertainty.first_order import FirstOrder
from pipeline.studies.uncertainty.polynomial_chaos import PolynomialChaos
from pipeline.studies.uncertainty.quantiles import Estimate
from pipeline.studies.uncertainty.sobol_indices import SobolIndex


@dataclass(frozen=True)
class Spread:
    """Distribution of a quantity over the samples.

    Attributes
    ----------
    mean, deviation : float
        Mean and standard deviation.
    quantiles : tuple of Estimate
        At the levels of the result.
    """

    mean: float
    deviation: float
    quantiles: tuple[Estimate, ...]


@dataclass(frozen=True)
class Convergence:
    """Quantiles from the first samples only.

    Attributes
    ----------
    samples : int
        Number of samples.
    amplitude, frequency : tuple of Estimate
        Quantiles of the worst amplitude, m, and of its frequency, Hz, at the levels 0.05, 0.5 and 0.95.
    """

    samples: int
    amplitude: tuple[Estimate, ...]
    frequency: tuple[Estimate, ...]


@dataclass(frozen=True)
class Centre:
    """The worst motion with every parameter at the centre of its distribution.

    Attributes
    ----------
    values : mapping of str to float
        The parameters.
    amplitude_m, frequency_hz : float
        The worst motion.
    branch : int
        Its branch, 0 is the main one.
    motion : str
        "periodic" or "quasi-periodic".
    """

    values: Mapping[str, float]
    amplitude_m: float
    frequency_hz: float
    branch: int
    motion: str


@dataclass(frozen=True)
class ResidualBand:
    """Lowest and highest peak of the main branch over all residual tractions, at the centre of the distributions.

    Attributes
    ----------
    lowest_m, highest_m : float
        Largest displacements as a whole, m.
    lowest_hz, highest_hz : float
        Their frequencies, Hz.
    """

    lowest_m: float
    lowest_hz: float
    highest_m: float
    highest_hz: float


@dataclass(frozen=True)
class UncertaintyResult:
    """Distribution of the worst motion for uncertain parameters.

    Attributes
    ----------
    samples : int
        Number n of samples.
    seed : int
        Seed of the quasi-random numbers.
    curves : int
        Curves that the study is made of, those of the sensitivities included.
    marginals : tuple of Marginal
        Distributions of the parameters.
    values : mapping of str to (n,) float
        The sampled values of each parameter.
    amplitude_m, frequency_hz : (n,) float
        The worst motion of each sample; NaN without a curve.
    lower_bound : (n,) bool
        Whether the worst motion of the sample may be higher: its curve is incomplete or its search left something
        open.
    branch : (n,) int
        Branch of the worst motion, 0 is the main one; -1: on no branch found, or not known.
    periodic : (n,) bool
        Whether the worst motion is periodic.
    missing, incomplete, unresolved : int
        Samples without a curve, with an incomplete one, and whose search for the worst motion left something open.
    levels : tuple of float
        Levels of the quantiles.
    amplitude, frequency : Spread
        Distribution of the worst amplitude, m, and of its frequency, Hz.
    convergence : tuple of Convergence
        Quantiles from the first eighth, quarter and half of the samples and from all.
    limit_m : float or None
        The given limit of the amplitude.
    exceedance : Estimate or None
        The probability that the worst amplitude exceeds the limit.
    centre : Centre or None
        The worst motion at the centre of the distributions; None without a curve.
    first_order : FirstOrder or None
        The linear answer from derivatives at the centre; None where there are none.
    residual : ResidualBand or None
        What friction leaves open at the centre; None where it leaves nothing open.
    polynomial, frequency_polynomial : PolynomialChaos or None
        Sensitivities and quantiles of the amplitude, m, and of the frequency, Hz, from a polynomial through the
        samples; None where they do not vary.
    sobol : tuple of SobolIndex
        Sensitivities from samples of their own; empty where they were not asked for.
    message : str
        One line that says what was found.
    remarks : tuple of str
        What qualifies the numbers.
    at_end : int
        Samples whose worst motion lies at an end of the frequency range: lower bounds.
    truncation_error : (n,) float
        Estimated relative error of each amplitude by neglected harmonics; NaN without an estimate.
    """

    samples: int
    seed: int
    curves: int
    marginals: tuple[Marginal, ...]
    values: Mapping[str, tuple[float, ...]]
    amplitude_m: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    lower_bound: NDArray[np.bool_]
    branch: NDArray[np.int64]
    periodic: NDArray[np.bool_]
    missing: int
    incomplete: int
    unresolved: int
    levels: tuple[float, ...]
    amplitude: Spread
    frequency: Spread
    convergence: tuple[Convergence, ...]
    limit_m: float | None
    exceedance: Estimate | None
    centre: Centre | None
    first_order: FirstOrder | None
    residual: ResidualBand | None
    polynomial: PolynomialChaos | None
    frequency_polynomial: PolynomialChaos | None
    sobol: tuple[SobolIndex, ...]
    message: str
    remarks: tuple[str, ...]
    at_end: int = 0
    truncation_error: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
