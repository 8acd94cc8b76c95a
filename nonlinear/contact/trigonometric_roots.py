"""Roots of trigonometric polynomials g = c_0 + sum_h Re_h cos(h theta) - Im_h sin(h theta) (compiled).

Root isolation by Taylor bounds: an interval is halved until a bound of the Taylor remainder about its middle proves
that g has no root in it, or is monotone, convex or concave there, so that the values at its ends tell of one simple
root. That root is found by Halley's method within its bracket. No pair of roots is missed, unlike on a grid.

Loops over harmonics count in floats: numba would unroll and vectorise integer loops for the few rounds that they do.

References
----------
R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM, 2009.
"""

import math
from functools import cache

import numpy as np

from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import Array

PERIOD = 2.0 * math.pi
NARROWEST = 5e-9  # half width (rad) of an interval in which two roots count as a touch without crossing
NOWHERE = 1e300  # in place of an angle: there is none
# cos and sin at equidistant angles, a power of 2 of them. An evaluation of `EventDrivenJenkins` with 9 nodes and 1,
# 3, 7 or 9 harmonics takes 23, 48, 152 or 226 us with this table; 27, 57, 175 or 255 us with math.cos and math.sin.
PARTS = 1024
_ANGLES = 2.0 * np.arccos(np.longdouble(-1.0)) * np.arange(PARTS) / PARTS
COSINES, SINES = np.cos(_ANGLES).astype(float), np.sin(_ANGLES).astype(float)
STEP_HIGH = round(float(_ANGLES[1]) * 2.0**38) / 2.0**38  # few digits: its multiples are exact
STEP_LOW = float(_ANGLES[1] - STEP_HIGH)


@lean
def cosine_sine(angle: float) -> tuple[float, float]:
    """cos and sin of an angle (up to a thousand periods) to 3e-16: the nearest table entry and a short series."""
    nearest = np.rint(angle * (PARTS / PERIOD))
    x = (angle - nearest * STEP_HIGH) - nearest * STEP_LOW
    part = int(nearest) & (PARTS - 1)
    square = x * x
    s = x + x * square * (-1.0 / 6.0 + square / 120.0)
    c = square * (-0.5 + square / 24.0)
    cosine, sine = COSINES[part], SINES[part]
    return cosine + (cosine * c - sine * s), sine + (sine * c + cosine * s)


@inner
def taylor(coefficients: Array, angle: float) -> tuple[float, float, float]:
    """g(theta), g'(theta) and g''(theta); `coefficients` (2H+1,) in the order 0, Re 1, Im 1, ..."""
    c, s = cosine_sine(angle)
    g, dg, ddg = coefficients[0], 0.0, 0.0
    ch, sh = 1.0, 0.0
    h, k, end = 1.0, 1, 0.5 * coefficients.shape[0]
    while h < end:
        ch, sh = ch * c - sh * s, sh * c + ch * s
        re, im = coefficients[k], coefficients[k + 1]
        part = re * ch - im * sh
        g += part
        dg -= h * (re * sh + im * ch)
        ddg -= h * h * part
        h += 1.0
        k += 2
    return g, dg, ddg


@inner
def derivative_bounds(coefficients: Array) -> tuple[float, float, float]:
    """Upper bounds sum h^k |c_h|, h > 0, of |g - c_0| and of the third and the fourth derivative."""
    zeroth, third, fourth = 0.0, 0.0, 0.0
    h, k, end = 1.0, 1, 0.5 * coefficients.shape[0]
    while h < end:
        re, im = coefficients[k], coefficients[k + 1]
        size = math.sqrt(re * re + im * im)
        zeroth += size
        size *= h * h * h
        third += size
        fourth += h * size
        h += 1.0
        k += 2
    return zeroth, third, fourth


@cache
def cell_table(n_harmonics: int) -> Array:
    """Equal cells of the period: g, g' r and g'' r^2 / 2 at their middles, r their half width: (2H+1, 3 cells).

    One array for all who ask; not to be written into.
    """
    cells = 8 * n_harmonics
    radius = math.pi / cells
    middle = radius * (2.0 * np.arange(cells) + 1.0)
    table = np.zeros((2 * n_harmonics + 1, 3, cells))
    table[0, 0] = 1.0
    for h in range(1, n_harmonics + 1):
        c, s, step = np.cos(h * middle), np.sin(h * middle), h * radius
        table[2 * h - 1] = c, -step * s, -0.5 * step**2 * c
        table[2 * h] = -s, -step * c, 0.5 * step**2 * s
    return table.reshape(2 * n_harmonics + 1, 3 * cells)


@inner
def bound_cells(
    first: Array, factor: float, second: Array, other: float, third: float, highest: Array, steepest: Array
) -> None:
    """Bound g = factor * first + other * second in every cell; both as `cell_table` times coefficients.

    Written: `highest`, which g does not exceed, and `steepest`, which -g' r does not; `third` bounds g'''.
    """
    cells = first.shape[1]
    radius = 0.5 * PERIOD / cells
    remainder = third * radius * radius * radius
    for k in range(cells):
        g = factor * first[0, k] + other * second[0, k]
        dg = factor * first[1, k] + other * second[1, k]
        ddg = factor * first[2, k] + other * second[2, k]
        highest[k] = g + abs(dg) + 0.5 * (ddg + abs(ddg)) + remainder / 6.0
        steepest[k] = 2.0 * abs(ddg) - dg + 0.5 * remainder


@inner
def crossing(coefficients: Array, level: float, left: float, right: float, angle: float) -> float:
    """The one angle in [left, right] at which g rises through `level`: Halley's method from `angle`, bracketed."""
    for _ in range(100):
        g, dg, ddg = taylor(coefficients, angle)
        g -= level
        if g < 0.0:
            left = angle
        else:
            right = angle
        divisor = 2.0 * dg * dg - g * ddg
        step = 2.0 * g * dg / divisor if divisor > 0.0 else NOWHERE
        angle -= step
        if left <= angle <= right:
            if abs(step) <= 1e-7:  # third order: the next step would be nothing
                return angle
        else:
            angle = 0.5 * (left + right)
            if right - left <= 1e-15 * PERIOD:
                return angle
    return angle


@inner
def quadratic_root(left: float, right: float, g: float, dg: float, ddg: float) -> float:
    """First guess of a rise in [left, right] from g, g' and g'' at the middle."""
    middle = left + 0.5 * (right - left)
    root = dg * dg - 2.0 * ddg * g
    root = dg + (math.sqrt(root) if root > 0.0 else 0.0)
    start = middle - 2.0 * g / root if root > 0.0 else middle
    if not left < start < right:
        start = middle if g > 0.0 else right
    return start


@inner
def first_rise(
    coefficients: Array, level: float, third: float, left: float, right: float, falling: bool, slack: float
) -> float:
    """First angle in [left, right] at which g, not above `level` at left, rises above level + slack; else NOWHERE.

    `third` bounds the third derivative; `falling`: g does not rise at `left`. No rise is missed but one undone within
    1e-8 rad, in which g is above by less than 2e-17 M2, M2 a bound of ``|g''|``.
    """
    angle = left
    while angle < right:
        stop = right
        while True:  # halve [angle, stop] until Taylor bounds about its middle decide
            radius = 0.5 * (stop - angle)
            middle = angle + radius
            g, dg, ddg = taylor(coefficients, middle)
            g -= level
            change = (abs(ddg) + 0.5 * third * radius) * radius  # of g' from the middle
            highest = g + (abs(dg) + (0.25 * (ddg + abs(ddg)) + third * radius / 6.0) * radius) * radius
            concave = ddg + third * radius <= 0.0
            if highest <= slack or dg <= -change or (falling and concave):
                break
            narrow = radius <= NARROWEST
            if concave or narrow or ddg >= third * radius or dg >= change:
                rate = 0.0
                at_stop = g + (dg + (0.5 * ddg - third * radius / 6.0) * radius) * radius  # at least
                if at_stop <= slack:
                    at_stop, rate, _ = taylor(coefficients, stop)
                    at_stop -= level
                if at_stop > slack:
                    return crossing(coefficients, level, angle, stop, quadratic_root(angle, stop, g, dg, ddg))
                if narrow or not concave or at_stop - radius * (rate - abs(rate)) <= slack:
                    break
            stop = middle
        angle, falling = stop, False
    return NOWHERE


@inner
def next_rise(
    interval: tuple[float, float],
    rows: tuple[int, int],
    level: float,
    slack: float,
    at_maximum: float,
    curves: Array,
    thirds: Array,
    highest: Array,
) -> tuple[float, int]:
    """First angle in the interval at which one of the curves rises above its level, and its row: else (end, -1).

    `curves` (4, 2H+1), `thirds` (4,) bounds of their third derivatives, `highest` (4, cells) bounds in the cells (any
    positive multiple where the level is 0); row 0 is held against `level`, row 1 against -level, 2 and 3 against 0.
    `at_maximum`: row of the curve that has a maximum, at its level, at the beginning of the interval (-1: none).
    """
    angle, end = interval
    cells = highest.shape[1]
    width = PERIOD / cells
    cell = math.floor(angle / width)
    if (cell + 1) * width <= angle:
        cell += 1
    place = cell % cells
    while angle < end:
        right = (cell + 1) * width
        if right > end:
            right = end
        # A maximum just before the end of a cell is best judged together with what follows.
        wide = at_maximum >= 0.0 and right - angle < 0.5 * width
        if wide:
            right = right + width if right + width < end else end
        met, hit = right, -1
        for row in range(rows[0], rows[1]):
            height = 0.0 if row > 1 else (1 - 2 * row) * level
            if wide or highest[row, place] > height + slack:
                rise = first_rise(curves[row], height, thirds[row], angle, met, row == at_maximum, slack)
                if rise < NOWHERE:
                    met, hit = rise, row
        if hit >= 0:
            return met, hit
        angle, at_maximum = right, -1.0
        cell += 2 if wide else 1
        place += 2 if wide else 1
        if place >= cells:
            place -= cells
    return end, -1


@lean
def find_roots(coefficients: Array, cells: Array, curves: Array, thirds: Array, highest: Array, roots: Array) -> int:
    """Write the simple roots of g in [0, 2 pi) into `roots`, ascending; returns their number, 2H at most.

    `cells` (3, cells): `cell_table` times the coefficients; `curves`, `thirds` and `highest`: scratch, see
    `next_rise`. None is missed but pairs nearer than 1e-8 rad, between which ``|g|`` is below 2e-17 M2,
    M2 = sum h^2 |c_h|.
    """
    zeroth, third, _ = derivative_bounds(coefficients)
    if zeroth <= abs(coefficients[0]):  # the vibration is too small to reach zero
        return 0
    for row in range(2, 4):
        sign = 5.0 - 2.0 * row
        for j in range(coefficients.shape[0]):
            curves[row, j] = sign * coefficients[j]
        thirds[row] = third
        bound_cells(cells, sign, cells, 0.0, third, highest[row], highest[0])
    value, rate, _ = taylor(coefficients, 0.0)
    row = 3 if value > 0.0 or (value == 0.0 and rate > 0.0) else 2
    angle, count = 0.0, 0
    while count < roots.shape[0]:
        angle, hit = next_rise((angle, PERIOD), (row, row + 1), 0.0, 0.0, -1.0, curves, thirds, highest)
        if hit < 0:
            break
        roots[count] = angle
        count += 1
        row = 5 - row
    return count
