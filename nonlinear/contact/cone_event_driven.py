"""Event-driven contact element with one slider per node under the circular friction cone.

Shakedown: after a transient the slider rests, |u - w| <= r all the time, and the contact sticks throughout. Where it
would take any number of periods to get there, it is placed in the corner of two circles (`shakedown_corner`).

References
----------
C. Siewert, L. Panning, J. Wallaschek, C. Richter, Multiharmonic forced response analysis of a turbine blading coupled
by nonlinear contact forces, Journal of Engineering for Gas Turbines and Power 132 (2010) 082501.

E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer, 1996, section IV.5 (Radau).
A. Klarbring, M. Ciavarella, J. R. Barber, Shakedown in elastic contact problems with Coulomb friction, International
Journal of Solids and Structures 44 (2007) 8355-8365.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.cone_periodic_orbit import periodic_orbits
from nonlinear.contact.cone_slip_collocation import ConeSlider, RadauTable, cone_sliders, radau_table, workspace
from nonlinear.contact.fourier import basis_at, basis_table
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters

GRID = 64  # instants a harmonic among which the farthest motions are sought
MOST_STEPS = 20
ON_CIRCLE = 1e-13  # |u - w| - r, relative to the largest r, that is nothing
APART = 1e-6  # sine of the angle between two directions below which they are one


def shakedown_corner(curves: Array, position: Array, dr_dn: float) -> tuple[Array, Array] | None:
    """Slider position (2,) from which |u - w| = r at two instants and less at all others; None if none is found.

    `curves` (3, 2H+1): coefficients of u1, u2 and r. A slider outside of the shakedown region |u - w| <= r is drawn
    in at one instant and at another, again and again; where their circles meet at a sharp corner, it takes any number
    of periods to get there. With e_i the direction of u - w at these instants, Newton's method from `position` is
    e_i . dw = |u - w| - r; the derivatives by the coefficients of u1, u2 and u_n, (2, 3 (2H+1)), obey
    e_i . dw = e_i . du - dr_dn du_n, as the instants are those of the largest |u - w| - r.
    """
    n_harmonics = (curves.shape[1] - 1) // 2
    w, pair = position.copy(), _two_farthest(curves, position)
    if pair is None:
        return None
    for _ in range(MOST_STEPS):
        pair = _nearest_maxima(curves, w, pair, np.pi / (GRID * n_harmonics))
        basis = basis_at(pair, n_harmonics)
        deflection = basis @ curves[:2].T - w
        far = np.linalg.norm(deflection, axis=1)
        directions, excess = deflection / far[:, None], far - basis @ curves[2]
        if abs(np.linalg.det(directions)) < APART:
            return None
        if np.abs(excess).max() <= ON_CIRCLE:
            break
        w = w + np.linalg.solve(directions, excess)
    every = _excess(curves, w, np.linspace(0.0, 2.0 * np.pi, 4 * GRID * n_harmonics))[0]
    if np.abs(excess).max() > ON_CIRCLE or every.max() > 10.0 * ON_CIRCLE:
        return None
    moved = np.concatenate([directions[:, :, None] * basis[:, None], -dr_dn * basis[:, None]], axis=1)
    return w, np.linalg.solve(directions, moved.reshape(2, -1))


def _two_farthest(curves: Array, w: Array) -> Array | None:
    """The instants (rad) of the two largest maxima of |u - w| - r in different directions, to the grid."""
    n_harmonics = (curves.shape[1] - 1) // 2
    grid = 2.0 * np.pi / (GRID * n_harmonics) * np.arange(GRID * n_harmonics)
    values = _excess(curves, w, grid)[0]
    peaks = np.flatnonzero((values >= np.roll(values, 1)) & (values > np.roll(values, -1)))
    peaks = peaks[np.argsort(-values[peaks])]
    deflection = basis_at(grid[peaks], n_harmonics) @ curves[:2].T - w
    across = deflection[0, 0] * deflection[:, 1] - deflection[0, 1] * deflection[:, 0]
    others = np.flatnonzero(
        np.abs(across) > APART * np.linalg.norm(deflection, axis=1) * np.linalg.norm(deflection[0])
    )
    return grid[peaks[[0, others[0]]]] if others.size else None


def _nearest_maxima(curves: Array, w: Array, angles: Array, width: float) -> Array:
    """The maxima of |u - w| - r next to the angles, by Newton's method."""
    for _ in range(3):
        _, first, second = _excess(curves, w, angles)
        steps = np.divide(-first, second, out=np.zeros_like(first), where=second < 0.0)
        angles = angles + np.clip(steps, -width, width)
    return angles


def _excess(curves: Array, w: Array, angles: Array) -> tuple[Array, Array, Array]:
    """|u - w| - r and its first two derivatives."""
    n_harmonics = (curves.shape[1] - 1) // 2
    x, y, r = (basis_at(angles, n_harmonics) @ curves.T).T
    x1, y1, r1 = (basis_at(angles, n_harmonics, 1) @ curves.T).T
    x2, y2, r2 = (basis_at(angles, n_harmonics, 2) @ curves.T).T
    x, y = x - w[0], y - w[1]
    far = np.hypot(x, y)
    rate = (x * x1 + y * y1) / far
    return far - r, rate - r1, (x1 * x1 + y1 * y1 + x * x2 + y * y2 - rate * rate) / far - r2


FORCE_ERROR = 1e-10  # of a force coefficient, relative to the largest mu N that its harmonics allow
MOST_SLIP = (
    1e7  # a vibration of more than so many elastic limit displacements mu N / kt sees a softer kt, with so many
)
FEW_PERIODS, MOST_PERIODS = 10, 60  # periods after which the shakedown state is solved for, most periods marched
LEAST_FRICTION = 1e-50  # a smaller part of kt |u| is none


@dataclass(frozen=True)
class EventDrivenCoulombCone:
    """Contact element with the friction cone, without time samples, with a controlled error (see `ContactElement`).

    T = kt (u - w), |T| <= mu N; the slider w slips along T. Stick, slip and separation are followed from event to
    event and none is missed: the ends of stick and of contact are roots of trigonometric polynomials (see
    `first_rise`). Stick and separation are integrated in closed form. In slip T = mu N (cos phi, sin phi), where phi
    obeys

        (mu N / kt) phi' = u2' cos(phi) - u1' sin(phi).

    This is solved by Radau collocation (order 15) on panels, pieces of the period whose length follows the solution:
    they are shortened until the last Legendre coefficients of T are below 1e-7 of the largest mu N; the error of the
    integrals is of the size of their square (where contact ends and T is less smooth they are kept below 1e-11). So
    the error of each force coefficient is below `FORCE_ERROR` mu (|N_0| + |N_1| + ... + |N_H|), as measured against
    other integrators.

    Without separation the steady cycle is the one that a slider starting at w = 0 reaches. Where the slider comes to
    rest (shakedown) it is marched period by period, or placed at once in a corner that it would take any number of
    periods to reach (see `shakedown_corner`). Else there is one periodic orbit only, found by Newton's method. The
    Jacobian, moving re-contact and slider memory included, is that of the computed force to about 1e-8; where a
    slider takes many periods to come to rest, to about 1e-4.
    """

    parameters: ContactParameters
    n_harmonics: int

    @cached_property
    def _table(self) -> RadauTable:
        return radau_table()

    @cached_property
    def _gram(self) -> Array:
        return gram_table(self.n_harmonics)

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        p = self.parameters
        displacement = p.from_slider_origin(displacement)
        size, n_contacts, _ = displacement.shape
        load = p.load_coefficients(displacement)
        largest = np.abs(load[0]) + _vibration(load.T)
        limit = p.friction * largest
        motion = displacement.transpose(1, 2, 0).copy()
        travel = _vibration(motion[:, :2]).max(axis=1)
        elastic_force = p.tangential_stiffness * (travel + np.abs(motion[:, :2, 0]).max(axis=1))
        slides = (p.tangential_stiffness > 0.0) & (limit > LEAST_FRICTION * elastic_force)
        stiffness = np.where(slides, p.tangential_stiffness, 0.0)
        far = stiffness * travel > MOST_SLIP * limit
        stiffness[far] = MOST_SLIP * limit[far] / travel[far]
        # lengths in units of limit / stiffness, the largest elastic limit displacement of the slider
        motion[:, :2] *= _ratio(stiffness, limit, slides)[:, None, None]
        motion[:, 2] = _ratio(load, largest, largest > 0.0).T
        sliders, slip = self._orbits(motion, _ratio(p.friction * p.normal_stiffness, stiffness, slides))
        deflection = sliders.deflection

        moments = np.stack([sliders.stick_moments, sliders.contact_moments], axis=1)
        gram = (moments.reshape(2 * n_contacts, -1) @ self._gram).reshape(n_contacts, 2, size, size)
        weight = np.where(np.arange(size) == 0, -1.0, -2.0)
        motion[:, :2, 0] = 0.0  # the slider position is relative to the mean motion
        force = np.empty((size, n_contacts, 3))
        tangential = (deflection[:, :, :, 0] + motion[:, :2] @ gram[:, 0]) * weight
        force[:, :, :2] = tangential.transpose(2, 0, 1) * limit[:, None]
        force[:, :, 2] = (motion[:, 2:] @ gram[:, 1])[:, 0].T * weight[:, None] * largest
        force[0, :, 2] += p.preload
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        jacobian[:, :2] = deflection[:, :, :, 1:-2].reshape(n_contacts, 2, size, 3, size).swapaxes(2, 3)
        for a in range(2):
            jacobian[:, a, a] += gram[:, 0]
        jacobian[:, :2] *= (stiffness[:, None] * weight)[:, None, None, :, None]
        jacobian[:, 2, 2] = (p.normal_stiffness[:, None] * weight)[:, :, None] * gram[:, 1]
        frictionless = (p.friction == 0.0) & (p.tangential_stiffness > 0.0) & (travel > 0.0)
        state = np.where(slip < 0.0, LIFT_OFF, np.where((slip > 0.0) | frictionless, SLIP, STICK))
        return ContactForces(force, jacobian, state)

    def _orbits(self, motion: Array, dr_dn: Array) -> tuple[ConeSlider, Array]:
        """Periodic orbits of all sliders and how far each slips in a period (see `periodic_orbits`)."""
        n_contacts, _, size = motion.shape
        curves = np.zeros((n_contacts, 4, 2 * size + 1))
        curves[:, :3, :size] = motion
        curves[:, :2, 0] = 0.0
        curves[:, 3, :-2] = square_of(curves[:, :3, :size])
        sliders = cone_sliders(motion, dr_dn, curves)
        state, begin = sliders.iteration, sliders.w.copy()
        work, slip = workspace(self._table, self.n_harmonics), np.empty(n_contacts)
        nodes = np.arange(n_contacts)
        for max_periods in (FEW_PERIODS, MOST_PERIODS):
            state[nodes], sliders.w[nodes] = 0, begin[nodes]
            state["max_periods"] = max_periods
            periodic_orbits(nodes, sliders, work, slip)
            nodes = nodes[(slip[nodes] > 0.0) & ~state["converged"][nodes] & (state["periods"][nodes] >= max_periods)]
            nodes = nodes[[not self._solve_shakedown(k, sliders, slip) for k in nodes]]
        _add_newton_step(state["converged"], sliders)
        sticks = slip == 0.0
        sliders.deflection[sticks] = 0.0
        sliders.deflection[sticks, :, 0] = -sliders.w[sticks]
        sliders.stick_moments[sticks] = 0.0
        sliders.stick_moments[sticks, 0, 0] = 1.0
        sliders.contact_moments[slip >= 0.0, 0, 0] = 1.0
        return sliders, slip

    def _solve_shakedown(self, k: int, sliders: ConeSlider, slip: Array) -> bool:
        """Place the slider of node k in its shakedown state, where that is a corner near its own path."""
        if sliders.iteration["off_path"][k]:  # from anywhere else it may be another corner
            return False
        corner = shakedown_corner(
            sliders.curves[k, :3, : 2 * self.n_harmonics + 1], sliders.w[k, :, 0], sliders.dr_dn[k]
        )
        if corner is None:
            return False
        sliders.w[k, :, 0], sliders.w[k, :, 1:-2] = corner
        slip[k] = 0.0
        return True


def _add_newton_step(nodes: NDArray[np.bool], sliders: ConeSlider) -> None:
    """Add to the deflection of converged orbits what Newton's last step on the period changes; it is not marched."""
    w, w_start, deflection = sliders.w[nodes], sliders.w_start[nodes], sliders.deflection
    step = np.linalg.solve(np.eye(2) - w[:, :, -2:], (w - w_start)[:, :, :-2])
    deflection[nodes, :, :, :-2] += deflection[nodes, :, :, -2:] @ step[:, None]


def _vibration(rows: Array) -> Array:
    """Bound of the vibration: the sum of the harmonics' magnitudes along the last axis, 2H+1."""
    return np.hypot(rows[..., 1::2], rows[..., 2::2]).sum(axis=-1)


def _ratio(numerator: Array, denominator: Array, where: NDArray[np.bool]) -> Array:
    """The quotient where it exists, else 0."""
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=where)


def square_of(motion: Array) -> Array:
    """Coefficients (n, 4H+1) of u1^2 + u2^2 - r^2 from those of u1, u2 and r (n, 3, 2H+1)."""
    n, _, size = motion.shape
    half = 0.5 * (motion[:, :, 1::2] + 1j * motion[:, :, 2::2])
    # coefficients of exp(-i H theta) ... exp(i H theta)
    whole = np.concatenate([half[:, :, ::-1].conj(), motion[:, :, :1], half], axis=2)
    product = np.zeros((n, 2 * size - 1), dtype=complex)
    for k in range(size):
        terms = whole[:, :, k : k + 1] * whole
        product[:, k : k + size] += terms[:, 0] + terms[:, 1] - terms[:, 2]
    result = np.empty((n, 2 * size - 1))
    result[:, 0] = product[:, size - 1].real
    result[:, 1::2] = 2.0 * product[:, size:].real
    result[:, 2::2] = 2.0 * product[:, size:].imag
    return result


def gram_table(n_harmonics: int) -> Array:
    """Matrix (4H+2, (2H+1)^2) from the means of cos(m theta), sin(m theta), m = 0 .. 2H, to those of phi_i phi_j."""
    size, samples = 2 * n_harmonics + 1, 8 * n_harmonics + 8
    basis = basis_table(n_harmonics, samples)
    products = (basis[:, :, None] * basis[:, None, :]).reshape(samples, -1)
    theta = 2.0 * np.pi * np.outer(np.arange(size), np.arange(samples)) / samples
    weight = np.where(np.arange(size) == 0, 1.0, 2.0)[:, None] / samples
    table = np.concatenate([(weight * np.cos(theta)) @ products, (weight * np.sin(theta)) @ products])
    return np.where(np.abs(table) < 1e-12, 0.0, table)
