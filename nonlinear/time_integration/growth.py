"""Growth rate of a small departure from a periodic motion, from states at the ends of the periods.

The differences of successive states obey the linearised map over a period, delta_(p+1) = M delta_p. Its leading
multipliers are found from the few directions that the differences span (dynamic mode decomposition).

References
----------
P. J. Schmid, Dynamic mode decomposition of numerical and experimental data, Journal of Fluid Mechanics 656
(2010) 5-28.
"""

import numpy as np

from nonlinear.contact.parameters import Array

DIFFERENCES = 22  # of successive states that an estimate rests on
SMALLEST_DIRECTION = 1e-3  # singular value, relative to the largest, of a direction that counts
MOST_DIRECTIONS = 8
SHARE = 0.05  # of the departure that a multiplier must carry
AGREEMENT = 0.1  # relative difference of two estimates, from the earlier and the later differences
STRAIGHT = 0.02  # largest distance from a straight line, relative to its rise
RESOLUTION = 1e-3  # difference of two exponents times the period that is none


def growth_rate(states: Array, period: float) -> float:
    """Largest growth rate that the states show.

    Shapes: `states` (P, ...).
    """
    flat = states.reshape(len(states), -1)[-DIFFERENCES - 1 :]
    differences = np.diff(flat, axis=0)
    if len(differences) < DIFFERENCES or not np.all(np.linalg.norm(differences, axis=1) > 0.0):
        return float("nan")
    third = DIFFERENCES // 3
    exponents = [_leading_exponent(part) for part in (differences[:-third], differences[third:])]
    change = abs(exponents[1] - exponents[0])
    if change <= max(AGREEMENT * abs(exponents[1]), RESOLUTION):
        return exponents[1] / period
    return _straight_growth(differences) / period


def _straight_growth(differences: Array) -> float:
    """Slope of the logarithm of the size of the differences, where it is a straight line; else NaN."""
    time, size = np.arange(len(differences)), np.log(np.linalg.norm(differences, axis=1))
    slope, start = np.polyfit(time, size, 1)
    off = np.abs(size - start - slope * time).max()
    return float(slope) if off < STRAIGHT * abs(slope) * len(time) else float("nan")


def _leading_exponent(differences: Array) -> float:
    """Largest log(abs(multiplier)) of the map that takes each difference to the next."""
    before, after = differences[:-1].T, differences[1:].T
    directions, sizes, times = np.linalg.svd(before, full_matrices=False)
    rank = min(int(np.count_nonzero(sizes > SMALLEST_DIRECTION * sizes[0])), MOST_DIRECTIONS)
    directions, sizes, times = directions[:, :rank], sizes[:rank], times[:rank]
    reduced = directions.T @ after @ times.T / sizes
    multipliers, vectors = np.linalg.eig(reduced)
    share = np.abs(np.linalg.lstsq(vectors, (directions.T @ after[:, -1]).astype(complex), rcond=None)[0])
    carried = np.abs(multipliers[share >= SHARE * share.max()])
    return float(np.log(max(carried.max(), 1e-300)))
