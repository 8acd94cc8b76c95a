"""A ring of blades, alone or as one structure, its state, and the modes that are integrated in time.

The other modes are a residual flexibility; the fastest motion of the integrated ones sets the step.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactError, ContactParameters
from nonlinear.options import Excitation
from rom.cyclic.contact_springs import contact_springs
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.sector_modes import RingModes


class DifferentBlades(Protocol):
    """The structure of a mistuned ring of N blades, each in its own time: see `mistuned_ring`."""

    @property
    def frequency_ratio(self) -> Array:
        """Natural frequencies of the blades over the tuned ones, (N,)."""

    def with_harmonics(self, n_harmonics: int) -> Self:
        """The same with harmonics 0 to H."""

    def coordinates(self, omega: float, force: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Modal coordinates (n_h, N, m) under the excitation and contact forces (n_h, N, r), and their slopes."""

    def relative(self, coordinates: ComplexArray) -> ComplexArray:
        """Relative displacements (n_h, N, r) of modal coordinates."""

    def output(self, name: str, coordinates: ComplexArray) -> ComplexArray:
        """An output of all blades, (N, n_h)."""

    @property
    def floating_motions(self) -> ComplexArray:
        """Relative displacements by bodies that contacts alone hold, in all waves, (N, r, number of motions)."""


@dataclass(frozen=True)
class Ring:
    """Blades that touch their neighbours, under a travelling-wave excitation."""

    # modes with free contacts, with their damping: of a blade alone, or of a sector with a disk wave by wave
    modal: RingModes
    # parameters of the contact nodes of one pair of faces; of a mistuned ring those of all pairs, pair after pair
    contact: ContactParameters
    excitation: Excitation  # engine order and force
    output: str = "tip"  # name of the output of which the amplitude is wanted
    # the structure of a mistuned ring of clamped blades; None: all blades and pairs are alike
    blades_apart: DifferentBlades | None = None

    def __post_init__(self) -> None:
        """Check that the contact fits the model."""
        expected = self.modal.n_contacts * self.frequency_ratio.size
        if self.contact.n_contacts != expected:
            raise ContactError(
                f"contact: parameters of {self.contact.n_contacts} nodes, allowed: {expected}, as the model"
            )

    @property
    def frequency_ratio(self) -> Array:
        """Natural frequencies of the blades over the tuned ones, (N_b,); (1,) where all are alike."""
        return np.ones(1) if self.blades_apart is None else self.blades_apart.frequency_ratio

    @property
    def phase(self) -> float:
        """Inter-blade phase angle psi of the excitation, rad."""
        return self.modal.phase(self.excitation.engine_order)

    @property
    def wave_blades(self) -> int:
        """Smallest number of blades that carries the wave of the excitation: N_b / gcd(N_b, EO)."""
        return self.blades(0)

    def blades(self, nodal_diameter: int) -> int:
        """Smallest number q of blades that carries the wave and a perturbation, q psi = q kappa = 0 mod 2 pi.

        1 for a single structure, and where nothing joins the blades: contact against ground and no disk.
        """
        n_blades = self.modal.n_blades
        if self.blades_apart is not None:
            return self.frequency_ratio.size
        if n_blades is None or not self.modal.neighbours_coupled:
            return 1
        numbers = (self.excitation.engine_order, nodal_diameter)
        return math.lcm(*(n_blades // math.gcd(n_blades, number) for number in numbers))

    def shift(self, nodal_diameter: int) -> float:
        """Phase shift kappa = 2 pi k / N_b of a perturbation, rad; 0 for a single structure."""
        return 2.0 * math.pi * nodal_diameter / (self.modal.n_blades or 1)

    def sampled_phases(self) -> Array:
        """Phases 0, about pi / 2 and pi from one blade to the next that the ring can have, (3,), rad."""
        quarters = 2.0 * math.pi * np.array([0.0, 0.25, 0.5])
        if not self.modal.waves_differ:
            return quarters
        pitch = self.shift(1)
        return pitch * np.rint(quarters / pitch)

    def receptance(self, n_harmonics: int) -> RelativeReceptance:
        """Receptance of the wave of the excitation with harmonics 0 to H."""
        harmonics, excitation = tuple(range(n_harmonics + 1)), self.excitation
        return RelativeReceptance(self.modal, self.phase, harmonics, excitation.force, excitation.factors)

    @cached_property
    def excited(self) -> RelativeReceptance:
        """Receptance of the wave in harmonics 0 to the highest of the excitation."""
        return self.receptance(self.receptance(1).excited_harmonics[-1])

    def coordinates(self, omega: float, force: ComplexArray) -> ComplexArray:
        """Modal coordinates (n_h, s, m) under contact forces, each harmonic in the modes of its own wave.

        Harmonics are in the time of each blade; s is 1 where all are alike.

        `omega`: excitation frequency, rad/s; `force` (n_h, s, 3 n_c): contact forces on the right faces, N.
        """
        if self.blades_apart is not None:
            return self.blades_apart.with_harmonics(len(force) - 1).coordinates(omega, force)[0]
        with np.errstate(divide="ignore", invalid="ignore"):  # the mean of bodies that contacts alone hold
            return self.receptance(len(force) - 1).modal_response(omega, force[:, 0])[0][:, None]

    def free_response(self, omega: float) -> ComplexArray:
        """Modal coordinates without contact, (n_h, s, m), see `coordinates`."""
        shape = len(self.excited.harmonics), self.frequency_ratio.size, 3 * self.modal.n_contacts
        coordinates = self.coordinates(omega, np.zeros(shape, dtype=complex))
        coordinates[0, :, : self.excited.floating] = 0.0  # see `static_push`
        return coordinates

    @cached_property
    def static_push(self) -> Array:
        """Static modal force on bodies that contacts alone hold, (r,): without contact there is no equilibrium."""
        return self.excited.modal_force[0, : self.excited.floating].real

    def floating_positions(self, displacement: Array, coordinates: ComplexArray) -> Array:
        """Mean modal coordinates (s, r) of bodies that contacts alone hold.

        `displacement` (s, 3 n_c): mean relative displacement, m; `coordinates` (n_h, s, m): modal coordinates; of the
        bodies the mean ones are not used.
        """
        elastic, count = coordinates.copy(), self.excited.floating
        elastic[0, :, :count] = 0.0
        of_bodies = np.fft.fft(displacement - self.relative(elastic)[0].real, axis=0)[..., None]
        motions = self.excited.relative[:1, :, :count]
        if self.blades_apart is not None:
            motions = self.blades_apart.floating_motions
        found: Array = np.fft.ifft((np.linalg.pinv(motions) @ of_bodies)[..., 0], axis=0).real
        return found

    def relative(self, coordinates: ComplexArray) -> ComplexArray:
        """Relative displacements (n_h, s, 3 n_c) of modal coordinates.

        `coordinates` (n_h, s, m): modal coordinates.
        """
        n_harmonics = len(coordinates) - 1
        if self.blades_apart is not None:
            return self.blades_apart.with_harmonics(n_harmonics).relative(coordinates)
        return np.einsum("hrm,hsm->hsr", self.receptance(n_harmonics).modes.relative, coordinates)

    def outputs(self, coordinates: ComplexArray) -> ComplexArray:
        """Harmonics (s, n_h) of the output, m. `coordinates` (n_h, s, m): modal coordinates."""
        n_harmonics = len(coordinates) - 1
        if self.blades_apart is not None:
            return self.blades_apart.with_harmonics(n_harmonics).output(self.output, coordinates)
        return self.receptance(n_harmonics).output(self.output, coordinates[:, 0])[None]


def whole_ring(modal: ModalModel, excitation: Excitation, frequency_ratio: Array) -> ModalModel:
    """A ring of clamped blades as one structure, with the nodes of all pairs; output NAME of blade j: "NAME_j".

    Its time is that of blade 0. A ring of fewer blades than the whole one has to carry the wave.
    Shapes: `frequency_ratio` (q,).
    """
    count, phase = frequency_ratio.size, modal.phase(excitation.engine_order)
    frequency = np.outer(frequency_ratio, modal.angular_frequency).ravel()
    order, left = np.argsort(frequency, kind="stable"), modal.left
    motion = np.zeros((count, len(modal.right), count, modal.angular_frequency.size))
    for j in range(count):
        motion[j, :, j] += modal.right
        if left is not None:
            motion[j, :, (j + 1) % count] -= left

    def of_all(values: NDArray[np.number], factors: NDArray[np.number]) -> NDArray[np.number]:
        return np.outer(factors, values).ravel()[order]

    def forces(harmonic: int) -> NDArray[np.number]:
        turns = np.exp(1j * harmonic * phase * np.arange(count))
        return of_all(modal.harmonic_forces.get(harmonic, modal.force), turns)

    excited = {*dict(excitation.factors), *modal.harmonic_forces} - {1}
    return ModalModel(
        angular_frequency=frequency[order],
        damping=np.tile(modal.damping, count)[order],
        right=motion.reshape(count * len(modal.right), -1)[:, order],
        left=None,
        force=forces(1),
        static_force=np.tile(modal.static_force, count)[order],
        outputs={
            f"{name}_{j}": of_all(row, np.arange(count) == j)
            for name, row in modal.outputs.items()
            for j in range(count)
        },
        shapes=np.eye(frequency.size)[:, order],
        position=np.tile(modal.position, (count, 1)),
        area=None if modal.area is None else np.tile(modal.area, count),
        n_blades=None,
        harmonic_forces={h: forces(h) for h in sorted(excited)},
        floating=count * modal.floating,
        coriolis=None if modal.coriolis is None else np.kron(np.eye(count), modal.coriolis)[np.ix_(order, order)],
    )


@dataclass(frozen=True)
class RingState:
    """State of q blades at the beginning of a period, theta = omega t = 0 of blade 0."""

    # coordinates, rates (q, m): modal coordinates of all modes of each blade and their rates. With a disk, where the
    # modes belong to waves, the sum of the waves (see `JoinedSectors`)
    coordinates: Array
    rates: Array
    slider: Array  # (q, n_c, 2) positions of the sliders, m
    force: Array  # (q, n_c, 3) contact force on the right nodes, N

    @property
    def n_blades(self) -> int:
        """Number q of blades."""
        return len(self.coordinates)

    def repeated(self, n_blades: int) -> "RingState":
        """The same motion on a ring of `n_blades`, a multiple of q."""
        if n_blades % self.n_blades:
            raise ValueError(f"blades: {n_blades}, allowed: multiples of {self.n_blades}")
        return self.over(n_blades)

    def over(self, n_blades: int) -> "RingState":
        """The same blades in turn on a ring of any number of them."""
        return RingState(*(part[np.arange(n_blades) % self.n_blades] for part in self._parts))

    def towards(self, other: "RingState", shares: Sequence[float]) -> "RingState":
        """The state with each blade on its way to another motion."""
        pairs = zip(self._parts, other._parts, strict=True)
        share = [np.reshape(shares, (-1, *[1] * (part.ndim - 1))) for part in self._parts]
        return RingState(*(here + s * (there - here) for (here, there), s in zip(pairs, share, strict=True)))

    @property
    def _parts(self) -> tuple[Array, Array, Array, Array]:
        return self.coordinates, self.rates, self.slider, self.force


RETENTION = 20.0  # modes up to this multiple of the excitation frequency are integrated
LEAST_STEPS = 240  # a period: error of amplitudes up to 2e-4
LARGEST_ANGLE = 0.6  # of the fastest mode of the ring with stuck contacts over a step, rad
MOST_STEPS = 50_000


class StepError(ArithmeticError):
    """The contacts are so stiff for the retained modes that a period needs too many steps."""


def residual_flexibility(stiffness: NDArray[Any], retained: NDArray[np.bool_]) -> NDArray[Any]:
    """1 / k of the modes that are not integrated, 0 for the others, for k (...), (rad/s)^2.

    Shapes: `retained` (...) or of the last axes.
    """
    found = np.zeros_like(stiffness)
    np.divide(1.0, stiffness, out=found, where=~retained)
    return found


@dataclass(frozen=True)
class RetainedModes:
    """Modes that are integrated, w_m <= RETENTION omega; the others follow their forces at once, eta = f / w_m^2.

    Without the residual flexibility a stiff contact spring on the small mass of a node would set the step. With it
    the spring acts in series with the local flexibility of the blade.
    """

    ring: Ring
    highest: float  # natural frequency up to which modes are integrated, rad/s

    @classmethod
    def of(cls, ring: Ring, omega: float, retention: float = RETENTION) -> "RetainedModes":
        """Choose the modes."""
        frequency = ring.modal.at(ring.excitation.engine_order).angular_frequency
        return cls(ring, max([retention * omega, *frequency[frequency > 0.0][:1].tolist()]))

    def are_retained(self, angular_frequency: Array) -> NDArray[np.bool_]:
        """Whether modes of natural frequencies w (...), rad/s, are integrated."""
        chosen: NDArray[np.bool_] = angular_frequency <= self.highest
        return chosen

    def fastest(self) -> float:
        """Highest natural frequency of the retained modes with all contacts stuck, rad/s.

        The springs k act in series with the residual flexibility G: (I + k G)^-1 k. The flow is left out. Coriolis
        forces of norm 2 c raise no frequency w above c + (w^2 + c^2)^(1/2).
        """
        modal, contact = self.ring.modal, self.ring.contact
        stiffest = (
            each.reshape(-1, modal.n_contacts).max(axis=0)
            for each in (contact.normal_stiffness, contact.tangential_stiffness)
        )
        springs = contact_springs(modal.n_contacts, *stiffest)
        phases = self.ring.sampled_phases()
        waves = modal.waves(phases, rigid=True)
        highest = turning = 0.0
        for phase, frequency, motion in zip(phases, waves.angular_frequency, waves.relative, strict=True):
            chosen = self.are_retained(frequency)
            residual = (motion * residual_flexibility(frequency**2, chosen)) @ motion.conj().T
            size = len(residual)
            series = np.linalg.solve(np.eye(size) + springs.reshape(-1, 1) * residual, np.diag(springs.reshape(-1)))
            kept = motion[:, chosen]
            stiffness = np.diag(frequency[chosen] ** 2) + kept.conj().T @ series @ kept
            highest = max(highest, float(np.linalg.eigvalsh(stiffness)[-1]))
            own = modal.at_phase(float(phase)).coriolis
            if own is not None:
                also = chosen[: len(own)]
                turning = max(turning, 0.5 * float(np.linalg.norm(own[also][:, also], 2)))
        return (turning + math.sqrt(highest + turning**2)) * float(self.ring.frequency_ratio.max())

    def steps(self, omega: float, finer: float = 1.0) -> int:
        """Steps a period: enough for the fastest mode, and a multiple of the blades of the wave, or `finer` times."""
        least = max(LEAST_STEPS, math.ceil(2.0 * math.pi * self.fastest() / (omega * LARGEST_ANGLE)))
        if least > MOST_STEPS:
            raise StepError(
                f"time integration: {least} steps a period, allowed: {MOST_STEPS}; the contacts are stiff"
            )
        blades = self.ring.wave_blades
        return blades * max(round(finer * math.ceil(least / blades)), 1)
