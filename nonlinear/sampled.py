"""Time-sampled contact element (alternating frequency/time): the force at n equidistant samples of the cycle."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.compilation import compiled
from nonlinear.contact import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.fourier import basis_table
from nonlinear.moments import add_gram, add_scaled, finish_node, mean_basis, prefix_moments
from nonlinear.sampled_plane import evaluate_plane
from nonlinear.slider import NEVER, Integers, march


@dataclass(frozen=True)
class SampledContact:
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
    def _prefix(self) -> tuple[Array, Array]:
        return prefix_moments(self.n_harmonics, self.samples)

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        size, n_contacts, _ = displacement.shape
        motion = (self.table @ displacement.reshape(size, -1)).T.reshape(n_contacts, 3, self.samples)
        force = np.zeros((size, n_contacts, 3))
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        state = np.zeros(n_contacts, dtype=np.int64)
        p = self.parameters
        laws = (p.normal_stiffness, p.tangential_stiffness, p.friction, p.interference, p.preload)
        arguments = (displacement, np.ascontiguousarray(motion), laws, self.table, *self._prefix)
        evaluate_normal(*arguments, force, jacobian)
        if p.law == "coupled":
            evaluate_plane(displacement, arguments[1], laws, self.table, force, jacobian, state)
        else:
            evaluate_tangential(*arguments, force, jacobian, state)
        return ContactForces(force, jacobian, state)


@compiled
def evaluate_normal(
    displacement: Array,
    motion: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    table: Array,
    prefix_cosine: Array,
    prefix_sine: Array,
    force: Array,
    jacobian: Array,
) -> None:
    """N = max(N0 + kn (v0 + d_n), 0) of every node; the balance sees N - N0."""
    normal_stiffness, _, _, interference, preload = laws
    n_samples, size = table.shape
    none = np.zeros((size, size))
    mean = np.empty(size)
    for node in range(force.shape[1]):
        stiffness = normal_stiffness[node]
        offset = preload[node] + stiffness * interference[node]
        gram = np.zeros((size, size))
        constant = np.zeros(size)
        start = NEVER
        for k in range(n_samples + 1):
            pressed = k < n_samples and offset + stiffness * motion[node, 2, k] > 0.0
            if pressed and start == NEVER:
                start = k
            elif not pressed and start != NEVER:
                cosine = (prefix_cosine[:, k] - prefix_cosine[:, start]) / n_samples
                sine = (prefix_sine[:, k] - prefix_sine[:, start]) / n_samples
                add_gram(gram, cosine, sine, stiffness)
                mean_basis(mean, cosine, sine)
                add_scaled(constant, offset, mean)
                start = NEVER
        finish_node(node, 2, (gram, none, constant), displacement, force, jacobian)
        force[0, node, 2] += preload[node]


@compiled
def evaluate_tangential(
    displacement: Array,
    motion: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    table: Array,
    prefix_cosine: Array,
    prefix_sine: Array,
    force: Array,
    jacobian: Array,
    worst: Integers,
) -> None:
    """One slider along t1 and one along t2 at every node (uncoupled law)."""
    normal_stiffness, tangential_stiffness, friction, interference, preload = laws
    n_samples, size = table.shape
    state = np.empty(n_samples, dtype=np.int64)
    source = np.empty(n_samples, dtype=np.int64)
    sign = np.empty(n_samples, dtype=np.int64)
    limit = np.empty(n_samples)
    for node in range(force.shape[1]):
        offset = preload[node] + normal_stiffness[node] * interference[node]
        for k in range(n_samples):
            load = offset + normal_stiffness[node] * motion[node, 2, k]
            limit[k] = friction[node] * max(load, 0.0)
            worst[node] = max(worst[node], LIFT_OFF if load <= 0.0 else STICK)
        for direction in range(2):
            if tangential_stiffness[node] == 0.0:
                continue
            march(motion[node, direction], limit, tangential_stiffness[node], state, source, sign)
            law = (np.zeros((size, size)), np.zeros((size, size)), np.zeros(size))
            start = 0
            for k in range(1, n_samples + 1):
                if k == n_samples or state[k] != state[start] or sign[k] != sign[start] or _moved(state, source, k):
                    moments = (
                        (prefix_cosine[:, k] - prefix_cosine[:, start]) / n_samples,
                        (prefix_sine[:, k] - prefix_sine[:, start]) / n_samples,
                    )
                    coefficients = (tangential_stiffness[node], friction[node], normal_stiffness[node], offset)
                    _add_stretch(law, moments, coefficients, state[start], sign[start], source[start], table)
                    if state[start] == SLIP:
                        worst[node] = max(worst[node], SLIP)
                    start = k
            finish_node(node, direction, law, displacement, force, jacobian)


@compiled
def _moved(state: Integers, source: Integers, k: int) -> bool:
    """Whether the slider stands elsewhere in the stick sample k than in the one before."""
    return state[k] == STICK and source[k] != source[k - 1]


@compiled
def _add_stretch(
    law: tuple[Array, Array, Array],
    moments: tuple[Array, Array],
    coefficients: tuple[float, float, float, float],
    state: int,
    sign: int,
    source: int,
    table: Array,
) -> None:
    """Add the tangential force of one stretch, linear in the displacement, to `law` (see `finish_node`)."""
    own, normal, constant = law
    cosine, sine = moments
    kt, mu, kn, offset = coefficients
    mean = np.empty(constant.shape[0])
    mean_basis(mean, cosine, sine)
    if state == SLIP:  # T = sign mu N
        add_gram(normal, cosine, sine, sign * mu * kn)
        add_scaled(constant, sign * mu * offset, mean)
    elif state == STICK:  # T = kt (u - u_source) + sign mu N_source
        add_gram(own, cosine, sine, kt)
        if source != NEVER:
            for i in range(mean.shape[0]):
                for j in range(mean.shape[0]):
                    own[i, j] -= kt * mean[i] * table[source, j]
                    normal[i, j] += sign * mu * kn * mean[i] * table[source, j]
            add_scaled(constant, sign * mu * offset, mean)
