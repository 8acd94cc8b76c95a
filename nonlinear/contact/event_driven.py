"""Event-driven contact element with two Jenkins elements per node: events located, intervals integrated exactly.

The kernels list the contact, stick and slip intervals of a period in order of time. An interval enters the force and
its Jacobian by the integrals of the Fourier basis phi = 1, cos, -sin, cos 2, -sin 2, ... of theta up to 2H.

References
----------
B. D. Yang, M. L. Chu, C. H. Menq, Stick-slip-separation analysis and non-linear stiffness and damping
characterization of friction contacts having variable normal load, Journal of Sound and Vibration 210 (1998) 461-481.

E. P. Petrov, D. J. Ewins, Analytical formulation of friction interface elements for analysis of nonlinear
multi-harmonic vibrations of bladed disks, Journal of Turbomachinery 125 (2003) 364-371.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.contact.return_map import Integers
from nonlinear.contact.trigonometric_roots import (
    NOWHERE,
    PERIOD,
    bound_cells,
    cell_table,
    cosine_sine,
    find_roots,
    next_rise,
    taylor,
)

WHOLE_PERIOD = PERIOD - 1e-12  # intervals longer than this are the whole cycle
NO_VIBRATION = 1e-16  # part of the motion in even harmonics that is none


@inner
def integrate_basis(length: float, factor: float, here: Array, there: Array, moments: Array, total: Array) -> None:
    """Integrals of phi_i / (2 pi) over an interval of `length`, with errors relative to the length.

    All arrays (4H+1,). Given: `here`, phi at its beginning. Written: `there`, phi at its end, and `moments`, the
    integrals; these times `factor` are added to `total`. With E = exp(i h length) - 1, phi changes by phi E, and its
    integral is phi E / (i h): no difference of two values is taken, in which stiff springs would amplify round-off.
    """
    turn = length if length < WHOLE_PERIOD else 0.0  # exactly, so that a large static load makes no vibration
    c, s = cosine_sine(0.5 * turn)
    re1, im1 = -2.0 * s * s, 2.0 * s * c
    re, im = 0.0, 0.0
    moments[0], there[0] = length / (2.0 * math.pi), 1.0
    total[0] += factor * moments[0]
    h, k, end = 1.0, 1, 0.5 * here.shape[0]
    while h < end:
        re, im = re + re1 + re * re1 - im * im1, im + im1 + re * im1 + im * re1
        rate = 1.0 / (2.0 * math.pi * h)
        change, other = here[k] * re + here[k + 1] * im, here[k + 1] * re - here[k] * im  # of phi
        even, odd = -other * rate, change * rate
        there[k], there[k + 1], moments[k], moments[k + 1] = here[k] + change, here[k + 1] + other, even, odd
        total[k] += factor * even
        total[k + 1] += factor * odd
        h += 1.0
        k += 2


@inner
def write_basis(angle: float, basis: Array) -> None:
    """Write phi at an angle."""
    c, s = cosine_sine(angle)
    ch, sh = 1.0, 0.0
    basis[0] = 1.0
    for k in range(1, basis.shape[0], 2):
        ch, sh = ch * c - sh * s, sh * c + ch * s
        basis[k], basis[k + 1] = ch, -sh


@inner
def subtract_products(matrix: Array, moments: Array) -> None:
    """Subtract integrals of phi_i phi_j from `matrix` (2H+1, 2H+1), twice in rows i > 0: coefficients of a reaction.

    `moments` (4H+1,): integrals of phi. With g <= h, cos h cos g = (C- + C+) / 2, sin h sin g = (C- - C+) / 2,
    -cos h sin g = (S+ - S-) / 2, -sin h cos g = (S+ + S-) / 2, C and S standing for cos and -sin of h +- g.
    """
    for j in range(matrix.shape[0]):
        matrix[0, j] -= moments[j]
    for h in range(1, matrix.shape[0], 2):  # row of cos h, before that of -sin h
        matrix[h, 0] -= 2.0 * moments[h]
        matrix[h + 1, 0] -= 2.0 * moments[h + 1]
        for g in range(1, h, 2):
            c_plus, s_plus, c_minus, s_minus = (
                moments[h + g + 1],
                moments[h + g + 2],
                moments[h - g - 1],
                moments[h - g],
            )
            matrix[h, g] -= c_minus + c_plus
            matrix[g, h] -= c_minus + c_plus
            matrix[h + 1, g + 1] -= c_minus - c_plus
            matrix[g + 1, h + 1] -= c_minus - c_plus
            matrix[h, g + 1] -= s_plus - s_minus
            matrix[g + 1, h] -= s_plus - s_minus
            matrix[h + 1, g] -= s_plus + s_minus
            matrix[g, h + 1] -= s_plus + s_minus
        c_plus, s_plus = moments[2 * h + 1], moments[2 * h + 2]
        matrix[h, h] -= moments[0] + c_plus
        matrix[h + 1, h + 1] -= moments[0] - c_plus
        matrix[h, h + 1] -= s_plus
        matrix[h + 1, h] -= s_plus


INITIAL_STICK, STICKS, SLIPS = -1.0, float(STICK), float(SLIP)  # INITIAL_STICK: the slider has never left w = 0
ROUND_OFF = 1e-13  # slip shorter than this part of the motion is none
SAME = 1e-7  # two maxima nearer than this (rad) set the slider at the same place, to 1e-14


class Interval(NamedTuple):
    """A part of the period in which a slider sticks or slips, or in which N > 0; a row of `intervals`."""

    state: float  # STICKS, INITIAL_STICK or SLIPS
    # `left`, `right`: where it begins and ends, angles
    left: float
    right: float
    # T / (mu N) in slip; in stick -dw / ((mu / kt) dN) at the angle `left` that set the slider
    slip_sign: float


class Start(NamedTuple):
    """Where a slider starts."""

    angle: float
    position: float  # w
    side: int  # limit that it slips along: 0 the lower one, 1 the upper one; -1: it sticks
    slip_sign: float  # of the stick interval, if it sticks (see `Interval`)


@inner
def list_intervals(
    coefficients: Array,
    cells: Array,
    mu_kt: Array,
    curves: Array,
    bounds: Array,
    intervals: Array,
    spans: Integers,
    state: Integers,
) -> None:
    """Record the contact, stick and slip intervals of all nodes and directions.

    Given: `coefficients` (n_c, 3, 2H+1) of u1, u2 and the unclipped load N; `cells` (n_c, 3, 3, cells), these times
    `cell_table`; `mu_kt` (n_c,) = mu / kt, 0 where there is no slider.
    Written: `intervals`, an `Interval` a row; `spans` (n_c, 3, 2): for t1, t2 and n (where N > 0) the first row
    and the one after the last; `state` (n_c,): the worst one, slip not yet considered.
    Scratch: `curves` (4, 2H+1) and `bounds` (5, cells), see `next_rise`; row 4 of `bounds` is its `thirds`.
    """
    count = 0
    for node in range(mu_kt.shape[0]):
        load, load_cells, span = coefficients[node, 2], cells[node, 2], spans[node, 2]
        span[0], span[1] = count, count
        closed = _list_contact(load, load_cells, curves, bounds, intervals, span)
        contact = (span[0], span[1], closed)
        state[node] = STICK if closed else LIFT_OFF
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
            add_interval(intervals, span, Interval(SLIPS, 0.0, PERIOD, 1.0))
        return pressed
    left = roots[n_roots - 1] - PERIOD if n_roots % 2 == 0 else 0.0
    for k in range(n_roots):
        if pressed:
            add_interval(intervals, span, Interval(SLIPS, left, roots[k], 1.0))
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
        add_interval(intervals, span, Interval(INITIAL_STICK, 0.0, PERIOD, 0.0))
        return
    for side in range(2):
        sign = 1.0 - 2.0 * side
        bound_cells(motion_cells, sign, load_cells, -mu_kt, thirds[side], bounds[side], bounds[side + 2])
    for k in range(first, last):
        contact_interval = interval_at(intervals, k)
        start = start_slider(contact_interval.left, closed, motion_cells, load_cells, mu_kt, curves, tolerance)
        follow_slider(start, contact_interval.right, closed, curves, bounds, tolerance, intervals, span)


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
def add_interval(intervals: Array, span: Integers, interval: Interval) -> None:
    """Append an interval, unless it is empty, to `span`: first row, the one after the last."""
    if interval.right > interval.left and span[1] < intervals.shape[0]:
        row = intervals[span[1]]
        row[0], row[1], row[2], row[3] = interval.state, interval.left, interval.right, interval.slip_sign
        span[1] += 1


@inner
def interval_at(intervals: Array, row: int) -> Interval:
    """The interval of a row."""
    return Interval(intervals[row, 0], intervals[row, 1], intervals[row, 2], intervals[row, 3])


@inner
def start_slider(
    angle: float, closed: bool, motion: Array, load: Array, mu_kt: float, curves: Array, tolerance: float
) -> Start:
    """Where a slider starts.

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
        slip_sign = (upper_rate - lower_rate) / closing if closing != 0.0 else 0.0
        return Start(angle, 0.5 * (lower - upper), side, slip_sign)
    if highest - lowest > tolerance or lower > tolerance:
        return Start(angle, lower, 0 if lower_rate > 0.0 else -1, 1.0)
    if upper > tolerance:
        return Start(angle, -upper, 1 if upper_rate > 0.0 else -1, -1.0)
    return Start(angle, 0.0, -1, 0.0)


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
        if sticks:
            add_interval(intervals, span, Interval(stick, left, event, slip_sign))
        else:
            add_interval(intervals, span, Interval(SLIPS, left, event, 1.0 - 2.0 * side))
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


class NodeLaws(NamedTuple):
    """The parameters of all nodes as the kernels take them."""

    # u1, u2 from where the sliders start, and the unclipped load, are offset + scale times (u1, u2, d_n)
    scale: Array  # (n_c, 3)
    offset: Array  # (n_c, 3)
    normal_stiffness: Array  # kn, (n_c,)
    tangential_stiffness: Array  # kt, (n_c,)
    friction: Array  # mu, (n_c,)
    mu_kt: Array  # mu / kt, 0 where there is no tangential force, (n_c,)
    preload: Array  # N0, (n_c,)
    table: Array  # (2H+1, 3 cells), see `cell_table`


class Scratch(NamedTuple):
    """Memory of `evaluate_nodes`.

    `moments` is (5, 4H+1), `by_node` (n_c, 3, 3 cells) another view of `cells`, the others are those of
    `list_intervals`.
    """

    coefficients: Array
    by_node: Array
    cells: Array
    curves: Array
    bounds: Array
    intervals: Array
    spans: Integers
    moments: Array


@dataclass(frozen=True)
class EventDrivenJenkins:
    """Contact element without time samples (see `ContactElement`): exact forces and Jacobian for any motion.

    Taylor bounds in small cells of the period tell where N can change its sign and where the slider can meet its
    limits or leave them; elsewhere nothing happens, and no event can be missed. Stick, slip and contact intervals
    are then integrals of trigonometric polynomials. The Jacobian includes that the time of re-contact, where the
    slider restarts, moves.
    """

    parameters: ContactParameters
    n_harmonics: int

    @cached_property
    def laws(self) -> NodeLaws:
        """The parameters as the kernels take them."""
        p = self.parameters
        kn, kt = p.normal_stiffness, p.tangential_stiffness
        at_rest = np.zeros((1, p.n_contacts, 3))
        offset = p.from_slider_origin(at_rest)[0].copy()
        offset[:, 2] = p.load_coefficients(at_rest)[0]
        mu_kt = np.divide(p.friction, kt, out=np.zeros(p.n_contacts), where=kt > 0.0)
        scale = np.column_stack([np.ones((p.n_contacts, 2)), kn])
        kn, kt, mu, preload = (
            np.ascontiguousarray(values, dtype=float) for values in (kn, kt, p.friction, p.preload)
        )
        return NodeLaws(scale, offset, kn, kt, mu, mu_kt, preload, cell_table(self.n_harmonics))

    def scratch(self) -> Scratch:
        """Memory for `evaluate_nodes`."""
        size, n_contacts = 2 * self.n_harmonics + 1, self.parameters.n_contacts
        cells = 8 * self.n_harmonics
        values = np.empty((n_contacts, 3, 3, cells))
        return Scratch(
            coefficients=np.empty((n_contacts, 3, size)),
            by_node=values.reshape(n_contacts, 3, -1),
            cells=values,
            curves=np.empty((4, size)),
            bounds=np.empty((5, cells)),
            intervals=np.empty((n_contacts * 32 * (size + 1), 4)),
            spans=np.empty((n_contacts, 3, 2), np.int64),
            moments=np.zeros((5, 2 * size - 1)),
        )

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        size, n_contacts, _ = displacement.shape
        force, state = np.empty((size, n_contacts, 3)), np.empty(n_contacts, np.int64)
        jacobian = np.empty((n_contacts, 3, 3, size, size))
        motion = np.ascontiguousarray(displacement, dtype=float)
        evaluate_nodes(motion, self.laws, self.scratch(), force, jacobian, state)
        return ContactForces(force, jacobian, state)


@lean
def evaluate_nodes(
    displacement: Array, laws: NodeLaws, scratch: Scratch, force: Array, jacobian: Array, state: Integers
) -> None:
    """Write forces (2H+1, n_c, 3), Jacobian (n_c, 3, 3, 2H+1, 2H+1) and worst states of the nodes."""
    size, spans = displacement.shape[0], scratch.spans
    _write_coefficients(displacement, laws, scratch.coefficients, scratch.by_node)
    force[:], jacobian[:], spans[:] = 0.0, 0.0, 0
    intervals = scratch.intervals
    list_intervals(
        scratch.coefficients, scratch.cells, laws.mu_kt, scratch.curves, scratch.bounds, intervals, spans, state
    )
    law = (laws.normal_stiffness, laws.tangential_stiffness, laws.friction)
    for node in range(state.shape[0]):
        force[0, node, 2] = laws.preload[node]
    _integrate(scratch.coefficients, law, intervals, spans, scratch.moments, force, jacobian, state)
    for node in range(state.shape[0]):
        if laws.tangential_stiffness[node] > 0.0 and laws.friction[node] == 0.0 and state[node] < SLIP:
            # a slider that meets no resistance has no events, and slips whenever it moves
            for i in range(1, size):
                if displacement[i, node, 0] != 0.0 or displacement[i, node, 1] != 0.0:
                    state[node] = SLIP


@inner
def _write_coefficients(displacement: Array, laws: NodeLaws, coefficients: Array, cells: Array) -> None:
    """Write the coefficients of u1, u2 and the unclipped load, and their values in the cells, (n_c, 3, 3 cells)."""
    table = laws.table
    for node in range(coefficients.shape[0]):
        for direction in range(3):
            row, values = coefficients[node, direction], cells[node, direction]
            for i in range(row.shape[0]):
                row[i] = laws.scale[node, direction] * displacement[i, node, direction]
            row[0] += laws.offset[node, direction]
            for k in range(values.shape[0]):
                values[k] = 0.0
            for i in range(row.shape[0]):
                factor, shape = row[i], table[i]
                for k in range(values.shape[0]):
                    values[k] += factor * shape[k]


@inner
def _integrate(
    coefficients: Array,
    law: tuple[Array, Array, Array],
    intervals: Array,
    spans: Integers,
    work: Array,
    force: Array,
    jacobian: Array,
    state: Integers,
) -> None:
    """Add the Fourier coefficients of the reactions -(T1, T2, N) and their derivatives.

    `coefficients`, `intervals`, `spans`: see `list_intervals`; `law`: kn, kt and mu, (n_c,) each; `work` (5, 4H+1):
    scratch. Written: `force` (2H+1, n_c, 3), `jacobian` (n_c, 3, 3, 2H+1, 2H+1); raised to SLIP: `state` (n_c,).
    """
    normal_stiffness, tangential_stiffness, friction = law
    for node in range(spans.shape[0]):
        load, kn = coefficients[node, 2], normal_stiffness[node]
        for direction in range(3):
            motion, span = coefficients[node, direction], spans[node, direction]
            own, through = jacobian[node, direction, direction % 2], jacobian[node, direction, 2]
            kt, mu = (tangential_stiffness[node], friction[node]) if direction < 2 else (0.0, 1.0)  # N: as T in slip
            if span[1] > span[0]:
                slips = _add_intervals(intervals, span, kt, mu, work, own, through)
                _finish(own, through, kn, work, motion, load, force[:, node, direction])
                if slips and direction < 2 and kn == 0.0 and _is_odd(motion):
                    force[0, node, direction] = 0.0  # round-off, which a soft support would amplify
                if slips and direction < 2 and state[node] < SLIP:
                    state[node] = SLIP


@inner
def _is_odd(motion: Array) -> bool:
    """Whether there are no even harmonics: under a constant load a slider that slips has no mean force then."""
    even, odd = 0.0, 0.0
    for k in range(1, motion.shape[0], 4):
        odd += abs(motion[k]) + abs(motion[k + 1])
        if k + 3 < motion.shape[0]:
            even += abs(motion[k + 2]) + abs(motion[k + 3])
    return even <= NO_VIBRATION * odd


@inner
def _add_intervals(
    intervals: Array, span: Integers, kt: float, mu: float, work: Array, own: Array, through: Array
) -> bool:
    """Write the moments of stick and slip to work[2], work[3]; add memory to -T = own u + through N; does it slip?

    T = sign mu N in slip, T = kt (u - w) in stick. There w was set at the left end theta_s of the interval: by a slip
    that ended there, w = u(theta_s) - sign mu N(theta_s) / kt, or by re-contact, w = u(theta_s) with N(theta_s) = 0,
    hence dw = du(theta_s) - u'(theta_s) dN(theta_s) / N'(theta_s). Both are w = u - slip_sign mu N / kt (see
    `Interval`).
    """
    moments = work[4]
    for m in range(moments.shape[0]):
        work[2, m], work[3, m] = 0.0, 0.0
    now, previous, slips = 0, -NOWHERE, False
    for k in range(span[0], span[1]):
        interval = interval_at(intervals, k)
        signed_mu, slipping = interval.slip_sign * mu, interval.state == SLIPS
        if interval.left != previous:
            write_basis(interval.left, work[now])
        now, previous = 1 - now, interval.right
        row, factor = (3, signed_mu) if slipping else (2, kt)
        length = interval.right - interval.left
        here = work[1 - now]
        integrate_basis(length, factor, here, work[now], moments, work[row])
        slips = slips or slipping
        if interval.state == STICKS:
            _add_memory(kt, signed_mu, moments, here, own, through)
    return slips


@inner
def _add_memory(kt: float, signed_mu: float, moments: Array, basis: Array, own: Array, through: Array) -> None:
    """Add kt w = kt u - slip_sign mu N at the angle where the `basis` is given, over an interval of stick."""
    size = own.shape[0]
    for i in range(size):
        weight = 2.0 * moments[i] if i > 0 else moments[0]
        held, pushed = weight * kt, weight * signed_mu
        for j in range(size):
            own[i, j] += held * basis[j]
            through[i, j] -= pushed * basis[j]


@inner
def _finish(own: Array, through: Array, kn: float, work: Array, motion: Array, load: Array, force: Array) -> None:
    """Add moments of stick and slip (work[2], work[3]) to -T = own u + through N; add its value to `force`."""
    size = motion.shape[0]
    subtract_products(own, work[2])
    subtract_products(through, work[3])
    for i in range(size):
        value = 0.0
        for j in range(size):
            value += own[i, j] * motion[j] + through[i, j] * load[j]
            through[i, j] *= kn
        force[i] += value
