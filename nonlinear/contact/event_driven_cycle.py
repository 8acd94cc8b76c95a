"""Events of Jenkins elements over one period: contact, stick and slip intervals in order of time (compiled)."""

import math

from nonlinear.contact.numba_cache import inner
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array
from nonlinear.contact.return_map import Integers
from nonlinear.contact.trigonometric_roots import NOWHERE, PERIOD, bound_cells, find_roots, next_rise, taylor

INITIAL_STICK, STICKS, SLIPS = -1.0, float(STICK), float(SLIP)  # INITIAL_STICK: the slider has never left w = 0
ROUND_OFF = 1e-13  # slip shorter than this part of the motion is none
SAME = 1e-7  # two maxima nearer than this (rad) set the slider at the same place, to 1e-14
Start = tuple[float, float, int, float]


@inner
def list_intervals(
    coefficients: Array, cells: Array, mu_kt: Array, curves: Array, bounds: Array, intervals: Array, spans: Integers
) -> None:
    """Record the contact, stick and slip intervals of all nodes and directions.

    Given: `coefficients` (n_c, 3, 2H+1) of u1, u2 and the unclipped load N; `cells` (n_c, 3, 3, cells), these times
    `cell_table`; `mu_kt` (n_c,) = mu / kt, 0 where there is no slider.
    Written: `intervals`, rows as in `add_interval`, and `spans` (n_c, 4, 2): for t1, t2 and n (where N > 0) the first
    row and the one after the last; then the worst state, slip not yet considered.
    Scratch: `curves` (4, 2H+1) and `bounds` (5, cells), see `next_rise`; row 4 of `bounds` is its `thirds`.
    """
    count = 0
    for node in range(mu_kt.shape[0]):
        load, load_cells, span = coefficients[node, 2], cells[node, 2], spans[node, 2]
        span[0], span[1] = count, count
        closed = _list_contact(load, load_cells, curves, bounds, intervals, span)
        contact = (span[0], span[1], closed)
        spans[node, 3, 0] = STICK if closed else LIFT_OFF
        count = span[1]
        for direction in range(2):
            span = spans[node, direction]
            span[0], span[1] = count, count
            if contact[1] > contact[0] and mu_kt[node] > 0.0:
                motion = coefficients[node, direction], cells[node, direction]
                normal = load, load_cells, mu_kt[node]
                _list_stick_and_slip(motion, normal, contact, curves, bounds, intervals, span)
            count = span[1]


@inner
def _list_contact(
    load: Array, load_cells: Array, curves: Array, bounds: Array, intervals: Array, span: Integers
) -> bool:
    """Record the contact intervals, N > 0, of a node; returns whether the contact is closed all the time."""
    roots = curves[0]
    n_roots = find_roots(load, load_cells, curves, bounds[4], bounds, roots)
    value, rate, _ = taylor(load, 0.0)
    pressed = value > 0.0 or (value == 0.0 and rate > 0.0)
    if n_roots == 0:
        if pressed:
            add_interval(intervals, span, SLIPS, 0.0, PERIOD, 1.0)
        return pressed
    left = roots[n_roots - 1] - PERIOD if n_roots % 2 == 0 else 0.0
    for k in range(n_roots):
        if pressed:
            add_interval(intervals, span, SLIPS, left, roots[k], 1.0)
        left, pressed = roots[k], not pressed
    return False


@inner
def _list_stick_and_slip(
    motion: tuple[Array, Array],
    normal: tuple[Array, Array, float],
    contact: tuple[int, int, bool],
    curves: Array,
    bounds: Array,
    intervals: Array,
    span: Integers,
) -> None:
    """Record the stick and slip intervals of one Jenkins element in its contact intervals.

    `motion`: coefficients of u and their values in the cells; `normal`: the same of N, and mu / kt; `contact`: first
    row of its contact intervals, the one after the last, and whether the contact is closed all the time.
    """
    (displacement, motion_cells), (load, load_cells, mu_kt), (first, last, closed) = motion, normal, contact
    thirds = bounds[4]
    highest, tolerance = write_limits(displacement, load, mu_kt, curves, thirds)
    if closed and highest <= 0.0:
        add_interval(intervals, span, INITIAL_STICK, 0.0, PERIOD, 0.0)
        return
    for side in range(2):
        sign = 1.0 - 2.0 * side
        bound_cells(motion_cells, sign, load_cells, -mu_kt, thirds[side], bounds[side], bounds[side + 2])
    for k in range(first, last):
        start = start_slider(intervals[k, 1], closed, motion_cells, load_cells, mu_kt, curves, tolerance)
        follow_slider(start, intervals[k, 2], closed, curves, bounds, tolerance, intervals, span)


@inner
def write_limits(motion: Array, load: Array, mu_kt: float, curves: Array, thirds: Array) -> tuple[float, float]:
    """Write the limits of the slider position w under the motion u and the load N, and bounds of their g'''.

    Rows 0 and 1 of `curves`: u - mu N / kt, which w follows upwards, and -(u + mu N / kt), which -w follows upwards.
    Rows 2 and 3: minus their derivatives, which rise through 0 where such a slip ends. Returns what the first two do
    not exceed (not positive: a slider at w = 0 never slips) and the slip that counts as none.
    """
    highest, tolerance, end = -NOWHERE, 0.0, 0.5 * motion.shape[0]
    for side in range(2):
        sign, row, rate = 1.0 - 2.0 * side, curves[side], curves[side + 2]
        row[0], rate[0] = sign * motion[0] - mu_kt * load[0], 0.0
        zeroth, third, fourth = 0.0, 0.0, 0.0
        h, k = 1.0, 1
        while h < end:
            re, im = sign * motion[k] - mu_kt * load[k], sign * motion[k + 1] - mu_kt * load[k + 1]
            row[k], row[k + 1], rate[k], rate[k + 1] = re, im, h * im, -h * re
            size = math.sqrt(re * re + im * im)
            zeroth += size
            size *= h * h * h
            third += size
            fourth += h * size
            h += 1.0
            k += 2
        thirds[side], thirds[side + 2] = third, fourth
        tolerance += ROUND_OFF * (abs(row[0]) + zeroth)
        if row[0] + zeroth > highest:
            highest = row[0] + zeroth
    return highest, tolerance


@inner
def add_interval(intervals: Array, span: Integers, state: float, left: float, right: float, slip_sign: float) -> None:
    """Append an interval (state, left and right angle, slip sign) to `span`: first row, the one after the last.

    `slip_sign`: T / (mu N) in slip; in stick -dw / ((mu / kt) dN) at the angle `left` that set the slider.
    """
    if right > left and span[1] < intervals.shape[0]:
        row = intervals[span[1]]
        row[0], row[1], row[2], row[3] = state, left, right, slip_sign
        span[1] += 1


@inner
def start_slider(
    angle: float, closed: bool, motion: Array, load: Array, mu_kt: float, curves: Array, tolerance: float
) -> Start:
    """Where a slider starts: angle, position w, limit it slips along (-1: it sticks), slip sign if it sticks.

    On re-contact at `angle` it starts from w = u = the mean of its limits, where N = 0: the angle moves by
    -dN / N', so that dw = -u' dN / N'. One that never lifts off, if it slips at all, is set by the largest value of
    its lower limit u - mu N / kt: it starts just before that, on the limit; else from w = 0 (slip sign 0).
    `motion`, `load`: values in the cells, used where the contact is `closed` all the time.
    """
    cells = motion.shape[1]
    peak, lowest, highest = 0, NOWHERE, -NOWHERE  # smallest upper limit, largest lower limit
    if closed:
        for k in range(cells):
            u, elastic_limit = motion[0, k], mu_kt * load[0, k]
            if u + elastic_limit < lowest:
                lowest = u + elastic_limit
            if u - elastic_limit > highest:
                highest, peak = u - elastic_limit, k
        angle = (peak - 1 if peak > 0 else cells - 1) * (PERIOD / cells)
    lower, lower_rate, _ = taylor(curves[0], angle)
    upper, upper_rate, _ = taylor(curves[1], angle)
    if not closed:
        closing = lower_rate + upper_rate
        side = 0 if lower_rate > 0.0 else (1 if upper_rate > 0.0 else -1)
        return angle, 0.5 * (lower - upper), side, (upper_rate - lower_rate) / closing if closing != 0.0 else 0.0
    if highest - lowest > tolerance or lower > tolerance:
        return angle, lower, 0 if lower_rate > 0.0 else -1, 1.0
    if upper > tolerance:
        return angle, -upper, 1 if upper_rate > 0.0 else -1, -1.0
    return angle, 0.0, -1, 0.0


@inner
def follow_slider(
    start: Start,
    end: float,
    closed: bool,
    curves: Array,
    bounds: Array,
    tolerance: float,
    intervals: Array,
    span: Integers,
) -> None:
    """Record the intervals of a slider in contact from its `start` (see `start_slider`) to separation at `end`.

    Without separation (`closed`) the cycle has no natural beginning: it begins where a slip ends. If one period later
    the slider is not at the same place, that slip was a transient. The steady cycle is then reached, and begins at
    the last slip.
    """
    left, position, side, slip_sign = start
    stick = STICKS
    if closed:
        end = left + PERIOD
        if slip_sign == 0.0:
            stick = INITIAL_STICK
    first_side, settled, last_end, last_row, at_maximum = -1, False, left, 0, -1.0
    while True:
        rows, slack = ((0, 2), tolerance) if side < 0 else ((side + 2, side + 3), 0.0)
        event, hit = next_rise((left, end), rows, position, slack, at_maximum, curves, bounds[4], bounds)
        if hit < 0 and closed and first_side >= 0 and not settled:
            settled = side == first_side or last_row == span[0] or last_end > end - SAME
            if not settled:
                span[0], end, settled = last_row, last_end + PERIOD, True
                continue
        sticks = side < 0
        add_interval(
            intervals, span, stick if sticks else SLIPS, left, event, slip_sign if sticks else 1.0 - 2.0 * side
        )
        if hit < 0:
            return
        left, at_maximum = event, -1.0
        if sticks:
            side = hit
            continue
        slip_sign, stick, last_end, last_row = 1.0 - 2.0 * side, STICKS, event, span[1]
        position = slip_sign * taylor(curves[side], event)[0]
        if closed and first_side < 0:
            span[0], first_side, end = last_row, side, event + PERIOD
        at_maximum, side = float(side), -1
