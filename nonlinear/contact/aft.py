"""Time-sampled contact element (alternating frequency/time): the force at n equidistant samples of the cycle."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.aft_cone import evaluate_plane
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
from nonlinear.contact.return_map import NEVER, Integers, march


@dataclass(frozen=True)
class AFTContact:
    """Contact element that evaluates the law at `samples` instants of a period (see `ContactElement`).

    The force is piecewise linear in the displacement, with pieces that change from sample to sample: stretches of
    samples in the same state are summed in closed form, so that the Jacobian costs little whatever `samples` is.
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
        size, n_contacts, _ = displacement.shape
        motion = (self.table @ displacement.reshape(size, -1)).T.reshape(n_contacts, 3, self.samples)
        motion = np.ascontiguousarray(motion)
        force = np.zeros((size, n_contacts, 3))
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        state = np.zeros(n_contacts, dtype=np.int64)
        p = self.parameters
        laws = (p.normal_stiffness, p.tangential_stiffness, p.friction, p.interference, p.preload)
        evaluate_normal(displacement, motion, laws, self._prefix, force, jacobian)
        if p.law == "cone":
            evaluate_plane(displacement, motion, laws, self.table, force, jacobian, state)
        else:
            evaluate_tangential(displacement, motion, laws, self._prefix, self.table, force, jacobian, state)
        return ContactForces(force, jacobian, state)


@compiled
def evaluate_normal(
    displacement: Array,
    motion: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    prefix: Array,
    force: Array,
    jacobian: Array,
) -> None:
    """N = max(N0 + kn (v0 + d_n), 0) of every node; the balance sees N - N0."""
    normal_stiffness, _, _, interference, preload = laws
    n_samples, size = motion.shape[2], force.shape[0]
    none, moments, mean = np.zeros((size, size)), np.empty((2, size)), np.empty(size)
    for node in range(force.shape[1]):
        stiffness = normal_stiffness[node]
        offset = preload[node] + stiffness * interference[node]
        gram, constant = np.zeros((size, size)), np.zeros(size)
        start = NEVER
        for k in range(n_samples + 1):
            pressed = k < n_samples and offset + stiffness * motion[node, 2, k] > 0.0
            if pressed and start == NEVER:
                start = k
            elif not pressed and start != NEVER:
                write_moments(prefix, start, k, moments)
                add_gram(gram, moments[0], moments[1], stiffness)
                mean_basis(mean, moments[0], moments[1])
                add_scaled(constant, offset, mean)
                start = NEVER
        finish_node(node, 2, (gram, none, constant), displacement, force, jacobian)
        force[0, node, 2] += preload[node]


@compiled
def evaluate_tangential(
    displacement: Array,
    motion: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    prefix: Array,
    table: Array,
    force: Array,
    jacobian: Array,
    worst: Integers,
) -> None:
    """One slider along t1 and one along t2 at every node (uncoupled law)."""
    normal_stiffness, tangential_stiffness, friction, interference, preload = laws
    n_samples, size = table.shape
    history = np.empty((3, n_samples), dtype=np.int64)
    state, source, sign = history[0], history[1], history[2]
    limit, moments, mean = np.empty(n_samples), np.empty((2, size)), np.empty(size)
    for node in range(force.shape[1]):
        kt, mu, kn = tangential_stiffness[node], friction[node], normal_stiffness[node]
        offset = preload[node] + kn * interference[node]
        for k in range(n_samples):
            load = offset + kn * motion[node, 2, k]
            limit[k] = mu * load if load > 0.0 else 0.0
            if load <= 0.0:
                worst[node] = LIFT_OFF
        if kt == 0.0:
            continue
        for direction in range(2):
            march(motion[node, direction], limit, kt, state, source, sign)
            law = (np.zeros((size, size)), np.zeros((size, size)), np.zeros(size))
            start = 0
            for k in range(1, n_samples + 1):
                if k == n_samples or state[k] != state[start] or sign[k] != sign[start] or _moved(state, source, k):
                    write_moments(prefix, start, k, moments)
                    mean_basis(mean, moments[0], moments[1])
                    pull = sign[start] * mu
                    if state[start] == SLIP:  # T = sign mu N
                        add_gram(law[1], moments[0], moments[1], pull * kn)
                        add_scaled(law[2], pull * offset, mean)
                        if worst[node] < SLIP:
                            worst[node] = SLIP
                    elif state[start] == STICK:
                        add_gram(law[0], moments[0], moments[1], kt)
                        if source[start] != NEVER:
                            _add_memory(law, mean, table[source[start]], kt, pull * kn)
                            add_scaled(law[2], pull * offset, mean)
                    start = k
            finish_node(node, direction, law, displacement, force, jacobian)


@inner
def _moved(state: Integers, source: Integers, k: int) -> bool:
    """Whether the slider stands elsewhere in the stick sample k than in the one before."""
    return state[k] == STICK and source[k] != source[k - 1]


@inner
def _add_memory(law: tuple[Array, Array, Array], mean: Array, basis: Array, kt: float, slope: float) -> None:
    """Add to T = kt u what it owes to the sample of `basis`, which set the slider: sign mu N - kt u there."""
    for i in range(mean.shape[0]):
        for j in range(mean.shape[0]):
            law[0][i, j] -= kt * mean[i] * basis[j]
            law[1][i, j] += slope * mean[i] * basis[j]
