"""Sobol indices: shares of the variance that single parameters explain, alone and with all others.

First-order and total indices by the estimators of Saltelli et al. (2010), from samples A and B and, for every
parameter i, the sample A with the values of parameter i taken from B; confidence intervals by a bootstrap over the
samples, which takes these for independent and so errs on the wide side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CONFIDENCE = 0.95
RESAMPLES = 999


@dataclass(frozen=True)
class SobolIndex:
    """Sensitivity of a quantity to one parameter."""

    key: str  # dotted key of the parameter
    first: float  # first-order index: share of the variance that is left out if the parameter alone is known
    total: float  # total index: share of the variance that is left if all others are known
    first_interval: tuple[float, float] | None = None  # confidence intervals, 95 %; None where none is known
    total_interval: tuple[float, float] | None = None  # confidence intervals, 95 %; None where none is known


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
