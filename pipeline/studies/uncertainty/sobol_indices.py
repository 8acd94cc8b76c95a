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
    """Sensitivity of a quantity to one parameter.

    Attributes
    ----------
    key : str
        Dotted key of the parameter.
    first : float
        First-order index: share of the variance that is left out if the parameter alone is known.
    total : float
        Total index: share of the variance that is left if all others are known.
    first_interval, total_interval : (float, float) or None
        Confidence intervals, 95 %; None where none is known.
    """

    key: str
    first: float
    total: float
    first_interval: tuple[float, float] | None = None
    total_interval: tuple[float, float] | None = None


def sobol_indices(
    keys: Sequence[str], first: Array, second: Array, mixed: Array, seed: int
) -> tuple[SobolIndex, ...]:
    """Sobol indices of all parameters, from a quantity at sampled values.

    Parameters
    ----------
    keys : sequence of str
        Dotted keys of the d parameters.
    first, second : (n,) float
        The quantity at the samples A and B; n is a power of two.
    mixed : (d, n) float
        The quantity at the samples A_B^(i), see `mixed_values`.
    seed : int
        Seed of the bootstrap.
    """
    from scipy import stats

    functions = {"f_A": first[None], "f_B": second[None], "f_AB": mixed[:, None]}
    generator = np.random.default_rng(seed)
    found = stats.sobol_indices(func=functions, n=first.size, rng=generator)
    bounds = found.bootstrap(CONFIDENCE, RESAMPLES)
    intervals = [
        [(float(low), float(high)) for low, high in zip(*each, strict=True)]
        for each in (bounds.first_order.confidence_interval, bounds.total_order.confidence_interval)
    ]
    return tuple(
        SobolIndex(key, float(found.first_order[i]), float(found.total_order[i]), intervals[0][i], intervals[1][i])
        for i, key in enumerate(keys)
    )
