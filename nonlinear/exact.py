"""Event-driven contact element for the uncoupled law: transition times found, stretches integrated in closed form."""

from dataclasses import dataclass

import numpy as np

from nonlinear.compilation import compiled
from nonlinear.contact import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters
from nonlinear.events import NEVER, RECONTACT, march_events
from nonlinear.moments import add_gram, add_scaled, finish_node, mean_basis
from nonlinear.slider import Integers
from nonlinear.trigonometric import FULL_TURN, find_roots, value_and_slope


@dataclass(frozen=True)
class ExactContact:
    """Contact element without time samples (see `ContactElement`): exact forces and Jacobian for any motion.

    Between the roots of N, of (kt u - mu N)' and of (kt u + mu N)' each limit of the slider is monotone, so a slider
    meets it at most once there and no event can be missed. Stick, slip and lift-off stretches are then integrals of
    trigonometric polynomials. The Jacobian includes that the time of re-contact, where the slider restarts, moves.
    """

    parameters: ContactParameters
    n_harmonics: int

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        size, n_contacts, _ = displacement.shape
        force = np.zeros((size, n_contacts, 3))
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        state = np.zeros(n_contacts, dtype=np.int64)
        p = self.parameters
        laws = (p.normal_stiffness, p.tangential_stiffness, p.friction, p.interference, p.preload)
        _evaluate(np.ascontiguousarray(displacement), laws, force, jacobian, state)
        return ContactForces(force, jacobian, state)


@compiled
def _evaluate(
    displacement: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    force: Array,
    jacobian: Array,
    worst: Integers,
) -> None:
    """All nodes and directions."""
    normal_stiffness, tangential_stiffness, friction, interference, preload = laws
    size = displacement.shape[0]
    load, motion = np.empty(size), np.empty(size)
    roots = np.empty(size)
    stretches = np.empty((16 * size + 8, 6))
    none = np.zeros((size, size))
    for node in range(force.shape[1]):
        kn, kt, mu = normal_stiffness[node], tangential_stiffness[node], friction[node]
        for j in range(size):
            load[j] = kn * displacement[j, node, 2]
        load[0] += preload[node] + kn * interference[node]
        offset = preload[node] + kn * interference[node]
        n_roots = find_roots(load, roots)
        law = (np.zeros((size, size)), none, np.zeros(size))
        worst[node] = STICK if _add_pressed(law, load, roots, n_roots, kn, offset) else LIFT_OFF
        finish_node(node, 2, law, displacement, force, jacobian)
        force[0, node, 2] += preload[node]
        for direction in range(2):
            if kt == 0.0:
                continue
            for j in range(size):
                motion[j] = displacement[j, node, direction]
            count = march_events(motion, load, roots, n_roots, mu, kt, stretches)
            law = (np.zeros((size, size)), np.zeros((size, size)), np.zeros(size))
            for k in range(count):
                stretch = stretches[k]
                if stretch[0] == SLIP:
                    worst[node] = max(worst[node], SLIP)
                if stretch[0] != LIFT_OFF:
                    _add_stretch(law, stretch, (kt, mu, kn, offset), motion, load)
            finish_node(node, direction, law, displacement, force, jacobian)


@compiled
def _moments(left: float, right: float, cosine: Array, sine: Array) -> None:
    """Integrals of cos(m theta), sin(m theta) over [left, right], divided by 2 pi; m = 0 .. 2H."""
    cosine[0], sine[0] = (right - left) / FULL_TURN, 0.0
    cl, sl, cr, sr = np.cos(left), np.sin(left), np.cos(right), np.sin(right)
    clm, slm, crm, srm = 1.0, 0.0, 1.0, 0.0
    for m in range(1, cosine.shape[0]):
        clm, slm = clm * cl - slm * sl, slm * cl + clm * sl
        crm, srm = crm * cr - srm * sr, srm * cr + crm * sr
        cosine[m] = (srm - slm) / (m * FULL_TURN)
        sine[m] = (clm - crm) / (m * FULL_TURN)


@compiled
def _add_pressed(
    law: tuple[Array, Array, Array], load: Array, roots: Array, n_roots: int, stiffness: float, offset: float
) -> bool:
    """Add kn v + offset over the stretches with N > 0 to `law`; returns whether the contact never opens."""
    own, _, constant = law
    size = constant.shape[0]
    cosine, sine, mean = np.empty(size), np.empty(size), np.empty(size)
    left, always = 0.0, True
    for k in range(n_roots + 1):
        right = roots[k] if k < n_roots else FULL_TURN
        if value_and_slope(load, 0.5 * (left + right))[0] > 0.0:
            _moments(left, right, cosine, sine)
            add_gram(own, cosine, sine, stiffness)
            mean_basis(mean, cosine, sine)
            add_scaled(constant, offset, mean)
        elif right > left:
            always = False
        left = right
    return always


@compiled
def _basis_at(angle: float, basis: Array) -> None:
    """Write 1, cos, -sin, cos 2, ... at `angle`."""
    c, s = np.cos(angle), np.sin(angle)
    ch, sh = 1.0, 0.0
    basis[0] = 1.0
    for h in range(1, (basis.shape[0] + 1) // 2):
        ch, sh = ch * c - sh * s, sh * c + ch * s
        basis[2 * h - 1], basis[2 * h] = ch, -sh


@compiled
def _add_stretch(
    law: tuple[Array, Array, Array],
    stretch: Array,
    coefficients: tuple[float, float, float, float],
    motion: Array,
    load: Array,
) -> None:
    """Add the tangential force of one stretch (state, left, right, sign, source kind, source angle) to `law`.

    Stick: T = kt (u - w). The slider was set by a slip that ended at the extremum theta_s of its limit,
    w = u(theta_s) - sign mu N(theta_s) / kt, or by re-contact, w = u(theta_s) with N(theta_s) = 0 and hence
    dw = du(theta_s) - u'(theta_s) dN(theta_s) / N'(theta_s).
    """
    own, normal, constant = law
    kt, mu, kn, offset = coefficients
    sign, kind, angle = stretch[3], stretch[4], stretch[5]
    size = constant.shape[0]
    cosine, sine, mean = np.empty(size), np.empty(size), np.empty(size)
    _moments(stretch[1], stretch[2], cosine, sine)
    mean_basis(mean, cosine, sine)
    if stretch[0] == SLIP:  # T = sign mu N
        add_gram(normal, cosine, sine, sign * mu * kn)
        add_scaled(constant, sign * mu * offset, mean)
        return
    add_gram(own, cosine, sine, kt)
    if kind == NEVER:
        return
    basis = np.empty(size)
    _basis_at(angle, basis)
    through_normal, shift = sign * mu * kn, sign * mu * offset
    if kind == RECONTACT:
        speed, closing = value_and_slope(motion, angle)[1], value_and_slope(load, angle)[1]
        through_normal = kt * speed * kn / closing if closing != 0.0 else 0.0
        # through_normal v(theta_s) + shift = 0 in the value: only the derivative sees the moving instant
        shift = through_normal * offset / kn if kn != 0.0 else 0.0
    for i in range(size):
        for j in range(size):
            own[i, j] -= kt * mean[i] * basis[j]
            normal[i, j] += through_normal * mean[i] * basis[j]
        constant[i] += shift * mean[i]
