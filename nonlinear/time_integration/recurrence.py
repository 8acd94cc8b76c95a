"""Whether a motion repeats itself, and whether it has settled."""

import numpy as np

from nonlinear.contact.parameters import Array

MOST_PERIODS = 8  # after which a motion that repeats itself still counts as periodic
REPEATS = 5e-3  # difference of two states, relative to the vibration, that is none
SAME_AMPLITUDE = 0.01  # relative change of the largest amplitude from window to window in a settled motion
SAME_SCATTER = 0.1  # the same of the scatter
SAME_MEAN = 0.05  # the same of the mean over periods and blades, which shows a slow change that the largest hides
NO_SCATTER = 5e-3  # scatter, relative to the amplitude, that is none


def repeats_after(ends: Array, vibration: float = 0.0) -> int:
    """Number of periods after which a motion repeats itself over the whole window; 0: it does not.

    Shapes: `ends` (P, ...).
    """
    flat = ends.reshape(len(ends), -1)
    scale = max(float(np.linalg.norm(flat, axis=1).max()), vibration)
    if scale == 0.0:
        return 1
    for periods in range(1, min(MOST_PERIODS, len(flat) // 4) + 1):
        spread = max(np.linalg.norm(flat[first::periods] - flat[first], axis=1).max() for first in range(periods))
        if spread <= REPEATS * scale:
            return periods
    return 0


def same_statistics(before: Array, after: Array) -> bool:
    """Whether two windows of a motion have the same largest amplitude and the same scatter.

    Shapes: `before` (P, q), `after` (P, q).
    """
    largest = after.max()
    scatter = [float(window.max() - window.min()) for window in (before, after)]
    same = abs(scatter[1] - scatter[0]) <= SAME_SCATTER * scatter[1] or max(scatter) <= NO_SCATTER * largest
    return bool(abs(largest - before.max()) <= SAME_AMPLITUDE * largest and same)


def same_mean(before: Array, after: Array) -> bool:
    """Whether two windows of a motion have the same mean amplitude.

    Shapes: `before` (P, q), `after` (P, q).
    """
    return bool(abs(after.mean() - before.mean()) <= SAME_MEAN * after.mean())
