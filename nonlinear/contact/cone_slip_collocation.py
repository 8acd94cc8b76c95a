"""Slip of a slider in the plane over a panel, a short piece of the cycle: collocation at Radau points (compiled).

u is the motion, r = mu N / kt the reach of the slider w; in slip u - w = r e with e = (cos phi, sin phi). The slider
moves along e at the rate m = u' . e - r', the margin (slip ends where it falls through 0), and

    r phi' = u' . f,          f = (-sin phi, cos phi).

With r on the left this holds where r = 0 too: where contact begins or ends. Lengths are relative to the largest r.
"""

import math

import numpy as np

from nonlinear.contact.numba_cache import inner
from nonlinear.contact.parameters import Array
from nonlinear.contact.trigonometric_roots import FULL_TURN, NOWHERE, cosine_sine

ORDER = 8  # Radau points of a panel
# rows of a panel: theta, d theta / ds, u1, u2, r and their derivatives, phi, e, f, r / (d theta / ds), m
ANGLE, RATE, U1, U2, REACH, DU1, DU2, DREACH, PHI, E1, E2, F1, F2, RATIO, MARGIN, ROWS = range(16)
# rows of the table: points s of [0, 1], weights, the last two Legendre coefficients, then two square matrices
POINT, WEIGHT, NEXT_TO_LAST, LAST, DERIVATIVE = range(5)
SOLVED = 1e-7  # correction of phi after which one more of Newton's steps leaves nothing
STILL = 1e-17  # motion of the slider that is none


def radau_table(order: int = ORDER) -> Array:
    """Collocation table (4 + 2 n, n), n = order + 1, of s = 0 and the right Radau points of [0, 1] (rows: see above).

    The square matrices take values at the points to derivatives and to Bernstein coefficients.
    """
    legendre = np.polynomial.legendre
    ends = np.zeros(order + 1)
    ends[order - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(ends).real)
    for _ in range(3):
        x -= legendre.legval(x, ends) / legendre.legval(x, legendre.legder(ends))
    x[-1] = 1.0
    s = np.concatenate([[0.0], 0.5 * (1.0 + x)])
    gap = s[:, None] - s + np.eye(order + 1)
    weight = 1.0 / np.prod(gap, axis=1)
    derivative = weight / weight[:, None] / gap
    np.fill_diagonal(derivative, 0.0)
    np.fill_diagonal(derivative, -derivative.sum(axis=1))
    power = np.arange(order + 1)
    binomial = np.array([math.comb(order, k) for k in power])
    bernstein = binomial * s[:, None] ** power * (1.0 - s[:, None]) ** (order - power)
    table = np.zeros((DERIVATIVE + 2 * (order + 1), order + 1))
    table[POINT] = s
    table[WEIGHT, 1:] = np.linalg.solve(legendre.legvander(x, order - 1).T, np.eye(order)[0])
    table[NEXT_TO_LAST : LAST + 1] = np.linalg.inv(legendre.legvander(2.0 * s - 1.0, order))[-2:]
    table[DERIVATIVE:] = np.concatenate([derivative, np.linalg.inv(bernstein)])
    return table


@inner
def write_panel(
    start: float, length: float, graded: float, table: Array, curves: Array, panel: Array, basis: Array
) -> None:
    """Write the motion at the points of a panel; curves: coefficients of u1, u2 and r in the rows 0, 1 and 2.

    theta = start + length s or, graded = 1, start + length (1 - (1 - s)^2), which is dense at the end.
    basis (n, 2 (2H+1)): the Fourier basis there, then its derivative.
    """
    size = basis.shape[1] // 2
    for k in range(panel.shape[1]):
        point = table[POINT, k]
        angle, rate = (
            start + length * point * (1.0 + graded * (1.0 - point)),
            length * (1.0 + graded - 2.0 * graded * point),
        )
        c, s = cosine_sine(angle)
        ch, sh = 1.0, 0.0
        basis[k, 0], basis[k, size] = 1.0, 0.0
        for h in range(1, (size + 1) // 2):
            ch, sh = ch * c - sh * s, sh * c + ch * s
            j = 2 * h
            basis[k, j - 1], basis[k, j] = ch, -sh
            j += size
            basis[k, j - 1], basis[k, j] = -h * sh, -h * ch
        for a in range(3):
            value, slope = 0.0, 0.0
            for j in range(size):
                value += curves[a, j] * basis[k, j]
                slope += curves[a, j] * basis[k, size + j]
            panel[U1 + a, k], panel[DU1 + a, k] = value, slope
        reach = max(panel[REACH, k], 0.0)
        panel[ANGLE, k], panel[RATE, k], panel[REACH, k] = angle, rate, reach
        panel[RATIO, k] = reach / rate if rate > 0.0 else 0.0


@inner
def guess(phi: float, memory: Array, panel: Array) -> float:
    """Write a first phi: from that at the beginning (NOWHERE: as u - w) each point returns radially from the last.

    Returns |u - w| at the beginning: 0 where contact begins, and e is the direction of motion.
    """
    x, y, far = panel[U1, 0] - memory[0, 0], panel[U2, 0] - memory[1, 0], panel[REACH, 0]
    if phi == NOWHERE:
        far = math.sqrt(x * x + y * y)
        phi = math.atan2(y, x)
    if far == 0.0:
        phi = math.atan2(panel[DU2, 0], panel[DU1, 0])
        panel[REACH, 0], panel[RATIO, 0] = 0.0, 0.0
    panel[PHI, 0] = phi
    for k in range(1, panel.shape[1]):
        c, s = math.cos(phi), math.sin(phi)
        x, y, step = panel[DU1, k], panel[DU2, k], panel[ANGLE, k] - panel[ANGLE, k - 1]
        phi += math.atan2((y * c - x * s) * step, panel[REACH, k - 1] + (x * c + y * s) * step)
        panel[PHI, k] = phi
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
def linearise(
    width: int, far: float, gain: float, table: Array, panel: Array, basis: Array, memory: Array, system: Array
) -> None:
    """Write Newton's equations for phi and, beyond column n + 1, those of its derivatives (see `solve_panel`)."""
    nodes, size = panel.shape[1], basis.shape[1] // 2
    first, rate = nodes + 1, 0.0
    for k in range(nodes):
        c, s, ratio = math.cos(panel[PHI, k]), math.sin(panel[PHI, k]), panel[RATIO, k]
        x, y, change = panel[DU1, k], panel[DU2, k], 0.0
        panel[E1, k], panel[E2, k], panel[F1, k], panel[F2, k] = c, s, -s, c
        for j in range(nodes):
            change += table[DERIVATIVE + k, j] * (panel[PHI, j] - panel[PHI, 0])
            system[k, j] = ratio * table[DERIVATIVE + k, j]
        system[k, k] += x * c + y * s
        panel[MARGIN, k] = x * c + y * s - panel[DREACH, k]
        system[k, nodes] = y * c - x * s - ratio * change
        if panel[RATE, k] > 0.0:
            rate = -gain * change / panel[RATE, k]
        for j in range(first, width):
            system[k, j] = 0.0
        if width > first:
            for j in range(size):
                slope = basis[k, size + j]
                system[k, first + j], system[k, first + size + j] = -s * slope, c * slope
                system[k, first + 2 * size + j] = rate * basis[k, j]
    if far > 0.0:  # phi is given at the beginning
        for j in range(width):
            system[0, j] = 0.0
        system[0, 0] = 1.0
        if width > first:
            for a in range(2):
                factor = panel[F1 + a, 0] / far
                for j in range(1, memory.shape[1]):
                    system[0, nodes + j] -= factor * memory[a, j]
                for j in range(size):
                    system[0, first + a * size + j] += factor * basis[0, j]


@inner
def solve_panel(
    phi: float, allowed: float, gain: float, table: Array, panel: Array, basis: Array, memory: Array, system: Array
) -> float:
    """Solve r phi' = u' . f on a panel and, if the error is allowed, for the derivatives of phi; returns the error.

    phi: at the beginning, NOWHERE: the place of the slider tells. The error is the larger of the last two Legendre
    coefficients of r e (d theta / ds) / length, NOWHERE where Newton's method fails. With dr = gain d(u_n) the
    derivatives obey

        r (d phi)' + (u' . e) d phi = d(u') . f - phi' dr,      d phi = (du - dw) . f / |u - w| at the beginning;

    where contact begins the equation itself stands there, and with it the moving re-contact is in the derivative.
    memory (2 or more, m): w1, w2, each followed by its derivatives. Columns n + 1 .. n + m - 1 of `system` (n, n + m)
    are left with those of phi in the same order.
    """
    nodes = panel.shape[1]
    far = guess(phi, memory, panel)
    width, error = nodes + 1, NOWHERE
    for _ in range(9):
        linearise(width, far, gain, table, panel, basis, memory, system)
        eliminate(system, width)
        largest = 0.0
        for k in range(nodes):
            panel[PHI, k] += system[k, nodes]
            largest = max(largest, abs(system[k, nodes]))
        if width > nodes + 1 or not largest < math.pi:
            break
        if largest < SOLVED:
            error = 0.0
            for row in range(NEXT_TO_LAST, LAST + 1):
                x, y = 0.0, 0.0
                for k in range(nodes):
                    weight = table[row, k] * panel[REACH, k] * panel[RATE, k] / panel[RATE, 0]
                    x += weight * panel[E1, k]
                    y += weight * panel[E2, k]
                error = max(error, math.sqrt(x * x + y * y))
            if error > allowed:
                break
            width = system.shape[1]
    return error


@inner
def leave(k: int, gain: float, panel: Array, basis: Array, system: Array, memory: Array) -> None:
    """Write w and its derivatives at point k of a solved panel: dw = du - dr e - r d(phi) f."""
    nodes, size = panel.shape[1], basis.shape[1] // 2
    reach = panel[REACH, k]
    for a in range(2):
        along, across = panel[E1 + a, k], reach * panel[F1 + a, k]
        memory[a, 0] = panel[U1 + a, k] - reach * along
        for j in range(1, memory.shape[1]):
            memory[a, j] = -across * system[k, nodes + j]
        for j in range(1, size + 1):
            value = basis[k, j - 1]
            memory[a, a * size + j] += value
            memory[a, 2 * size + j] -= gain * along * value


@inner
def add_panel(gain: float, table: Array, panel: Array, basis: Array, system: Array, own: Array) -> None:
    """Add the mean of (u - w) phi_i over a solved panel, and its derivatives, to `own` (2, 2H+1, m)."""
    nodes, size = panel.shape[1], basis.shape[1] // 2
    for k in range(1, nodes):
        weight, reach = table[WEIGHT, k] * panel[RATE, k] / FULL_TURN, panel[REACH, k]
        for a in range(2):
            for i in range(size):
                along, across = (
                    weight * basis[k, i] * panel[E1 + a, k],
                    weight * basis[k, i] * reach * panel[F1 + a, k],
                )
                own[a, i, 0] += reach * along
                along *= gain
                for j in range(1, own.shape[2]):
                    own[a, i, j] += across * system[k, nodes + j]
                for j in range(size):
                    own[a, i, 1 + 2 * size + j] += along * basis[k, j]


@inner
def slip_end(length: float, graded: float, homing: float, table: Array, panel: Array) -> float:
    """Length at which the panel should end because the margin falls through 0 in it, or its `length` if all is well.

    homing: it is meant to end there, and does if Newton's step on its length would not move w. Else a change of sign
    at the points tells where; without one, positive Bernstein coefficients prove that there is none between them.
    Negative: they do not, and a panel of that length (without the sign) should be tried.
    """
    nodes = panel.shape[1]
    last = nodes - 1 if homing > 0.0 else 0
    for k in range(nodes - 1, 0, -1):
        if homing == 0.0 and panel[MARGIN, k] < 0.0:
            last = k
    if homing > 0.0 or last == 0:
        for i in range(1, nodes if last == 0 else last):
            value = 0.0
            for k in range(nodes):
                value += table[DERIVATIVE + nodes + i, k] * panel[MARGIN, k]
            if value <= 0.0:
                return -0.5 * length
        if last == 0:
            return length
    slope, margin = 0.0, panel[MARGIN, last]
    for k in range(nodes):
        slope += table[DERIVATIVE + last, k] * panel[MARGIN, k]
    step, part, before = -margin / slope, table[POINT, last], table[POINT, last - 1]
    if homing > 0.0 and not STILL < abs(step * length * margin) < abs(0.5 * length * margin):
        return length
    if homing == 0.0 and not before - part < step < 0.0:
        step = 0.5 * (before - part)
    part += step
    return length * part * (1.0 + graded * (1.0 - part))
