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
    """What one parameter contributes to first order.

    Attributes
    ----------
    key : str
        Dotted key of the parameter.
    amplitude_rate, frequency_rate : float
        Derivatives of the worst amplitude, m, and of its frequency, Hz, per unit of the key.
    amplitude_deviation, frequency_deviation : float
        Their products with the standard deviation of the parameter, with their signs.
    """

    key: str
    amplitude_rate: float
    frequency_rate: float
    amplitude_deviation: float
    frequency_deviation: float


@dataclass(frozen=True)
class LinearSpread:
    """Distribution of a quantity by the linear model.

    Attributes
    ----------
    mean, deviation : float
        Mean and standard deviation.
    quantiles : tuple of float
        At the levels of the result.
    """

    mean: float
    deviation: float
    quantiles: tuple[float, ...]


@dataclass(frozen=True)
class FirstOrder:
    """The linear model of the worst motion.

    Attributes
    ----------
    terms : tuple of FirstOrderTerm
        One for each parameter.
    amplitude, frequency : LinearSpread
        Distribution of amplitude, m, and frequency, Hz.
    """

    terms: tuple[FirstOrderTerm, ...]
    amplitude: LinearSpread
    frequency: LinearSpread


def first_order(
    marginals: Sequence[Marginal],
    peak: tuple[float, float],
    rates: Mapping[str, tuple[float, float]],
    levels: Sequence[float],
    seed: int,
) -> FirstOrder:
    """The linear model at the centre of the distributions.

    Parameters
    ----------
    marginals : sequence of Marginal
        Distributions of the parameters.
    peak : (float, float)
        Worst amplitude, m, and its frequency, Hz, at the centre.
    rates : mapping of str to (float, float)
        Derivatives of both with respect to each parameter, per unit of its key.
    levels : sequence of float
        Levels of the quantiles.
    seed : int
        Seed of the points at which the model is evaluated.
    """
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
    """Amplitude, m, and frequency, Hz, of the linear model at `POINTS` points of equal probability, (points, 2).

    Parameters
    ----------
    marginals : sequence of Marginal
        Distributions of the parameters.
    terms : sequence of FirstOrderTerm
        Derivatives, in the order of the parameters.
    peak : (float, float)
        Amplitude, m, and frequency, Hz, at the centre.
    seed : int
        Seed of the points.
    """
    points = unit_points(POINTS, len(marginals), seed)
    moved = np.column_stack([m.quantile(points[:, k]) - m.centre for k, m in enumerate(marginals)])
    slopes = np.array([[term.amplitude_rate, term.frequency_rate] for term in terms])
    return np.asarray(np.array(peak) + moved @ slopes)
