"""A mistuned ring whose contacts are linear springs: stuck, sliding or free.

The displacement of blade j is T z_j, in its own time; T are a few vectors in the modal coordinates, the same for all
blades. With the contact springs k_j of pair j,

    (A_j - omega^2 T^T T + i omega T^T c T) z_j + U_j z_(j+1) + U_(j-1)^H z_(j-1) = T^T F,
    A_j = T^T ((1 + delta_j) omega_m)^2 T + T^T (R^T k_j R + L^T k_(j-1) L) T,    U_j = -exp(i psi) T^T R^T k_j L T.

T spans the modes of the tuned ring at all nodal diameters up to a multiple of the frequencies of interest, and the
tuned responses at both ends of the range. Mistuning couples these with higher modes only to second order.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.mistuned_ring.linear_contacts import (
    HIGHEST,
    LinearPeak,
    highest_peak,
    springs_in_state,
    supported_stiffness,
)
from nonlinear.mistuned_ring.mistuning import Mistuning, MistuningError
from nonlinear.options import Excitation
from rom.cyclic.modal_model import ModalModel

INDEPENDENT = 1e-7  # smallest relative singular value of a vector of T
BATCH = 64  # frequencies solved together


@dataclass(frozen=True)
class LinearRing:
    """Harmonic 1 of a ring with linear contacts, in r coordinates a blade."""

    # mass, damping (r, r): T^T T and T^T c T
    mass: Array
    damping: Array
    blade: Array  # (r, r) T^T omega_m^2 T
    # (r, r) T^T R^T k R T, T^T L^T k L T and -exp(i psi) T^T R^T k L T of the tuned springs
    springs: tuple[Array, Array, ComplexArray]
    force: ComplexArray  # (r,) T^T F
    output: Array  # (r,) the output of the coordinates
    mistuning: Mistuning  # deviations of all blades; those of friction and interference have no effect
    # smallest half-power bandwidth of the modes of the blade up to the upper end of the range, Hz
    bandwidth_hz: float

    @classmethod
    def of(
        cls,
        modal: ModalModel,
        contact: ContactParameters,
        excitation: Excitation,
        mistuning: Mistuning,
        *,
        highest_hz: float,
        state: str = "stuck",
        output: str = "tip",
    ) -> LinearRing:
        """The ring of a blade with its contacts in one linear state.

        `highest_hz`: upper end of the frequencies of interest, Hz.
        """
        if mistuning.n_blades != modal.n_blades:
            raise MistuningError(f"mistuning: {mistuning.n_blades} blades, allowed: {modal.n_blades}, as the model")
        if modal.waves_differ:
            raise MistuningError("modal: in a flow or with Coriolis forces, allowed: LinearSectors")
        tuned = _TunedBlade(modal, springs_in_state(contact, state), excitation)
        basis = tuned.basis(2.0 * np.pi * highest_hz)
        right, left = modal.right @ basis, (np.zeros_like(modal.right) if modal.left is None else modal.left) @ basis
        at_right, at_left = ((face * tuned.springs[:, None]).T @ face for face in (right, left))
        below = np.flatnonzero(modal.angular_frequency <= 2.0 * np.pi * highest_hz)
        return cls(
            mass=basis.T @ basis,
            damping=basis.T @ (modal.damping[:, None] * basis),
            blade=basis.T @ ((modal.angular_frequency**2)[:, None] * basis),
            springs=(at_right, at_left, -np.exp(1j * tuned.phase(1)) * ((right * tuned.springs[:, None]).T @ left)),
            force=basis.T @ tuned.force,
            output=modal.outputs[output] @ basis,
            mistuning=mistuning,
            bandwidth_hz=float(modal.damping[below].min(initial=modal.damping[0])) / (2.0 * np.pi),
        )

    def with_mistuning(self, mistuning: Mistuning) -> LinearRing:
        """The same ring with other deviations."""
        return replace(self, mistuning=mistuning)

    @cached_property
    def _stiffness(self) -> Array:
        """A_j, (N_b, r, r)."""
        ratio = (1.0 + self.mistuning.frequency)[:, None, None] ** 2
        factor = 1.0 + self.mistuning.stiffness[:, None, None]
        at_right, at_left, _ = self.springs
        return ratio * self.blade + factor * at_right + np.roll(factor, 1, axis=0) * at_left

    @cached_property
    def _coupling(self) -> ComplexArray:
        """U_j, (N_b, r, r)."""
        return np.asarray((1.0 + self.mistuning.stiffness)[:, None, None] * self.springs[2], dtype=complex)

    def vibration(self, frequency_hz: Array | list[float]) -> ComplexArray:
        """Amplitude of the output of all blades, each in its own time.

        `frequency_hz`: excitation frequencies, Hz. Returns (F, N_b): amplitudes, m.
        """
        omega = 2.0 * np.pi * np.asarray(frequency_hz, dtype=float)
        parts = [self._solved(omega[first : first + BATCH]) for first in range(0, omega.size, BATCH)]
        return np.concatenate([part @ self.output for part in parts])

    def _solved(self, omega: Array) -> ComplexArray:
        """z of all blades at a few frequencies, (F, N_b, r)."""
        at = omega[:, None, None]
        dynamic = 1j * at * self.damping - at**2 * self.mass
        own = np.asarray(dynamic[:, None] + self._stiffness, dtype=np.complex128)
        return solve_cyclic(own, self._coupling, np.broadcast_to(self.force, own.shape[:-1]))

    def peak(self, frequency_hz: tuple[float, float]) -> LinearPeak:
        """The highest amplitude of any blade between two frequencies.

        `frequency_hz`: range, Hz. It is sampled four times in the half-power bandwidth, then solved for around the
        highest samples.
        """
        return highest_peak(self.vibration, self.bandwidth_hz, frequency_hz)


@dataclass(frozen=True)
class _TunedBlade:
    """The tuned blade with its springs, (3 n_c,), and its excitation."""

    modal: ModalModel
    springs: Array
    excitation: Excitation

    def phase(self, harmonic: int) -> float:
        return harmonic * self.modal.phase(self.excitation.engine_order)

    @property
    def force(self) -> ComplexArray:
        """Modal force of harmonic 1, (m,)."""
        amplitude = self.excitation.force * dict(self.excitation.factors).get(1, 1.0)
        return amplitude * self.modal.force.astype(complex)

    def basis(self, highest: float) -> Array:
        """T, (m, r), for frequencies up to `highest` (rad/s)."""
        from scipy.linalg import eigh

        modal, found = self.modal, []
        if HIGHEST * highest >= modal.angular_frequency[-1]:
            return np.eye(modal.angular_frequency.size)
        for nodal_diameter in range((modal.n_blades or 1) // 2 + 1):
            limits = (0.0, (HIGHEST * highest) ** 2)
            found.append(
                eigh(supported_stiffness(modal, modal.phase(nodal_diameter), self.springs), subset_by_value=limits)[1]
            )
        stiffness = supported_stiffness(modal, self.phase(1), self.springs)
        for share in (0.0, 0.5):  # below the range of the modes: quasi-static parts of the response
            response = np.linalg.solve(stiffness - (share * highest) ** 2 * np.eye(len(stiffness)), self.force)
            found.append((response / np.linalg.norm(response))[:, None])
        vectors = np.concatenate(found, axis=1)
        left, values, _ = np.linalg.svd(np.concatenate([vectors.real, vectors.imag], axis=1), full_matrices=False)
        return np.ascontiguousarray(left[:, values > INDEPENDENT * values[0]])


def solve_cyclic(own: ComplexArray, after: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Solve own_j z_j + after_j z_(j+1) + after_(j-1)^H z_(j-1) = right_j around a ring, at F frequencies at once.

    The last blade is taken out; the chain of the others is eliminated block by block.
    Shapes: `own` (F, N, r, r), `after` (N, r, r), `right` (F, N, r), returns (F, N, r).
    """
    count, size = right.shape[1], right.shape[2]
    before = np.roll(after, 1, axis=0).conj().transpose(0, 2, 1)
    chain = count - 1
    beside = np.zeros((len(right), chain, size, size + 1), complex)  # for the last blade, and the right-hand side
    onward = np.zeros((len(right), chain, size, size), complex)
    beside[..., -1] = right[:, :chain]
    end = np.concatenate([own[:, -1], right[:, -1, :, None]], axis=-1)
    if not chain:
        end[..., :-1] += after[0] + before[0]
    else:
        beside[:, 0, :, :-1] += before[0]
        beside[:, -1, :, :-1] += after[chain - 1]
        for k in range(chain):
            pivot, rest = own[:, k], beside[:, k]
            if k:
                pivot = pivot - before[k] @ onward[:, k - 1]
                rest = rest - before[k] @ beside[:, k - 1]
            onto = np.zeros_like(pivot) if k == chain - 1 else np.broadcast_to(after[k], pivot.shape)
            found = np.linalg.solve(pivot, np.concatenate([rest, onto], axis=-1))
            beside[:, k], onward[:, k] = found[..., : size + 1], found[..., size + 1 :]
        for k in range(chain - 2, -1, -1):
            beside[:, k] -= onward[:, k] @ beside[:, k + 1]
        end -= after[-1] @ beside[:, 0] + before[-1] @ beside[:, -1]
    z = np.empty(right.shape, complex)
    z[:, -1] = np.linalg.solve(end[..., :-1], end[..., -1:])[..., 0]
    z[:, :chain] = beside[..., -1] - (beside[..., :-1] @ z[:, None, -1, :, None])[..., 0]
    return z
