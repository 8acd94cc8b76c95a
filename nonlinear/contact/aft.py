"""Contact element by alternating frequency/time (AFT): the force is sampled at n equidistant instants of the period.

Two Jenkins elements a node (`evaluate_two_sliders`) or one slider under the friction cone (`evaluate_cone`). Samples
in one state enter by their trigonometric moments C_m = sum cos(m theta), S_m = sum sin(m theta), m = 0 .. 2H: all
that is linear in the displacement follows from them.

References
----------
T. M. Cameron, J. H. Griffin, An alternating frequency/time domain method for calculating the steady-state response of
nonlinear dynamic systems, Journal of Applied Mechanics 56 (1989) 149-154.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import basis_table
from nonlinear.contact.numba_cache import compiled, inner
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.contact.return_map import (
    MAX_PERIODS,
    NEVER,
    REPEAT_TOLERANCE,
    ROUND_OFF,
    Integers,
    cone_return_map,
    jenkins_return_map,
)

Law = tuple[Array, Array, Array, Array, Array]
Tangent = tuple[float, float, float, float, float]


@compiled
def evaluate_cone(motion: Array, law: Law, table: Array, force: Array, jacobian: Array, worst: Integers) -> None:
    """Add the coefficients of -T1, -T2 and their Jacobian, and the worst states.

    `motion` (n_c, 3, samples): u1, u2 and the unclipped load; `law`: kn, kt, mu and two more, (n_c,) each; `table`
    (samples, 2H+1): basis functions. The return map starts from w = 0 and goes on to the steady cycle; its derivative
    goes the same way, so that the Jacobian is that of the computed force, memory of the start included.
    """
    normal_stiffness, tangential_stiffness, friction, _, _ = law
    n_samples, size = table.shape
    limit = np.empty(n_samples)
    plane = np.empty((n_samples, 2))
    state = np.empty(n_samples, dtype=np.int64)
    traction = np.empty((n_samples, 2))
    for node in range(force.shape[1]):
        largest = 0.0
        for k in range(n_samples):
            load = motion[node, 2, k]
            limit[k] = friction[node] * max(load, 0.0)
            plane[k, 0], plane[k, 1] = motion[node, 0, k], motion[node, 1, k]
            largest = max(largest, abs(plane[k, 0]), abs(plane[k, 1]))
            worst[node] = max(worst[node], LIFT_OFF if load <= 0.0 else STICK)
        kt = tangential_stiffness[node]
        if kt == 0.0:
            continue
        periods = cone_return_map(plane, limit, kt, MAX_PERIODS, REPEAT_TOLERANCE * largest, state, traction)
        for k in range(n_samples):
            if state[k] == SLIP:
                worst[node] = max(worst[node], SLIP)
            for i in range(size):
                weight = (1.0 if i == 0 else 2.0) / n_samples
                force[i, node, 0] -= weight * table[k, i] * traction[k, 0]
                force[i, node, 1] -= weight * table[k, i] * traction[k, 1]
        mu_kn = friction[node] * normal_stiffness[node]
        _differentiate(plane, limit, kt, mu_kn, periods, table, jacobian[node])


@compiled
def _differentiate(
    motion: Array, limit: Array, kt: float, mu_kn: float, periods: int, table: Array, jacobian: Array
) -> None:
    """Repeat the return map with its derivative by the coefficients of (u1, u2, d_n); sum over the last period.

    `jacobian` (3, 3, 2H+1, 2H+1) of one node.
    """
    n_samples, size = table.shape
    x, y = 0.0, 0.0
    position = np.zeros((2, 3, size))  # d w / d (u1, u2, d_n)
    traction = np.zeros((2, 3, size))  # d T / d (u1, u2, d_n)
    for period in range(periods):
        for k in range(n_samples):
            tx, ty = kt * (motion[k, 0] - x), kt * (motion[k, 1] - y)
            magnitude = np.sqrt(tx * tx + ty * ty)
            sticks = limit[k] > 0.0 and magnitude <= limit[k] * (1.0 + ROUND_OFF)
            tangent = (1.0, 0.0, 1.0, 0.0, 0.0)
            if limit[k] <= 0.0:
                tangent = (0.0, 0.0, 0.0, 0.0, 0.0)
                x, y = motion[k, 0], motion[k, 1]
            elif not sticks:
                ex, ey, ratio = tx / magnitude, ty / magnitude, limit[k] / magnitude
                tangent = (ratio * ey * ey, -ratio * ex * ey, ratio * ex * ex, ex, ey)
                x, y = motion[k, 0] - limit[k] * ex / kt, motion[k, 1] - limit[k] * ey / kt
            if not sticks or period == periods - 1:
                _write_traction(tangent, kt, mu_kn, table[k], position, traction)
            if not sticks:
                _move(kt, table[k], traction, position)
            if period == periods - 1:
                _add_coefficients(table[k], n_samples, traction, jacobian)


@inner
def _write_traction(
    tangent: Tangent, kt: float, mu_kn: float, basis: Array, position: Array, traction: Array
) -> None:
    """Write dT = kt A (du - dw) + mu kn e dd_n for unit coefficients, (2, 3, 2H+1).

    `tangent`: A11, A12, A22 and e; A = 1 in stick, ratio (1 - e e^T) in slip along e, 0 in lift-off.
    """
    axx, axy, ayy, ex, ey = tangent
    for b in range(3):
        for j in range(basis.shape[0]):
            du = basis[j]
            rx = (du if b == 0 else 0.0) - position[0, b, j]
            ry = (du if b == 1 else 0.0) - position[1, b, j]
            traction[0, b, j] = kt * (axx * rx + axy * ry) + (mu_kn * ex * du if b == 2 else 0.0)
            traction[1, b, j] = kt * (axy * rx + ayy * ry) + (mu_kn * ey * du if b == 2 else 0.0)


@inner
def _move(kt: float, basis: Array, traction: Array, position: Array) -> None:
    """Write dw = du - dT / kt."""
    for b in range(3):
        for j in range(basis.shape[0]):
            position[0, b, j] = (basis[j] if b == 0 else 0.0) - traction[0, b, j] / kt
            position[1, b, j] = (basis[j] if b == 1 else 0.0) - traction[1, b, j] / kt


@inner
def _add_coefficients(basis: Array, n_samples: int, traction: Array, jacobian: Array) -> None:
    """Add what one sample contributes to the Fourier coefficients of -dT."""
    for a in range(2):
        for b in range(3):
            for i in range(basis.shape[0]):
                weight = -(1.0 if i == 0 else 2.0) / n_samples * basis[i]
                for j in range(basis.shape[0]):
                    jacobian[a, b, i, j] += weight * traction[a, b, j]


@dataclass(frozen=True)
class AFTContact:
    """Contact element that evaluates the contact law at `samples` instants of a period (see `ContactElement`).

    The sampled force is piecewise linear in the displacement. Intervals of samples in one state are summed in closed
    form, so that the Jacobian costs little whatever `samples` is. It is the exact Jacobian of the sampled force.
    """

    parameters: ContactParameters
    n_harmonics: int
    samples: int

    @cached_property
    def table(self) -> Array:
        """Basis functions at the samples, (samples, 2H+1)."""
        return basis_table(self.n_harmonics, self.samples)

    @cached_property
    def _prefix(self) -> Array:
        return prefix_moments(self.n_harmonics, self.samples)

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        p = self.parameters
        displacement = p.from_slider_origin(displacement)
        size, n_contacts, _ = displacement.shape
        motion = (self.table @ displacement.reshape(size, -1)).reshape(self.samples, n_contacts, 3)
        motion[:, :, 2] = p.unclipped_load(motion[:, :, 2])
        motion = np.ascontiguousarray(motion.transpose(1, 2, 0))
        force = np.zeros((size, n_contacts, 3))
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        state = np.zeros(n_contacts, dtype=np.int64)
        evaluate_normal(displacement, motion, self._law(~p.cone), self._prefix, force, jacobian)
        if p.cone.any():
            evaluate_cone(motion, self._law(p.cone), self.table, force, jacobian, state)
        if not p.cone.all():
            law = self._law(~p.cone)
            evaluate_two_sliders(displacement, motion, law, self._prefix, self.table, force, jacobian, state)
        return ContactForces(force, jacobian, state)

    def _law(self, nodes: NDArray[np.bool_]) -> Law:
        """The parameters with sliders at some nodes (n_c,) alone."""
        p = self.parameters
        stiffness = np.where(nodes, p.tangential_stiffness, 0.0)
        return p.normal_stiffness, stiffness, p.friction, p.initial_load, p.preload


@compiled
def evaluate_normal(
    displacement: Array, motion: Array, law: Law, prefix: Array, force: Array, jacobian: Array
) -> None:
    """Add the coefficients of -(N - N0) and their Jacobian.

    `displacement` (2H+1, n_c, 3); `motion` (n_c, 3, samples): u1, u2 and the unclipped load; `prefix`: see
    `prefix_moments`.
    """
    normal_stiffness, _, _, initial_load, preload = law
    n_samples, size = motion.shape[2], force.shape[0]
    none, moments, mean = np.zeros((size, size)), np.empty((2, size)), np.empty(size)
    for node in range(force.shape[1]):
        gram, constant = np.zeros((size, size)), np.zeros(size)
        start = NEVER
        for k in range(n_samples + 1):
            pressed = k < n_samples and motion[node, 2, k] > 0.0
            if pressed and start == NEVER:
                start = k
            elif not pressed and start != NEVER:
                write_moments(prefix, start, k, moments)
                add_gram(gram, moments[0], moments[1], normal_stiffness[node])
                mean_basis(mean, moments[0], moments[1])
                add_scaled(constant, initial_load[node], mean)
                start = NEVER
        finish_node(node, 2, (gram, none, constant), displacement, force, jacobian)
        force[0, node, 2] += preload[node]


@compiled
def evaluate_two_sliders(
    displacement: Array,
    motion: Array,
    law: Law,
    prefix: Array,
    table: Array,
    force: Array,
    jacobian: Array,
    worst: Integers,
) -> None:
    """Add the coefficients of -T1 and -T2 of two Jenkins elements at each node, and their Jacobian.

    Arguments as in `evaluate_normal`; `table` (samples, 2H+1): basis functions at the samples; `worst` (n_c,)
    receives the worst states.
    """
    normal_stiffness, tangential_stiffness, friction, initial_load, _ = law
    n_samples, size = table.shape
    history = np.empty((3, n_samples), dtype=np.int64)
    state, source, sign = history[0], history[1], history[2]
    limit, scratch = np.empty(n_samples), (np.empty((2, size)), np.empty(size))
    for node in range(force.shape[1]):
        kt, mu = tangential_stiffness[node], friction[node]
        slider = (kt, mu, normal_stiffness[node], initial_load[node])
        for k in range(n_samples):
            load = motion[node, 2, k]
            limit[k] = mu * load if load > 0.0 else 0.0
            if load <= 0.0:
                worst[node] = LIFT_OFF
        if kt == 0.0:
            continue
        for direction in range(2):
            jenkins_return_map(motion[node, direction], limit, kt, state, source, sign)
            for k in range(n_samples):
                worst[node] = max(worst[node], SLIP if state[k] == SLIP else STICK)
            linear_law = (np.zeros((size, size)), np.zeros((size, size)), np.zeros(size))
            start = 0
            for k in range(1, n_samples + 1):
                if k == n_samples or _changes(history, start, k):
                    _add_interval(linear_law, (start, k), history, slider, prefix, table, scratch)
                    start = k
            finish_node(node, direction, linear_law, displacement, force, jacobian)


@inner
def _changes(history: Integers, start: int, k: int) -> bool:
    """Whether sample k is in another state than the interval from `start`, or its slider stands elsewhere."""
    state, source, sign = history[0], history[1], history[2]
    return state[k] != state[start] or sign[k] != sign[start] or (state[k] == STICK and source[k] != source[k - 1])


@inner
def _add_interval(
    law: tuple[Array, Array, Array],
    samples: tuple[int, int],
    history: Integers,
    slider: tuple[float, float, float, float],
    prefix: Array,
    table: Array,
    scratch: tuple[Array, Array],
) -> None:
    """Add an interval in one state, the samples start .. stop - 1, to the linear law of T (see `finish_node`).

    In slip T = sign mu N; in stick T = kt u or, where a sample s has set the slider, kt (u - u_s) + sign mu N_s.
    """
    start, stop = samples
    state, source, sign = history[0, start], history[1, start], history[2, start]
    kt, mu, kn, initial_load = slider
    own, normal, constant = law
    moments, mean = scratch
    if state == LIFT_OFF:
        return
    write_moments(prefix, start, stop, moments)
    mean_basis(mean, moments[0], moments[1])
    signed_mu = sign * mu
    if state == SLIP:
        add_gram(normal, moments[0], moments[1], signed_mu * kn)
        add_scaled(constant, signed_mu * initial_load, mean)
        return
    add_gram(own, moments[0], moments[1], kt)
    if source != NEVER:
        for i in range(mean.shape[0]):
            for j in range(mean.shape[0]):
                own[i, j] -= kt * mean[i] * table[source, j]
                normal[i, j] += signed_mu * kn * mean[i] * table[source, j]
        add_scaled(constant, signed_mu * initial_load, mean)


@inner
def add_gram(gram: Array, cosine: Array, sine: Array, factor: float) -> None:
    """Add factor * sum phi_i phi_j to `gram` (2H+1, 2H+1) for phi = 1, cos, -sin, cos 2, -sin 2, ..."""
    n_harmonics = (gram.shape[0] - 1) // 2
    gram[0, 0] += factor * cosine[0]
    for h in range(1, n_harmonics + 1):
        gram[0, 2 * h - 1] += factor * cosine[h]
        gram[2 * h - 1, 0] += factor * cosine[h]
        gram[0, 2 * h] -= factor * sine[h]
        gram[2 * h, 0] -= factor * sine[h]
        for g in range(1, n_harmonics + 1):
            plus = h + g
            minus = abs(h - g)
            sine_minus = sine[minus] if h >= g else -sine[minus]  # sum of sin((h - g) theta)
            gram[2 * h - 1, 2 * g - 1] += 0.5 * factor * (cosine[minus] + cosine[plus])
            gram[2 * h, 2 * g] += 0.5 * factor * (cosine[minus] - cosine[plus])
            gram[2 * h - 1, 2 * g] -= 0.5 * factor * (sine[plus] - sine_minus)
            gram[2 * h, 2 * g - 1] -= 0.5 * factor * (sine[plus] + sine_minus)


@inner
def mean_basis(vector: Array, cosine: Array, sine: Array) -> None:
    """Write sum phi_i into `vector` (2H+1,)."""
    vector[0] = cosine[0]
    for h in range(1, (vector.shape[0] - 1) // 2 + 1):
        vector[2 * h - 1] = cosine[h]
        vector[2 * h] = -sine[h]


@inner
def add_scaled(total: Array, factor: float, vector: Array) -> None:
    """Add factor * vector to `total`; a loop, since array expressions take long to compile."""
    for i in range(total.shape[0]):
        total[i] += factor * vector[i]


@inner
def finish_node(
    node: int, direction: int, law: tuple[Array, Array, Array], displacement: Array, force: Array, jacobian: Array
) -> None:
    """Turn the accumulated linear law of one force component into its coefficients and Jacobian.

    `law` = (own, normal, constant): sums over the period of phi_i times the component of the reaction as a linear
    function of the displacement along `direction` and along n, (2H+1, 2H+1) each, and of its constant part, (2H+1,),
    already divided by the length of the period. The reaction acts on the right node with a minus sign.
    """
    own, normal, constant = law
    size = own.shape[0]
    for i in range(size):
        weight = -1.0 if i == 0 else -2.0
        value = constant[i]
        for j in range(size):
            value += own[i, j] * displacement[j, node, direction]
            jacobian[node, direction, direction, i, j] = weight * own[i, j]
            if direction != 2:
                value += normal[i, j] * displacement[j, node, 2]
                jacobian[node, direction, 2, i, j] = weight * normal[i, j]
        force[i, node, direction] = weight * value


def prefix_moments(n_harmonics: int, n_samples: int) -> Array:
    """Running means over samples of cos(m theta_k) and sin(m theta_k), m = 0 .. 2H: (n+1, 2, 2H+1)."""
    angles = np.outer(2.0 * np.pi * np.arange(n_samples) / n_samples, np.arange(2 * n_harmonics + 1))
    prefix = np.zeros((n_samples + 1, 2, 2 * n_harmonics + 1))
    prefix[1:] = np.cumsum(np.stack([np.cos(angles), np.sin(angles)], axis=1), axis=0) / n_samples
    return prefix


@inner
def write_moments(prefix: Array, start: int, stop: int, moments: Array) -> None:
    """Write the moments of the samples start .. stop - 1 over their number in the cycle, (2, 2H+1), from `prefix`."""
    for part in range(2):
        for m in range(moments.shape[1]):
            moments[part, m] = prefix[stop, part, m] - prefix[start, part, m]
