"""A mistuned ring in its waves, with contacts that are linear springs: stuck, sliding or free.

In the wave l, each in the time of its own blade, the sectors move as V_l a_l: V_l are the modes of the tuned ring
with the springs up to a multiple of the frequencies of interest, and in the wave 0 its response. The other modes
follow as they do near the upper end of the range. With x_j = N^(-1/2) sum_l exp(2 pi i j l / N) V_l a_l, and P the
strains of the blades and springs whose stiffness deviates by the factors E,

    sum_k (K_lk + W_l^H Y_k) a_k,    W_l = N^(-1/2) exp(2 pi i j l / N) P V_l,    Y = (1 + E R)^-1 E W,

where R is the flexibility of the other modes under forces on the strains, a block-circulant matrix.

Without a flow and Coriolis forces the K are Hermitian, and the ring has undamped modes. With them it has poles. The
other modes z follow the Coriolis forces -C v of the velocities v of the motions, z = -C v / omega_m^2, which adds the
mass C^H C / omega_m^2 to these.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.mistuned_ring.linear_contacts import (
    HIGHEST,
    LinearPeak,
    highest_peak,
    springs_in_state,
    strain_directions,
    supported_stiffness,
)
from nonlinear.mistuned_ring.mistuning import Mistuning, MistuningError, check_blades
from nonlinear.mistuned_ring.sector_ring import wave_turns
from nonlinear.options import Excitation
from rom.cyclic.cyclic_symmetry import relative_contact_motion
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.pole_modes import PoleModes
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.sector_modes import RingModes

NEAR = 0.9  # where the other modes are taken at, relative to the upper end of the range
INDEPENDENT = 1e-7  # smallest part of a response that the modes do not have, relative to it
ITERATIONS, CONVERGED = 60, 1e-13  # of the damping between modes
BATCH = 256  # frequencies solved together
SOFT = 1e-6  # of the squares of frequencies: rigid motions


@dataclass(frozen=True)
class LinearSectors:
    """Harmonic 1 of a ring with linear contacts in motions a of all waves, of blades alone or on a disk."""

    wave: NDArray[np.intp]  # (A,) wave l of each motion
    # stiffness, damping, mass (A, A): matrices of the tuned ring, the stiffness without the flow, the damping with
    # that and with Coriolis forces
    stiffness: ComplexArray
    damping: ComplexArray
    mass: ComplexArray
    strain: ComplexArray  # (p, A) P V: strains of the blade, then those of the contact springs
    # residual, residual_output (N, p): flexibility of the other modes of each wave, for the strains and for the
    # output, under forces on the strains
    residual: ComplexArray
    residual_output: ComplexArray
    # force, output (A,): force on the motions, and output of each in the sector 0, not divided by N^(1/2)
    force: ComplexArray
    output: ComplexArray
    mistuning: Mistuning  # deviations of all blades; those of friction and interference have no effect
    bandwidth_hz: float  # smallest half-power bandwidth of the modes up to the upper end of the range, Hz
    n_springs: int  # number of strains of the contact springs, the last ones
    # (A, A) stiffness that the flow adds; None without a flow and without Coriolis forces
    flow: ComplexArray | None = None

    @classmethod
    def of(
        cls,
        modal: RingModes,
        contact: ContactParameters,
        excitation: Excitation,
        mistuning: Mistuning,
        *,
        highest_hz: float,
        state: str = "stuck",
        output: str = "tip",
    ) -> LinearSectors:
        """The ring of a sector or a blade with its contacts in one linear state."""
        if mistuning.n_blades != modal.n_blades:
            raise MistuningError(f"mistuning: {mistuning.n_blades} blades, allowed: {modal.n_blades}, as the model")
        check_blades(modal, mistuning)
        springs = springs_in_state(contact, state)
        waves = _waves(modal, contact, excitation, springs, 2.0 * np.pi * highest_hz, output)
        motions = [wave.motions(response=number == 0) for number, wave in enumerate(waves)]
        pairs = list(zip(waves, motions, strict=True))
        numbers = np.repeat(np.arange(mistuning.n_blades), [own.shape[1] for own in motions])
        force = np.zeros(numbers.size, complex)
        amplitude = excitation.force * dict(excitation.factors).get(1, 1.0) * np.sqrt(mistuning.n_blades)
        force[numbers == 0] = amplitude * (motions[0].conj().T @ waves[0].modes.force)
        return cls(
            wave=numbers,
            stiffness=_diagonal([own.conj().T @ wave.stiffness @ own for wave, own in pairs]),
            damping=_diagonal([own.conj().T @ wave.damping @ own for wave, own in pairs]),
            mass=_diagonal([own.conj().T @ own + wave.followed_mass(own) for wave, own in pairs]),
            strain=np.concatenate([wave.strain @ own for wave, own in pairs], axis=1),
            residual=np.array([wave.residual(wave.strain, own) for wave, own in pairs]),
            residual_output=np.array([wave.residual(wave.output[None], own)[0] for wave, own in pairs]),
            force=force,
            output=np.concatenate([wave.output @ own for wave, own in pairs]),
            mistuning=mistuning,
            bandwidth_hz=_bandwidth_hz(waves),
            n_springs=springs.size,
            flow=_diagonal([own.conj().T @ wave.flow @ own for wave, own in pairs]) if _has_poles(modal) else None,
        )

    def with_mistuning(self, mistuning: Mistuning) -> LinearSectors:
        """The same ring with other deviations."""
        return replace(self, mistuning=mistuning)

    @cached_property
    def _deviations(self) -> tuple[Array, NDArray[np.intp]]:
        """E (N, p) of the strains that deviate in some sector, and their numbers."""
        n_springs = self.n_springs
        added = self.mistuning.added_stiffness[:, None]
        blade = np.repeat(added, len(self.strain) - n_springs, axis=1)
        springs = np.repeat(self.mistuning.stiffness[:, None], n_springs, axis=1)
        every = np.concatenate([blade, springs], axis=1)
        some = np.flatnonzero(every.any(axis=0))
        return every[:, some], some

    @cached_property
    def _modes(self) -> tuple[Array, ComplexArray, ComplexArray]:
        """Squared natural frequencies (A,), mass-normalised motions (A, A) and their outputs (N, A)."""
        from scipy.linalg import eigh

        deviation, some = self._deviations
        turn = wave_turns(self.mistuning.n_blades, self.wave)
        strain = turn[:, None, :] * self.strain[some]
        force = _followed(deviation, strain, self.residual[:, some][:, :, some])
        added = strain.reshape(-1, self.wave.size).conj().T @ force.reshape(-1, self.wave.size)
        squared, motions = eigh(self.stiffness + (added + added.conj().T) / 2.0, self.mass)
        moved = self.residual_output[:, None, some] @ np.fft.fft(force, axis=0, norm="ortho")
        output = turn * self.output - np.fft.ifft(moved[:, 0], axis=0, norm="ortho")
        return squared, motions, output @ motions

    @cached_property
    def _poles(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Poles (2 A,), what each makes of the outputs (N, 2 A), and what it takes of the force (2 A,)."""
        squared, motions, rows = self._modes
        found = _pole_modes(squared, motions, self.damping, self.flow)
        return found.poles, rows @ found.shapes, found.dual @ (motions.conj().T @ self.force)

    @property
    def tuned_hz(self) -> Array:
        """Frequencies of the tuned ring in the wave of the excitation, ascending, Hz."""
        from scipy.linalg import eigh

        own = np.ix_(self.wave == 0, self.wave == 0)
        flow = None if self.flow is None else self.flow[own]
        squared, motions = eigh(self.stiffness[own], self.mass[own])
        poles = _pole_modes(squared, motions, self.damping[own], flow).poles.imag
        return np.asarray(np.sort(poles[poles > 0.0]) / (2.0 * np.pi))

    def vibration(self, frequency_hz: Array | list[float]) -> ComplexArray:
        """Amplitude of the output of all blades, each in its own time.

        `frequency_hz`: excitation frequencies, Hz. Returns (F, N_b): amplitudes, m.
        """
        omega = 2.0 * np.pi * np.asarray(frequency_hz, dtype=float)
        if self.flow is not None:
            poles, rows, force = self._poles
            return (force / (np.abs(poles) ** 2 - 1j * np.multiply.outer(omega, poles.conj()))) @ rows.T
        squared, motions, rows = self._modes
        damping, force = motions.conj().T @ self.damping @ motions, motions.conj().T @ self.force
        parts = [
            _damped(squared, damping, force, omega[first : first + BATCH]) for first in range(0, omega.size, BATCH)
        ]
        return (rows @ np.concatenate(parts, axis=1)).T

    def peak(self, frequency_hz: tuple[float, float]) -> LinearPeak:
        """The highest amplitude of any blade between two frequencies.

        `frequency_hz`: range, Hz. It is sampled four times in the half-power bandwidth, then solved for around the
        highest samples.
        """
        return highest_peak(self.vibration, self.bandwidth_hz, frequency_hz)


def _has_poles(modal: RingModes) -> bool:
    return bool(modal.influence) or modal.turns


def _pole_modes(squared: Array, motions: ComplexArray, damping: ComplexArray, flow: ComplexArray | None) -> PoleModes:
    """Poles of a ring from its undamped modes without a flow; rigid motions are softly held."""
    adjoint = motions.conj().T
    stiffness = np.diag(np.maximum(squared, SOFT * squared[squared > SOFT * squared[-1]].min())).astype(complex)
    if flow is not None:
        stiffness += adjoint @ flow @ motions
    return PoleModes.of(stiffness, adjoint @ damping @ motions)


def _waves(
    modal: RingModes,
    contact: ContactParameters,
    excitation: Excitation,
    springs: Array,
    highest: float,
    output: str,
) -> list[_Wave]:
    """The tuned sector in all waves, each in the time of its own blade, with springs (3 n_c,)."""
    phase, n_blades = modal.phase(excitation.engine_order), modal.n_blades or 1
    rows = np.zeros((0, len(modal.at(0).shapes)))
    if modal.blades_may_differ:
        rows = strain_directions(RelativeReceptance(modal, phase, (0, 1), excitation.force), contact, highest)
    phases = phase + 2.0 * np.pi * np.arange(n_blades) / n_blades
    return [_Wave(modal.at_phase(float(own)), float(own), springs, rows, highest, output) for own in phases]


def _damped(squared: Array, damping: ComplexArray, force: ComplexArray, omega: Array) -> ComplexArray:
    """Coordinates (A, F) of the undamped modes at frequencies (F,), with the damping between the modes.

    That part is small: it is brought in step by step, and where these do not converge the whole system is solved.
    """
    own = squared[:, None] - omega**2 + 1j * omega * damping.diagonal().real[:, None]
    between = damping - np.diag(damping.diagonal().real)
    found = force[:, None] / own
    for _ in range(ITERATIONS):
        new = (force[:, None] - 1j * omega * (between @ found)) / own
        change = np.abs(new - found).max()
        found = new
        if not change > CONVERGED * np.abs(found).max():
            return np.asarray(found, dtype=complex)
    at = omega[:, None, None]
    whole = np.diag(squared) + 1j * at * damping - at**2 * np.eye(squared.size)
    solved = np.linalg.solve(whole, np.broadcast_to(force, (omega.size, force.size))[..., None])
    return np.asarray(solved[..., 0].T, dtype=complex)


def _followed(deviation: Array, strain: ComplexArray, residual: ComplexArray) -> ComplexArray:
    """Y = (1 + E R)^-1 E W, (N, p, A), of E (N, p), W (N, p, A) and R of the waves (N, p, p)."""
    own = deviation[:, :, None]
    found = own * strain
    for _ in range(ITERATIONS):
        followed = np.fft.ifft(residual @ np.fft.fft(found, axis=0, norm="ortho"), axis=0, norm="ortho")
        new = own * (strain - followed)
        change = np.abs(new - found).max(initial=0.0)
        found = new
        if not change > CONVERGED * np.abs(found).max(initial=0.0):
            return found
    count, size = deviation.shape
    turn = wave_turns(count, np.arange(count))
    whole = np.einsum("jl,lpq,kl->jpkq", turn, residual, turn.conj()).reshape(count * size, -1)
    system = np.eye(count * size) + deviation.reshape(-1, 1) * whole
    solved = np.linalg.solve(system, (own * strain).reshape(count * size, -1))
    return np.asarray(solved.reshape(strain.shape), dtype=complex)


def _bandwidth_hz(waves: list[_Wave]) -> float:
    """Smallest half-power bandwidth of the modes up to the frequencies of interest, Hz; 0 without damping."""
    damping = np.concatenate([wave.decay[wave.modes.angular_frequency <= wave.highest] for wave in waves])
    smallest = float(damping[damping > 0.0].min(initial=np.inf))
    return (smallest if np.isfinite(smallest) else 0.0) / (2.0 * np.pi)


def _diagonal(blocks: list[ComplexArray]) -> ComplexArray:
    from scipy.linalg import block_diag

    found: ComplexArray = block_diag(*blocks).astype(complex)
    return found


@dataclass(frozen=True)
class _Wave:
    """The tuned sector in one wave, with springs (3 n_c,), rows of strains (t, n) and the output asked for."""

    modes: ModalModel
    phase: float
    springs: Array
    rows: Array
    highest: float
    name: str

    @cached_property
    def strain(self) -> ComplexArray:
        """P: strains of the blade and of the springs for unit modal coordinates, (t + 3 n_c, m)."""
        relative = relative_contact_motion(self.modes.right, self.modes.left, self.phase)
        springs = np.sqrt(self.springs)[:, None] * relative
        return np.concatenate([self.rows @ self.modes.shapes, springs])

    @property
    def output(self) -> ComplexArray:
        """The output of the modes, (m,)."""
        return np.asarray(self.modes.outputs[self.name], dtype=complex)

    @cached_property
    def stiffness(self) -> ComplexArray:
        """Stiffness in the modes with the springs, (m, m)."""
        return supported_stiffness(self.modes, self.phase, self.springs)

    @property
    def damping(self) -> ComplexArray:
        """Damping, what the flow adds to it, and Coriolis forces, (m, m)."""
        own, coriolis = np.diag(self.modes.total_damping).astype(complex), self.modes.coriolis
        return own if coriolis is None else own + coriolis

    @property
    def flow(self) -> ComplexArray:
        """Stiffness that the flow adds, (m, m)."""
        modes = self.modes
        return np.diag(np.zeros(modes.damping.shape, complex) if modes.flow is None else modes.flow[0])

    @property
    def decay(self) -> Array:
        """Damping coefficients of the modes with what the flow adds, one by one, of either sign: sizes (m,)."""
        modes, flow = self.modes, self.flow.diagonal().imag
        frequency = np.where(modes.angular_frequency > 0.0, modes.angular_frequency, np.inf)
        return np.asarray(np.abs(modes.total_damping.real + flow / frequency))

    def followed_mass(self, motions: ComplexArray) -> ComplexArray:
        """Mass that the other modes add to motions (m, k), whose Coriolis forces they follow, (k, k)."""
        squared, shapes, count = self._solved
        if self.modes.coriolis is None:
            return np.zeros((motions.shape[1],) * 2, complex)
        others = shapes[:, count:].conj().T @ (self.modes.coriolis @ motions)
        return np.asarray(others.conj().T @ (others / squared[count:, None]))

    @cached_property
    def _solved(self) -> tuple[Array, ComplexArray, int]:
        """Squared natural frequencies with the springs, the modes, and the number of low ones."""
        squared, shapes = np.linalg.eigh(self.stiffness)
        return squared, shapes, int(np.count_nonzero(squared <= (HIGHEST * self.highest) ** 2))

    def motions(self, response: bool) -> ComplexArray:
        """V (m, k): the low modes, with the response of the others to the excitation if asked for."""
        squared, shapes, count = self._solved
        found = np.asarray(shapes[:, :count], dtype=complex)
        if not response or count == len(shapes):
            return found
        others, force = shapes[:, count:], shapes[:, count:].conj().T @ self.modes.force
        for share in (0.1, 0.5):  # below the range of the modes: quasi-static parts of the response
            motion = others @ (force / (squared[count:] - (share * self.highest) ** 2))
            rest = motion - found @ (found.conj().T @ motion)
            if np.linalg.norm(rest) > INDEPENDENT * np.linalg.norm(motion):
                found = np.concatenate([found, (rest / np.linalg.norm(rest))[:, None]], axis=1)
        return found

    def residual(self, rows: ComplexArray, motions: ComplexArray) -> ComplexArray:
        """Flexibility (q, p) of what is not in the motions (m, k), for rows (q, m), under forces on the strains."""
        squared, shapes, count = self._solved
        others = shapes[:, count:]
        near = (NEAR * self.highest) ** 2
        found: ComplexArray = ((rows @ others) / (squared[count:] - near)) @ (self.strain @ others).conj().T
        extra = motions[:, count:]
        if extra.shape[1]:
            dynamic = extra.conj().T @ self.stiffness @ extra - near * np.eye(extra.shape[1])
            inner = np.linalg.solve(dynamic, (self.strain @ extra).conj().T)
            found = found - (rows @ extra) @ inner
        return found
