"""Quasi-random values of the uncertain parameters: independent scramblings of one Sobol sequence.

Each of R scramblings is an unbiased sample of its own, so that their scatter tells the error of everything that is
estimated from all of them. Sample i is number i // R of scrambling i % R: the first n samples are those of a run with
n samples, and more samples only add to them.

References
----------
A. B. Owen, "Scrambled net variance for integrals of smooth functions", The Annals of Statistics 25 (1997) 1541-1562.
A. Saltelli et al., "Variance based sensitivity analysis of model output. Design and estimator for the total
sensitivity index", Computer Physics Communications 181 (2010) 259-270.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.marginal import Marginal

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


def sampled_values(marginals: Sequence[Marginal], count: int, seed: int) -> tuple[Array, Array]:
    """Two independent samples A and B of the parameters, each (count, d), in the units of the keys."""
    d = len(marginals)
    points = unit_points(count, 2 * d, seed)
    columns = [marginals[k % d].quantile(points[:, k]) for k in range(2 * d)]
    return np.column_stack(columns[:d]), np.column_stack(columns[d:])


def mixed_values(first: Array, second: Array, parameter: int) -> Array:
    """The sample `first` (n, d) with one parameter taken from the sample `second`: A_B^(i) of Saltelli et al."""
    mixed = first.copy()
    mixed[:, parameter] = second[:, parameter]
    return mixed
