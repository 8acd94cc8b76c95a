"""Extended periodic motion: a structure vibrates freely, and a negative damping makes up for what is dissipated.

A nonlinear mode is a periodic motion of

    M q'' + (C - 2 zeta omega M) q' + K q = B^H f(B q) + f_static,

with the relative contact displacements d = B q: the damping ratio zeta is that of the mode, since the term that it
stands in feeds back what structure and contacts dissipate [1]_. In modal coordinates the dynamic stiffness of mode m
in harmonic h is

    D_m^(h) = omega_m^2 + i h omega (c_m - 2 zeta_h omega) - (h omega)^2,

and with Coriolis forces a full matrix, i h omega times these beside it.
zeta_h = zeta in all harmonics ("all_harmonics") is the motion of [1]_. With zeta_1 = zeta alone, zeta_h = 0 above
("first_harmonic", the default), the motion solves the forced equations exactly, under a force
2 i zeta omega^2 M q^(1) e^(i omega t) in phase with its velocity. That is the one to compare with a forced response:
a higher harmonic in resonance keeps its own damping.

One mode, the carrier k, vanishes from the receptance of harmonic 1: its coordinate q_k is an unknown of its own, real
by the choice of phase. Then nothing is singular where the contacts are open. Equations and unknowns:

    d^(h) - d_static - sum_m B_h phi_m q_m^(h) = 0,     q_m^(h) = (B_h phi_m)^H f^(h) / D_m^(h),
    D_k^(1) q_k - (B_1 phi_k)^H f^(1) = 0,
    ln(sum_m |q_m^(1)|^2) / 2 - ln a = 0

for d, q_k, omega and zeta at the modal amplitude a. The first states come from a linear mode.

References
----------
.. [1] M. Krack, "Nonlinear modal analysis of nonconservative systems: extension of the periodic motion concept",
   Computers and Structures 154 (2015) 59-71.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array, ContactElement, ContactForces, ContactParameters
from nonlinear.harmonic_balance.residual import receptance_times_force_jacobian
from rom.cyclic.contact_springs import contact_springs, spring_stiffness
from rom.cyclic.pole_modes import PoleModes
from rom.cyclic.receptance import RelativeReceptance

EXTRA = 4  # unknowns beside the displacements: q_k, omega, zeta, ln a


@dataclass(frozen=True)
class MotionState:
    """The unknowns of an extended periodic motion."""

    displacement: Array  # (2H+1, n_c, 3), real Fourier coefficients of the relative displacement, m
    carrier: float  # coordinate q_k of the carrier in harmonic 1, m sqrt(kg)
    omega: float  # frequency, rad/s
    damping: float  # damping ratio zeta
    level: float  # ln a, a in m sqrt(kg)

    def packed(self) -> Array:
        """All unknowns in one array, (n + 4,)."""
        return np.append(self.displacement.reshape(-1), (self.carrier, self.omega, self.damping, self.level))

    @classmethod
    def unpacked(cls, values: Array, shape: tuple[int, ...]) -> MotionState:
        """The state of an array (n + 4,); `shape` is that of the displacement."""
        return cls(values[:-EXTRA].reshape(shape), *(float(value) for value in values[-EXTRA:]))


@dataclass(frozen=True)
class LinearisedMotion:
    """The n + 3 equations at one state and their derivatives by the n + 4 unknowns."""

    # (n + 3,), displacements in m, the equation of the carrier divided by its omega_k^2, and the amplitude's
    residual: Array
    jacobian: Array  # (n + 3, n + 4), derivatives by d, q_k, omega, zeta and ln a
    contact: ContactForces  # contact forces
    coordinates: ComplexArray  # (H+1, m), modal coordinates


@dataclass(frozen=True)
class ExtendedMotion:
    """The equations of the extended periodic motion."""

    receptance: RelativeReceptance  # the structure, with harmonics 0 .. H; its excitation plays no part
    element: ContactElement  # the contact forces
    carrier: int  # mode k whose coordinate is an unknown
    every_harmonic: bool = False  # whether the negative damping acts in all harmonics, and not in harmonic 1 alone

    @cached_property
    def _coriolis(self) -> ComplexArray | None:
        """i h times the Coriolis forces of the wave of each harmonic, (H+1, m, m); None: there are none."""
        if not self.receptance.modal.turns:
            return None
        size = self.receptance.modes.angular_frequency.shape[1]
        found = np.zeros((len(self.receptance.harmonics), size, size), dtype=complex)
        for h, matrix in zip(self.receptance.harmonics, found, strict=True):
            own = self.receptance.modal.at_phase(h * self.receptance.phase).coriolis
            assert own is not None
            matrix[: len(own), : len(own)] = 1j * h * own
        return found

    def stiffness(self, omega: float, damping: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """D (H+1, m), without Coriolis forces, and its derivatives by omega and by zeta."""
        modes, h = self.receptance.modes, np.asarray(self.receptance.harmonics, dtype=float)[:, None]
        turned, fed = 1j * h * omega, 2.0 * (1.0 if self.every_harmonic else h == 1.0)
        lost = modes.total_damping
        value = modes.total_stiffness + turned * (lost - fed * damping * omega) - (h * omega) ** 2
        by_omega = 1j * h * (lost - 2.0 * fed * damping * omega) - 2.0 * h**2 * omega
        by_damping = np.broadcast_to(-fed * turned * omega, value.shape)
        return value, by_omega, by_damping

    def evaluate(self, state: MotionState) -> LinearisedMotion:
        """The equations and their derivatives at a state."""
        contact, k = self.element.evaluate(state.displacement), self.carrier
        modes, rows = self.receptance.modes, len(state.displacement)
        force = to_complex(contact.force.reshape(rows, -1))
        value, by_omega, by_damping = self.stiffness(state.omega, state.damping)
        dynamic = _Dynamics.of(value, self._coriolis, state.omega, k)
        pushed = (modes.adjoint @ force[..., None])[..., 0]
        external = pushed.copy()
        external[0] += self.receptance.modal_force[0]
        unit = np.zeros_like(pushed)
        unit[1, k] = 1.0
        unit -= dynamic.solved(dynamic.beside(unit))
        coordinates = dynamic.solved(external) + state.carrier * unit
        changes = by_omega * coordinates, by_damping * coordinates
        if self._coriolis is not None:
            changes = changes[0] + (self._coriolis @ coordinates[..., None])[..., 0], changes[1]
        rates = [-dynamic.solved(each) for each in changes]
        moved = modes.relative @ np.stack([coordinates, *rates, unit], axis=-1)
        columns = to_real(moved).reshape(-1, 4)
        n, omega2 = columns.shape[0], modes.angular_frequency[1, k] ** 2
        residual, jacobian = np.zeros(n + 3), np.zeros((n + 3, n + EXTRA))
        residual[:n] = state.displacement.reshape(-1) - columns[:, 0]
        followed = dynamic.solved_all(modes.adjoint)
        jacobian[:n, :n] = np.eye(n) - self._by_displacement(modes.relative @ followed, contact)
        jacobian[:n, n], jacobian[:n, n + 1], jacobian[:n, n + 2] = -columns[:, 3], -columns[:, 1], -columns[:, 2]
        own = dynamic.row @ coordinates[1] - pushed[1, k]
        residual[n : n + 2] = np.array([own.real, own.imag]) / omega2
        by_force = self._force_derivative(contact)  # of f^(1), (3 n_c, n)
        row = (dynamic.row @ followed[1] - modes.adjoint[1, k]) @ by_force / omega2
        parts = [
            dynamic.row @ unit[1],
            *(each[1, k] + dynamic.row @ rate[1] for each, rate in zip(changes, rates, strict=True)),
        ]
        for i, part in enumerate((np.real, np.imag)):
            jacobian[n + i, :n] = part(row)
            jacobian[n + i, n : n + 3] = [part(each) / omega2 for each in parts]
        size = float(np.sum(np.abs(coordinates[1]) ** 2))
        residual[n + 2] = 0.5 * np.log(size) - state.level
        along = coordinates[1].conj()
        jacobian[n + 2, :n] = np.real((along @ followed[1]) @ by_force) / size
        jacobian[n + 2, n:] = [*(float((along @ each[1]).real) / size for each in (unit, *rates)), -1.0]
        return LinearisedMotion(residual, jacobian, contact, coordinates)

    def _by_displacement(self, matrix: ComplexArray, contact: ContactForces) -> Array:
        """G df/dd (n, n) in the order of the unknowns."""
        product = receptance_times_force_jacobian(matrix, contact.jacobian, 0)
        rows, nodes = contact.force.shape[0], contact.force.shape[1]
        return product.reshape(-1, nodes, rows, 3).transpose(0, 2, 1, 3).reshape(product.shape)

    @staticmethod
    def _force_derivative(contact: ContactForces) -> ComplexArray:
        """Derivatives of the contact force of harmonic 1 by the displacements, (3 n_c, n)."""
        nodes, rows = contact.jacobian.shape[0], contact.jacobian.shape[3]
        found = np.zeros((nodes, 3, rows, nodes, 3), dtype=complex)
        for node, table in enumerate(contact.jacobian):
            found[node, :, :, node] = (table[:, :, 1] + 1j * table[:, :, 2]).transpose(0, 2, 1)
        return found.reshape(3 * nodes, rows * nodes * 3)


@dataclass(frozen=True)
class _Dynamics:
    """The dynamic stiffness Z of the modes in each harmonic, the carrier held in harmonic 1."""

    inverse: ComplexArray  # (H+1, m), 1 / D; or (H+1, m, m), Z^-1; 0 of the carrier in harmonic 1
    row: ComplexArray  # (m,), row of Z of the carrier in harmonic 1
    coupling: ComplexArray | None  # (H+1, m, m), what Coriolis forces make of Z; None: there are none

    @classmethod
    def of(cls, value: ComplexArray, coriolis: ComplexArray | None, omega: float, k: int) -> _Dynamics:
        """From D (H+1, m), i h times the Coriolis forces and the carrier k."""
        row = np.zeros(value.shape[1], dtype=complex)
        row[k], value[1, k] = value[1, k], np.inf
        if coriolis is None:
            return cls(1.0 / value, row, None)
        coupling, value[1, k] = omega * coriolis, 1.0
        row += coupling[1, k]
        every = coupling + value[:, :, None] * np.eye(row.size)
        every[1, k], every[1, :, k] = 0.0, 0.0
        every[1, k, k] = 1.0
        inverse = np.linalg.inv(every)
        inverse[1, k, k] = 0.0
        return cls(np.asarray(inverse, dtype=complex), row, coupling)

    def beside(self, coordinates: ComplexArray) -> ComplexArray:
        """What Coriolis forces make of coordinates, (H+1, m)."""
        if self.coupling is None:
            return np.zeros_like(coordinates)
        return (self.coupling @ coordinates[..., None])[..., 0]

    def solved(self, force: ComplexArray) -> ComplexArray:
        """Z^-1 times modal forces (H+1, m)."""
        return self.inverse * force if self.coupling is None else (self.inverse @ force[..., None])[..., 0]

    def solved_all(self, forces: ComplexArray) -> ComplexArray:
        """Z^-1 times columns of modal forces (H+1, m, r)."""
        return self.inverse[..., None] * forces if self.coupling is None else self.inverse @ forces


RIGID = 1e-14  # eigenvalue over the largest stiffness, below which it is round-off


def linear_mode(
    receptance: RelativeReceptance, contact: ContactParameters, share: Array, number: int
) -> tuple[float, float, ComplexArray]:
    """Frequency (rad/s), damping ratio and modal coordinates (m,) of one mode with linear contact springs.

    Shapes: `share` (n_c,). A rigid motion, which no contact holds, has frequency and damping ratio 0.
    """
    from scipy.linalg import eigh

    waves, relative = receptance.modes, receptance.modes.relative[1]
    springs = contact_springs(
        receptance.modal.n_contacts,
        contact.normal_stiffness * share,
        contact.tangential_stiffness * share * (contact.friction > 0.0),
    )
    added = spring_stiffness(relative, springs)
    if receptance.modal.turns:
        return _turning_mode(receptance, added, number)
    matrix = np.diag(waves.angular_frequency[1] ** 2).astype(complex) + added
    squared, shapes = eigh(matrix, subset_by_index=(number - 1, number - 1))
    shape = np.asarray(shapes[:, 0], dtype=complex)
    if squared[0] <= RIGID * np.abs(matrix).max():
        return 0.0, 0.0, shape
    omega = float(np.sqrt(squared[0]))
    lost = waves.total_damping[1].real + waves.total_stiffness[1].imag / omega
    damping = float(lost @ np.abs(shape) ** 2) / (2.0 * omega)
    return omega, damping, shape


def _turning_mode(
    receptance: RelativeReceptance, added: ComplexArray, number: int
) -> tuple[float, float, ComplexArray]:
    """As `linear_mode`, of the poles that turn forward with Coriolis forces and with stiffness `added` (m, m)."""
    own, waves = receptance.modal.at_phase(receptance.phase), receptance.modes
    assert own.coriolis is not None
    size, stiffness = len(own.coriolis), np.array(waves.total_stiffness[1])
    stiffness[:size] = own.held_stiffness
    damping = np.diag(waves.total_damping[1]).astype(complex)
    damping[:size, :size] += own.coriolis
    found = PoleModes.of(np.diag(stiffness) + added, damping)
    forward = np.flatnonzero(found.poles.imag > 0.0)
    place = forward[np.argsort(found.poles[forward].imag, kind="stable")[number - 1]]
    omega, shape = float(found.poles[place].imag), found.shapes[:, place]
    return omega, -float(found.poles[place].real) / omega, shape / np.linalg.norm(shape)


def first_state(
    receptance: RelativeReceptance, mode: tuple[float, float, ComplexArray], static: Array, level: float
) -> tuple[int, MotionState]:
    """The carrier, which takes the largest part in a linear mode, and the state at the amplitude exp(`level`)."""
    omega, damping, shape = mode
    carrier = int(np.argmax(np.abs(shape)))
    shape = shape * (abs(shape[carrier]) / shape[carrier]) * np.exp(level)
    motion = np.zeros((len(receptance.harmonics), static.size), dtype=complex)
    motion[0] = static.reshape(-1)
    motion[1] = receptance.modes.relative[1] @ shape
    displacement = to_real(motion).reshape(-1, *static.shape)
    return carrier, MotionState(displacement, float(shape[carrier].real), omega, damping, level)


def end_of_linear_motion(contact: ContactParameters, static: Array, motion: ComplexArray) -> float:
    """Modal amplitude up to which no node slips, lifts off or touches.

    Shapes: `static` (n_c, 3), `motion` (n_c, 3).
    """
    load = contact.unclipped_load(static[:, 2])
    swing = contact.normal_stiffness * np.abs(motion[:, 2])
    shear = contact.tangential_stiffness[:, None] * np.abs(motion[:, :2])
    rubs = (load > 0.0) & (contact.friction > 0.0)
    growth = swing.copy()
    growth[rubs] += shear.max(axis=1)[rubs] / contact.friction[rubs]
    moving = growth > 0.0
    return float(np.min(np.abs(load[moving]) / growth[moving], initial=np.inf))
