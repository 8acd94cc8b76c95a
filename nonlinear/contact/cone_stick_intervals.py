"""Stick of a slider in the contact plane, and contact intervals: both end at roots of polynomials (compiled)."""

import math

from nonlinear.contact.cone_slider import ConeSlider, Workspace
from nonlinear.contact.numba_cache import inner
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import NOWHERE, PERIOD, derivative_bounds, first_rise, taylor

ROUND_OFF = 1e-14  # of the terms of |u - w|^2 - r^2


@inner
def next_rise_of(polynomial: Array, angle: float, end: float, falling: bool, slack: float) -> float:
    """First angle in [angle, end] at which g rises above 0, by more than `slack`, or `end`.

    `falling`: g falls from 0 at `angle`, which is no rise.
    """
    zeroth, third, _ = derivative_bounds(polynomial)
    if polynomial[0] + zeroth <= slack:
        return end
    if not falling:
        value, rate, _ = taylor(polynomial, angle)
        if value > slack or (value >= -slack and rate > 0.0):
            return angle
    piece = PERIOD / (3.0 * (polynomial.shape[0] - 1))
    while angle < end:
        right = min(angle + piece, end)
        rise = first_rise(polynomial, 0.0, third, angle, right, falling, slack)
        if rise < NOWHERE:
            return rise
        angle, falling = right, False
    return end


@inner
def find_contact_intervals(r: Array, angles: Array, polynomial: Array) -> int:
    """Write the roots of r, the first one again a period later and NOWHERE to the end of `angles` (2H+3 or more).

    Returns the place of the first rise, where a contact interval begins; -1: r > 0 throughout, -2: nowhere.
    """
    sign, count, angle = -1.0 if taylor(r, 0.0)[0] > 0.0 else 1.0, 0, 0.0
    first = int(0.5 - 0.5 * sign)
    while angle < PERIOD and count < angles.shape[0] - 2:
        for j in range(r.shape[0]):
            polynomial[j] = sign * r[j]
        angle = next_rise_of(polynomial, angle, PERIOD, count > 0, 0.0)
        if angle < PERIOD or count % 2 == 1:  # as many rises as falls
            angles[count], sign = angle, -sign
            count += 1
    if count == 0:
        return first - 2
    angles[count] = angles[0] + PERIOD
    for k in range(count + 1, angles.shape[0]):
        angles[k] = NOWHERE
    return first


@inner
def add_interval_moments(left: float, right: float, moments: Array, mean: Array) -> None:
    """Add the means of cos(m theta), sin(m theta) over an interval to `moments` (2, 2H+1).

    Written: `mean` (2H+1,), the means of the basis functions phi_i over the interval.
    """
    for m in range(moments.shape[1]):
        cosine, sine = right - left, 0.0
        if m > 0:
            cosine = (math.sin(m * right) - math.sin(m * left)) / m
            sine = (math.cos(m * left) - math.cos(m * right)) / m
        cosine /= PERIOD
        sine /= PERIOD
        moments[0, m] += cosine
        moments[1, m] += sine
        if 2 * m < moments.shape[1]:
            mean[2 * m] = -sine
            mean[max(2 * m - 1, 0)] = cosine


@inner
def stick(slider: ConeSlider, work: Workspace) -> float:
    """Hold the slider until |u - w|^2 - r^2, a polynomial of degree 2H, rises through 0; returns the angle.

    That is at most the end of the present interval. The stick interval is added to the means.
    """
    state, w, polynomial, mean = slider.iteration, slider.w, work.polynomial, work.mean
    slack = 1.0
    for j in range(slider.curves.shape[1]):
        polynomial[j] = slider.curves[3, j]
        slack += abs(polynomial[j])
    for a in range(2):
        polynomial[0] += w[a, 0] * w[a, 0]
        for j in range(slider.curves.shape[1]):
            polynomial[j] -= 2.0 * w[a, 0] * slider.curves[a, j]
    rise = next_rise_of(polynomial, state.angle, state.end, state.after_slip, ROUND_OFF * slack)
    if state.accumulate:
        add_interval_moments(state.angle, rise, slider.stick_moments, mean)
        _add_position(mean, w, slider.deflection)
    return rise


@inner
def _add_position(mean: Array, w: Array, deflection: Array) -> None:
    """Add the mean of -w phi_i over an interval of stick, and its derivatives."""
    for a in range(2):
        for i in range(deflection.shape[1]):
            for j in range(deflection.shape[2]):
                deflection[a, i, j] -= mean[i] * w[a, j]
