"""Event-driven contact element for the uncoupled law: transition times found, stretches integrated in closed form."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.compilation import compiled
from nonlinear.contact import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.events import (
    NEVER,
    RECONTACT,
    bound_limits,
    march,
    record,
    round_off,
    start_loaded,
    start_recontact,
    write_limits,
)
from nonlinear.moments import add_gram
from nonlinear.slider import Integers
from nonlinear.trigonometric import FULL_TURN, NOWHERE, cell_table, derivative_bound, prepare_roots, taylor


@dataclass(frozen=True)
class ExactContact:
    """Contact element without time samples (see `ContactElement`): exact forces and Jacobian for any motion.

    Taylor bounds in small cells of the turn tell where N can change its sign and where the slider can meet its limits
    or leave them; elsewhere nothing happens, and no event can be missed. Stick, slip and lift-off stretches are then
    integrals of trigonometric polynomials. The Jacobian includes that the time of re-contact, where the slider
    restarts, moves.
    """

    parameters: ContactParameters
    n_harmonics: int

    @cached_property
    def _table(self) -> Array:
        return cell_table(self.n_harmonics)

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        size, n_contacts, _ = displacement.shape
        columns = np.ascontiguousarray(displacement.reshape(size, -1).T)
        force = np.zeros((size, n_contacts, 3))
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        state = np.zeros(n_contacts, dtype=np.int64)
        p = self.parameters
        laws = (p.normal_stiffness, p.tangential_stiffness, p.friction, p.interference, p.preload)
        values = (columns @ self._table).reshape(n_contacts, 3, 3, -1)
        _evaluate(columns.reshape(n_contacts, 3, size), values, laws, force, jacobian, state)
        return ContactForces(force, jacobian, state)


@compiled
def _evaluate(
    displacement: Array,
    values: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    force: Array,
    jacobian: Array,
    worst: Integers,
) -> None:
    """All nodes and directions; displacement (n_c, 3, 2H+1), values (n_c, 3, 3, cells) (see `cell_table`)."""
    size, cells = displacement.shape[2], values.shape[3]
    load, windows, scratch = np.empty(size), np.empty((size, 2)), np.empty((10, size))
    curves, thirds, highest = np.empty((4, size)), np.empty(4), np.empty((4, cells))
    stretches, none = np.empty((32 * size + 8, 5)), np.zeros((size, size))
    for node in range(force.shape[1]):
        kn, kt, mu = laws[0][node], laws[1][node], laws[2][node]
        offset = laws[4][node] + kn * laws[3][node]
        for j in range(size):
            load[j] = kn * displacement[node, 2, j]
        load[0] += offset
        normal = values[node, 2]
        for k in range(cells):
            normal[0, k] = kn * normal[0, k] + offset
            normal[1, k] *= kn
            normal[2, k] *= kn
        n_roots = prepare_roots(load, normal, curves, thirds, highest, scratch[0])
        n_windows = _pressed(load, scratch[0], n_roots, windows, stretches)
        closed = n_roots == 0 and n_windows == 1
        worst[node] = STICK if closed else LIFT_OFF
        own, through = none, jacobian[node, 2, 2]
        if n_windows > 0:  # N is a "slip" with mu = 1
            _integrate(stretches, 0, n_windows, 0.0, 1.0, load, load, scratch, own, through)
            _finish(own, through, kn, load, load, force, node, 2)
        force[0, node, 2] += laws[4][node]
        for direction in range(2):
            if kt == 0.0 or n_windows == 0:
                continue
            motion = displacement[node, direction]
            own, through = jacobian[node, direction, direction], jacobian[node, direction, 2]
            stuck = write_limits(motion, load, mu / kt, curves)
            if mu == 0.0:  # no force; the slider goes with u
                worst[node] = max(worst[node], STICK if derivative_bound(motion, 0) == 0.0 else SLIP)
                continue
            if stuck and closed:
                for j in range(size):
                    own[j, j] = -kt
                    force[j, node, direction] = -kt * motion[j]
                continue
            bound_limits(mu / kt, values[node, direction], normal, curves, thirds, highest)
            least = round_off(curves)
            first, count = 0, 0
            if closed:
                start = start_loaded(curves, highest, least)
                first, count = march(start, NOWHERE, curves, thirds, highest, least, stretches, 0)
            else:
                for k in range(n_windows):
                    start = start_recontact(windows[k, 0], motion, curves)
                    _, count = march(start, windows[k, 1], curves, thirds, highest, least, stretches, count)
            for k in range(first, count):
                if stretches[k, 0] == SLIP:
                    worst[node] = max(worst[node], SLIP)
            _integrate(stretches, first, count, kt, mu, motion, load, scratch, own, through)
            _finish(own, through, kn, motion, load, force, node, direction)


@compiled
def _pressed(load: Array, roots: Array, n_roots: int, windows: Array, stretches: Array) -> int:
    """Write the windows in which N > 0, beginning and end, and the same as stretches; returns their number."""
    count = 0
    for k in range(max(n_roots, 1)):
        left, right = 0.0, FULL_TURN
        if n_roots > 0:
            left, right = roots[k], roots[k + 1] if k + 1 < n_roots else roots[0] + FULL_TURN
        if taylor(load, 0.5 * (left + right))[0] > 0.0:
            windows[count, 0], windows[count, 1] = left, right
            count = record(stretches, count, SLIP, left, right, 1.0, NEVER)
    return count


@compiled
def _powers(angle: float, cosine: Array, sine: Array) -> None:
    """cos(m theta), sin(m theta) for m = 0 .. 2H."""
    c, s = math.cos(angle), math.sin(angle)
    cosine[0], sine[0] = 1.0, 0.0
    for m in range(1, cosine.shape[0]):
        cosine[m] = cosine[m - 1] * c - sine[m - 1] * s
        sine[m] = sine[m - 1] * c + cosine[m - 1] * s


@compiled
def _integrate(
    stretches: Array,
    first: int,
    count: int,
    kt: float,
    mu: float,
    motion: Array,
    load: Array,
    scratch: Array,
    own: Array,
    through: Array,
) -> None:
    """Add the law T = own u + through N of the stretches first .. count - 1 to `own` and `through` (2H+1, 2H+1).

    Slip: T = sign mu N. Stick: T = kt (u - w), where w was set at the left end theta_s of the stretch: by a slip that
    ended there, w = u(theta_s) - sign mu N(theta_s) / kt, or by re-contact, w = u(theta_s) with N(theta_s) = 0 and hence
    dw = du(theta_s) - u'(theta_s) dN(theta_s) / N'(theta_s).
    """
    size, now, previous = load.shape[0], 0, -1.0
    for row in range(4, 8):  # sums of the moments: stick and slip, cosine and sine
        for m in range(size):
            scratch[row, m] = 0.0
    mean, basis = scratch[8], scratch[9]
    for k in range(first, count):
        state, left, right, sign, kind = stretches[k]
        if left != previous:
            _powers(left, scratch[now], scratch[now + 1])
        then, previous = 2 - now, right
        _powers(right, scratch[then], scratch[then + 1])
        row, factor = (6, sign * mu) if state == SLIP else (4, 1.0)
        for m in range(size):
            scale = 1.0 / (max(m, 1) * FULL_TURN)
            cosine = (scratch[then + 1, m] - scratch[now + 1, m]) * scale
            sine = (scratch[now, m] - scratch[then, m]) * scale
            if m == 0:
                cosine = (right - left) * scale
            scratch[row, m] += factor * cosine
            scratch[row + 1, m] += factor * sine
            if 2 * m < size:
                if m > 0:
                    mean[2 * m - 1], basis[2 * m - 1] = cosine, scratch[now, m]
                mean[2 * m], basis[2 * m] = (-sine, -scratch[now + 1, m]) if m > 0 else (cosine, 1.0)
        if state == STICK and kind != NEVER:
            gain = sign * mu
            if kind == RECONTACT:
                closing = taylor(load, left)[1]
                gain = kt * taylor(motion, left)[1] / closing if closing != 0.0 else 0.0
            for i in range(size):
                for j in range(size):
                    own[i, j] -= kt * mean[i] * basis[j]
                    through[i, j] += gain * mean[i] * basis[j]
        now = then
    add_gram(own, scratch[4], scratch[5], kt)
    add_gram(through, scratch[6], scratch[7], 1.0)


@compiled
def _finish(
    own: Array, through: Array, kn: float, motion: Array, load: Array, force: Array, node: int, direction: int
) -> None:
    """Turn the law T = own u + through N into the Fourier coefficients of -T and their derivatives by u and d_n."""
    size = load.shape[0]
    for i in range(size):
        weight = -1.0 if i == 0 else -2.0
        value = 0.0
        for j in range(size):
            value += own[i, j] * motion[j] + through[i, j] * load[j]
            own[i, j] *= weight
            through[i, j] *= weight * kn
        force[i, node, direction] = weight * value
