"""Event-driven contact element for the uncoupled law: transition times found, stretches integrated in closed form."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.compilation import compiled
from nonlinear.contact import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.events import NEVER, RECONTACT, SLIPS, STICKS, bound_limits, record, slide, write_limits
from nonlinear.moments import add_gram
from nonlinear.slider import Integers
from nonlinear.trigonometric import FULL_TURN, NOWHERE, cell_table, derivative_bounds, prepare_roots, taylor

WHOLE_TURN = FULL_TURN - 1e-12  # stretches longer than this are the whole cycle


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
        force = np.zeros((n_contacts, 3, size))
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        state = np.zeros(n_contacts, dtype=np.int64)
        p = self.parameters
        laws = (p.normal_stiffness, p.tangential_stiffness, p.friction, p.interference, p.preload)
        values = (columns @ self._table).reshape(n_contacts, 3, 3, -1)
        _evaluate(columns.reshape(n_contacts, 3, size), values, laws, force, jacobian, state)
        return ContactForces(np.ascontiguousarray(force.transpose(2, 0, 1)), jacobian, state)


@compiled
def _evaluate(
    displacement: Array,
    values: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    force: Array,
    jacobian: Array,
    worst: Integers,
) -> None:
    """All nodes and directions; displacement, force (n_c, 3, 2H+1), values (n_c, 3, 3, cells) (see `cell_table`)."""
    size, cells = displacement.shape[2], values.shape[3]
    windows, scratch = np.empty((size, 2)), np.empty((11, size))
    curves, thirds, highest = np.empty((4, size)), np.empty(4), np.empty((4, cells))
    stretches, span = np.empty((32 * size + 8, 5)), np.zeros(2, np.int64)
    none, load = np.zeros((size, size)), scratch[10]
    for node in range(force.shape[0]):
        kn, kt, mu, preload = laws[0][node], laws[1][node], laws[2][node], laws[4][node]
        for j in range(size):
            load[j] = kn * displacement[node, 2, j]
        offset = preload + kn * laws[3][node]
        load[0] += offset
        normal = values[node, 2]
        for k in range(cells):
            normal[0, k] = kn * normal[0, k] + offset
            normal[1, k] *= kn
            normal[2, k] *= kn
        n_roots = prepare_roots(load, normal, curves, thirds, highest, scratch[0])
        n_windows = _list_pressed(load, scratch[0], n_roots, windows, stretches, span)
        force[node, 2, 0] = preload
        closed = n_windows == 1 and windows[0, 1] == NOWHERE
        worst[node] = STICK if closed else LIFT_OFF
        if n_windows == 0:
            continue
        for axis in range(3):
            direction = 2 - axis
            motion, through = displacement[node, direction], jacobian[node, direction, 2]
            own = none
            if direction < 2:
                if kt == 0.0:
                    continue
                own = jacobian[node, direction, direction]
                stuck = write_limits(motion, load, mu / kt, curves)
                if mu == 0.0:  # no force: the slider goes with u
                    worst[node] = max(worst[node], SLIP if derivative_bounds(motion)[0] > 0.0 else STICK)
                    continue
                if closed and stuck:
                    for j in range(size):
                        own[j, j] = -kt
                        force[node, direction, j] = -kt * motion[j]
                    continue
                bound_limits(mu / kt, values[node, direction], normal, curves, thirds, highest)
                slide(windows, n_windows, curves, thirds, highest, stretches, span)
                for k in range(span[0], span[1]):
                    if stretches[k, 0] == SLIPS:
                        worst[node] = max(worst[node], SLIP)
            else:  # N is a slip with mu = 1
                kt, mu = 0.0, 1.0
            _integrate(stretches, span, kt, mu, motion, load, scratch, own, through)
            _finish(own, through, kn, motion, load, force[node, direction])
            kt, mu = laws[1][node], laws[2][node]


@compiled
def _list_pressed(load: Array, roots: Array, n_roots: int, windows: Array, stretches: Array, span: Integers) -> int:
    """Write the windows in which N > 0, beginning and end, and the same as stretches; returns their number."""
    count = 0
    span[0], span[1] = 0, 0
    for k in range(max(n_roots, 1)):
        left, right = 0.0, FULL_TURN
        if n_roots > 0:
            left, right = roots[k], roots[k + 1] if k + 1 < n_roots else roots[0] + FULL_TURN
        if taylor(load, 0.5 * (left + right))[0] > 0.0:
            windows[count, 0], windows[count, 1] = left, right if n_roots > 0 else NOWHERE
            count += 1
            record(stretches, span, SLIPS, left, right, 1.0, NEVER)
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
    span: Integers,
    kt: float,
    mu: float,
    motion: Array,
    load: Array,
    scratch: Array,
    own: Array,
    through: Array,
) -> None:
    """Add the law T = own u + through N of a cycle to `own` and `through` (2H+1, 2H+1).

    Slip: T = sign mu N. Stick: T = kt (u - w), where w was set at the left end theta_s of the stretch: by a slip that
    ended there, w = u(theta_s) - sign mu N(theta_s) / kt, or by re-contact, w = u(theta_s) with N(theta_s) = 0, hence
    dw = du(theta_s) - u'(theta_s) dN(theta_s) / N'(theta_s).
    """
    size, now, previous = load.shape[0], 0, -1.0
    for row in range(4, 8):  # sums of the moments: stick and slip, cosine and sine
        for m in range(size):
            scratch[row, m] = 0.0
    mean, basis = scratch[8], scratch[9]
    for k in range(span[0], span[1]):
        state, left, right, sign, kind = stretches[k]
        if left != previous:
            _powers(left, scratch[now], scratch[now + 1])
        then, previous = 2 - now, right
        # a whole turn has no moments but its length: exactly, so that a large static load makes no vibration
        _powers(left if right - left > WHOLE_TURN else right, scratch[then], scratch[then + 1])
        row, factor = (6, sign * mu) if state == SLIPS else (4, 1.0)
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
        if state == STICKS and kind != NEVER:
            gain = sign * mu
            if kind == RECONTACT:
                closing = taylor(load, left)[1]
                gain = kt * taylor(motion, left)[1] / closing if closing != 0.0 else 0.0
            for i in range(size):
                held, pushed = kt * mean[i], gain * mean[i]
                for j in range(size):
                    own[i, j] -= held * basis[j]
                    through[i, j] += pushed * basis[j]
        now = then
    add_gram(own, scratch[4], scratch[5], kt)
    add_gram(through, scratch[6], scratch[7], 1.0)


@compiled
def _finish(own: Array, through: Array, kn: float, motion: Array, load: Array, force: Array) -> None:
    """Turn the law T = own u + through N into the Fourier coefficients of -T and their derivatives by u and d_n."""
    size = load.shape[0]
    for i in range(size):
        weight = -1.0 if i == 0 else -2.0
        value = 0.0
        for j in range(size):
            value += own[i, j] * motion[j] + through[i, j] * load[j]
            own[i, j] *= weight
            through[i, j] *= weight * kn
        force[i] += weight * value
