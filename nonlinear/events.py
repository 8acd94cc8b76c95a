"""Events of a slider over one cycle: when it sticks, slips and lifts off, in the order of time (compiled)."""

from nonlinear.compilation import compiled
from nonlinear.contact import SLIP, STICK, Array
from nonlinear.slider import Integers
from nonlinear.trigonometric import FULL_TURN, NOWHERE, bound_cells, derivative_bounds, next_rise, taylor

STICKS, SLIPS = float(STICK), float(SLIP)  # floats all: every integer constant would be compiled for by itself
NEVER, EXTREMUM, RECONTACT = -1.0, 0.0, 1.0
ROUND_OFF = 1e-13  # slip shorter than this part of the motion is none
SAME = 1e-7  # two maxima nearer than this (rad) set the slider at the same place, to 1e-14


@compiled
def write_limits(motion: Array, load: Array, gain: float, curves: Array) -> bool:
    """Write the curves that decide on the slider w of the motion u under the load N: gain = mu / kt.

    Rows 0 and 1: u - gain N, which w follows upwards, and -(u + gain N), which -w follows upwards. Rows 2 and 3:
    their derivatives times -1, which rise through 0 where such a slip ends. Returns whether the first two are surely
    negative: then a slider at w = 0 never slips.
    """
    stuck = True
    for side in range(2):
        for j in range(motion.shape[0]):
            curves[side, j] = (1.0 - 2.0 * side) * motion[j] - gain * load[j]
        curves[side + 2, 0] = 0.0
        for h in range(1, (motion.shape[0] + 1) // 2):
            curves[side + 2, 2 * h - 1] = h * curves[side, 2 * h]
            curves[side + 2, 2 * h] = -h * curves[side, 2 * h - 1]
        stuck = stuck and curves[side, 0] + derivative_bounds(curves[side])[0] <= 0.0
    return stuck


@compiled
def bound_limits(gain: float, motion: Array, load: Array, curves: Array, thirds: Array, highest: Array) -> None:
    """Write bounds of the curves (see `next_rise`); motion and load: their values (3, cells) of `cell_table`."""
    for side in range(2):
        _, thirds[side], thirds[side + 2] = derivative_bounds(curves[side])
        bound_cells(motion, 1.0 - 2.0 * side, load, -gain, thirds[side], highest[side], highest[side + 2])


@compiled
def record(
    stretches: Array, span: Integers, state: float, left: float, right: float, sign: float, kind: float
) -> None:
    """Append a stretch: state, left and right angle, sign of the last slip, what set the slider (at `left`).

    span: first row of the cycle and number of rows.
    """
    if right > left:
        row = stretches[span[1]]
        row[0], row[1], row[2], row[3], row[4] = state, left, right, sign, kind
        span[1] += 1


@compiled
def start_loaded(curves: Array, highest: Array, least: float) -> tuple[float, float, float, float]:
    """Where to start a slider that never lifts off: angle, position, limit it slips along (-1.0: it sticks), sign.

    The sign (0.0: none) is that of the limit which moved it to its position. Where it slips at all in its cycle, the
    largest value of its lower limit u - gain N sets it: it starts just before that, on the limit. Else it starts from
    w = 0.
    """
    cells = highest.shape[1]
    width = FULL_TURN / cells
    top, peak = 0.0, 0
    for row in range(1, -1, -1):
        peak = 0
        for k in range(cells):
            if highest[row, k] > highest[row, peak]:
                peak = k
        top += taylor(curves[row], (peak + 0.5) * width)[0]
    angle = ((peak - 1) % cells) * width
    position, side, sign = 0.0, -1.0, 0.0
    for row in range(2):
        value, slope, _ = taylor(curves[row], angle)
        direction = 1.0 - 2.0 * row
        if value - direction * position > least or (row == 0 and top > least):
            position, side, sign = direction * value, float(row) if slope > 0.0 else -1.0, direction
    return angle, position, side, sign


@compiled
def start_recontact(angle: float, curves: Array) -> tuple[float, float, float, float]:
    """The same for a slider that touches down at `angle`: it starts from w = u, the mean of its limits."""
    up, rising, _ = taylor(curves[0], angle)
    down, falling, _ = taylor(curves[1], angle)
    side = -1.0
    if rising > 0.0:
        side = 0.0
    elif falling > 0.0:
        side = 1.0
    return angle, 0.5 * (up - down), side, 0.0


@compiled
def march(
    start: tuple[float, float, float, float],
    end: float,
    curves: Array,
    thirds: Array,
    highest: Array,
    least: float,
    stretches: Array,
    span: Integers,
) -> None:
    """Record the stretches of a slider under load.

    start: angle, position w, limit the slider slips along (-1.0: it sticks), sign of what moved it there. It goes to
    lift-off at `end` or,
    end = NOWHERE, on and on. Then the cycle begins where a slip ends: a turn later the slider is at the same place,
    or that slip was none of the steady cycle, which is reached within one turn; then it begins at the last slip.
    """
    began, position = start[0], start[1]
    side = int(start[2])
    closed, settled = end == NOWHERE, False
    sign = start[3] if side < 0 else 1.0 - 2.0 * side
    kind = RECONTACT
    if closed:
        # a motion too small to tell where its limit is largest sticks where the limit put it
        kind, end = NEVER if sign == 0.0 else EXTREMUM, began + FULL_TURN
    anchor, last, last_row, fresh = -1, began, 0, -1.0
    while True:
        slack = least if side < 0 else 0.0
        rows = (0, 2) if side < 0 else (side + 2, side + 3)
        met, hit = next_rise((began, end), rows, position, slack, fresh, curves, thirds, highest)
        if hit < 0 and closed and anchor >= 0 and not settled:
            settled = side == anchor or last_row == span[0] or last > end - SAME
            if not settled:
                span[0], end, settled = last_row, last + FULL_TURN, True
                continue
        record(stretches, span, STICKS if side < 0 else SLIPS, began, met, sign, kind)
        if hit < 0:
            return
        began, fresh = met, -1.0
        if side < 0:
            side, sign = hit, 1.0 - 2.0 * hit
            continue
        position, kind, last, last_row = sign * taylor(curves[side], met)[0], EXTREMUM, met, span[1]
        if closed and anchor < 0:
            span[0], anchor, end = last_row, side, met + FULL_TURN
        fresh, side = float(side), -1


@compiled
def slide(
    windows: Array,
    n_windows: int,
    curves: Array,
    thirds: Array,
    highest: Array,
    stretches: Array,
    span: Integers,
) -> None:
    """Record the steady cycle of a slider under load in the `windows`, beginning and end (NOWHERE: no lift-off)."""
    span[0], span[1] = 0, 0
    least = 0.0
    for j in range(curves.shape[1]):
        least += ROUND_OFF * (abs(curves[0, j]) + abs(curves[1, j]))
    for k in range(n_windows):
        if windows[k, 1] == NOWHERE:
            start = start_loaded(curves, highest, least)
        else:
            start = start_recontact(windows[k, 0], curves)
        march(start, windows[k, 1], curves, thirds, highest, least, stretches, span)
