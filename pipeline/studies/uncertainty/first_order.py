"""The first-order answer: a linear model from the derivatives of the worst motion at the centre of the distributions.

    A(p) = A(c) + sum_i dA/dp_i (p_i - c_i)

Its mean and deviation follow from those of the parameters, its quantiles from values of the model alone. No curve is
solved for it. It knows nothing of kinks, of an exchange of peaks or of isolated branches.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.marginal import Marginal
from pipeline.studies.uncertainty.quantiles import quantile
from pipeline.studies.uncertainty.samples import POINTS, unit_points

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FirstOrderTerm:
    """What one parameter contributes to first order."""

    key: str  # dotted key of the parameter
    amplitude_rate: float  # derivatives of the worst amplitude, m, and of its frequency, Hz, per unit of the key
    frequency_rate: float  # derivatives of the worst amplitude, m, and of its frequency, Hz, per unit of the key
    amplitude_deviation: float  # their products with the standard deviation of the parameter, with their signs
    frequency_deviation: float  # their products with the standard deviation of the parameter, with their signs


@dataclass(frozen=True)
class LinearSpread:
    """Distribution of a quantity by the linear model."""

    mean: float  # mean and standard deviation
    deviation: float  # mean and standard deviation
    quantiles: tuple[float, ...]  # at the levels of the result


@dataclass(frozen=True)
class FirstOrder:
    """The linear model of the worst motion."""

    terms: tuple[FirstOrderTerm, ...]  # one for each parameter
    amplitude: LinearSpread  # distribution of amplitude, m, and frequency, Hz
    frequency: LinearSpread  # distribution of amplitude, m, and frequency, Hz


def first_order(
    marginals: Sequence[Marginal],
    peak: tuple[float, float],
    rates: Mapping[str, tuple[float, float]],
    levels: Sequence[float],
    seed: int,
) -> FirstOrder:
    """The linear model at the centre of the distributions."""
    moments = [marginal.moments for marginal in marginals]
    terms = tuple(
        FirstOrderTerm(m.key, *rates[m.key], rates[m.key][0] * deviation, rates[m.key][1] * deviation)
        for m, (_, deviation) in zip(marginals, moments, strict=True)
    )
    values = linear_values(marginals, terms, peak, seed)
    shifts = np.array([mean - m.centre for m, (mean, _) in zip(marginals, moments, strict=True)])
    spreads = []
    for quantity in range(2):
        slopes = np.array([rates[m.key][quantity] for m in marginals])
        parts = [slope * deviation for slope, (_, deviation) in zip(slopes, moments, strict=True)]
        quantiles = tuple(quantile(values[:, quantity], level).value for level in levels)
        mean = peak[quantity] + float(slopes @ shifts)
        spreads.append(LinearSpread(mean, float(np.linalg.norm(parts)), quantiles))
    return FirstOrder(terms, *spreads)


def linear_values(
    marginals: Sequence[Marginal], terms: Sequence[FirstOrderTerm], peak: tuple[float, float], seed: int
) -> Array:
    """Amplitude, m, and frequency, Hz, of the linear model at `POINTS` points of equal probability, (points, 2)."""
    points = unit_points(POINTS, len(marginals), seed)
    moved = np.column_stack([m.quantile(points[:, k]) - m.centre for k, m in enumerate(marginals)])
    slopes = np.array([[term.amplitude_rate, term.frequency_rate] for term in terms])
    return np.asarray(np.array(peak) + moved @ slopes)
