"""Divisions of curves and layers: node positions as fractions of a length."""

from math import ceil

import numpy as np

from geometry.sector import FloatArray

GROWTH = 1.5  # ratio of neighbouring steps of a graded division: more saves few steps, less gains no accuracy


def grid_fractions(count: int) -> FloatArray:
    """Centres of ``count`` equal parts of [0, 1]."""
    return (np.arange(count) + 0.5) / count


def contact_fractions(count: int, length: float, size: float, *, even: bool = False) -> FloatArray:
    """Node positions on [0, 1] that include the centres of ``count`` equal parts.

    The steps are at most ``size`` / ``length`` long and symmetric about 1/2; with ``even`` their number is even.
    """
    knots = np.concatenate([[0.0], grid_fractions(count), [1.0]])
    parts = [max(1, ceil(step * length / size - 1e-6)) for step in np.diff(knots)]
    if even and sum(parts) % 2:
        parts[count // 2] += 1  # an odd number of steps means an even number of centres, so this is the middle part
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(knots[:-1], knots[1:], parts, strict=True)]
    fractions = np.concatenate([*pieces, [1.0]])
    return (fractions + (1 - fractions[::-1])) / 2


def graded_fractions(length: float, size: float, least: int = 1, grading: float = 1.0) -> FloatArray:
    """Node positions on [0, 1] with steps at most ``size`` / ``length`` and 1 / ``least`` long, finer at both ends.

    The steps at the ends are ``grading`` times shorter than the longest and grow by the factor ``GROWTH`` towards the
    middle; with a grading of 1 all are equal. They are symmetric about 1/2.
    """
    count = max(least, ceil(length / size - 1e-6))
    if grading == 1.0:
        return np.linspace(0.0, 1.0, count + 1)
    steps = [1.0 / (count * grading)]
    while sum(steps) < 0.5 - 1e-6:
        steps.append(min(GROWTH * steps[-1], 1.0 / count))
    half = np.concatenate([[0.0], np.cumsum(steps)]) / (2 * sum(steps))
    return np.concatenate([half[:-1], 1.0 - half[::-1]])
