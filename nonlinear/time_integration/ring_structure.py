"""The structure of a ring in time: blades that only their contacts join, or sectors that a disk joins.

Modal coordinates advance exactly over a step for a force that varies linearly over it (first-order hold).

Blades on a rigid disk have modal coordinates of their own, in a mistuned ring with frequencies of their own. With a
disk the modes belong to waves, and a force on one sector moves all. Waves of q sectors have the phases 2 pi l / q,
l = 0 .. q - 1. In the wave l, with the modes phi_l, sector j moves as q^(-1/2) exp(2 pi i j l / q) phi_l z_l. In a
real motion z_(q-l) is the complex conjugate of z_l.

The coordinates of the ring are the sums of the waves, mode number by mode number,

    x_j = q^(-1/2) sum_l exp(2 pi i j l / q) z_l,

real, (q, m). A travelling wave on fewer sectors, repeated, is the same wave on more. If the modes were the same in
all waves, x_j would be the modal coordinates of blade j. The kernels have the cosine and sine waves, the real
discrete Fourier transform of x_j: real coordinates of unit mass, each of which moves as a mode of a blade alone does.

Blades on a rigid disk in a flow are such sectors too: their modes are the same in all waves, but the springs and
dashpots of the flow between the blades make the stiffness and the damping of a wave complex. Cosine and sine then
turn into each other.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array
from nonlinear.time_integration.contact_step import (
    BladeSystem,
    DiskSystem,
    DiskWork,
    RingSystem,
    RingWork,
    TurningWaves,
    cosine_rows,
    node_law,
    padded,
    wave_matrices,
)
from nonlinear.time_integration.ring import RetainedModes, residual_flexibility
from nonlinear.time_integration.ring_period import march_sectors, march_steps
from rom.cyclic.modal_model import ModalModel, WaveModes


def propagation(stiffness: NDArray[Any], damping: NDArray[Any], step: float) -> tuple[NDArray[Any], NDArray[Any]]:
    """Coefficients of eta'' + c eta' + k eta = f over one step, f linear from f_0 to f_1; complex where k and c are.

    Shapes: `stiffness` (m,), `damping` (m,), returns `position, rate` (4, m).
    """
    from scipy.linalg import expm

    generator = np.zeros((stiffness.size, 4, 4), dtype=stiffness.dtype)  # of eta, eta', f, df/dt
    generator[:, 0, 1] = generator[:, 1, 2] = generator[:, 2, 3] = 1.0
    generator[:, 1, 0], generator[:, 1, 1] = -stiffness, -damping
    after = expm(generator * step)
    of_last = after[:, :2, 3] / step
    columns = np.stack([after[:, :2, 0], after[:, :2, 1], after[:, :2, 2] - of_last, of_last])
    return np.ascontiguousarray(columns[:, :, 0]), np.ascontiguousarray(columns[:, :, 1])


@dataclass(frozen=True)
class RingStructure(ABC):
    """The structure of q blades in time: coordinates (q, m), and what the kernels hold of them. Nobody asks which."""

    modes: RetainedModes  # the ring, and its modes that are integrated
    n_blades: int  # number q of blades

    @property
    @abstractmethod
    def angular_frequency(self) -> Array:
        """Natural frequencies, (m,) or, wave by wave, (J, m), rad/s."""

    @property
    @abstractmethod
    def stiffness(self) -> NDArray[Any]:
        """Their squares, of the same shape, (rad/s)^2: complex with what the flow adds."""

    @property
    @abstractmethod
    def damping(self) -> NDArray[Any]:
        """Modal damping coefficients 2 zeta w, of the same shape, 1/s: complex with what the flow adds."""

    @abstractmethod
    def scaled(self, coordinates: Array, factor: NDArray[Any]) -> Array:
        """Coordinates (..., q, m) times a factor of each mode, of the shape of `angular_frequency`."""

    @abstractmethod
    def packed(self, values: Array) -> Array:
        """Modal forces (q, m) as the kernels hold them, and coordinates where these are those of modes."""

    @abstractmethod
    def unpacked(self, kept: Array) -> Array:
        """Coordinates (..., q, m) from those of the kernels; 0 where a mode is not retained."""

    def packed_state(self, coordinates: Array, rates: Array) -> tuple[Array, Array]:
        """The retained part of coordinates (q, m) and rates, as the kernels hold them."""
        return self.packed(coordinates), self.packed(rates)

    def unpacked_state(self, kept: Array, rates: Array) -> tuple[Array, Array]:
        """Coordinates (..., q, m) and rates from those of the kernels."""
        return self.unpacked(kept), self.unpacked(rates)

    def following(self, force: Array) -> tuple[Array, Array]:
        """Coordinates and rates (q, m) of what is not integrated and follows modal forces (q, m) at once."""
        return self.scaled(force, self.flexibility), np.zeros_like(force)

    @abstractmethod
    def motion(self, coordinates: Array) -> Array:
        """Relative displacement (..., q, r) of the pairs of faces, m."""

    @abstractmethod
    def modal_force(self, force: Array) -> Array:
        """Modal forces (q, m) of contact forces (q, r) on the right nodes, and of static ones: see `push`."""

    @abstractmethod
    def kernel(self, omega: float, steps: int) -> "Kernel":
        """The kernel that marches the ring at `omega` (rad/s) with `steps` a period."""

    @cached_property
    def retained(self) -> NDArray[np.bool_]:
        """Modes that are integrated, (m,) or, wave by wave, (J, m)."""
        return self.modes.are_retained(self.angular_frequency)

    @cached_property
    def push(self) -> Array:
        """Static modal force on bodies that contacts alone hold, (m,): 0 on all other modes."""
        found, given = np.zeros(self.angular_frequency.shape[-1]), self.modes.ring.static_push
        found[: given.size] = given
        return found

    @cached_property
    def flexibility(self) -> NDArray[Any]:
        """Residual flexibility of the modes that are not integrated, of the shape of `angular_frequency`."""
        return residual_flexibility(self.stiffness, self.retained)

    @property
    def feeding(self) -> float:
        """Growth rate that the flow can give to a motion at most, 1/s; 0 without a flow."""
        return 0.0

    def system(self, omega: float, propagated: tuple[Array, Array], near: Sequence[Array]) -> RingSystem:
        """What a step needs of any structure.

        Shapes: `propagated` coefficients of `propagation`, (s, 4, m) each; `near` (s, r, r) each, `own`, `previous`
        and `following`.
        """
        ring = self.modes.ring
        coordinates, angles = ring.free_response(omega), ring.phase * np.arange(self.n_blades)
        position, rate = map(np.ascontiguousarray, propagated)
        own, previous, following = (padded(each, 2) for each in near)
        return RingSystem(
            each=int(ring.blades_apart is not None),
            position=position,
            rate=rate,
            own=own,
            previous=previous,
            following=following,
            free_motion=padded(cosine_rows(ring.relative(coordinates)).transpose(1, 0, 2), 1),
            free_output=np.ascontiguousarray(cosine_rows(ring.outputs(coordinates).T).T),
            waves=np.stack([np.cos(angles), np.sin(angles)], axis=1),
            contact=node_law(ring.contact, ring.modal.n_contacts),
        )


@dataclass(frozen=True)
class ClampedBlades(RingStructure):
    """Coordinates (q, m) of q blades: the modal coordinates of each."""

    @cached_property
    def modal(self) -> ModalModel:
        """Modes of a blade."""
        return self.modes.ring.modal.at(0)

    @cached_property
    def angular_frequency(self) -> Array:
        """Natural frequencies, (m,) or, of blades that differ, (q, m), rad/s."""
        tuned = self.modal.angular_frequency
        return tuned if self.modes.ring.blades_apart is None else np.outer(self.modes.ring.frequency_ratio, tuned)

    @cached_property
    def retained(self) -> NDArray[np.bool_]:
        """Modes that are integrated, (m,): the same of all blades."""
        return self.modes.are_retained(self.modal.angular_frequency)

    @property
    def stiffness(self) -> Array:
        """Their squares, (rad/s)^2."""
        return self.angular_frequency**2

    @property
    def damping(self) -> Array:
        """Modal damping coefficients 2 zeta w, (m,), 1/s."""
        return self.modal.damping

    def scaled(self, coordinates: Array, factor: NDArray[Any]) -> Array:
        """Coordinates (..., q, m) times a factor (m,) of each mode."""
        return coordinates * factor

    def packed(self, values: Array) -> Array:
        """The retained ones of coordinates or forces (q, m), as the kernels hold them."""
        return padded(values[:, self.retained], 1)

    def unpacked(self, kept: Array) -> Array:
        """Coordinates (..., q, m) from those of the kernels; 0 where a mode is not retained."""
        coordinates = np.zeros((*kept.shape[:-1], self.retained.size))
        coordinates[..., self.retained] = kept[..., : np.count_nonzero(self.retained)]
        return coordinates

    def motion(self, coordinates: Array) -> Array:
        """Relative displacement (..., q, r) of the pairs of faces, m."""
        motion = coordinates @ self.modal.right.T
        if self.modal.left is not None:
            motion = motion - np.roll(coordinates, -1, axis=-2) @ self.modal.left.T
        return motion

    def modal_force(self, force: Array) -> Array:
        """Modal forces (q, m) of contact forces (q, r) on the right nodes."""
        found: Array = force @ self.modal.right
        if self.modal.left is not None:
            found = found - np.roll(force, 1, axis=0) @ self.modal.left
        return found + self.push

    @property
    def faces(self) -> tuple[Array, Array]:
        """Motion of the right and the left face, (r, m); one blade is its own neighbour: right is the whole."""
        right = self.modal.right
        left = np.zeros_like(right) if self.modal.left is None else self.modal.left
        return (right - left, np.zeros_like(left)) if self.n_blades == 1 else (right, left)

    def kernel(self, omega: float, steps: int) -> "BladeKernel":
        """The kernel that marches the ring at `omega` (rad/s) with `steps` a period."""
        ring, modal, kept, (right, left) = self.modes.ring, self.modal, self.retained, self.faces
        stiffness, flexibility = np.atleast_2d(self.stiffness), np.atleast_2d(self.flexibility)
        damping = np.tile(modal.damping[kept], len(stiffness))
        advanced = propagation(stiffness[:, kept].ravel(), damping, 2.0 * np.pi / omega / steps)
        position, rate = (padded(each.reshape(4, len(stiffness), -1).transpose(1, 0, 2), 1) for each in advanced)
        at_end = flexibility.copy()
        at_end[:, kept] = position[:, 3, : np.count_nonzero(kept)]
        by_right, by_left = right * at_end[:, None], left * at_end[:, None]
        own = by_right @ right.T + np.roll(by_left @ left.T, -1, axis=0)  # the left face is that of the next blade
        previous = -np.roll(by_left @ right.T, -1, axis=0)  # [force, motion]
        following = -by_right @ left.T
        output = modal.outputs[ring.output]
        follows = (flexibility * output).T
        blades = BladeSystem(
            right=padded(right[:, kept], 2),
            left=padded(left[:, kept], 2),
            right_modes=padded(right[:, kept].T, 2),
            left_modes=padded(left[:, kept].T, 2),
            output_modes=padded(output[kept], 1),
            push=padded(self.push[kept], 1),
            output_forces=padded(np.stack([right @ follows, -left @ follows]).transpose(2, 0, 1), 1),
        )
        still = TurningWaves(np.zeros((2, 4, 0)), np.zeros((2, 0)), 0)
        return BladeKernel(self.system(omega, (position, rate), (own, previous, following)), blades, still)


@dataclass(frozen=True)
class BladeKernel:
    """Marches a ring of blades; `system`, `blades` and `turning` hold the arrays."""

    system: RingSystem
    blades: BladeSystem
    turning: TurningWaves

    def __call__(self, work: RingWork, first: int, last: int, scale: float, output: Array) -> float:
        """March steps of a period, see `march_steps`."""
        return float(march_steps(self.system, self.blades, self.turning, work, (first, last), scale, output))


class WavesOverStep(NamedTuple):
    """How J waves move over a step: k modes in each, or with Coriolis forces poles."""

    position: NDArray[Any]  # (4, J, k), see `propagation`
    rate: NDArray[Any]  # (4, J, k)
    motion: ComplexArray  # (J, r, k), relative contact motion
    force: ComplexArray  # (J, k, r), what contact forces give to each
    at_end: ComplexArray  # (J, r, r), flexibility of the contacts at the end of the step, m/N
    output: ComplexArray  # (J, 1, k)
    residual_output: ComplexArray  # (J, 1, r), of what follows contact forces at once, m/N
    push: Array  # (k,), static force on bodies that contacts alone hold
    half: int  # see `TurningWaves`


@dataclass(frozen=True)
class JoinedSectors(RingStructure):
    """Coordinates (q, m) of q sectors: the sums of the waves.

    Factors of modes have one row for each of the J = q // 2 + 1 waves l = 0 .. q // 2.
    """

    @cached_property
    def phases(self) -> Array:
        """Phases from one sector to the next, (J,), rad."""
        return 2.0 * np.pi * np.arange(self.n_blades // 2 + 1) / self.n_blades

    @cached_property
    def waves(self) -> WaveModes:
        """Modes of the waves."""
        return self.modes.ring.modal.waves(self.phases, rigid=True)

    @property
    def angular_frequency(self) -> Array:
        """Natural frequencies, (J, m), rad/s."""
        return self.waves.angular_frequency

    @cached_property
    def stiffness(self) -> NDArray[Any]:
        """Their squares and what the flow adds, (J, m), (rad/s)^2."""
        return self.waves.total_stiffness

    @cached_property
    def damping(self) -> NDArray[Any]:
        """Modal damping coefficients 2 zeta w and what the flow adds, (J, m), 1/s."""
        return self.waves.total_damping

    @property
    def feeding(self) -> float:
        """Growth rate that the flow can give to a motion at most, 1/s; 0 without a flow.

        Of the energy (abs(z')^2 + Re k abs(z)^2) / 2 it is twice as large; contacts take energy.
        """
        if self.waves.flow is None:
            return 0.0
        stiffness, moves = self.stiffness, self.retained & (self.angular_frequency > 0.0)
        dashpots = np.maximum(-self.damping.real, 0.0)
        springs = np.abs(stiffness.imag) / (2.0 * np.sqrt(np.abs(stiffness.real)))
        return float((dashpots[moves] + springs[moves]).max(initial=0.0))

    @cached_property
    def output(self) -> NDArray[Any]:
        """Output of the modes, (J, m)."""
        ring = self.modes.ring
        return np.broadcast_to(ring.modal.wave_outputs(ring.output, self.phases), self.angular_frequency.shape)

    def scaled(self, coordinates: Array, factor: NDArray[Any]) -> Array:
        """Coordinates (..., q, m) times a factor (J, m) of each mode."""
        return self._in_time(self._in_waves(coordinates) * factor)

    def packed(self, values: Array) -> Array:
        """The retained ones of coordinates or forces (q, m) as the kernels hold them: real waves, (1, q k)."""
        count = self._kept.shape[1]
        return ((self._turn @ values)[:, :count] * self._kept[self._wave]).reshape(1, -1)

    def unpacked(self, kept: Array) -> Array:
        """Coordinates (..., q, m) from those of the kernels; 0 where a mode is not retained."""
        moved = self._turn.T @ kept.reshape(*kept.shape[:-2], self.n_blades, -1)
        coordinates = np.zeros((*moved.shape[:-1], self.angular_frequency.shape[1]))
        coordinates[..., : self._kept.shape[1]] = moved
        return coordinates

    def motion(self, coordinates: Array) -> Array:
        """Relative displacement (..., q, r) of the pairs of faces, m."""
        return self._in_time((self.waves.relative @ self._in_waves(coordinates)[..., None])[..., 0])

    def modal_force(self, force: Array) -> Array:
        """Modal forces (q, m) of contact forces (q, r) on the right nodes."""
        adjoint = self.waves.relative.conj().transpose(0, 2, 1)
        return self._in_time((adjoint @ self._in_waves(force)[..., None])[..., 0]) + self.push

    def kernel(self, omega: float, steps: int) -> "SectorKernel":
        """The kernel that marches the ring at `omega` (rad/s) with `steps` a period."""
        moved = self.over_step(2.0 * np.pi / omega / steps)
        near, far = self._near_and_far(moved.at_end)
        rows = self.n_blades * moved.motion.shape[2]
        position, rate = (part[:, self._wave].reshape(4, rows) for part in (moved.position, moved.rate))
        disk = DiskSystem(
            turn=self._turn,
            turn_back=np.ascontiguousarray(self._turn.T),
            motion=wave_matrices(moved.motion),
            force=wave_matrices(moved.force),
            far=wave_matrices(far),
            output=wave_matrices(moved.output),
            residual_output=wave_matrices(moved.residual_output),
            push=np.sqrt(self.n_blades) * moved.push,
            is_far=self.n_blades > 3,
        )
        each = [part[None] for part in near]
        turning = [position.imag, rate.imag] if np.iscomplexobj(position) else [np.zeros((4, 0))] * 2
        system = self.system(omega, (position.real[None], rate.real[None]), each)
        imaginary = np.array(turning, order="C")  # as stacked their rows would be strided: another compilation
        return SectorKernel(system, disk, imaginary, moved.half)

    def over_step(self, step: float) -> "WavesOverStep":
        """How the waves move over a step, s."""
        count = self._kept.shape[1]
        stiffness, damping = (np.where(self._kept, each[:, :count], 0.0) for each in (self.stiffness, self.damping))
        parts = propagation(stiffness.ravel(), damping.ravel(), step)
        position, rate = (part.reshape(4, *stiffness.shape) for part in parts)
        residual = self.flexibility
        at_end = residual.copy()
        at_end[:, :count][self._kept] = position[3][self._kept]
        relative, adjoint = self.waves.relative, self.waves.relative.conj().transpose(0, 2, 1)
        kept = relative[:, :, :count] * self._kept[:, None]
        return WavesOverStep(
            position=position,
            rate=rate,
            motion=kept,
            force=kept.conj().transpose(0, 2, 1),
            at_end=(relative * at_end[:, None]) @ adjoint,
            output=(self.output[:, :count] * self._kept)[:, None],
            residual_output=(self.output * residual)[:, None] @ adjoint,
            push=self.push[:count],
            half=0,
        )

    def _near_and_far(self, flexibility: ComplexArray) -> tuple[list[Array], ComplexArray]:
        """Flexibility (J, r, r) of the waves as that of a pair of faces and what is left.

        The first part: its motion, and that of the pair after it and the pair before it, under a unit force, (r, r)
        each, [force, motion]. Of two pairs the one before is the one after.
        """
        q = self.n_blades
        blocks = np.fft.irfft(flexibility, n=q, axis=0)
        places = (0, 1, q - 1)[: min(q, 3)]
        near = [np.ascontiguousarray(blocks[place].T) for place in places]
        near += [np.zeros_like(near[0])] * (3 - len(near))
        turns = np.exp(-1j * np.multiply.outer(self.phases, places))
        return near, flexibility - np.einsum("lp,pab->lab", turns, blocks[list(places)])

    @cached_property
    def _wave(self) -> NDArray[np.int64]:
        """Waves l of the real waves, (q,): 0, then cosine and sine of 1, of 2, ..., and q / 2."""
        return (np.arange(self.n_blades) + 1) // 2

    @cached_property
    def _turn(self) -> Array:
        """Real discrete Fourier transform, orthogonal, (q, q): real waves from values of the sectors.

        With z = (a - i b) / 2^(1/2) the waves l and q - l together move as (2 / q)^(1/2) (a cos + b sin).
        """
        angle = np.multiply.outer(self.phases[self._wave], np.arange(self.n_blades))
        alone = (2 * self._wave % self.n_blades == 0)[:, None]
        is_cosine = alone | (np.arange(self.n_blades) % 2 == 1)[:, None]
        return np.where(is_cosine, np.cos(angle), np.sin(angle)) * np.sqrt(np.where(alone, 1.0, 2.0) / self.n_blades)

    @cached_property
    def _kept(self) -> NDArray[np.bool_]:
        """Modes of the waves that are integrated, among as many as the wave with the most has, (J, k)."""
        return self.retained[:, : int(self.retained.sum(axis=1).max())]

    def _in_waves(self, values: Array) -> ComplexArray:
        """z (..., J, m) of the waves from values (..., q, m) of the sectors."""
        return np.fft.rfft(values, axis=-2, norm="ortho")

    def _in_time(self, values: ComplexArray) -> Array:
        """Values (..., q, m) of the sectors from those of the waves."""
        return np.fft.irfft(values, n=self.n_blades, axis=-2, norm="ortho")


@dataclass(frozen=True)
class SectorKernel:
    """Marches a ring of sectors; `system`, `disk`, `imaginary` and `half` (see `TurningWaves`) are the arrays."""

    system: RingSystem
    disk: DiskSystem
    imaginary: Array
    half: int

    def __call__(self, work: RingWork, first: int, last: int, scale: float, output: Array) -> float:
        """March steps of a period, see `march_sectors`."""
        sectors, rows = work.force.shape
        scratch = DiskWork(
            coordinates=work.coordinates.reshape(sectors, -1),
            modal_force=work.modal_force.reshape(sectors, -1),
            motion=np.zeros((sectors, rows)),
            force=np.zeros((sectors, rows)),
            output=np.zeros((sectors, 1)),
            change=np.zeros((sectors, rows)),
        )
        turning = TurningWaves(self.imaginary, np.zeros((2, work.coordinates.size)), self.half)
        return float(march_sectors(self.system, self.disk, work, scratch, turning, (first, last), scale, output))


Kernel = BladeKernel | SectorKernel
