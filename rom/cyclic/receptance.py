"""Receptance of the blade in cyclic relative coordinates: all that the contact forces see of the structure."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rom.cyclic.modal_model import ModalModel
from rom.cyclic.reduced_model import Array, ComplexArray


@dataclass(frozen=True)
class RelativeReceptance:
    """G^(h)(w) = B_h r^(h)(w) B_h^H for a travelling wave of inter-blade phase angle psi.

    The relative displacement of the contact nodes is d^(h) = q_R^(h) - q_L^(h) exp(i h psi) = B_h q^(h), the
    contact force on the right nodes f^(h) acts on the blade as B_h^H f^(h) (paper eqs. 17 and 18), and the
    receptance of the reduced system is the modal sum r^(h) = sum_m phi phi^T / (w_m^2 + i c_m h w - (h w)^2)
    with c_m = 2 zeta_m w_m (paper eq. 7).

    Attributes
    ----------
    modal : the modes.
    phase : psi, rad.
    harmonics : the harmonics h that are asked for, ascending; may hold 0.
    force : amplitude of the excitation, N; it acts in harmonic 1 only.
    """

    modal: ModalModel
    phase: float
    harmonics: tuple[int, ...]
    force: float
    _last: dict[float, tuple[ComplexArray, ComplexArray]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @cached_property
    def relative(self) -> ComplexArray:
        """Relative contact motion of the modes, B_h phi: (n_h, 3 n_c, m)."""
        right = self.modal.right.astype(complex)
        if self.modal.left is None:
            return np.stack([right for _ in self.harmonics])
        return np.stack([right - self.modal.left * np.exp(1j * h * self.phase) for h in self.harmonics])

    @cached_property
    def modal_force(self) -> ComplexArray:
        """External modal force in each harmonic: static in 0, excitation in 1: (n_h, m)."""
        forces = np.zeros((len(self.harmonics), self.modal.angular_frequency.size), dtype=complex)
        for row, h in enumerate(self.harmonics):
            if h == 0:
                forces[row] = self.modal.static_force
            if h == 1:
                forces[row] = self.force * self.modal.force
        return forces

    @cached_property
    def adjoint(self) -> ComplexArray:
        """Modal forces of unit contact forces, (B_h phi)^H: (n_h, m, 3 n_c)."""
        return np.ascontiguousarray(self.relative.conj().transpose(0, 2, 1))

    @cached_property
    def _rates(self) -> tuple[ComplexArray, Array]:
        """The coefficients of w and of -w^2 in the denominators, (n_h, m) and (n_h, 1)."""
        h = np.asarray(self.harmonics, dtype=float)[:, None]
        return 1j * h * self.modal.damping, h**2

    def denominators(self, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """w_m^2 + i c_m h w - (h w)^2 and its derivative in w at w = `omega` (rad/s): each (n_h, m)."""
        found = self._last.get(omega)
        if found is None:  # asked for time and again at the same frequency
            damping, squares = self._rates
            value = damping * omega + (self.modal.angular_frequency**2 - squares * omega**2)
            found = value, damping - 2.0 * omega * squares
            self._last.clear()
            self._last[omega] = found
        return found

    def matrix(self, omega: float) -> ComplexArray:
        """G^(h) at `omega` (rad/s), (n_h, 3 n_c, 3 n_c)."""
        value, _ = self.denominators(omega)
        return (self.relative * (1.0 / value)[:, None, :]) @ self.adjoint

    def response(self, omega: float, contact_force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Relative displacement under the external and the contact forces f^(h), and its derivative in w.

        d_lin + G f and d_lin' + G' f, each (n_h, 3 n_c), for `contact_force` f (n_h, 3 n_c) at `omega` (rad/s);
        two products with vectors, without G itself.
        """
        coordinates = np.stack(self.modal_response(omega, contact_force), axis=-1)
        both = self.relative @ coordinates
        return both[..., 0], both[..., 1]

    def modal_response(self, omega: float, contact_force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Modal coordinates under external and contact forces at w = `omega` (rad/s), and their derivative in w.

        `contact_force` is f^(h) on the right nodes, (n_h, 3 n_c). Returns two arrays (n_h, m).
        """
        value, slope = self.denominators(omega)
        coordinates = (self.modal_force + (self.adjoint @ contact_force[..., None])[..., 0]) / value
        return coordinates, -slope * coordinates / value

    def coordinates(self, frequencies: Array, contact_force: ComplexArray) -> ComplexArray:
        """Modal coordinates (P, n_h, m) at `frequencies` (P,), rad/s, each under its own `contact_force`.

        contact_force: f^(h) on the right nodes, (P, n_h, 3 n_c), N.
        """
        damping, squares = self._rates
        omega = frequencies[:, None, None]
        value = damping * omega + (self.modal.angular_frequency**2 - squares * omega**2)
        by_harmonic = self.adjoint @ contact_force.transpose(1, 2, 0)
        return (self.modal_force + by_harmonic.transpose(2, 0, 1)) / value

    def output_rows(self, name: str, omega: float) -> ComplexArray:
        """Receptance of output `name` to contact forces at `omega` (rad/s), o r^(h) B_h^H: (n_h, 3 n_c)."""
        value, _ = self.denominators(omega)
        weighted = (self.modal.outputs[name] / value)[:, None, :]
        return (weighted @ self.adjoint)[:, 0, :]


def coupled_frequencies(modal: ModalModel, phase: float, stiffness: Array) -> Array:
    """Undamped natural frequencies (m,), rad/s, with linear springs `stiffness` (3 n_c,) N/m at the contact nodes.

    modal: the m modes with free contacts; phase: inter-blade phase angle, rad.
    """
    relative = RelativeReceptance(modal, phase, (1,), 0.0).relative[0]
    squared = np.diag(modal.angular_frequency**2) + relative.conj().T @ (stiffness[:, None] * relative)
    return np.sqrt(np.linalg.eigvalsh(squared))


def linear_response(
    modal: ModalModel,
    frequency_hz: Sequence[float] | Array,
    *,
    phase: float,
    force: float,
    normal: Array | float = 0.0,
    tangential: Array | float = 0.0,
    output: str = "tip",
) -> ComplexArray:
    """Response of harmonic 1 with linear springs at the contact nodes: free (no springs) or fully stuck.

    modal: the modes; frequency_hz: (F,) of the excitation, Hz; phase: inter-blade phase angle, rad; force: amplitude
    of the excitation, N. Solves d = d_lin - G k d at every frequency, k the springs (tangential, tangential, normal)
    of the nodes in N/m; `normal`, `tangential`: numbers or (n_c,). Returns the complex amplitude of the output, (F,),
    metres.
    """
    n_contacts = modal.n_contacts
    springs = np.empty((n_contacts, 3))
    springs[:, :2] = np.broadcast_to(np.asarray(tangential, dtype=float), n_contacts)[:, None]
    springs[:, 2] = np.broadcast_to(np.asarray(normal, dtype=float), n_contacts)
    stiffness = springs.reshape(-1)
    receptance = RelativeReceptance(modal, phase, (1,), force)
    response = np.empty(len(frequency_hz), dtype=complex)
    for index, hertz in enumerate(frequency_hz):
        omega = 2.0 * np.pi * hertz
        contact_force = np.zeros(3 * n_contacts, dtype=complex)
        if np.any(stiffness):
            free, _ = receptance.response(omega, contact_force[None])
            system = np.eye(3 * n_contacts) + receptance.matrix(omega)[0] * stiffness
            contact_force = -stiffness * np.linalg.solve(system, free[0])
        coordinates, _ = receptance.modal_response(omega, contact_force[None])
        response[index] = modal.outputs[output] @ coordinates[0]
    return response
