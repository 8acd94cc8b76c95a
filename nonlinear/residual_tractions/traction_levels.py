"""Contact forces for a given place of every residual traction between its two admissible limits."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.parameters import Array, ContactElement, ContactForces, ContactParameters

FREE = 1e-9  # a traction is free if its limits differ by more than this part of the largest mean traction
BEYOND = 2.0  # start of a slider, in bounds of its motion and of its elastic limit: beyond every admissible position


class TractionElement(ContactElement, Protocol):
    """A contact element with variables, (n_c, 2) from -1 to 1, on which the residual tractions depend."""

    def at(self, variables: Array) -> "TractionElement":
        """The same element at other variables (n_c, 2)."""
        ...

    def origin(self, displacement: Array, forces: ContactForces) -> Array:
        """Start of the sliders that leads to the `forces` of a displacement, (n_c, 2), m."""
        ...

    def derivative(self, displacement: Array, forces: ContactForces) -> Array:
        """Derivative of the force coefficients by the variables, (2H+1, n_c, 3, 2), N.

        [i, k, a, c]: of component a at node k by variable c of this node. `forces` are those of the `displacement`.
        """
        ...


def farthest_position(contact: ContactParameters, displacement: Array) -> Array:
    """Bound of the positions (n_c, 2) from which a slider is not moved, m: of abs(u) + mu N / kt over the period.

    `displacement`: (2H+1, n_c, 3) real coefficients, m.
    """

    def bound(rows: Array) -> Array:
        return np.asarray(np.abs(rows[0]) + np.hypot(rows[1::2], rows[2::2]).sum(axis=0), dtype=np.float64)

    limit, kt = contact.friction * bound(contact.load_coefficients(displacement)), contact.tangential_stiffness
    elastic = np.divide(limit, kt, out=np.zeros_like(limit), where=kt > 0.0)
    return bound(displacement[:, :, :2]) + elastic[:, None]


def free_tractions(contact: ContactParameters, element: ContactElement, displacement: Array) -> NDArray[np.bool_]:
    """Which tractions T1, T2 depend on where the slider started, (n_c, 2): the residual ones, free within limits.

    Forces from four starts beyond all admissible positions are compared. `element` has the parameters `contact`.
    """
    beyond = BEYOND * farthest_position(contact, contact.from_slider_origin(displacement))
    tractions = []
    for first, second in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
        shifted = displacement.copy()
        shifted[0, :, :2] += beyond * [first, second]
        tractions.append(element.evaluate(shifted).force[0, :, :2])
    spread = np.ptp(tractions, axis=0)
    return np.asarray(spread > FREE * np.abs(tractions).max(), dtype=np.bool_)


@dataclass(frozen=True)
class TractionLevels:
    """Two sliders per node, whose residual tractions stand at a level between their limits (see `ContactElement`).

    A slider that sticks all the time may stand anywhere in [max_t(u - mu N / kt), min_t(u + mu N / kt)] (Gulisano et
    al. 2011, eqs. 10-16). Started far below this interval it ends at its lower end, started far above at its upper
    end. The force is linear in the position: at the level m it is

        f(m) = (1 - m) / 2 f_low + (1 + m) / 2 f_high,    -1 <= m <= 1,

    exactly, with its Jacobian. A slider that slips or opens has the same cycle from every start: f_low = f_high. So
    the force is as smooth in m as in the displacement, and the limits of Coulomb's law need no further constraint.
    """

    contact: ContactParameters  # parameters of the nodes, `law` "two_sliders"; `slider_origin` has no influence
    element: ContactElement  # the element of these parameters
    level: Array  # (n_c, 2), m along t1 and t2; -1: the slider at the lower end, the traction at its upper limit

    def at(self, variables: Array) -> "TractionLevels":
        """The same element at other levels (n_c, 2)."""
        return TractionLevels(self.contact, self.element, variables)

    def limits(self, displacement: Array) -> tuple[ContactForces, ContactForces]:
        """Forces from sliders that start far below and far above."""
        beyond = BEYOND * farthest_position(self.contact, self.contact.from_slider_origin(displacement))
        shifted = np.stack([displacement, displacement])
        shifted[0, 0, :, :2] += beyond
        shifted[1, 0, :, :2] -= beyond
        return self.element.evaluate(shifted[0]), self.element.evaluate(shifted[1])

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        low, high = self.limits(displacement)
        weight = np.ones((self.level.shape[0], 3))  # of f_high; the normal forces are the same
        weight[:, :2] = 0.5 * (1.0 + self.level)
        force = low.force + weight * (high.force - low.force)
        jacobian = low.jacobian + weight[:, :, None, None, None] * (high.jacobian - low.jacobian)
        return ContactForces(force, jacobian, np.maximum(low.state, high.state))

    def level_of(self, force: Array, displacement: Array) -> Array:
        """The level (n_c, 2) of a contact force (2H+1, n_c, 3) of the displacement; 0 where it is not free."""
        low, high = (forces.force[0, :, :2] for forces in self.limits(displacement))
        width = high - low
        level = np.divide(2.0 * force[0, :, :2] - low - high, width, out=np.zeros_like(width), where=width != 0.0)
        return np.asarray(np.clip(level, -1.0, 1.0), dtype=np.float64)

    def origin(self, displacement: Array, forces: ContactForces) -> Array:
        """w = u - T / kt; beyond every admissible position at the levels -1 and 1, which hold all along a curve."""
        kt = np.where(self.contact.tangential_stiffness > 0.0, self.contact.tangential_stiffness, 1.0)
        position = displacement[0, :, :2] + forces.force[0, :, :2] / kt[:, None]
        beyond = BEYOND * farthest_position(self.contact, displacement)
        return np.asarray(position + np.where(np.abs(self.level) == 1.0, self.level * beyond, 0.0), dtype=np.float64)

    def derivative(self, displacement: Array, forces: ContactForces) -> Array:
        """Derivative of the force by the levels, (f_high - f_low) / 2; see `TractionElement`."""
        low, high = self.limits(displacement)
        half = 0.5 * (high.force - low.force)
        result = np.zeros((*half.shape, 2))
        for c in range(2):
            result[:, :, c, c] = half[:, :, c]
        return result


@dataclass(frozen=True)
class TractionOrigins:
    """An element whose sliders start at given places in a box (see `ContactElement`); for the friction cone.

    There the admissible positions are no interval, but the common part of the discs abs(u - w) <= mu N / kt.
    A slider that starts outside is drawn in by Coulomb's law, so that every place of the box is admissible.
    """

    element: ContactElement  # the element, its sliders starting at 0
    centre: Array  # (n_c, 2), centre and half widths of the box, m
    radius: Array  # (n_c, 2), centre and half widths of the box, m
    place: Array  # (n_c, 2), place in the box, -1 to 1

    def at(self, variables: Array) -> "TractionOrigins":
        """The same element at other places (n_c, 2)."""
        return TractionOrigins(self.element, self.centre, self.radius, variables)

    def evaluate(self, displacement: Array) -> ContactForces:
        """Forces and Jacobian for real coefficients `displacement` (2H+1, n_c, 3), metres."""
        shifted = displacement.copy()
        shifted[0, :, :2] -= self.centre + self.radius * self.place
        return self.element.evaluate(shifted)

    def origin(self, displacement: Array, forces: ContactForces) -> Array:
        """The place itself, (n_c, 2), m."""
        return self.centre + self.radius * self.place

    def derivative(self, displacement: Array, forces: ContactForces) -> Array:
        """Derivative of the force by the places; see `TractionElement`."""
        return force_by_origin(forces) * self.radius[:, None, :]


def force_by_origin(forces: ContactForces) -> Array:
    """Derivative of the force by where the sliders start, (2H+1, n_c, 3, 2), N/m: -df/du of harmonic 0.

    [i, k, a, c]: coefficient i of component a at node k by w0 along t1 or t2 of this node.
    """
    return -forces.jacobian[:, :, :2, :, 0].transpose(3, 0, 1, 2)
