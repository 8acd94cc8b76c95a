"""Events of a slider over one cycle: when it sticks, slips and lifts off, in the order of time (compiled)."""

import numpy as np

from nonlinear.compilation import compiled
from nonlinear.contact import LIFT_OFF, SLIP, STICK, Array
from nonlinear.trigonometric import FULL_TURN, bracketed_root, differentiate, find_roots, value_and_slope

NEVER, EXTREMUM, RECONTACT = -1, 0, 1
ROUND_OFF = 1e-13  # slip shorter than this part of the motion is none


@compiled
def march_events(
    motion: Array, load: Array, load_roots: Array, n_roots: int, mu: float, kt: float, stretches: Array
) -> int:
    """Record the steady cycle of a slider as stretches; returns their number.

    motion u, load N (not clipped): coefficients (2H+1,); load_roots: the n_roots roots of N. Each row of `stretches`:
    state, left and right angle, sign of the last slip, what set the slider (NEVER, EXTREMUM, RECONTACT) and at which
    angle. The slider starts at w = 0; one turn brings it to its steady cycle, the second is recorded.
    """
    size = motion.shape[0]
    limits = np.empty(
        (2, size)
    )  # w slips along limits[0] = u - mu N / kt upwards, limits[1] = u + mu N / kt downwards
    slope, found = np.empty(size), np.empty(size)
    breaks = np.empty(3 * size + 2)
    breaks[0], n_breaks = 0.0, 1
    for k in range(n_roots):
        n_breaks = _insert(breaks, n_breaks, load_roots[k])
    for side in range(2):
        for j in range(size):
            limits[side, j] = motion[j] + (2 * side - 1) * mu * load[j] / kt
        differentiate(limits[side], slope)
        for k in range(find_roots(slope, found)):
            n_breaks = _insert(breaks, n_breaks, found[k])
    breaks[n_breaks] = FULL_TURN
    scale = 0.0
    for j in range(size):
        scale += abs(motion[j]) + mu / kt * abs(load[j])
    slider = np.array([0.0, 0.0, float(NEVER), 0.0])  # position, sign, kind, angle
    count = 0
    for turn in range(2):
        for k in range(n_breaks):
            if breaks[k + 1] > breaks[k]:
                interval = (breaks[k], breaks[k + 1])
                count = _advance(interval, motion, load, limits, slider, ROUND_OFF * scale, stretches, count)
        if turn == 0:
            count = 0
    return count


@compiled
def _insert(ascending: Array, count: int, value: float) -> int:
    """Insert `value` in its place among the first `count`; returns the new count."""
    place = count
    while place > 0 and ascending[place - 1] > value:
        ascending[place] = ascending[place - 1]
        place -= 1
    ascending[place] = value
    return count + 1


@compiled
def _advance(
    interval: tuple[float, float],
    motion: Array,
    load: Array,
    limits: Array,
    slider: Array,
    least: float,
    stretches: Array,
    count: int,
) -> int:
    """Move the slider over an interval without extrema of its limits and roots of the load."""
    left, right = interval
    if value_and_slope(load, 0.5 * (left + right))[0] <= 0.0:
        slider[0], slider[1] = value_and_slope(motion, right)[0], 0.0
        slider[2], slider[3] = RECONTACT, right
        return _record(stretches, count, LIFT_OFF, left, right, slider)
    for side in range(2):
        direction = 1.0 - 2.0 * side
        reached = direction * (value_and_slope(limits[side], right)[0] - slider[0])
        if reached <= least:
            continue
        start = left
        if direction * (value_and_slope(limits[side], left)[0] - slider[0]) < 0.0:
            start = bracketed_root(limits[side], slider[0], left, right)
            count = _record(stretches, count, STICK, left, start, slider)
        slider[0], slider[1] = value_and_slope(limits[side], right)[0], direction
        slider[2], slider[3] = EXTREMUM, right
        return _record(stretches, count, SLIP, start, right, slider)
    return _record(stretches, count, STICK, left, right, slider)


@compiled
def _record(stretches: Array, count: int, state: int, left: float, right: float, slider: Array) -> int:
    """Append a stretch."""
    row = stretches[count]
    row[0], row[1], row[2], row[3], row[4], row[5] = state, left, right, slider[1], slider[2], slider[3]
    return count + 1
