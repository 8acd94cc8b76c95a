"""What the study `uncertainty` found: plain frozen data, as in uncertainty.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.uncertainty.quantiles import Estimate
from pipeline.studies.uncertainty.section import Marginal
from pipeline.studies.uncertainty.sensitivities import FirstOrder, PolynomialChaos, SobolIndex


@dataclass(frozen=True)
class Spread:
    """Distribution of a quantity over the samples."""

    # `mean`, `deviation`: mean and standard deviation
    mean: float
    deviation: float
    quantiles: tuple[Estimate, ...]  # at the levels of the result


@dataclass(frozen=True)
class Convergence:
    """Quantiles from the first samples only."""

    samples: int  # number of samples
    # quantiles of the worst amplitude, m, and of its frequency, Hz, at the levels 0.05, 0.5 and 0.95
    amplitude: tuple[Estimate, ...]
    # quantiles of the worst amplitude, m, and of its frequency, Hz, at the levels 0.05, 0.5 and 0.95
    frequency: tuple[Estimate, ...]


@dataclass(frozen=True)
class Centre:
    """The worst motion with every parameter at the centre of its distribution."""

    values: Mapping[str, float]  # the parameters
    # `amplitude_m`, `frequency_hz`: the worst motion
    amplitude_m: float
    frequency_hz: float
    branch: int  # its branch, 0 is the main one
    motion: str  # "periodic" or "quasi-periodic"


@dataclass(frozen=True)
class ResidualBand:
    """Lowest and highest peak of the main branch over all residual tractions, at the centre of the distributions."""

    lowest_m: float  # largest displacements as a whole, m
    lowest_hz: float  # their frequencies, Hz
    highest_m: float  # largest displacements as a whole, m
    highest_hz: float  # their frequencies, Hz


@dataclass(frozen=True)
class UncertaintyResult:
    """Distribution of the worst motion for uncertain parameters."""

    samples: int  # number n of samples
    seed: int  # seed of the quasi-random numbers
    curves: int  # curves that the study is made of, those of the sensitivities included
    marginals: tuple[Marginal, ...]  # distributions of the parameters
    values: Mapping[str, tuple[float, ...]]  # (n,), the sampled values of each parameter
    # `amplitude_m`, `frequency_hz`: (n,), the worst motion of each sample; NaN without a curve
    amplitude_m: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    # (n,), whether the worst motion of the sample may be higher: its curve is incomplete or its search left something
    # open
    lower_bound: NDArray[np.bool_]
    # (n,), branch of the worst motion, 0 is the main one; -1: on no branch found, or not known
    branch: NDArray[np.int64]
    periodic: NDArray[np.bool_]  # (n,), whether the worst motion is periodic
    # samples without a curve, with an incomplete one, and whose search for the worst motion left something open
    missing: int
    # samples without a curve, with an incomplete one, and whose search for the worst motion left something open
    incomplete: int
    # samples without a curve, with an incomplete one, and whose search for the worst motion left something open
    unresolved: int
    levels: tuple[float, ...]  # levels of the quantiles
    # `amplitude`, `frequency`: distribution of the worst amplitude, m, and of its frequency, Hz
    amplitude: Spread
    frequency: Spread
    # quantiles from the first eighth, quarter and half of the samples and from all
    convergence: tuple[Convergence, ...]
    limit_m: float | None  # the given limit of the amplitude
    exceedance: Estimate | None  # the probability that the worst amplitude exceeds the limit
    centre: Centre | None  # the worst motion at the centre of the distributions; None without a curve
    first_order: FirstOrder | None  # the linear answer from derivatives at the centre; None where there are none
    residual: ResidualBand | None  # what friction leaves open at the centre; None where it leaves nothing open
    # sensitivities and quantiles of the amplitude, m, and of the frequency, Hz, from a polynomial through the
    # samples; None where they do not vary
    polynomial: PolynomialChaos | None
    # sensitivities and quantiles of the amplitude, m, and of the frequency, Hz, from a polynomial through the
    # samples; None where they do not vary
    frequency_polynomial: PolynomialChaos | None
    sobol: tuple[SobolIndex, ...]  # sensitivities from samples of their own; empty where they were not asked for
    message: str  # one line that says what was found
    remarks: tuple[str, ...]  # what qualifies the numbers
    at_end: int = 0  # samples whose worst motion lies at an end of the frequency range: lower bounds
    # (n,), estimated relative error of each amplitude by neglected harmonics; NaN without an estimate
    truncation_error: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    correlation: tuple[tuple[float, ...], ...] = ()  # of the parameters; empty: independent
