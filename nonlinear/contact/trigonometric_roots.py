"""Trigonometric polynomials c_0 + sum_h Re_h cos(h theta) - Im_h sin(h theta): values, rises and roots (compiled).

Loops over harmonics count in floats: the compiler would unroll and vectorise others, for the few rounds that they do.
"""

import math

import numpy as np

from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import Array

FULL_TURN = 2.0 * math.pi
NARROWEST = 5e-9  # half width (rad) of an interval in which two roots count as a touch without crossing
NOWHERE = 1e300
PARTS = 1024  # of the turn, with tables at their ends, a power of 2
_ANGLES = 2.0 * np.arccos(np.longdouble(-1.0)) * np.arange(PARTS) / PARTS
COSINES, SINES = np.cos(_ANGLES).astype(float), np.sin(_ANGLES).astype(float)
PART = round(float(_ANGLES[1]) * 2.0**38) / 2.0**38  # few digits: its multiples are exact
REST = float(_ANGLES[1] - PART)


@inner
def cosine_sine(angle: float) -> tuple[float, float]:
    """cos and sin of an angle (up to a thousand turns) to 3e-16: a table and short series, quick."""
    nearest = np.rint(angle * (PARTS / FULL_TURN))
    x = (angle - nearest * PART) - nearest * REST
    part = int(nearest) & (PARTS - 1)
    square = x * x
    s = x + x * square * (-1.0 / 6.0 + square / 120.0)
    c = square * (-0.5 + square / 24.0)
    cosine, sine = COSINES[part], SINES[part]
    return cosine + (cosine * c - sine * s), sine + (sine * c + cosine * s)


@inner
def taylor(coefficients: Array, angle: float) -> tuple[float, float, float]:
    """g(theta), g'(theta) and g''(theta); coefficients (2H+1,) in the order 0, Re 1, Im 1, ..."""
    c, s = cosine_sine(angle)
    value, slope, curvature = coefficients[0], 0.0, 0.0
    ch, sh = 1.0, 0.0
    h, k, end = 1.0, 1, 0.5 * coefficients.shape[0]
    while h < end:
        ch, sh = ch * c - sh * s, sh * c + ch * s
        re, im = coefficients[k], coefficients[k + 1]
        part = re * ch - im * sh
        value += part
        slope -= h * (re * sh + im * ch)
        curvature -= h * h * part
        h += 1.0
        k += 2
    return value, slope, curvature


@lean
def value_and_slope(coefficients: Array, angle: float) -> tuple[float, float]:
    """g(theta) and g'(theta)."""
    value, slope, _ = taylor(coefficients, angle)
    return value, slope


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


def cell_table(n_harmonics: int) -> Array:
    """Equal cells of the turn: g, g' r and g'' r^2 / 2 at their middles, r their half width: (2H+1, 3 cells)."""
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
    """Bound g = factor * first + other * second in every cell; first, second: as `cell_table` times coefficients.

    Written: `highest`, which g does not exceed, and `steepest`, which -g' r does not; third bounds |g'''|.
    """
    cells = first.shape[1]
    radius = 0.5 * FULL_TURN / cells
    rest = third * radius * radius * radius
    for k in range(cells):
        value = factor * first[0, k] + other * second[0, k]
        slope = factor * first[1, k] + other * second[1, k]
        bend = factor * first[2, k] + other * second[2, k]
        highest[k] = value + abs(slope) + 0.5 * (bend + abs(bend)) + rest / 6.0
        steepest[k] = 2.0 * abs(bend) - slope + 0.5 * rest


@inner
def crossing(coefficients: Array, level: float, left: float, right: float, angle: float) -> float:
    """The one angle in [left, right] at which g rises through `level`: Halley's steps from `angle`, kept in there."""
    for _ in range(100):
        value, slope, curvature = taylor(coefficients, angle)
        value -= level
        if value < 0.0:
            left = angle
        else:
            right = angle
        divisor = 2.0 * slope * slope - value * curvature
        step = 2.0 * value * slope / divisor if divisor > 0.0 else NOWHERE
        angle -= step
        if left <= angle <= right:
            if abs(step) <= 1e-7:  # third order: the next step would be nothing
                return angle
        else:
            angle = 0.5 * (left + right)
            if right - left <= 1e-15 * FULL_TURN:
                return angle
    return angle


@inner
def first_rise(
    coefficients: Array, level: float, third: float, left: float, right: float, falling: bool, slack: float
) -> float:
    """First angle in [left, right] at which g, not above `level` at left, rises above level + slack; else NOWHERE.

    Intervals are halved until a Taylor bound about the middle (third bounds |g'''|) proves that g stays below, or
    that it is monotone, convex or concave, so that its value at the right end tells of a single crossing. No rise is
    missed but one undone within 1e-8 rad, in which g is above by less than 2e-17 M2, M2 a bound of |g''|.
    falling: g does not rise at `left`.
    """
    angle = left
    while angle < right:
        stop = right
        while True:
            radius = 0.5 * (stop - angle)
            middle = angle + radius
            value, slope, curvature = taylor(coefficients, middle)
            value -= level
            change = (abs(curvature) + 0.5 * third * radius) * radius
            top = (
                value + (abs(slope) + (0.25 * (curvature + abs(curvature)) + third * radius / 6.0) * radius) * radius
            )
            concave = curvature + third * radius <= 0.0
            if top <= slack or slope <= -change or (falling and concave):
                break
            narrow = radius <= NARROWEST
            if concave or narrow or curvature >= third * radius or slope >= change:
                leaving = 0.0
                at_stop = value + (slope + (0.5 * curvature - third * radius / 6.0) * radius) * radius  # at least
                if at_stop <= slack:
                    at_stop, leaving, _ = taylor(coefficients, stop)
                    at_stop -= level
                if at_stop > slack:
                    root = slope * slope - 2.0 * curvature * value
                    root = slope + (math.sqrt(root) if root > 0.0 else 0.0)
                    start = middle - 2.0 * value / root if root > 0.0 else middle
                    if not angle < start < stop:
                        start = middle if value > 0.0 else stop
                    return crossing(coefficients, level, angle, stop, start)
                if narrow or not concave or at_stop - radius * (leaving - abs(leaving)) <= slack:
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
    fresh: float,
    curves: Array,
    thirds: Array,
    highest: Array,
) -> tuple[float, int]:
    """First angle in the interval at which one of the curves rises above its level, and its row: else (end, -1).

    curves (4, 2H+1), thirds (4,) bounds of their third derivatives, highest (4, cells) bounds in the cells (any
    positive multiple where the level is 0); row 0 is held against `level`, row 1 against -level, 2 and 3 against 0.
    fresh: row of the curve that has a maximum, at its level, at the beginning of the interval (-1: none).
    """
    angle, end = interval
    cells = highest.shape[1]
    width = FULL_TURN / cells
    cell = math.floor(angle / width)
    if (cell + 1) * width <= angle:
        cell += 1
    place = cell % cells
    while angle < end:
        right = (cell + 1) * width
        if right > end:
            right = end
        # A maximum just before the end of a cell is best judged together with what follows.
        wide = fresh >= 0.0 and right - angle < 0.5 * width
        if wide:
            right = right + width if right + width < end else end
        met, hit = right, -1
        for row in range(rows[0], rows[1]):
            height = 0.0 if row > 1 else (1 - 2 * row) * level
            if wide or highest[row, place] > height + slack:
                rise = first_rise(curves[row], height, thirds[row], angle, met, row == fresh, slack)
                if rise < NOWHERE:
                    met, hit = rise, row
        if hit >= 0:
            return met, hit
        angle, fresh = right, -1.0
        cell += 2 if wide else 1
        place += 2 if wide else 1
        if place >= cells:
            place -= cells
    return end, -1


@inner
def prepare_roots(
    coefficients: Array, values: Array, curves: Array, thirds: Array, highest: Array, roots: Array
) -> int:
    """Roots of g in [0, 2 pi) from its `values` (3, cells) in the cells (see `cell_table`); their number.

    `roots` has room for them; curves, thirds and highest are scratch (see `next_rise`).
    """
    zeroth, third, _ = derivative_bounds(coefficients)
    if zeroth <= abs(coefficients[0]):  # no harmonic can reach zero
        return 0
    for row in range(2, 4):
        sign = 5.0 - 2.0 * row
        for j in range(coefficients.shape[0]):
            curves[row, j] = sign * coefficients[j]
        thirds[row] = third
        bound_cells(values, sign, values, 0.0, third, highest[row], highest[0])
    value, slope, _ = taylor(coefficients, 0.0)
    row = 3 if value > 0.0 or (value == 0.0 and slope > 0.0) else 2
    angle, count = 0.0, 0
    while count < roots.shape[0]:
        angle, hit = next_rise((angle, FULL_TURN), (row, row + 1), 0.0, 0.0, -1.0, curves, thirds, highest)
        if hit < 0:
            break
        roots[count] = angle
        count += 1
        row = 5 - row
    return count


def find_roots(coefficients: Array, roots: Array) -> int:
    """Write all simple roots of g in [0, 2 pi) into `roots` (room for 2H), ascending; returns their number.

    The turn is cut into cells, and these are halved, until Taylor bounds prove that a piece holds no root or that g
    crosses zero once in it (see `first_rise`). None is missed but pairs nearer than 1e-8 rad, between which |g| is
    below 2e-17 M2, M2 = sum h^2 |c_h|.
    """
    table = cell_table((coefficients.shape[0] - 1) // 2)
    values = np.ascontiguousarray((coefficients @ table).reshape(3, -1))
    curves, highest = np.zeros((4, coefficients.shape[0])), np.empty((4, values.shape[1]))
    return _enter_roots(coefficients, values, curves, np.empty(4), highest, roots)


@lean
def _enter_roots(
    coefficients: Array, values: Array, curves: Array, thirds: Array, highest: Array, roots: Array
) -> int:
    return prepare_roots(coefficients, values, curves, thirds, highest, roots)
