"""Quasi-random values of the uncertain parameters, and quantiles of a sampled quantity with their confidence.

The samples are independent scramblings of one Sobol sequence. Each of R scramblings is an unbiased sample of its own,
so that their scatter tells the error of everything that is estimated from all of them. Sample i is number i // R of
scrambling i % R: the first n samples are those of a run with n samples, and more samples only add to them.

The error of a quantile is told by probabilities: the share F_r of the samples of scrambling r that lie below the
quantile has, whatever the distribution, no bias, and the scatter of the F_r gives the standard error s of their mean.
The interval

    [Q(p - t s - 1/(2n)), Q(p + t s + 1/(2n))]

is that of Woodruff, with the factor t of Student's distribution. Bounds from order statistics or a bootstrap would
take the samples for independent ones and miss what the quasi-random sequence gains.

References
----------
R. S. Woodruff, "Confidence intervals for medians and other position measures", Journal of the American Statistical
Association 47 (1952) 635-646.
Z. Kaplan, Y. Li, M. K. Nakayama, B. Tuffin, "Randomized quasi-Monte Carlo for quantile estimation", Proc. Winter
Simulation Conference (2019) 428-439.
A. B. Owen, "Scrambled net variance for integrals of smooth functions", The Annals of Statistics 25 (1997) 1541-1562.
A. Saltelli et al., "Variance based sensitivity analysis of model output. Design and estimator for the total
sensitivity index", Computer Physics Communications 181 (2010) 259-270.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.uncertainty.section import Marginal

Array = NDArray[np.float64]
REPLICATES = 8
POINTS = 8192  # at which models that cost nothing are evaluated
_CELL = 2.0**-31  # half of the resolution of the sequence: no number is 0, where a distribution may have no value


def unit_points(count: int, dimensions: int, seed: int) -> Array:
    """Points of the unit cube, (count, dimensions); the first ones are those of any smaller count."""
    from scipy.stats import qmc

    points = np.empty((count, dimensions))
    for replicate in range(REPLICATES):
        generator = np.random.default_rng([seed, replicate])
        sequence = qmc.Sobol(dimensions, scramble=True, rng=generator)
        points[replicate::REPLICATES] = sequence.random(count // REPLICATES) + _CELL
    return points


Correlation = Sequence[Sequence[float]]  # of the normal scores of the parameters; empty: independent


def correlated(points: Array, correlation: Correlation) -> Array:
    """Points of the unit cube (count, d) whose normal scores have a correlation: a Gaussian copula."""
    if not len(correlation):
        return points
    from scipy.special import ndtr, ndtri

    return np.asarray(ndtr(ndtri(points) @ np.linalg.cholesky(np.array(correlation)).T))


def sampled_values(
    marginals: Sequence[Marginal], count: int, seed: int, correlation: Correlation = ()
) -> tuple[Array, Array]:
    """Two independent samples A and B of the parameters, each (count, d), in the units of the keys."""
    d = len(marginals)
    points = unit_points(count, 2 * d, seed)
    parts = (correlated(part, correlation) for part in (points[:, :d], points[:, d:]))
    first, second = (np.column_stack([m.quantile(part[:, k]) for k, m in enumerate(marginals)]) for part in parts)
    return first, second


def mixed_values(first: Array, second: Array, parameter: int) -> Array:
    """The sample `first` (n, d) with one parameter taken from the sample `second`: A_B^(i) of Saltelli et al."""
    mixed = first.copy()
    mixed[:, parameter] = second[:, parameter]
    return mixed


LEVELS = (0.05, 0.5, 0.95)
TAILS = 0.01, 0.99
ENOUGH_FOR_TAILS = 256  # samples
PERCENTILES = tuple(percent / 100.0 for percent in range(1, 100))
CONFIDENCE = 0.95
CONVERGENCE = 8, 4, 2, 1  # parts of the samples whose quantiles are compared


@dataclass(frozen=True)
class Estimate:
    """A number estimated from samples with its confidence interval."""

    value: float  # the estimate
    # ends of the interval that holds the true value with a probability of 95 %; None: the samples do not tell
    low: float | None
    # ends of the interval that holds the true value with a probability of 95 %; None: the samples do not tell
    high: float | None
    # the estimate if every sample whose amplitude is only a lower bound were infinite; None: no bound
    at_most: float | None


def levels_of(count: int) -> tuple[float, ...]:
    """Levels of the quantiles that so many samples can tell."""
    return (TAILS[0], *LEVELS, TAILS[1]) if count >= ENOUGH_FOR_TAILS else LEVELS


def quantile(values: Array, level: float, open_above: NDArray[np.bool_] | None = None) -> Estimate:
    """A quantile of n samples with its confidence interval.

    Shapes: `values` (n,), `open_above` (n,).
    """
    known = values[np.isfinite(values)]
    value = _at(known, level)
    shares = _shares_below(values, value)
    half = _student() * float(np.std(shares, ddof=1)) / np.sqrt(len(shares)) + 0.5 / known.size
    low, high = level - half, level + half
    at_most: float | None = value
    if open_above is not None and open_above.any():
        raised = np.sort(np.where(open_above, np.inf, values)[np.isfinite(values)])
        at_most = _at(raised, level)
    return Estimate(
        value,
        _at(known, low) if low > 0.0 else None,
        _at(known, high) if high < 1.0 else None,
        at_most if at_most is not None and np.isfinite(at_most) else None,
    )


def exceedance(values: Array, limit: float, open_above: NDArray[np.bool_] | None = None) -> Estimate:
    """The probability that a quantity exceeds a limit, with its confidence interval; as `quantile`."""
    known = np.isfinite(values)
    shares = 1.0 - _shares_below(values, limit)
    value = float(np.mean(values[known] > limit))
    half = _student() * float(np.std(shares, ddof=1)) / np.sqrt(len(shares)) + 0.5 / int(known.sum())
    above = values > limit if open_above is None else (values > limit) | open_above
    return Estimate(value, max(value - half, 0.0), min(value + half, 1.0), float(np.mean(above[known])))


def _at(values: Array, level: float) -> float:
    """Quantile of samples that stand for strata of equal probability: sample k of n at (k - 1/2) / n."""
    ordered = np.sort(values)
    place = min(max(level * ordered.size - 0.5, 0.0), ordered.size - 1.0)
    below = int(place)
    if place == below or ordered[below] == ordered[below + 1]:
        return float(ordered[below])
    return float(ordered[below] + (place - below) * (ordered[below + 1] - ordered[below]))


def _shares_below(values: Array, bound: float) -> Array:
    """Share of the samples of each scrambling below a bound, equal ones half; without those that have no samples."""
    groups = [values[r::REPLICATES] for r in range(REPLICATES)]
    known = [group[np.isfinite(group)] for group in groups]
    return np.array([np.mean((g < bound) + 0.5 * (g == bound)) for g in known if g.size])


def _student() -> float:
    """Factor of the standard error in the half width of an interval with the confidence `CONFIDENCE`."""
    from scipy.special import stdtrit

    return float(stdtrit(REPLICATES - 1, 0.5 + 0.5 * CONFIDENCE))
