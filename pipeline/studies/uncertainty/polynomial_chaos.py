"""Sobol indices from a polynomial fitted to the samples: no further curves, but an error of the fit.

The quantity is a sum of products of polynomials that are orthonormal under the distribution of each parameter
(polynomial chaos), fitted by least squares. The variance is the sum of the squared coefficients, and that of any group
of parameters the sum over the products that hold no others. The degree is the one with the smallest leave-one-out
error, the mean square difference of each sample from a fit to all others relative to the variance.

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
from pipeline.studies.uncertainty.sobol_indices import SobolIndex

Array = NDArray[np.float64]
HIGHEST_DEGREE = 4
SAMPLES_PER_TERM = 2.0  # at least
_GRID = 4096  # points of equal probability on which the polynomials of a parameter are made orthonormal


@dataclass(frozen=True)
class PolynomialChaos:
    """A polynomial fitted to samples, and the sensitivities that follow from it.

    Attributes
    ----------
    degree : int
        Total degree of the polynomial.
    leave_one_out : float
        Leave-one-out error relative to the variance: the share of the variance that the polynomial misses.
    indices : tuple of SobolIndex
        First-order and total index of each parameter.
    """

    degree: int
    leave_one_out: float
    indices: tuple[SobolIndex, ...]


def polynomial_chaos(marginals: Sequence[Marginal], points: Array, values: Array) -> PolynomialChaos | None:
    """Fit polynomials to samples; None where the values do not vary, or where there are too few.

    Parameters
    ----------
    marginals : sequence of Marginal
        Distributions of the d parameters.
    points : (n, d) float
        Values of the parameters, in the units of their keys.
    values : (n,) float
        The quantity; samples where it is NaN are left out.
    """
    known = np.isfinite(values)
    points, values = points[known], values[known]
    if values.size < 2 or np.ptp(values) <= 1e-12 * np.abs(values).max():
        return None
    bases = [_orthonormal(marginal, points[:, i]) for i, marginal in enumerate(marginals)]
    found: PolynomialChaos | None = None
    for degree in range(1, HIGHEST_DEGREE + 1):
        powers = [p for p in product(range(degree + 1), repeat=len(marginals)) if sum(p) <= degree]
        if len(powers) * SAMPLES_PER_TERM > values.size:
            break
        matrix = np.prod([basis[:, [p[i] for p in powers]] for i, basis in enumerate(bases)], axis=0)
        fitted = _fit([marginal.key for marginal in marginals], degree, np.array(powers), matrix, values)
        if found is None or fitted.leave_one_out < found.leave_one_out:
            found = fitted
    return found


def _orthonormal(marginal: Marginal, values: Array) -> Array:
    """Polynomials of degree 0 to `HIGHEST_DEGREE` at values (n,), orthonormal under a distribution, (n, degrees).

    Of the logarithm of a lognormal parameter.
    """
    grid = marginal.quantile((np.arange(_GRID) + 0.5) / _GRID)
    if marginal.kind == "lognormal":
        grid, values = np.log(grid), np.log(values)
    middle, size = grid.mean(), grid.std()
    table = np.vander((grid - middle) / size, HIGHEST_DEGREE + 1, increasing=True)
    upper = np.linalg.qr(table / np.sqrt(_GRID), mode="r")
    at_values = np.vander((values - middle) / size, HIGHEST_DEGREE + 1, increasing=True)
    return np.asarray(np.linalg.solve(upper.T, at_values.T).T * np.sign(upper[0, 0]))


def _fit(keys: Sequence[str], degree: int, powers: NDArray[np.int64], matrix: Array, values: Array) -> PolynomialChaos:
    """Least squares with the leave-one-out error, and the indices of the polynomial."""
    q, r = np.linalg.qr(matrix)
    coefficients = np.linalg.solve(r, q.T @ values)
    leverage = np.minimum((q * q).sum(axis=1), 1.0 - 1e-12)
    missed = (values - matrix @ coefficients) / (1.0 - leverage)
    part = coefficients**2
    part[~powers.any(axis=1)] = 0.0  # the mean
    variance = float(part.sum())
    alone = [part[(powers[:, i] > 0) & (powers.sum(axis=1) == powers[:, i])].sum() for i in range(len(keys))]
    any_order = [part[powers[:, i] > 0].sum() for i in range(len(keys))]
    indices = tuple(
        SobolIndex(key, float(first / variance), float(total / variance))
        for key, first, total in zip(keys, alone, any_order, strict=True)
    )
    return PolynomialChaos(degree, float(np.mean(missed**2) / np.var(values)), indices)
