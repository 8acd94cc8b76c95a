"""Event-driven contact element for the uncoupled law: transition times found, stretches integrated in closed form."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.event_driven_cycle import SLIPS, STICKS, list_stretches
from nonlinear.contact.fourier_moments import add_moments, subtract_products
from nonlinear.contact.numba_cache import inner, lean
from nonlinear.contact.parameters import SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.contact.return_map import Integers
from nonlinear.contact.trigonometric_roots import FULL_TURN, NOWHERE, cell_table

WHOLE_TURN = FULL_TURN - 1e-12  # stretches longer than this are the whole cycle


@dataclass(frozen=True)
class EventDrivenJenkins:
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

    @cached_property
    def _load(self) -> tuple[Array, Array]:
        """Scale (3 n_c, 1) and shift (3 n_c, 2H+1) that turn (u1, u2, d_n) of every node into (u1, u2, N)."""
        p = self.parameters
        scale = np.ones((p.n_contacts, 3))
        scale[:, 2] = p.normal_stiffness
        shift = np.zeros((p.n_contacts, 3, 2 * self.n_harmonics + 1))
        shift[:, 2, 0] = p.preload + p.normal_stiffness * p.interference
        return scale.reshape(-1, 1), shift.reshape(3 * p.n_contacts, -1)

    @cached_property
    def _laws(self) -> tuple[Array, Array]:
        """(kn, kt, mu, N0) of every node, (n_c, 4), and mu / kt, (n_c,), 0 where there is no tangential force."""
        p = self.parameters
        kt, mu = p.tangential_stiffness, p.friction
        gains = np.divide(mu, kt, out=np.zeros(p.n_contacts), where=kt > 0.0)
        return np.stack([p.normal_stiffness, kt, mu, p.preload], axis=1), gains

    @cached_property
    def _frictionless(self) -> Integers:
        """Nodes with sliders that meet no resistance: they have no events, and slip whenever they move."""
        return np.flatnonzero((self.parameters.tangential_stiffness > 0.0) & (self.parameters.friction == 0.0))

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        size, n_contacts, _ = displacement.shape
        scale, shift = self._load
        laws, gains = self._laws
        motion = np.multiply(displacement.reshape(size, -1).T, scale, order="C")
        motion += shift
        values = (motion @ self._table).reshape(n_contacts, 3, 3, -1)
        motion = motion.reshape(n_contacts, 3, size)
        spans = np.zeros((n_contacts, 4, 2), np.int64)
        stretches = np.empty((n_contacts * 32 * (size + 1), 4))
        list_stretches(motion, values, gains, np.empty((4, size)), np.empty((5, values.shape[3])), stretches, spans)
        force = np.zeros((size, n_contacts, 3))
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        _integrate(motion, laws, stretches, spans, np.zeros((5, 2 * size - 1)), force, jacobian)
        state = spans[:, 3, 0].copy()
        if self._frictionless.size > 0:
            moving = np.any(displacement[1:, self._frictionless, :2] != 0.0, axis=(0, 2))
            state[self._frictionless] = np.maximum(state[self._frictionless], np.where(moving, SLIP, STICK))
        return ContactForces(force, jacobian, state)


@lean
def _integrate(
    displacement: Array,
    laws: Array,
    stretches: Array,
    spans: Integers,
    work: Array,
    force: Array,
    jacobian: Array,
) -> None:
    """Fourier coefficients of the reactions -(T1, T2, N - N0) and their derivatives.

    T = sign mu N in slip, T = kt (u - w) in stick. There w was set at the left end theta_s of the stretch: by a slip
    that ended there, w = u(theta_s) - sign mu N(theta_s) / kt, or by re-contact, w = u(theta_s) with N(theta_s) = 0,
    hence dw = du(theta_s) - u'(theta_s) dN(theta_s) / N'(theta_s). Both are w = u - pull mu N / kt (see `record`).
    displacement, stretches, spans: see `list_stretches`; laws (n_c, 4): kn, kt, mu, N0;
    work (5, 4H+1): scratch, zeros. Written: force (2H+1, n_c, 3), jacobian (n_c, 3, 3, 2H+1, 2H+1),
    zeros both, and the worst state in `spans`.
    """
    size, moments = displacement.shape[2], work[4]
    for node in range(laws.shape[0]):
        load, kn = displacement[node, 2], laws[node, 0]
        force[0, node, 2] = laws[node, 3]
        for direction in range(3):
            first, last, motion = spans[node, direction, 0], spans[node, direction, 1], displacement[node, direction]
            own, through = jacobian[node, direction, direction % 2], jacobian[node, direction, 2]
            kt, mu = (laws[node, 1], laws[node, 2]) if direction < 2 else (0.0, 1.0)  # N: as T in slip
            for m in range(moments.shape[0]):
                work[2, m], work[3, m] = 0.0, 0.0
            now, previous = 0, -NOWHERE
            for k in range(first, last):
                state, left, right, pull = stretches[k, 0], stretches[k, 1], stretches[k, 2], stretches[k, 3]
                if left != previous:
                    add_moments(left, 0.0, 0.0, work[now], work[now], moments, moments)
                now, previous = 1 - now, right
                row, factor = (3, pull * mu) if state == SLIPS else (2, kt)
                # a whole turn has no moments but its length: exactly, so that a large static load makes no vibration
                angle, here = left if right - left > WHOLE_TURN else right, work[1 - now]
                add_moments(angle, right - left, factor, here, work[now], moments, work[row])
                if state == STICKS:
                    for i in range(size):
                        weight = 2.0 * moments[i] if i > 0 else moments[0]
                        held, pushed = weight * kt, weight * (pull * mu)
                        for j in range(size):
                            own[i, j] += held * here[j]
                            through[i, j] -= pushed * here[j]
                if state == SLIPS and direction < 2 and spans[node, 3, 0] < SLIP:
                    spans[node, 3, 0] = SLIP
            if last > first:
                _finish(own, through, kn, work, motion, load, force[:, node, direction])


@inner
def _finish(own: Array, through: Array, kn: float, work: Array, motion: Array, load: Array, force: Array) -> None:
    """Add moments of stick and slip (work[2], work[3]) to the law own u + through N; its value and derivatives."""
    size = motion.shape[0]
    subtract_products(own, work[2])
    subtract_products(through, work[3])
    for i in range(size):
        value = 0.0
        for j in range(size):
            value += own[i, j] * motion[j] + through[i, j] * load[j]
            through[i, j] *= kn
        force[i] += value
