"""A polynomial through the samples: sensitivities and quantiles without further curves, with the error of the fit.

The quantity is a sum of products of polynomials that are orthonormal under the distribution of each parameter
(polynomial chaos), fitted by least squares. The variance is the sum of the squared coefficients, and that of any
group of parameters the sum over the products that hold no others. The degree is the one with the smallest
leave-one-out error, the mean square difference of each sample from a fit to all others relative to the variance.
Quantiles are those of the polynomial at many points. Where the error is small they are far better than those of the
samples; where the quantity has kinks or jumps the error tells that they are not.

References
----------
B. Sudret, "Global sensitivity analysis using polynomial chaos expansions", Reliability Engineering and System Safety
93 (2008) 964-979.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.marginal import Marginal
from pipeline.studies.uncertainty.quantiles import PERCENTILES, quantile
from pipeline.studies.uncertainty.samples import POINTS, unit_points
from pipeline.studies.uncertainty.sobol_indices import SobolIndex

Array = NDArray[np.float64]
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
    points, values = points[known], values[known]
    if values.size < 2 or np.ptp(values) <= 1e-12 * np.abs(values).max():
        return None
    bases = _bases(marginals, points)
    fits = []
    for degree in range(1, HIGHEST_DEGREE + 1):
        powers = tuple(p for p in product(range(degree + 1), repeat=len(marginals)) if sum(p) <= degree)
        if len(powers) * SAMPLES_PER_TERM > values.size:
            break
        fits.append((*_fit(_products(bases, powers), values), degree, powers))
    if not fits:
        return None
    error, coefficients, degree, powers = min(fits, key=lambda fit: fit[0])
    many = unit_points(POINTS, len(marginals), seed)
    places = np.column_stack([marginal.quantile(many[:, k]) for k, marginal in enumerate(marginals)])
    spread = _products(_bases(marginals, places), powers) @ coefficients
    percentiles = tuple(quantile(spread, level).value for level in PERCENTILES)
    return PolynomialChaos(degree, error, _indices(marginals, powers, coefficients), percentiles)


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


def _fit(matrix: Array, values: Array) -> tuple[float, Array]:
    """Leave-one-out error relative to the variance, and coefficients, by least squares."""
    q, r = np.linalg.qr(matrix)
    coefficients = np.asarray(np.linalg.solve(r, q.T @ values))
    leverage = np.minimum((q * q).sum(axis=1), 1.0 - 1e-12)
    missed = (values - matrix @ coefficients) / (1.0 - leverage)
    return float(np.mean(missed**2) / np.var(values)), coefficients


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
