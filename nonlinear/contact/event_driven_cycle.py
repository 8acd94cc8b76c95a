"""Events of the sliders over one cycle: when they stick, slip and lift off, in the order of time (compiled)."""

import math

from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array
from nonlinear.contact.return_map import Integers
from nonlinear.contact.trigonometric_roots import FULL_TURN, NOWHERE, bound_cells, next_rise, prepare_roots, taylor

NEVER_MOVED, STICKS, SLIPS = -1.0, float(STICK), float(SLIP)
ROUND_OFF = 1e-13  # slip shorter than this part of the motion is none
SAME = 1e-7  # two maxima nearer than this (rad) set the slider at the same place, to 1e-14


@lean
def list_stretches(
    displacement: Array, values: Array, gains: Array, curves: Array, bounds: Array, stretches: Array, spans: Integers
) -> None:
    """Record the cycles of all nodes and directions.

    displacement (n_c, 3, 2H+1): u1, u2 and N; values (n_c, 3, 3, cells): the same times `cell_table`; gains (n_c,):
    mu / kt, 0 where there is no slider. Written: `stretches`, rows as in `record`, and spans (n_c, 4, 2): for t1, t2
    and n (where N > 0) the first row and the one after the last; then the worst state, slip not yet considered.
    Scratch: curves (4, 2H+1) and bounds (5, cells), see `next_rise`; row 4 of `bounds` is its `thirds`.
    """
    count, thirds, roots = 0, bounds[4], curves[0]
    for node in range(gains.shape[0]):
        load, normal, gain, span = displacement[node, 2], values[node, 2], gains[node], spans[node, 2]
        span[0], span[1] = count, count
        n_roots = prepare_roots(load, normal, curves, thirds, bounds, roots)
        value, slope, _ = taylor(load, 0.0)
        pressed = value > 0.0 or (value == 0.0 and slope > 0.0)
        if pressed and n_roots == 0:
            record(stretches, span, SLIPS, 0.0, FULL_TURN, 1.0)
        left = roots[n_roots - 1] - FULL_TURN if n_roots > 0 and n_roots % 2 == 0 else 0.0
        for k in range(n_roots):
            if pressed:
                record(stretches, span, SLIPS, left, roots[k], 1.0)
            left, pressed = roots[k], not pressed
        first, last = span[0], span[1]
        closed = n_roots == 0 and last > first
        spans[node, 3, 0] = STICK if closed else LIFT_OFF
        count = last
        for direction in range(2):
            span, motion = spans[node, direction], values[node, direction]
            span[0], span[1] = count, count
            if last > first and gain > 0.0:
                height, least = write_limits(displacement[node, direction], load, gain, curves, thirds)
                if closed and height <= 0.0:
                    record(stretches, span, NEVER_MOVED, 0.0, FULL_TURN, 0.0)
                else:
                    for side in range(2):
                        sign = 1.0 - 2.0 * side
                        bound_cells(motion, sign, normal, -gain, thirds[side], bounds[side], bounds[side + 2])
                    for k in range(first, last):
                        start = start_slider(stretches[k, 1], closed, motion, normal, gain, curves, least)
                        march(start, stretches[k, 2], closed, curves, bounds, least, stretches, span)
            count = span[1]


@inner
def write_limits(motion: Array, load: Array, gain: float, curves: Array, thirds: Array) -> tuple[float, float]:
    """Write the curves that decide on the slider w of the motion u under the load N, and bounds of their g'''.

    Rows 0 and 1: u - gain N, which w follows upwards, and -(u + gain N), which -w follows upwards. Rows 2 and 3:
    their derivatives times -1, which rise through 0 where such a slip ends. Returns what the first two do not exceed
    (not positive: a slider at w = 0 never slips) and the slip that counts as none.
    """
    height, least, end = -NOWHERE, 0.0, 0.5 * motion.shape[0]
    for side in range(2):
        sign, row, slope = 1.0 - 2.0 * side, curves[side], curves[side + 2]
        row[0], slope[0] = sign * motion[0] - gain * load[0], 0.0
        zeroth, third, fourth = 0.0, 0.0, 0.0
        h, k = 1.0, 1
        while h < end:
            re, im = sign * motion[k] - gain * load[k], sign * motion[k + 1] - gain * load[k + 1]
            row[k], row[k + 1], slope[k], slope[k + 1] = re, im, h * im, -h * re
            size = math.sqrt(re * re + im * im)
            zeroth += size
            size *= h * h * h
            third += size
            fourth += h * size
            h += 1.0
            k += 2
        thirds[side], thirds[side + 2] = third, fourth
        least += ROUND_OFF * (abs(row[0]) + zeroth)
        if row[0] + zeroth > height:
            height = row[0] + zeroth
    return height, least


@inner
def record(stretches: Array, span: Integers, state: float, left: float, right: float, pull: float) -> None:
    """Append a stretch (state, left and right angle, pull) to the cycle `span`: first row, the one after the last.

    pull: T / (mu N) in slip; in stick -dw / (gain dN) at the angle `left` that set the slider.
    """
    if right > left and span[1] < stretches.shape[0]:
        row = stretches[span[1]]
        row[0], row[1], row[2], row[3] = state, left, right, pull
        span[1] += 1


@inner
def start_slider(
    angle: float, closed: bool, motion: Array, load: Array, gain: float, curves: Array, least: float
) -> tuple[float, float, int, float]:
    """Where to start a slider: angle, position w, limit it slips along (-1: it sticks), pull if it sticks.

    One that touches down at `angle` starts from w = u = the mean of its limits, where N = 0: the angle moves by
    -dN / N', so that dw = -u' dN / N'. One that never lifts off, if it slips at all, is set by the largest value of
    its lower limit u - gain N: it starts just before that, on the limit; else from w = 0 (pull 0).
    motion, load: values in the cells, where `closed`.
    """
    cells = motion.shape[1]
    peak, low, high = 0, -NOWHERE, NOWHERE
    if closed:
        for k in range(cells):
            u, reach = motion[0, k], gain * load[0, k]
            if u + reach < high:
                high = u + reach
            if u - reach > low:
                low, peak = u - reach, k
        angle = (peak - 1 if peak > 0 else cells - 1) * (FULL_TURN / cells)
    lower, rising, _ = taylor(curves[0], angle)
    upper, falling, _ = taylor(curves[1], angle)
    if not closed:
        closing = rising + falling
        side = 0 if rising > 0.0 else (1 if falling > 0.0 else -1)
        return angle, 0.5 * (lower - upper), side, (falling - rising) / closing if closing != 0.0 else 0.0
    if low - high > least or lower > least:
        return angle, lower, 0 if rising > 0.0 else -1, 1.0
    if upper > least:
        return angle, -upper, 1 if falling > 0.0 else -1, -1.0
    return angle, 0.0, -1, 0.0


@inner
def march(
    start: tuple[float, float, int, float],
    end: float,
    closed: bool,
    curves: Array,
    bounds: Array,
    least: float,
    stretches: Array,
    span: Integers,
) -> None:
    """Record the stretches of a slider under load from its `start` (see `start_slider`) to lift-off at `end`.

    Where it is `closed` it goes on and on. Then the cycle begins where a slip ends: a turn later the slider is at the
    same place, or that slip was none of the steady cycle, which is reached within one turn; then it begins at the
    last slip.
    """
    began, position, side, pull = start
    rest = STICKS
    if closed:
        end = began + FULL_TURN
        if pull == 0.0:
            rest = NEVER_MOVED
    anchor, settled, last, last_row, fresh = -1, False, began, 0, -1.0
    while True:
        rows, slack = ((0, 2), least) if side < 0 else ((side + 2, side + 3), 0.0)
        met, hit = next_rise((began, end), rows, position, slack, fresh, curves, bounds[4], bounds)
        if hit < 0 and closed and anchor >= 0 and not settled:
            settled = side == anchor or last_row == span[0] or last > end - SAME
            if not settled:
                span[0], end, settled = last_row, last + FULL_TURN, True
                continue
        record(stretches, span, rest if side < 0 else SLIPS, began, met, pull if side < 0 else 1.0 - 2.0 * side)
        if hit < 0:
            return
        began, fresh = met, -1.0
        if side < 0:
            side = hit
            continue
        pull, rest, last, last_row = 1.0 - 2.0 * side, STICKS, met, span[1]
        position = pull * taylor(curves[side], met)[0]
        if closed and anchor < 0:
            span[0], anchor, end = last_row, side, met + FULL_TURN
        fresh, side = float(side), -1
