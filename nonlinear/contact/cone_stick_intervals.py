"""Stick of a slider in the plane and windows of contact: both end where a polynomial rises through 0 (compiled)."""

import math

from nonlinear.contact.numba_cache import inner
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import FULL_TURN, NOWHERE, derivative_bounds, first_rise, taylor

ROUND_OFF = 1e-14  # of the terms of |u - w|^2 - r^2


@inner
def next_rise_of(curve: Array, angle: float, end: float, fresh: float, slack: float) -> float:
    """First angle in [angle, end] at which g rises above 0, by more than `slack`, or `end`; fresh: not at `angle`."""
    zeroth, third, _ = derivative_bounds(curve)
    if curve[0] + zeroth <= slack:
        return end
    falling = fresh > 0.0
    if not falling:
        value, slope, _ = taylor(curve, angle)
        if value > slack or (value >= -slack and slope > 0.0):
            return angle
    piece = FULL_TURN / (3.0 * (curve.shape[0] - 1))
    while angle < end:
        right = min(angle + piece, end)
        rise = first_rise(curve, 0.0, third, angle, right, falling, slack)
        if rise < NOWHERE:
            return rise
        angle, falling = right, False
    return end


@inner
def find_windows(reach: Array, roots: Array, curve: Array) -> int:
    """Write the roots of r, the first one again a turn later and NOWHERE to the end of `roots` (2H+3 or more).

    Returns the place of the first rise, where a window of contact begins; -1: r > 0 throughout, -2: nowhere.
    """
    sign, count, angle = -1.0 if taylor(reach, 0.0)[0] > 0.0 else 1.0, 0, 0.0
    first = int(0.5 - 0.5 * sign)
    while angle < FULL_TURN and count < roots.shape[0] - 2:
        for j in range(reach.shape[0]):
            curve[j] = sign * reach[j]
        angle = next_rise_of(curve, angle, FULL_TURN, float(count), 0.0)
        if angle < FULL_TURN or count % 2 == 1:  # as many rises as falls
            roots[count], sign = angle, -sign
            count += 1
    if count == 0:
        return first - 2
    roots[count] = roots[0] + FULL_TURN
    for k in range(count + 1, roots.shape[0]):
        roots[k] = NOWHERE
    return first


@inner
def add_moments(left: float, right: float, row: int, moments: Array, mean: Array) -> None:
    """Add the means of cos(m theta), sin(m theta) over a stretch to two rows of `moments`; write the basis' own."""
    for m in range(moments.shape[1]):
        cosine, sine = right - left, 0.0
        if m > 0:
            cosine = (math.sin(m * right) - math.sin(m * left)) / m
            sine = (math.cos(m * left) - math.cos(m * right)) / m
        cosine /= FULL_TURN
        sine /= FULL_TURN
        moments[row, m] += cosine
        moments[row + 1, m] += sine
        if 2 * m < moments.shape[1]:
            mean[2 * m] = -sine
            mean[max(2 * m - 1, 0)] = cosine


@inner
def stick(
    angle: float,
    end: float,
    fresh: float,
    keep: float,
    curves: Array,
    memory: Array,
    scratch: Array,
    moments: Array,
    own: Array,
) -> float:
    """Hold the slider until |u - w|^2 - r^2, a polynomial of degree 2H, rises through 0; returns that angle or `end`.

    Row 3 of curves: the coefficients of |u|^2 - r^2. fresh: slip has just ended. keep: the stretch is added.
    """
    curve, mean = scratch[0], scratch[1]
    slack = 1.0
    for j in range(curves.shape[1]):
        curve[j] = curves[3, j]
        slack += abs(curve[j])
    for a in range(2):
        curve[0] += memory[a, 0] * memory[a, 0]
        for j in range(curves.shape[1]):
            curve[j] -= 2.0 * memory[a, 0] * curves[a, j]
    rise = next_rise_of(curve, angle, end, fresh, ROUND_OFF * slack)
    if keep > 0.0:
        add_moments(angle, rise, 0, moments, mean)
        for a in range(2):
            for i in range(own.shape[1]):
                for j in range(own.shape[2]):
                    own[a, i, j] -= mean[i] * memory[a, j]
    return rise
