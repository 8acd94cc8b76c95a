"""Steady cycle of a slider in the plane of the contact under the circular friction cone |T| <= mu N (compiled).

Lengths are relative to the largest reach r = mu N / kt of the node. Arrays, with m = 3 (2H+1) + 3:
curves (4, 4H+3): coefficients of u1, u2 (without their means), r and |u|^2 - r^2, then zeros;
memory (6, m): rows 0 and 1 the place w of the slider, then its derivatives by the coefficients of u1, u2, u_n and by
w at the beginning of the turn; the same at the beginning of the turn, and where the march left its own path;
own (2, 2H+1, m): the mean of (u - w) phi_i over the cycle (in stick without u), followed by its derivatives;
moments (4, 2H+1): means of cos(m theta), sin(m theta) over stick and over contact; scratch (3, 4H+3).
"""

import math

from nonlinear.contact.cone_slip_collocation import (
    DREACH,
    DU1,
    DU2,
    E1,
    E2,
    MARGIN,
    PHI,
    RATE,
    REACH,
    U1,
    U2,
    WEIGHT,
    add_panel,
    leave,
    slip_end,
    solve_panel,
    write_panel,
)
from nonlinear.contact.cone_stick_intervals import add_moments, find_windows, stick
from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import FULL_TURN, NOWHERE

# Last Legendre coefficients of r e in a panel: the error of its integrals is of the order of their square. Where
# contact ends r e is less smooth, the error as large as they times the length.
TAIL, GRADED_TAIL = 1e-7, 1e-11
SHORTEST = 1e-9  # length (rad) of a panel that is taken as it is
MOST_PANELS = 50000
STICKING, STARTING, SLIPPING = 0.0, 1.0, 2.0
TOUCHING = 1e-13  # slip that is none
OPEN = -1.0  # in place of the slip of a turn: there is lift-off
FEASIBLE = 1e-10  # smallest determinant of 1 - M that is divided by
NEAR = 1e-8  # step of Newton's method on the turn after which the next is none
# places of `pace`: angle, end and state of what is marched next, is it added, its number, its place in the roots; is
# there lift-off; was the slider placed by Newton's method, and the step to beat; is it off the march's own path, does
# it come to rest, is the cycle the steady one
AT, TO, STATE, KEEP, TURN, ROOT, LIFTS, TRIAL, BEFORE, ASIDE, RESTS, SETTLED, LIMIT, PLACES = range(14)


@inner
def touch_down(
    gain: float,
    table: Array,
    curves: Array,
    memory: Array,
    panel: Array,
    basis: Array,
    system: Array,
    scratch: Array,
    moments: Array,
    pace: Array,
) -> None:
    """Place the slider where the next window of contact begins, an angle that moves: w = u, dw = du - u' dr / r'."""
    k = int(pace[ROOT])
    left, right = scratch[2, k], scratch[2, k + 1]
    pace[AT], pace[TO], pace[ROOT] = left, right, pace[ROOT] + 2.0
    add_moments(left, right, 2, moments, scratch[1])
    write_panel(left, 0.0, 0.0, table, curves, panel, basis)
    x, y, opening = panel[DU1, 0], panel[DU2, 0], max(panel[DREACH, 0], 1.0 / NOWHERE)
    pace[STATE] = SLIPPING if math.sqrt(x * x + y * y) > opening else STICKING
    panel[REACH, 0], panel[E1, 0], panel[E2, 0] = 0.0, x / opening, y / opening
    leave(0, gain, panel, basis, system, memory)


@inner
def begin_turn(memory: Array, moments: Array, own: Array, pace: Array) -> None:
    """Note where a turn begins and clear what it adds to."""
    last = memory.shape[1] - 1
    for a in range(2):
        for j in range(last + 1):
            memory[2 + a, j] = memory[a, j]
        memory[a, last - 1], memory[a, last] = 1.0 - a, a
        for i in range(own.shape[1]):
            moments[a, i] = 0.0
            for j in range(last + 1):
                own[a, i, j] = 0.0
    pace[AT], pace[TO], pace[STATE] = 0.0, FULL_TURN, STICKING


@inner
def end_turn(slid: float, memory: Array, pace: Array) -> bool:
    """Judge a turn and place the slider for the next one; returns whether nothing is left to do.

    The map w -> w' of a turn never takes two places apart, and has one fixed point at most unless the slider comes to
    rest. Newton's method on w' = w, with the derivative M from the march, needs few turns where the march itself
    needs many; where that leads astray, the march goes on from where it left its own path. Where a slider comes to
    rest depends on its path: there the march is followed to the end. Derivatives of w go through the same steps as w.
    """
    last = memory.shape[1] - 1
    a11, a12, a21, a22 = 1.0 - memory[0, last - 1], -memory[0, last], -memory[1, last - 1], 1.0 - memory[1, last]
    x, y, jump = memory[0, 0] - memory[2, 0], memory[1, 0] - memory[3, 0], NOWHERE
    step, determinant = math.sqrt(x * x + y * y), a11 * a22 - a12 * a21
    if determinant > FEASIBLE:
        jump = math.sqrt((a22 * x - a12 * y) ** 2 + (a11 * y - a21 * x) ** 2) / determinant
    if pace[KEEP] > 0.0 and jump <= min(NEAR, 0.01 * slid):
        pace[SETTLED] = 1.0
    rests = slid == 0.0 and pace[ASIDE] > 0.0  # where it was put: its own path leads elsewhere
    if pace[SETTLED] > 0.0 or (not rests and (slid == 0.0 or pace[TURN] >= pace[LIMIT])):
        return True
    if rests:
        pace[RESTS], pace[TURN] = 1.0, 2.0  # turns of its own path that were made before it was put aside
    astray = slid == 0.0 or (pace[TRIAL] > 0.0 and step > 0.9 * pace[BEFORE])
    trial = not astray and jump < NOWHERE and pace[TURN] > 1.0 and pace[RESTS] == 0.0
    for j in range(last - 1):
        x, y = memory[0, j] - memory[2, j], memory[1, j] - memory[3, j]
        for a in range(2):
            if astray:
                memory[a, j] = memory[4 + a, j]
            elif pace[ASIDE] == 0.0:
                memory[4 + a, j] = memory[a, j]
        if trial:
            memory[0, j] = memory[2, j] + (a22 * x - a12 * y) / determinant
            memory[1, j] = memory[3, j] + (a11 * y - a21 * x) / determinant
    pace[TRIAL] = 1.0 if trial else 0.0
    if trial or astray:
        pace[ASIDE] = pace[TRIAL]
    pace[KEEP] = 1.0 if jump <= math.sqrt(NEAR) or pace[TURN] >= pace[LIMIT] - 1.0 else 0.0
    pace[BEFORE] = step
    return False


@inner
def next_stretch(
    slid: float,
    gain: float,
    table: Array,
    curves: Array,
    memory: Array,
    panel: Array,
    basis: Array,
    system: Array,
    scratch: Array,
    moments: Array,
    own: Array,
    pace: Array,
) -> bool:
    """Set in `pace` what is marched next: a window of contact or, without lift-off, a turn; False: nothing left."""
    if pace[TURN] == 0.0:
        pace[ROOT] = find_windows(curves[2], scratch[2], scratch[0])
        pace[LIFTS] = 0.0 if pace[ROOT] == -1.0 else 1.0
        pace[KEEP] = pace[LIFTS]
    if pace[LIFTS] > 0.0:
        if pace[ROOT] < 0.0 or scratch[2, int(pace[ROOT]) + 1] == NOWHERE:
            return False
        touch_down(gain, table, curves, memory, panel, basis, system, scratch, moments, pace)
    else:
        if pace[TURN] > 0.0 and end_turn(slid, memory, pace):
            return False
        begin_turn(memory, moments, own, pace)
    pace[TURN] += 1.0
    return True


@inner
def first_length(longest: float, panel: Array) -> float:
    """Length of the first panel of a slip: e turns while u moves by about r."""
    x, y = panel[DU1, 0], panel[DU2, 0]
    return max(min(longest, 3.0 * panel[REACH, 0] / (math.sqrt(x * x + y * y) + 1.0 / NOWHERE)), SHORTEST)


@lean
def steady_cycle(
    gain: float,
    table: Array,
    curves: Array,
    memory: Array,
    panel: Array,
    basis: Array,
    system: Array,
    scratch: Array,
    moments: Array,
    own: Array,
    pace: Array,
) -> float:
    """March the slider of a node to its steady cycle, event by event; returns how far it slips in a turn, or OPEN."""
    longest, last = 8.0 / (moments.shape[1] - 1), panel.shape[1] - 1
    angle, end, slid, state, lifts, fresh = 0.0, 0.0, 0.0, STICKING, 0.0, 0.0
    length, reach, homing, phi = longest, NOWHERE, 0.0, NOWHERE
    for _ in range(MOST_PANELS):
        if angle >= end:
            slid = slid if slid > TOUCHING else 0.0
            if not next_stretch(slid, gain, table, curves, memory, panel, basis, system, scratch, moments, own, pace):
                break
            angle, end, state, lifts, fresh = pace[AT], pace[TO], pace[STATE], pace[LIFTS], pace[LIFTS]
            slid, length, reach, homing, phi = 0.0, longest, NOWHERE, 0.0, NOWHERE
        if state == STICKING:
            angle = stick(angle, end, fresh, pace[KEEP], curves, memory, scratch, moments, own)
            state, length, homing, phi = STARTING, longest, 0.0, NOWHERE
            continue
        left, graded = end - angle, 0.0
        if lifts > 0.0 and homing == 0.0:
            graded = 1.0 if left <= min(2.0 * length, reach) else 0.0
            length = left if graded > 0.0 else min(length, 0.65 * left)
        elif left < 2.0 * length and homing == 0.0:
            length = left if left <= length else 0.5 * left
        write_panel(angle, length, graded, table, curves, panel, basis)
        if state == STARTING:
            state, length = SLIPPING, first_length(length, panel)
            continue
        allowed = GRADED_TAIL / left if graded > 0.0 else TAIL
        if length <= SHORTEST:
            allowed = 0.5 * NOWHERE
        error = solve_panel(phi, allowed, gain, table, panel, basis, memory, system)
        better = 0.75 * length * (allowed / (error + 1e-30)) ** (1.0 / last)
        if error > allowed and length > SHORTEST:  # a shorter panel
            if graded > 0.0:
                reach, better = left * min(0.5, 0.9 * math.sqrt(allowed / error)), 0.5 * left
            length, homing = max(better, 0.15 * length), 0.0
            continue
        if panel[MARGIN, 0] <= 0.0:  # no slip, but a slider that starts beyond its reach is drawn in
            x, y = panel[U1, 0] - memory[0, 0], panel[U2, 0] - memory[1, 0]
            slid += max(math.sqrt(x * x + y * y) - panel[REACH, 0] - TOUCHING, 0.0)
            leave(0, gain, panel, basis, system, memory)
            state, fresh = STICKING, 1.0
            continue
        stop = slip_end(length, graded, homing, table, panel)
        if stop != length and length > SHORTEST and homing < 6.0:  # slip ends within the panel, or may
            homing, reach = homing + 1.0 if stop > 0.0 else 0.0, min(reach, 0.75 * left)
            length = min(abs(stop), left)
            continue
        leave(last, gain, panel, basis, system, memory)
        if pace[KEEP] > 0.0:
            add_panel(gain, table, panel, basis, system, own)
        for k in range(1, last + 1):
            slid += table[WEIGHT, k] * panel[RATE, k] * panel[MARGIN, k]
        angle = end if length >= left * (1.0 - 1e-15) else angle + length
        length, phi = min(longest, better, 3.0 * length), panel[PHI, last]
        if homing > 0.0:
            state, fresh = STICKING, 1.0
    return OPEN if pace[LIFTS] > 0.0 else slid
