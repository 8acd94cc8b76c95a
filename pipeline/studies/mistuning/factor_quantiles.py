"""Quantiles of independent samples with distribution-free confidence intervals.

The number of n independent samples below the quantile of level p is binomial. So the order statistics x_(l) and x_(u)
hold the quantile with the probability P(l <= B < u), B binomial of n and p, whatever the distribution [1]_.

References
----------
.. [1] H. A. David, H. N. Nagaraja, Order Statistics, 3rd ed., Wiley, 2003, section 7.1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.studies.mistuning.mistuning_result import FactorQuantile

LEVELS = (0.05, 0.5, 0.95, 0.99)
CONFIDENCE = 0.95


def factor_quantiles(values: NDArray[np.float64]) -> tuple[FactorQuantile, ...]:
    """Quantiles of independent samples.

    Shapes: `values` (n,).
    """
    known = np.sort(values[np.isfinite(values)])
    levels = [level for level in LEVELS if known.size * min(level, 1.0 - level) >= 0.5]
    return tuple(_quantile(known, level) for level in levels)


def _quantile(ordered: NDArray[np.float64], level: float) -> FactorQuantile:
    from scipy.stats import binom

    n, tail = ordered.size, 0.5 * (1.0 - CONFIDENCE)
    low = int(binom.ppf(tail, n, level))  # of the samples at least so many lie below, but for the tail
    high = int(binom.ppf(1.0 - tail, n, level)) + 1
    value = float(np.quantile(ordered, level, method="hazen"))
    return FactorQuantile(
        level,
        value,
        float(ordered[low - 1]) if low >= 1 else None,
        float(ordered[high - 1]) if high <= n else None,
    )
