"""Contact element by alternating frequency/time (AFT): the force is sampled at n equidistant instants of the period.

References
----------
T. M. Cameron, J. H. Griffin, An alternating frequency/time domain method for calculating the steady-state response of
nonlinear dynamic systems, Journal of Applied Mechanics 56 (1989) 149-154.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.aft_cone import evaluate_cone
from nonlinear.contact.fourier import basis_table
from nonlinear.contact.fourier_moments import (
    add_gram,
    add_scaled,
    finish_node,
    mean_basis,
    prefix_moments,
    write_moments,
)
from nonlinear.contact.numba_cache import compiled, inner
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.contact.return_map import NEVER, Integers, jenkins_return_map

Law = tuple[Array, Array, Array, Array, Array]  # kn, kt, mu, N0 + kn v0 and N0 of all nodes, (n_c,) each


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
        law = (p.normal_stiffness, p.tangential_stiffness, p.friction, p.initial_load, p.preload)
        evaluate_normal(displacement, motion, law, self._prefix, force, jacobian)
        if p.law == "cone":
            evaluate_cone(motion, law, self.table, force, jacobian, state)
        else:
            evaluate_two_sliders(displacement, motion, law, self._prefix, self.table, force, jacobian, state)
        return ContactForces(force, jacobian, state)


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
