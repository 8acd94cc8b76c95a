"""Event-driven contact element for the coupled law: one slider in the contact plane, circular friction cone."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.cone_periodic_orbit import ASIDE, LIMIT, PLACES, SETTLED, TURN, steady_cycle
from nonlinear.contact.cone_shakedown import corner
from nonlinear.contact.cone_slip_collocation import ROWS, radau_table
from nonlinear.contact.fourier import basis_table
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactForces, ContactParameters

FORCE_ERROR = 1e-10  # of a force coefficient, relative to the largest mu N that its harmonics allow
LONGEST_SLIDE = 1e7  # a vibration of more than so many elastic travels mu N / kt sees a softer kt, with so many
FEW_TURNS, MOST_TURNS = 10, 60  # turns after which the place of rest is solved for, and those that are made at most
LEAST_FRICTION = 1e-50  # a smaller part of kt |u| is none


@dataclass(frozen=True)
class EventDrivenCoulombCone:
    """Contact element of the coupled law without time samples, with a controlled error (see `ContactElement`).

    T = kt (u - w), |T| <= mu N; the slider w slips along T. Stick, slip and lift-off are followed from event to event
    and none is missed: the ends of stick and of contact are roots of trigonometric polynomials (see `first_rise`).
    Stick and lift-off are integrated in closed form. In slip T = mu N (cos phi, sin phi), where phi obeys

        (mu N / kt) phi' = u2' cos(phi) - u1' sin(phi).

    This is solved by Radau collocation (order 15) on panels, pieces of the cycle whose length follows the solution:
    they are shortened until the last Legendre coefficients of T are below 1e-7 of the largest mu N; the error of the
    integrals is of the size of their square (where contact ends and T is less smooth they are kept below 1e-11). So
    the error of each force coefficient is below `FORCE_ERROR` mu (|N_0| + |N_1| + ... + |N_H|), as measured against
    other integrators.

    Without lift-off the steady cycle is the one that a slider starting at w = 0 reaches: followed turn by turn where
    it comes to rest (at once to a corner that it would take any number of turns to, see `corner`), else, since there
    is only one, found by Newton's method. The Jacobian, moving re-contact and memory included, is that of the
    computed force to about 1e-8; where a slider takes many turns to come to rest, to about 1e-4.
    """

    parameters: ContactParameters
    n_harmonics: int

    @cached_property
    def _table(self) -> Array:
        return radau_table()

    @cached_property
    def _gram(self) -> Array:
        return gram_table(self.n_harmonics)

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        p = self.parameters
        size, n_contacts, _ = displacement.shape
        load = p.normal_stiffness * displacement[:, :, 2]
        load[0] += p.preload + p.normal_stiffness * p.interference
        largest = np.abs(load[0]) + _vibration(load.T)
        limit = p.friction * largest
        motion = displacement.transpose(1, 2, 0).copy()
        travel = _vibration(motion[:, :2]).max(axis=1)
        stretch = p.tangential_stiffness * (travel + np.abs(motion[:, :2, 0]).max(axis=1))
        slides = (p.tangential_stiffness > 0.0) & (limit > LEAST_FRICTION * stretch)
        stiffness = np.where(slides, p.tangential_stiffness, 0.0)
        far = stiffness * travel > LONGEST_SLIDE * limit
        stiffness[far] = LONGEST_SLIDE * limit[far] / travel[far]
        # lengths in units of limit / stiffness, the largest reach of the slider
        motion[:, :2] *= _ratio(stiffness, limit, slides)[:, None, None]
        motion[:, 2] = _ratio(load, largest, largest > 0.0).T
        moments, own, slid = self._cycles(motion, _ratio(p.friction * p.normal_stiffness, stiffness, slides))

        gram = (moments.reshape(2 * n_contacts, -1) @ self._gram).reshape(n_contacts, 2, size, size)
        weight = np.where(np.arange(size) == 0, -1.0, -2.0)
        motion[:, :2, 0] = 0.0  # the place of the slider is relative to the mean motion
        force = np.empty((size, n_contacts, 3))
        force[:, :, :2] = ((own[:, :, :, 0] + motion[:, :2] @ gram[:, 0]) * weight).transpose(2, 0, 1) * limit[
            :, None
        ]
        force[:, :, 2] = (motion[:, 2:] @ gram[:, 1])[:, 0].T * weight[:, None] * largest
        force[0, :, 2] += p.preload
        jacobian = np.zeros((n_contacts, 3, 3, size, size))
        jacobian[:, :2] = own[:, :, :, 1:-2].reshape(n_contacts, 2, size, 3, size).swapaxes(2, 3)
        for a in range(2):
            jacobian[:, a, a] += gram[:, 0]
        jacobian[:, :2] *= (stiffness[:, None] * weight)[:, None, None, :, None]
        jacobian[:, 2, 2] = (p.normal_stiffness[:, None] * weight)[:, :, None] * gram[:, 1]
        frictionless = (p.friction == 0.0) & (p.tangential_stiffness > 0.0) & (travel > 0.0)
        state = np.where(slid < 0.0, LIFT_OFF, np.where((slid > 0.0) | frictionless, SLIP, STICK))
        return ContactForces(force, jacobian, state)

    def _cycles(self, motion: Array, gain: Array) -> tuple[Array, Array, Array]:
        """March every node: moments (n_c, 4, 2H+1), own (n_c, 2, 2H+1, 6H+6) and slip a turn (see `cone_cycle`)."""
        n_contacts, _, size = motion.shape
        columns, order = 3 * size + 3, self._table.shape[1]
        memory = np.zeros((n_contacts, 6, columns))
        memory[:, :2, 0] = -motion[:, :2, 0]
        curves = np.zeros((n_contacts, 4, 2 * size + 1))
        curves[:, :3, :size] = motion
        curves[:, :2, 0] = 0.0
        curves[:, 3, :-2] = square_of(curves[:, :3, :size])
        moments, own = np.zeros((n_contacts, 4, size)), np.zeros((n_contacts, 2, size, columns))
        panel, basis, system = (
            np.empty((ROWS, order)),
            np.empty((order, 2 * size)),
            np.zeros((order, order + columns)),
        )
        work = panel, basis, system, np.empty((3, 2 * size + 1))
        pace, slid = np.zeros((n_contacts, PLACES)), np.empty(n_contacts)
        begin = memory.copy()
        for k in range(n_contacts):
            for limit in (FEW_TURNS, MOST_TURNS):
                pace[k], memory[k], pace[k, LIMIT] = 0.0, begin[k], limit
                slid[k] = steady_cycle(gain[k], self._table, curves[k], memory[k], *work, moments[k], own[k], pace[k])
                if slid[k] <= 0.0 or pace[k, SETTLED] > 0.0 or pace[k, TURN] < limit:
                    break
                own_path = pace[k, ASIDE] == 0.0  # from anywhere else it may be another corner
                rest = corner(curves[k, :3, :size], memory[k, :2, 0], gain[k]) if own_path else None
                if rest is not None:
                    memory[k, :2, 0], memory[k, :2, 1:-2] = rest
                    slid[k] = 0.0
                    break
        settled, stuck = pace[:, SETTLED] > 0.0, slid == 0.0
        missing = np.linalg.solve(
            np.eye(2) - memory[settled, :2, -2:], (memory[:, :2] - memory[:, 2:4])[settled, :, :-2]
        )
        own[settled, :, :, :-2] += own[settled, :, :, -2:] @ missing[:, None]  # Newton's last step, not marched
        own[stuck] = 0.0
        own[stuck, :, 0] = -memory[stuck, :2]
        moments[stuck, :2] = 0.0
        moments[stuck, 0, 0] = 1.0
        moments[slid >= 0.0, 2, 0] = 1.0
        return moments, own, slid


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
    whole = np.concatenate(
        [half[:, :, ::-1].conj(), motion[:, :, :1], half], axis=2
    )  # exp(-i H theta) ... exp(i H theta)
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
