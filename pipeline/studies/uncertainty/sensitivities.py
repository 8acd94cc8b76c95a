"""Sensitivities: Sobol indices by sampling, a polynomial through the samples, the first-order answer.

Polynomial chaos gives sensitivities and quantiles without further curves, with the error of the fit. The quantity is
a sum of products of polynomials that are orthonormal under the distribution of each parameter (polynomial chaos),
fitted by least squares. The variance is the sum of the squared coefficients, and that of any group of parameters the
sum over the products that hold no others. The degree is the one with the smallest leave-one-out error, the mean
square difference of each sample from a fit to all others relative to the variance. Quantiles are those of the
polynomial at many points. Where the error is small they are far better than those of the samples; where the quantity
has kinks or jumps the error tells that they are not.

Sobol indices are shares of the variance that single parameters explain, alone and with all others: by the estimators
of Saltelli et al. (2010), from samples A and B and, for every parameter i, the sample A with the values of parameter
i taken from B; confidence intervals by a bootstrap over the samples, which takes these for independent and so errs on
the wide side.

The first-order answer is a linear model from the derivatives of the worst motion at the centre of the distributions.

    A(p) = A(c) + sum_i dA/dp_i (p_i - c_i)

Its mean and deviation follow from those of the parameters, its quantiles from values of the model alone. No curve is
solved for it. It knows nothing of kinks, of an exchange of peaks or of isolated branches.

References
----------
B. Sudret, "Global sensitivity analysis using polynomial chaos expansions", Reliability Engineering and System Safety
93 (2008) 964-979.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.uncertainty.quantiles import PERCENTILES, POINTS, Correlation, correlated, quantile, unit_points
from pipeline.studies.uncertainty.section import Marginal

Array = NDArray[np.float64]
CONFIDENCE = 0.95
RESAMPLES = 999


@dataclass(frozen=True)
class SobolIndex:
    """Sensitivity of a quantity to one parameter."""

    key: str  # dotted key of the parameter
    first: float  # first-order index: share of the variance that is left out if the parameter alone is known
    total: float  # total index: share of the variance that is left if all others are known
    # `first_interval`, `total_interval`: confidence intervals, 95 %; None where none is known
    first_interval: tuple[float, float] | None = None
    total_interval: tuple[float, float] | None = None


def sobol_indices(
    keys: Sequence[str], first: Array, second: Array, mixed: Array, seed: int
) -> tuple[SobolIndex, ...]:
    """Sobol indices of all parameters, from a quantity at sampled values.

    Shapes: `first` (n,), `second` (n,), `mixed` (d, n).
    """
    from scipy.stats import bootstrap

    table = np.vstack([first, second, mixed]) - 0.5 * (first.mean() + second.mean())
    found = _estimates(table)
    bounds = bootstrap(
        [np.arange(first.size)],
        lambda rows: _estimates(table[:, rows]),
        vectorized=False,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="BCa",
        rng=np.random.default_rng(seed),
    ).confidence_interval
    lows, highs = np.asarray(bounds.low), np.asarray(bounds.high)
    intervals = [[(float(lows[k, i]), float(highs[k, i])) for k in range(2)] for i in range(len(keys))]
    return tuple(SobolIndex(key, float(found[0, i]), float(found[1, i]), *intervals[i]) for i, key in enumerate(keys))


def _estimates(table: Array) -> Array:
    """First-order and total indices, (2, d), from the quantity at A, B and A_B^(i), (2 + d, n), about its mean."""
    first, second, mixed = table[0], table[1], table[2:]
    variance = np.var(table[:2])
    alone = np.mean(second * (mixed - first), axis=1) / variance
    return np.stack([alone, 0.5 * np.mean((first - mixed) ** 2, axis=1) / variance])


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

    # `mean`, `deviation`: mean and standard deviation
    mean: float
    deviation: float
    quantiles: tuple[float, ...]  # at the levels of the result


@dataclass(frozen=True)
class FirstOrder:
    """The linear model of the worst motion."""

    terms: tuple[FirstOrderTerm, ...]  # one for each parameter
    # `amplitude`, `frequency`: distribution of amplitude, m, and frequency, Hz
    amplitude: LinearSpread
    frequency: LinearSpread


def first_order(
    marginals: Sequence[Marginal],
    peak: tuple[float, float],
    rates: Mapping[str, tuple[float, float]],
    levels: Sequence[float],
    seed: int,
    correlation: Correlation = (),
) -> FirstOrder:
    """The linear model at the centre of the distributions."""
    moments = [marginal.moments for marginal in marginals]
    terms = tuple(
        FirstOrderTerm(m.key, *rates[m.key], rates[m.key][0] * deviation, rates[m.key][1] * deviation)
        for m, (_, deviation) in zip(marginals, moments, strict=True)
    )
    values = linear_values(marginals, terms, peak, seed, correlation)
    shifts = np.array([mean - m.centre for m, (mean, _) in zip(marginals, moments, strict=True)])
    spreads = []
    for quantity in range(2):
        slopes = np.array([rates[m.key][quantity] for m in marginals])
        parts = [slope * deviation for slope, (_, deviation) in zip(slopes, moments, strict=True)]
        quantiles = tuple(quantile(values[:, quantity], level).value for level in levels)
        mean = peak[quantity] + float(slopes @ shifts)
        deviation = float(values[:, quantity].std() if len(correlation) else np.linalg.norm(parts))
        spreads.append(LinearSpread(mean, deviation, quantiles))
    return FirstOrder(terms, *spreads)


def linear_values(
    marginals: Sequence[Marginal],
    terms: Sequence[FirstOrderTerm],
    peak: tuple[float, float],
    seed: int,
    correlation: Correlation = (),
) -> Array:
    """Amplitude, m, and frequency, Hz, of the linear model at `POINTS` points of equal probability, (points, 2)."""
    points = correlated(unit_points(POINTS, len(marginals), seed), correlation)
    moved = np.column_stack([m.quantile(points[:, k]) - m.centre for k, m in enumerate(marginals)])
    slopes = np.array([[term.amplitude_rate, term.frequency_rate] for term in terms])
    return np.asarray(np.array(peak) + moved @ slopes)


Powers = tuple[tuple[int, ...], ...]
HIGHEST_DEGREE = 4
SAMPLES_PER_TERM = 2.0  # at least
_GRID = 4096  # points of equal probability on which the polynomials of a parameter are made orthonormal


@dataclass(frozen=True)
class PolynomialChaos:
    """A polynomial fitted to samples, and what follows from it."""

    degree: int  # total degree of the polynomial
    # leave-one-out error relative to the variance: the share of the variance that the polynomial misses
    leave_one_out: float
    indices: tuple[SobolIndex, ...]  # first-order and total index of each parameter
    percentiles: tuple[float, ...]  # (99,), quantiles of the polynomial at the levels 1 % to 99 %

    def at(self, level: float) -> float:
        """Quantile of the polynomial at a level that is a whole percentage."""
        return self.percentiles[round(100.0 * level) - 1]


def polynomial_chaos(
    marginals: Sequence[Marginal], points: Array, values: Array, seed: int
) -> PolynomialChaos | None:
    """Fit polynomials to samples; None where the values do not vary, or where there are too few.

    Shapes: `points` (n, d), `values` (n,).
    """
    known = np.isfinite(values)
    fit = fitted_polynomial(marginals, points[known], values[known])
    if fit is None:
        return None
    many = unit_points(POINTS, len(marginals), seed)
    spread = fit.at(np.column_stack([marginal.quantile(many[:, k]) for k, marginal in enumerate(marginals)]))
    percentiles = tuple(quantile(spread, level).value for level in PERCENTILES)
    error = float(np.mean(fit.missed**2) / np.var(values[known]))
    return PolynomialChaos(fit.degree, error, _indices(marginals, fit.powers, fit.coefficients), percentiles)


@dataclass(frozen=True)
class FittedPolynomial:
    """A polynomial through values at samples of some parameters."""

    marginals: Sequence[Marginal]
    degree: int  # total degree
    powers: Powers  # of the parameters in each product
    coefficients: Array
    missed: Array  # (n,), differences of the samples from a fit to all others

    def at(self, points: Array) -> Array:
        """The polynomial at points (n, d)."""
        return _products(_bases(self.marginals, points), self.powers) @ self.coefficients


def fitted_polynomial(marginals: Sequence[Marginal], points: Array, values: Array) -> FittedPolynomial | None:
    """The polynomial of the least leave-one-out error; None where values do not vary, or where there are too few.

    Shapes: `points` (n, d), `values` (n,).
    """
    if values.size < 2 or np.ptp(values) <= 1e-12 * np.abs(values).max():
        return None
    bases, fits = _bases(marginals, points), []
    for degree in range(1, HIGHEST_DEGREE + 1):
        powers = tuple(p for p in product(range(degree + 1), repeat=len(marginals)) if sum(p) <= degree)
        if len(powers) * SAMPLES_PER_TERM > values.size:
            break
        coefficients, missed = _fit(_products(bases, powers), values)
        fits.append(FittedPolynomial(marginals, degree, powers, coefficients, missed))
    return min(fits, key=lambda fit: float(np.mean(fit.missed**2)), default=None)


def _bases(marginals: Sequence[Marginal], points: Array) -> list[Array]:
    """Polynomials of each parameter at points (n, d)."""
    return [_orthonormal(marginal, points[:, k]) for k, marginal in enumerate(marginals)]


def _orthonormal(marginal: Marginal, values: Array) -> Array:
    """Polynomials of degree 0 to `HIGHEST_DEGREE` at values (n,), orthonormal under a distribution, (n, degrees).

    Of the logarithm of a lognormal parameter.
    """
    grid = marginal.quantile((np.arange(_GRID) + 0.5) / _GRID)
    if marginal.kind == "lognormal":
        grid, values = np.log(grid), np.log(values)
    middle, size = grid.mean(), grid.std()
    table = np.vander((grid - middle) / size, HIGHEST_DEGREE + 1, increasing=True)
    upper = np.linalg.qr(table / np.sqrt(_GRID)).R
    at_values = np.vander((values - middle) / size, HIGHEST_DEGREE + 1, increasing=True)
    return np.asarray(np.linalg.solve(upper.T, at_values.T).T * np.sign(upper[0, 0]))


def _products(bases: Sequence[Array], powers: Powers) -> Array:
    """Products of the polynomials of all parameters, (n, products)."""
    matrix = np.ones((len(bases[0]), len(powers)))
    for k, basis in enumerate(bases):
        matrix *= basis[:, [power[k] for power in powers]]
    return matrix


def _fit(matrix: Array, values: Array) -> tuple[Array, Array]:
    """Coefficients by least squares, and what a fit to all others misses of each value."""
    q, r = np.linalg.qr(matrix)
    coefficients = np.asarray(np.linalg.solve(r, q.T @ values))
    leverage = np.minimum((q * q).sum(axis=1), 1.0 - 1e-12)
    return coefficients, np.asarray((values - matrix @ coefficients) / (1.0 - leverage))


def _indices(marginals: Sequence[Marginal], powers: Powers, coefficients: Array) -> tuple[SobolIndex, ...]:
    """The share of each parameter in the variance of the polynomial, alone and with all others."""
    table = np.array(powers)
    part = np.where(table.any(axis=1), coefficients**2, 0.0)  # without the mean
    found = []
    for k, marginal in enumerate(marginals):
        holds = table[:, k] > 0
        alone = holds & (table.sum(axis=1) == table[:, k])
        found.append(
            SobolIndex(marginal.key, float(part[alone].sum() / part.sum()), float(part[holds].sum() / part.sum()))
        )
    return tuple(found)
