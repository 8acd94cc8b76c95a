"""Slip of a slider in the contact plane over a panel, a short piece of the period: Radau collocation (compiled).

u is the motion, r = mu N / kt the elastic limit displacement; in slip u - w = r e with e = (cos phi, sin phi). The
slider moves along e at the rate m = u' . e - r', the margin (slip ends where it falls through 0), and

    r phi' = u' . f,          f = (-sin phi, cos phi).

With r on the left this holds where r = 0 too: where contact begins or ends. Lengths are relative to the largest r.

A row of m = 3 (2H+1) + 3 numbers holds a value and its derivatives by the coefficients of u1, u2 and u_n and by the
two components of the slider position w at the beginning of the period.

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer, 1996, section IV.5.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from nonlinear.contact.numba_cache import inner
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import NOWHERE, PERIOD, cosine_sine

ORDER = 8  # collocation points; the method has order 2 * ORDER - 1 = 15


class RadauTable(NamedTuple):
    """Collocation table of n points of [0, 1]: s = 0 and the n - 1 right Radau points."""

    point: Array  # s, (n,)
    weight: Array  # of the Radau quadrature, (n,), 0 at s = 0
    legendre: Array  # values at the points to the last two Legendre coefficients, (2, n)
    derivative: Array  # values at the points to derivatives in s there, (n, n)
    bernstein: Array  # values at the points to Bernstein coefficients, (n, n)


def radau_table(order: int = ORDER) -> RadauTable:
    """Collocation table with `order` right Radau points."""
    legendre = np.polynomial.legendre
    ends = np.zeros(order + 1)
    ends[order - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(ends).real)
    for _ in range(3):
        x -= legendre.legval(x, ends) / legendre.legval(x, legendre.legder(ends))
    x[-1] = 1.0
    s = np.concatenate([[0.0], 0.5 * (1.0 + x)])
    gap = s[:, None] - s + np.eye(order + 1)
    barycentric = 1.0 / np.prod(gap, axis=1)
    derivative = barycentric / barycentric[:, None] / gap
    np.fill_diagonal(derivative, 0.0)
    np.fill_diagonal(derivative, -derivative.sum(axis=1))
    power = np.arange(order + 1)
    binomial = np.array([math.comb(order, k) for k in power])
    bernstein = np.linalg.inv(binomial * s[:, None] ** power * (1.0 - s[:, None]) ** (order - power))
    weight = np.append(0.0, np.linalg.solve(legendre.legvander(x, order - 1).T, np.eye(order)[0]))
    last = np.linalg.inv(legendre.legvander(2.0 * s - 1.0, order))[-2:]
    matrices = (np.ascontiguousarray(matrix, dtype=np.float64) for matrix in (last, derivative, bernstein))
    return RadauTable(s, weight, *matrices)


STICKING, STARTING, SLIPPING = 0, 1, 2  # STARTING: slip begins, the length of its first panel is not known
ITERATION = np.dtype(
    [
        ("angle", np.float64),  # reached in the present interval
        ("end", np.float64),  # of the interval: a contact interval or, without separation, a period
        ("state", np.int64),  # STICKING, STARTING or SLIPPING
        ("after_slip", np.bool_),  # the slider stands on its limit: the same instant is no new onset of slip
        ("length", np.float64),  # of the next panel
        ("graded_below", np.float64),  # length left in the interval below which a graded panel is tried
        ("approach", np.int64),  # panels tried so far that should end where slip ends
        ("phi", np.float64),  # direction of slip at `angle`, rad; NOWHERE: the slider position tells
        ("slip", np.float64),  # distance slipped in the interval
        ("separates", np.bool_),  # the contact opens in the period
        ("next_contact", np.int64),  # place of the next contact interval in `Workspace.contact_angles`
        ("accumulate", np.bool_),  # means over the interval are summed
        ("periods", np.int64),  # marched so far
        ("max_periods", np.int64),
        ("newton_start", np.bool_),  # the period started where Newton's method placed the slider
        ("change", np.float64),  # of the slider position over the last period
        ("off_path", np.bool_),  # Newton's method has moved the slider off its own path
        ("shakedown", np.bool_),  # the slider comes to rest: its own path is followed to the end
        ("converged", np.bool_),  # the next Newton step is negligible: this is the periodic orbit
    ],
    align=True,
)


class ConeSlider(NamedTuple):
    """A slider of one node; or of all nodes, with one more leading axis in each field."""

    dr_dn: Any  # float: derivative of r by u_n, mu kn / kt
    curves: Array  # (4, 4H+3): coefficients of u1, u2 (without their means), r and |u|^2 - r^2, then zeros
    w: Array  # (2, m): slider position now
    w_start: Array  # (2, m): at the beginning of the period
    w_path: Array  # (2, m): where the slider was moved off its own path
    deflection: Array  # (2, 2H+1, m): mean of (u - w) phi_i over the period (in stick without u)
    stick_moments: Array  # (2, 2H+1): means of cos(m theta), sin(m theta) over stick
    contact_moments: Array  # (2, 2H+1): the same over contact
    iteration: Any  # record of type `ITERATION`


class Panel(NamedTuple):
    """A piece of a slip interval with n collocation points."""

    radau: RadauTable
    angle: Array  # theta, (n,)
    rate: Array  # d theta / ds, (n,)
    motion: Array  # u1, u2 and r, (3, n)
    velocity: Array  # their derivatives by theta, (3, n)
    phi: Array  # direction of slip, (n,)
    e: Array  # (cos phi, sin phi), (2, n)
    f: Array  # (-sin phi, cos phi), (2, n)
    ratio: Array  # r / (d theta / ds), (n,)
    margin: Array  # rate of slip u' . e - r', (n,)
    basis: Array  # Fourier basis, then its derivatives, (n, 2 (2H+1))
    system: Array  # equations of collocation with right sides, (n, n + m)


class Workspace(NamedTuple):
    """Scratch arrays of the kernels."""

    panel: Panel
    polynomial: Array  # coefficients of a trigonometric polynomial, (4H+3,)
    mean: Array  # means of the basis functions over an interval, (2H+1,)
    contact_angles: Array  # roots of r, (4H+3,)


def workspace(radau: RadauTable, n_harmonics: int) -> Workspace:
    """Scratch arrays for `n_harmonics`."""
    n, size = radau.point.size, 2 * n_harmonics + 1
    panel = Panel(
        radau,
        angle=np.empty(n),
        rate=np.empty(n),
        motion=np.empty((3, n)),
        velocity=np.empty((3, n)),
        phi=np.empty(n),
        e=np.empty((2, n)),
        f=np.empty((2, n)),
        ratio=np.empty(n),
        margin=np.empty(n),
        basis=np.empty((n, 2 * size)),
        system=np.zeros((n, n + 3 * size + 3)),
    )
    return Workspace(panel, np.empty(2 * size + 1), np.empty(size), np.empty(2 * size + 1))


def cone_sliders(motion: Array, dr_dn: Array, curves: Array) -> ConeSlider:
    """Sliders of all nodes at w = 0; `motion` (n_c, 3, 2H+1): u1, u2 and r, `curves` as in `ConeSlider`."""
    n, _, size = motion.shape
    w = np.zeros((n, 2, 3 * size + 3))
    w[:, :, 0] = -motion[:, :2, 0]
    deflection = np.zeros((n, 2, size, 3 * size + 3))
    stick, contact = np.zeros((2, n, 2, size))
    return ConeSlider(dr_dn, curves, w, w.copy(), w.copy(), deflection, stick, contact, np.zeros(n, ITERATION))


SOLVED = 1e-7  # correction of phi after which one more of Newton's steps leaves nothing
STILL = 1e-17  # motion of the slider that is none
FARTHEST_STEP = 10.0  # of the length of a panel, relative, after which no end of slip is near
SHORTER, LONGER = -0.75, 2.0  # limits of such a step


@inner
def write_panel(start: float, length: float, graded: float, curves: Array, panel: Panel) -> None:
    """Write the motion at the points of a panel; rows 0, 1 and 2 of `curves`: coefficients of u1, u2 and r.

    theta = start + length s or, graded = 1, start + length (1 - (1 - s)^2), which is dense at the end.
    """
    basis = panel.basis
    size = basis.shape[1] // 2
    for k in range(panel.angle.shape[0]):
        s = panel.radau.point[k]
        angle = start + length * s * (1.0 + graded * (1.0 - s))
        rate = length * (1.0 + graded - 2.0 * graded * s)
        cosine, sine = cosine_sine(angle)
        ch, sh = 1.0, 0.0
        basis[k, 0], basis[k, size] = 1.0, 0.0
        for h in range(1, (size + 1) // 2):
            ch, sh = ch * cosine - sh * sine, sh * cosine + ch * sine
            j = 2 * h
            basis[k, j - 1], basis[k, j] = ch, -sh
            j += size
            basis[k, j - 1], basis[k, j] = -h * sh, -h * ch
        for a in range(3):
            value, derivative = 0.0, 0.0
            for j in range(size):
                value += curves[a, j] * basis[k, j]
                derivative += curves[a, j] * basis[k, size + j]
            panel.motion[a, k], panel.velocity[a, k] = value, derivative
        r = max(panel.motion[2, k], 0.0)
        panel.angle[k], panel.rate[k], panel.motion[2, k] = angle, rate, r
        panel.ratio[k] = r / rate if rate > 0.0 else 0.0


@inner
def guess(phi: float, w: Array, panel: Panel) -> float:
    """Write a first phi: from that at the beginning (NOWHERE: as u - w) each point returns radially from the last.

    Returns |u - w| at the beginning: 0 where contact begins, and e is the direction of motion.
    """
    x, y, far = panel.motion[0, 0] - w[0, 0], panel.motion[1, 0] - w[1, 0], panel.motion[2, 0]
    if phi == NOWHERE:
        far = math.sqrt(x * x + y * y)
        phi = math.atan2(y, x)
    if far == 0.0:
        phi = math.atan2(panel.velocity[1, 0], panel.velocity[0, 0])
        panel.motion[2, 0], panel.ratio[0] = 0.0, 0.0
    panel.phi[0] = phi
    for k in range(1, panel.angle.shape[0]):
        c, s = math.cos(phi), math.sin(phi)
        x, y, step = panel.velocity[0, k], panel.velocity[1, k], panel.angle[k] - panel.angle[k - 1]
        phi += math.atan2((y * c - x * s) * step, panel.motion[2, k - 1] + (x * c + y * s) * step)
        panel.phi[k] = phi
    return far


@inner
def eliminate(system: Array, width: int) -> None:
    """Gauss-Jordan elimination with row exchanges of a system (n, n + right sides) up to column `width`."""
    n = system.shape[0]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        divisor = system[best, k]
        for j in range(k, width):
            value = system[best, j]
            system[best, j] = system[k, j]
            system[k, j] = value / divisor
        for i in range(n):
            factor = system[i, k]
            if i != k:
                for j in range(k + 1, width):
                    system[i, j] -= factor * system[k, j]


@inner
def linearise(width: int, far: float, slider: ConeSlider, panel: Panel) -> None:
    """Write Newton's equations for phi and, beyond column n + 1, those of its derivatives (see `solve_panel`)."""
    nodes, size, system = panel.angle.shape[0], panel.basis.shape[1] // 2, panel.system
    first, rate = nodes + 1, 0.0
    for k in range(nodes):
        c, s, ratio = math.cos(panel.phi[k]), math.sin(panel.phi[k]), panel.ratio[k]
        x, y, change = panel.velocity[0, k], panel.velocity[1, k], 0.0
        panel.e[0, k], panel.e[1, k], panel.f[0, k], panel.f[1, k] = c, s, -s, c
        for j in range(nodes):
            change += panel.radau.derivative[k, j] * (panel.phi[j] - panel.phi[0])
            system[k, j] = ratio * panel.radau.derivative[k, j]
        system[k, k] += x * c + y * s
        panel.margin[k] = x * c + y * s - panel.velocity[2, k]
        system[k, nodes] = y * c - x * s - ratio * change
        if panel.rate[k] > 0.0:
            rate = -slider.dr_dn * change / panel.rate[k]
        for j in range(first, width):
            system[k, j] = 0.0
        if width > first:
            for j in range(size):
                derivative = panel.basis[k, size + j]
                system[k, first + j], system[k, first + size + j] = -s * derivative, c * derivative
                system[k, first + 2 * size + j] = rate * panel.basis[k, j]
    if far > 0.0:
        _give_first(width, far, slider.w, panel)


@inner
def _give_first(width: int, far: float, w: Array, panel: Panel) -> None:
    """Write the equation of phi at the beginning, where it is given: d phi = (du - dw) . f / |u - w|."""
    nodes, size, system = panel.angle.shape[0], panel.basis.shape[1] // 2, panel.system
    for j in range(width):
        system[0, j] = 0.0
    system[0, 0] = 1.0
    if width > nodes + 1:
        for a in range(2):
            factor = panel.f[a, 0] / far
            for j in range(1, w.shape[1]):
                system[0, nodes + j] -= factor * w[a, j]
            for j in range(size):
                system[0, nodes + 1 + a * size + j] += factor * panel.basis[0, j]


@inner
def solve_panel(phi: float, allowed: float, slider: ConeSlider, panel: Panel) -> float:
    """Solve r phi' = u' . f on a panel and, if the error is allowed, for the derivatives of phi; returns the error.

    `phi`: at the beginning, NOWHERE: the slider position tells. With dr = dr_dn d(u_n) the derivatives obey

        r (d phi)' + (u' . e) d phi = d(u') . f - phi' dr,      d phi = (du - dw) . f / |u - w| at the beginning;

    where contact begins the equation itself stands there, and with it the moving re-contact is in the derivative.
    Columns n + 1 .. n + m - 1 of `panel.system` are left with the derivatives of phi, in the order of those of w.
    """
    nodes = panel.angle.shape[0]
    far = guess(phi, slider.w, panel)
    width, error = nodes + 1, NOWHERE
    for _ in range(9):
        linearise(width, far, slider, panel)
        eliminate(panel.system, width)
        largest = 0.0
        for k in range(nodes):
            panel.phi[k] += panel.system[k, nodes]
            largest = max(largest, abs(panel.system[k, nodes]))
        if width > nodes + 1 or not largest < math.pi:
            break
        if largest < SOLVED:
            error = _last_coefficients(panel)
            if error > allowed:
                break
            width = panel.system.shape[1]
    return error


@inner
def _last_coefficients(panel: Panel) -> float:
    """The larger of the last two Legendre coefficients of r e (d theta / ds) / length."""
    error = 0.0
    for row in range(2):
        x, y = 0.0, 0.0
        for k in range(panel.angle.shape[0]):
            weight = panel.radau.legendre[row, k] * panel.motion[2, k] * panel.rate[k] / panel.rate[0]
            x += weight * panel.e[0, k]
            y += weight * panel.e[1, k]
        error = max(error, math.sqrt(x * x + y * y))
    return error


@inner
def write_position(k: int, slider: ConeSlider, panel: Panel) -> None:
    """Write w and its derivatives at point k of a solved panel: dw = du - dr e - r d(phi) f."""
    nodes, size, w = panel.angle.shape[0], panel.basis.shape[1] // 2, slider.w
    r = panel.motion[2, k]
    for a in range(2):
        along, across = panel.e[a, k], r * panel.f[a, k]
        w[a, 0] = panel.motion[a, k] - r * along
        for j in range(1, w.shape[1]):
            w[a, j] = -across * panel.system[k, nodes + j]
        for j in range(1, size + 1):
            value = panel.basis[k, j - 1]
            w[a, a * size + j] += value
            w[a, 2 * size + j] -= slider.dr_dn * along * value


@inner
def add_panel(slider: ConeSlider, panel: Panel) -> None:
    """Add the mean of (u - w) phi_i over a solved panel, and its derivatives, to the deflection."""
    nodes, size, deflection = panel.angle.shape[0], panel.basis.shape[1] // 2, slider.deflection
    for k in range(1, nodes):
        weight, r = panel.radau.weight[k] * panel.rate[k] / PERIOD, panel.motion[2, k]
        for a in range(2):
            for i in range(size):
                along = weight * panel.basis[k, i] * panel.e[a, k]
                across = weight * panel.basis[k, i] * r * panel.f[a, k]
                deflection[a, i, 0] += r * along
                along *= slider.dr_dn
                for j in range(1, deflection.shape[2]):
                    deflection[a, i, j] += across * panel.system[k, nodes + j]
                for j in range(size):
                    deflection[a, i, 1 + 2 * size + j] += along * panel.basis[k, j]


@inner
def slip_end(length: float, graded: float, approach: int, panel: Panel) -> float:
    """Length at which the panel should end because the margin falls through 0 in it, or its `length` if all is well.

    `approach` > 0: it is meant to end there, and does if Newton's step on its length would not move w. Else a change
    of sign at the points tells where; without one, positive Bernstein coefficients prove that there is none between
    them. Negative: they do not, and a panel of that length (without the sign) should be tried.
    """
    nodes, radau = panel.angle.shape[0], panel.radau
    last = nodes - 1 if approach > 0 else 0
    for k in range(nodes - 1, 0, -1):
        if approach == 0 and panel.margin[k] < 0.0:
            last = k
    if approach > 0 or last == 0:
        for i in range(1, nodes if last == 0 else last):
            value = 0.0
            for k in range(nodes):
                value += radau.bernstein[i, k] * panel.margin[k]
            if value <= 0.0:
                return -0.5 * length
        if last == 0:
            return length
    derivative, margin = 0.0, panel.margin[last]
    for k in range(nodes):
        derivative += radau.derivative[last, k] * panel.margin[k]
    step, part, before = -margin / derivative, radau.point[last], radau.point[last - 1]
    if approach > 0:
        if not (abs(step * length * margin) > STILL and abs(step) < FARTHEST_STEP):
            return length
        step = min(max(step, SHORTER), LONGER)
    if approach == 0 and not before - part < step < 0.0:
        step = 0.5 * (before - part)
    part += step
    return length * part * (1.0 + graded * (1.0 - part))
