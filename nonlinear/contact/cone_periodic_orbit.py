"""Periodic orbit of a slider in the contact plane under the circular friction cone |T| <= mu N (compiled).

The slider is followed from event to event: stick and contact end at roots of polynomials, slip is solved panel by
panel in `cone_slip_collocation`. With separation each contact interval begins anew, with w = u; without it the
periodic orbit is a fixed point of the map of the slider position over a period.
"""

import math

from nonlinear.contact.cone_slip_collocation import (
    SLIPPING,
    STARTING,
    STICKING,
    ConeSlider,
    Panel,
    Workspace,
    add_panel,
    slip_end,
    solve_panel,
    write_panel,
    write_position,
)
from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import Array
from nonlinear.contact.return_map import Integers
from nonlinear.contact.trigonometric_roots import NOWHERE, PERIOD, derivative_bounds, first_rise, taylor

ROUND_OFF = 1e-14  # of the terms of |u - w|^2 - r^2


@inner
def next_rise_of(polynomial: Array, angle: float, end: float, falling: bool, slack: float) -> float:
    """First angle in [angle, end] at which g rises above 0, by more than `slack`, or `end`.

    `falling`: g falls from 0 at `angle`, which is no rise.
    """
    zeroth, third, _ = derivative_bounds(polynomial)
    if polynomial[0] + zeroth <= slack:
        return end
    if not falling:
        value, rate, _ = taylor(polynomial, angle)
        if value > slack or (value >= -slack and rate > 0.0):
            return angle
    piece = PERIOD / (3.0 * (polynomial.shape[0] - 1))
    while angle < end:
        right = min(angle + piece, end)
        rise = first_rise(polynomial, 0.0, third, angle, right, falling, slack)
        if rise < NOWHERE:
            return rise
        angle, falling = right, False
    return end


@inner
def find_contact_intervals(r: Array, angles: Array, polynomial: Array) -> int:
    """Write the roots of r, the first one again a period later and NOWHERE to the end of `angles` (2H+3 or more).

    Returns the place of the first rise, where a contact interval begins; -1: r > 0 throughout, -2: nowhere.
    """
    sign, count, angle = -1.0 if taylor(r, 0.0)[0] > 0.0 else 1.0, 0, 0.0
    first = int(0.5 - 0.5 * sign)
    while angle < PERIOD and count < angles.shape[0] - 2:
        for j in range(r.shape[0]):
            polynomial[j] = sign * r[j]
        angle = next_rise_of(polynomial, angle, PERIOD, count > 0, 0.0)
        if angle < PERIOD or count % 2 == 1:  # as many rises as falls
            angles[count], sign = angle, -sign
            count += 1
    if count == 0:
        return first - 2
    angles[count] = angles[0] + PERIOD
    for k in range(count + 1, angles.shape[0]):
        angles[k] = NOWHERE
    return first


@inner
def add_interval_moments(left: float, right: float, moments: Array, mean: Array) -> None:
    """Add the means of cos(m theta), sin(m theta) over an interval to `moments` (2, 2H+1).

    Written: `mean` (2H+1,), the means of the basis functions phi_i over the interval.
    """
    for m in range(moments.shape[1]):
        cosine, sine = right - left, 0.0
        if m > 0:
            cosine = (math.sin(m * right) - math.sin(m * left)) / m
            sine = (math.cos(m * left) - math.cos(m * right)) / m
        cosine /= PERIOD
        sine /= PERIOD
        moments[0, m] += cosine
        moments[1, m] += sine
        if 2 * m < moments.shape[1]:
            mean[2 * m] = -sine
            mean[max(2 * m - 1, 0)] = cosine


@inner
def stick(slider: ConeSlider, work: Workspace) -> float:
    """Hold the slider until |u - w|^2 - r^2, a polynomial of degree 2H, rises through 0; returns the angle.

    That is at most the end of the present interval. The stick interval is added to the means.
    """
    state, w, polynomial, mean = slider.iteration, slider.w, work.polynomial, work.mean
    slack = 1.0
    for j in range(slider.curves.shape[1]):
        polynomial[j] = slider.curves[3, j]
        slack += abs(polynomial[j])
    for a in range(2):
        polynomial[0] += w[a, 0] * w[a, 0]
        for j in range(slider.curves.shape[1]):
            polynomial[j] -= 2.0 * w[a, 0] * slider.curves[a, j]
    rise = next_rise_of(polynomial, state.angle, state.end, state.after_slip, ROUND_OFF * slack)
    if state.accumulate:
        add_interval_moments(state.angle, rise, slider.stick_moments, mean)
        _add_position(mean, w, slider.deflection)
    return rise


@inner
def _add_position(mean: Array, w: Array, deflection: Array) -> None:
    """Add the mean of -w phi_i over an interval of stick, and its derivatives."""
    for a in range(2):
        for i in range(deflection.shape[1]):
            for j in range(deflection.shape[2]):
                deflection[a, i, j] -= mean[i] * w[a, j]


# Last Legendre coefficients of r e in a panel: the error of its integrals is of the order of their square. Where
# contact ends r e is less smooth, the error as large as they times the length.
TAIL, GRADED_TAIL = 1e-7, 1e-11
SHORTEST = 1e-9  # length (rad) of a panel that is taken as it is
MOST_PANELS = 50000
MOST_APPROACHES = 6
NO_SLIP = 1e-13  # slip that is none
SEPARATES = -1.0  # in place of the slip of a period: there is separation
FEASIBLE = 1e-10  # smallest determinant of 1 - M that is divided by
NEAR = 1e-8  # step of Newton's method on the period after which the next is none


@inner
def begin_contact(slider: ConeSlider, work: Workspace) -> None:
    """Place the slider at re-contact, where the next contact interval begins; it moves: dw = du - u' dr / r'."""
    state, panel = slider.iteration, work.panel
    left, right = work.contact_angles[state.next_contact], work.contact_angles[state.next_contact + 1]
    state.angle, state.end = left, right
    state.next_contact += 2
    add_interval_moments(left, right, slider.contact_moments, work.mean)
    write_panel(left, 0.0, 0.0, slider.curves, panel)
    x, y, opening = panel.velocity[0, 0], panel.velocity[1, 0], max(panel.velocity[2, 0], 1.0 / NOWHERE)
    state.state = SLIPPING if math.sqrt(x * x + y * y) > opening else STICKING
    panel.motion[2, 0], panel.e[0, 0], panel.e[1, 0] = 0.0, x / opening, y / opening
    write_position(0, slider, panel)


@inner
def begin_period(slider: ConeSlider) -> None:
    """Note where a period begins and clear what it adds to."""
    state, last = slider.iteration, slider.w.shape[1] - 1
    for a in range(2):
        for j in range(last + 1):
            slider.w_start[a, j] = slider.w[a, j]
        slider.w[a, last - 1], slider.w[a, last] = 1.0 - a, a
        for i in range(slider.deflection.shape[1]):
            slider.stick_moments[a, i] = 0.0
            for j in range(last + 1):
                slider.deflection[a, i, j] = 0.0
    state.angle, state.end, state.state = 0.0, PERIOD, STICKING


@inner
def end_period(slider: ConeSlider) -> bool:
    """Judge a period and place the slider for the next one; returns whether nothing is left to do.

    The map w -> w' of a period never takes two positions apart, and has one fixed point at most unless the slider
    comes to rest (shakedown). Newton's method on w' = w, with the derivative M from the marching, needs few periods
    where marching itself needs many. Where Newton's method leads astray, marching goes on from where the slider was
    moved off its own path. Where a slider comes to rest depends on its path: there the path is followed to the end.
    Derivatives of w go through the same steps as w.
    """
    state, w, w_start = slider.iteration, slider.w, slider.w_start
    last = w.shape[1] - 1
    a11, a12, a21, a22 = 1.0 - w[0, last - 1], -w[0, last], -w[1, last - 1], 1.0 - w[1, last]
    x, y, jump = w[0, 0] - w_start[0, 0], w[1, 0] - w_start[1, 0], NOWHERE
    change, determinant = math.sqrt(x * x + y * y), a11 * a22 - a12 * a21
    if determinant > FEASIBLE:
        jump = math.sqrt((a22 * x - a12 * y) ** 2 + (a11 * y - a21 * x) ** 2) / determinant
    if state.accumulate and jump <= min(NEAR, 0.01 * state.slip):
        state.converged = True
    rests = state.slip == 0.0 and state.off_path  # where it was put: its own path leads elsewhere
    if state.converged or (not rests and (state.slip == 0.0 or state.periods >= state.max_periods)):
        return True
    if rests:
        state.shakedown, state.periods = True, 2  # periods of its own path, made before it was moved off
    astray = state.slip == 0.0 or (state.newton_start and change > 0.9 * state.change)
    newton = not astray and jump < NOWHERE and state.periods > 1 and not state.shakedown
    _keep_path(astray, slider)
    if newton:
        for j in range(last - 1):
            x, y = w[0, j] - w_start[0, j], w[1, j] - w_start[1, j]
            w[0, j] = w_start[0, j] + (a22 * x - a12 * y) / determinant
            w[1, j] = w_start[1, j] + (a11 * y - a21 * x) / determinant
    state.newton_start = newton
    if newton or astray:
        state.off_path = newton
    state.accumulate = jump <= math.sqrt(NEAR) or state.periods >= state.max_periods - 1
    state.change = change
    return False


@inner
def _keep_path(astray: bool, slider: ConeSlider) -> None:
    """Put the slider back on its own path where it is `astray`; else note its position if it is on that path."""
    for j in range(slider.w.shape[1] - 2):
        for a in range(2):
            if astray:
                slider.w[a, j] = slider.w_path[a, j]
            elif not slider.iteration.off_path:
                slider.w_path[a, j] = slider.w[a, j]


@inner
def next_interval(slider: ConeSlider, work: Workspace) -> bool:
    """Begin what is marched next: a contact interval or, without separation, a period; False: nothing left."""
    state = slider.iteration
    if state.periods == 0:
        state.next_contact = find_contact_intervals(slider.curves[2], work.contact_angles, work.polynomial)
        state.separates = state.next_contact != -1
        state.accumulate = state.separates
    if state.separates:
        if state.next_contact < 0 or work.contact_angles[state.next_contact + 1] == NOWHERE:
            return False
        begin_contact(slider, work)
    else:
        if state.periods > 0 and end_period(slider):
            return False
        begin_period(slider)
    state.periods += 1
    state.after_slip = state.separates
    return True


@inner
def first_length(longest: float, panel: Panel) -> float:
    """Length of the first panel of a slip: e turns while u moves by about r."""
    x, y = panel.velocity[0, 0], panel.velocity[1, 0]
    return max(min(longest, 3.0 * panel.motion[2, 0] / (math.sqrt(x * x + y * y) + 1.0 / NOWHERE)), SHORTEST)


@inner
def choose_length(left: float, slider: ConeSlider) -> float:
    """Fit the length of the next panel to what is `left` of the interval; returns 1 if the panel is graded, else 0.

    A graded panel, dense at its end, goes to the end of contact, where r e is not smooth.
    """
    state = slider.iteration
    if state.approach > 0:
        return 0.0
    if state.separates:
        if left <= min(2.0 * state.length, state.graded_below):
            state.length = left
            return 1.0
        state.length = min(state.length, 0.65 * left)
    elif left < 2.0 * state.length:
        state.length = left if left <= state.length else 0.5 * left
    return 0.0


@inner
def slip(longest: float, slider: ConeSlider, panel: Panel) -> None:
    """Go on by one panel of a slip interval, or find that it must be shorter, or that slip ends."""
    state, last = slider.iteration, panel.angle.shape[0] - 1
    left = state.end - state.angle
    graded = choose_length(left, slider)
    length = state.length
    write_panel(state.angle, length, graded, slider.curves, panel)
    if state.state == STARTING:
        state.state, state.length = SLIPPING, first_length(length, panel)
        return
    allowed = GRADED_TAIL / left if graded > 0.0 else TAIL
    if length <= SHORTEST:
        allowed = 0.5 * NOWHERE
    error = solve_panel(state.phi, allowed, slider, panel)
    better = 0.75 * length * (allowed / (error + 1e-30)) ** (1.0 / last)
    if error > allowed and length > SHORTEST:  # a shorter panel
        if graded > 0.0:
            state.graded_below, better = left * min(0.5, 0.9 * math.sqrt(allowed / error)), 0.5 * left
        state.length, state.approach = max(better, 0.15 * length), 0
        return
    if panel.margin[0] <= 0.0:  # no slip, but a slider that starts beyond its elastic limit is drawn in
        x, y = panel.motion[0, 0] - slider.w[0, 0], panel.motion[1, 0] - slider.w[1, 0]
        state.slip += max(math.sqrt(x * x + y * y) - panel.motion[2, 0] - NO_SLIP, 0.0)
        write_position(0, slider, panel)
        state.state, state.after_slip = STICKING, True
        return
    stop = slip_end(length, graded, state.approach, panel)
    if stop != length and length > SHORTEST and state.approach < MOST_APPROACHES:  # slip ends in the panel, or may
        state.approach = state.approach + 1 if stop > 0.0 else 0
        state.graded_below, state.length = min(state.graded_below, 0.75 * left), min(abs(stop), left)
        return
    write_position(last, slider, panel)
    if state.accumulate:
        add_panel(slider, panel)
    for k in range(1, last + 1):
        state.slip += panel.radau.weight[k] * panel.rate[k] * panel.margin[k]
    state.angle = state.end if length >= left * (1.0 - 1e-15) else state.angle + length
    state.length, state.phi = min(longest, better, 3.0 * length), panel.phi[last]
    if state.approach > 0:
        state.state, state.after_slip = STICKING, True


@lean
def periodic_orbits(nodes: Integers, sliders: ConeSlider, work: Workspace, distances: Array) -> None:
    """March the sliders of some nodes to their steady cycles.

    `distances` (n_c,) receives how far each slips in a period, or SEPARATES.
    """
    longest = 8.0 / (sliders.stick_moments.shape[2] - 1)
    for k in nodes:
        state = sliders.iteration[k]
        slider = ConeSlider(
            sliders.dr_dn[k],
            sliders.curves[k],
            sliders.w[k],
            sliders.w_start[k],
            sliders.w_path[k],
            sliders.deflection[k],
            sliders.stick_moments[k],
            sliders.contact_moments[k],
            state,
        )
        for _ in range(MOST_PANELS):
            if state.angle >= state.end:
                if state.slip <= NO_SLIP:
                    state.slip = 0.0
                if not next_interval(slider, work):
                    break
                state.slip, state.length, state.approach = 0.0, longest, 0
                state.graded_below, state.phi = NOWHERE, NOWHERE
            if state.state == STICKING:
                state.angle = stick(slider, work)
                state.state, state.length, state.approach, state.phi = STARTING, longest, 0, NOWHERE
            else:
                slip(longest, slider, work.panel)
        distances[k] = SEPARATES if state.separates else state.slip
