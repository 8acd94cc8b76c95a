"""Trigonometric polynomials c_0 + sum_h Re_h cos(h theta) - Im_h sin(h theta): values and all roots (compiled)."""

import numpy as np

from nonlinear.compilation import compiled
from nonlinear.contact import Array

FULL_TURN = 2.0 * np.pi
NARROWEST = 1e-8  # half width (rad) below which two roots count as a touch without crossing
STACK = 256


@compiled
def value_and_slope(coefficients: Array, angle: float) -> tuple[float, float]:
    """g(theta) and g'(theta); coefficients (2H+1,) in the order 0, Re 1, Im 1, ..."""
    c, s = np.cos(angle), np.sin(angle)
    value, slope = coefficients[0], 0.0
    ch, sh = 1.0, 0.0
    for h in range(1, (coefficients.shape[0] + 1) // 2):
        ch, sh = ch * c - sh * s, sh * c + ch * s
        re, im = coefficients[2 * h - 1], coefficients[2 * h]
        value += re * ch - im * sh
        slope -= h * (re * sh + im * ch)
    return value, slope


@compiled
def differentiate(coefficients: Array, derivative: Array) -> None:
    """Write the coefficients of g' into `derivative`."""
    derivative[0] = 0.0
    for h in range(1, (coefficients.shape[0] + 1) // 2):
        derivative[2 * h - 1] = -h * coefficients[2 * h]
        derivative[2 * h] = h * coefficients[2 * h - 1]


@compiled
def bracketed_root(coefficients: Array, level: float, left: float, right: float) -> float:
    """The root of g(theta) = level in [left, right], g monotone with a sign change: Newton kept in its bracket."""
    at_left = value_and_slope(coefficients, left)[0] - level
    angle = 0.5 * (left + right)
    for _ in range(80):
        value, slope = value_and_slope(coefficients, angle)
        value -= level
        if value == 0.0:
            break
        if (value < 0.0) == (at_left < 0.0):
            left = angle
        else:
            right = angle
        moved = angle - value / slope if slope != 0.0 else right
        if not left < moved < right:
            moved = 0.5 * (left + right)
        if abs(moved - angle) <= 4e-16 * FULL_TURN or right - left <= 4e-16 * FULL_TURN:
            return moved
        angle = moved
    return angle


@compiled
def find_roots(coefficients: Array, roots: Array) -> int:
    """Write all simple roots of g in [0, 2 pi) into `roots` (room for 2H), ascending; returns their number.

    One harmonic: closed form. More: the turn is halved until Taylor bounds prove that a cell holds no root
    (|g| > |g'| r + M2 r^2 / 2 about its middle) or that g is monotone in it (|g'| > M2 r), with M2 = sum h^2 |c_h|.
    None is missed but pairs nearer than 1e-8 rad, between which g is below 1e-16 M2.
    """
    n_harmonics = (coefficients.shape[0] - 1) // 2
    if n_harmonics == 1:
        return _two_roots(coefficients, roots)
    bound = 0.0
    for h in range(1, n_harmonics + 1):
        bound += h * h * np.hypot(coefficients[2 * h - 1], coefficients[2 * h])
    if bound <= abs(coefficients[0]):  # no harmonic can reach zero
        return 0
    cells = 4 * n_harmonics
    width = FULL_TURN / cells
    stack = np.empty((STACK, 2))
    count = 0
    for cell in range(cells):
        stack[0, 0], stack[0, 1] = cell * width, (cell + 1) * width
        depth = 1
        while depth > 0:
            depth -= 1
            left, right = stack[depth, 0], stack[depth, 1]
            middle, radius = 0.5 * (left + right), 0.5 * (right - left)
            value, slope = value_and_slope(coefficients, middle)
            if abs(value) > abs(slope) * radius + 0.5 * bound * radius * radius:
                continue
            if abs(slope) > bound * radius or radius < NARROWEST:
                at_left = value_and_slope(coefficients, left)[0]
                at_right = value_and_slope(coefficients, right)[0]
                if (at_left < 0.0) != (at_right < 0.0) and count < roots.shape[0]:
                    roots[count] = bracketed_root(coefficients, 0.0, left, right)
                    count += 1
                continue
            stack[depth, 0], stack[depth, 1] = middle, right
            stack[depth + 1, 0], stack[depth + 1, 1] = left, middle
            depth += 2
    return count


@compiled
def _two_roots(coefficients: Array, roots: Array) -> int:
    """Roots of c_0 + R cos(theta + phase) = 0."""
    radius = np.hypot(coefficients[1], coefficients[2])
    if radius <= abs(coefficients[0]):
        return 0
    phase = np.arctan2(coefficients[2], coefficients[1])
    opening = np.arccos(-coefficients[0] / radius)
    first = (-phase - opening) % FULL_TURN
    second = (-phase + opening) % FULL_TURN
    roots[0], roots[1] = min(first, second), max(first, second)
    return 2
