"""Events of a slider over one cycle: when it sticks, slips and lifts off, in the order of time (compiled)."""

from nonlinear.compilation import compiled
from nonlinear.contact import SLIP, STICK, Array
from nonlinear.trigonometric import FULL_TURN, NOWHERE, bound_cells, derivative_bound, next_rise, taylor

NEVER, EXTREMUM, RECONTACT = -1, 0, 1
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
        stuck = stuck and curves[side, 0] + derivative_bound(curves[side], 0) <= 0.0
    return stuck


@compiled
def bound_limits(gain: float, motion: Array, load: Array, curves: Array, thirds: Array, highest: Array) -> None:
    """Write bounds of the curves (see `next_rise`); motion and load: their values (3, cells) of `cell_table`."""
    for side in range(2):
        thirds[side] = derivative_bound(curves[side], 3)
        thirds[side + 2] = derivative_bound(curves[side], 4)
        bound_cells(motion, 1.0 - 2.0 * side, load, -gain, thirds[side], highest[side], highest[side + 2])


@compiled
def round_off(curves: Array) -> float:
    """Excess over a limit (m) that does not count as slip."""
    scale = 0.0
    for j in range(curves.shape[1]):
        scale += abs(curves[0, j]) + abs(curves[1, j])
    return ROUND_OFF * scale


@compiled
def record(stretches: Array, count: int, state: int, left: float, right: float, sign: float, kind: int) -> int:
    """Append a stretch: state, left and right angle, sign of the last slip, what set the slider (at `left`)."""
    if right <= left:
        return count
    row = stretches[count]
    row[0], row[1], row[2], row[3], row[4] = state, left, right, sign, kind
    return count + 1


@compiled
def start_loaded(curves: Array, highest: Array, least: float) -> tuple[float, float, int]:
    """Where to start a slider that never lifts off: angle, position and limit it slips along (-1: it sticks).

    Where it slips at all in its cycle, the largest value of its lower limit u - gain N sets it: it starts just before
    that, on the limit. Else it starts from w = 0.
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
    position, side = 0.0, -1
    for row in range(2):
        value, slope, _ = taylor(curves[row], angle)
        direction = 1.0 - 2.0 * row
        if value - direction * position > least or (row == 0 and top > least):
            position, side = direction * value, row if slope > 0.0 else -1
    return angle, position, side


@compiled
def start_recontact(angle: float, motion: Array, curves: Array) -> tuple[float, float, int]:
    """The same for a slider that touches down at `angle`: it starts from w = u."""
    side = -1
    for row in range(2):
        if taylor(curves[row], angle)[1] > 0.0:
            side = row
    return angle, taylor(motion, angle)[0], side


@compiled
def march(
    start: tuple[float, float, int],
    end: float,
    curves: Array,
    thirds: Array,
    highest: Array,
    least: float,
    stretches: Array,
    count: int,
) -> tuple[int, int]:
    """Record the stretches of a slider under load; returns the first row of the cycle and the number of rows.

    start: angle, position w and limit the slider slips along (0, 1; -1: it sticks). It goes to lift-off at `end` or,
    end = NOWHERE, on and on. Then the cycle begins where a slip ends: a turn later the slider is at the same place,
    or that slip was none of the steady cycle, which is reached within one turn; then it begins at the last slip.
    """
    began, position, side = start
    closed, settled = end == NOWHERE, False
    sign = 0.0 if side < 0 else 1.0 - 2.0 * side
    kind = RECONTACT
    if closed:
        kind, end = NEVER, began + FULL_TURN
    first, anchor, last, last_row, fresh = 0, -1, began, 0, -1
    while True:
        slack = least if side < 0 else 0.0
        rows = (0, 2) if side < 0 else (side + 2, side + 3)
        met, hit = next_rise((began, end), rows, position, slack, fresh, curves, thirds, highest)
        if hit < 0 and closed and anchor >= 0 and not settled:
            settled = side == anchor or last_row == first or last > end - SAME
            if not settled:
                first, anchor, end, settled = last_row, 2, last + FULL_TURN, True
                continue
        count = record(stretches, count, STICK if side < 0 else SLIP, began, met, sign, kind)
        if hit < 0:
            return first, count
        began, fresh = met, -1
        if side < 0:
            side, sign = hit, 1.0 - 2.0 * hit
            continue
        position, kind, last, last_row = sign * taylor(curves[side], met)[0], EXTREMUM, met, count
        if closed and anchor < 0:
            first, anchor, end = count, side, met + FULL_TURN
        fresh, side = side, -1
