"""Modes of the reduced system in one wave and in several at once, with their damping."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.cyclic_symmetry import inter_blade_phase, relative_contact_motion
from rom.cyclic.influence_coefficients import InfluenceCoefficients, flow_in_wave
from rom.cyclic.pole_modes import PoleModes
from rom.cyclic.reduced_model import Array, ComplexArray
from rom.errors import ReducedModelError

SAME_WAVE = 12  # decimals of a phase
SOFT = 1e-3  # natural frequency of softly held bodies over the first one: its square is the error


class ModalCoefficients:
    """Stiffness and damping of modes with what the flow adds in a wave, complex then."""

    angular_frequency: Array
    damping: Array
    flow: ComplexArray | None

    @property
    def total_stiffness(self) -> NDArray[Any]:
        """Squares of the natural frequencies and what the flow adds, (rad/s)^2."""
        squared = self.angular_frequency**2
        return squared if self.flow is None else squared + self.flow[0]

    @property
    def total_damping(self) -> NDArray[Any]:
        """Damping coefficients and what the flow adds, 1/s."""
        return self.damping if self.flow is None else self.damping + self.flow[1]


@dataclass(frozen=True)
class WaveModes(ModalCoefficients):
    """Natural frequencies, damping and relative contact motion of m modes in each of J waves."""

    angular_frequency: Array  # (J, m) natural frequencies, rad/s
    damping: Array  # (J, m) modal damping coefficients 2 zeta_m w_m, 1/s
    relative: ComplexArray  # (J, 3 n_c, m) relative contact motion of the modes, right - exp(i phase) left
    # (2, J, m) what the flow adds to the squares of the natural frequencies and to the damping coefficients
    flow: ComplexArray | None = None
    # with Coriolis forces, the modes are the poles s of each wave, each by itself: w = abs(s), damping -2 Re s
    turning: PoleModes | None = None
    pole_adjoint: ComplexArray | None = None  # (J, m, 3 n_c) with them, what the modes take of contact forces

    @property
    def inertia(self) -> float:
        """Coefficient a of s^2 in k + c s + a s^2 of all modes: 0 of poles each by itself."""
        return 1.0 if self.turning is None else 0.0

    @property
    def total_damping(self) -> NDArray[Any]:
        """Coefficient c of s: damping and what the flow adds, 1/s; -conj(s_k) of a pole s_k by itself."""
        return super().total_damping if self.turning is None else -self.turning.poles.conj()

    @cached_property
    def adjoint(self) -> ComplexArray:
        """Modal forces of unit contact forces, (J, m, 3 n_c); without Coriolis forces relative^H."""
        found = self.relative.conj().transpose(0, 2, 1) if self.pole_adjoint is None else self.pole_adjoint
        return np.ascontiguousarray(found)

    def poles_apart(self, turning: PoleModes, still: NDArray[np.bool_]) -> "WaveModes":
        """The poles of these waves with Coriolis forces, each by itself.

        `still` (J,): where they are the modes themselves, on which the flow acts apart.
        """
        relative, adjoint = self.relative @ turning.shapes, turning.dual @ self.adjoint
        flow = None
        if self.flow is not None:
            own = self.flow * still[:, None]
            flow = np.concatenate([own, np.zeros_like(own)], axis=2)
        return WaveModes(np.abs(turning.poles), -2.0 * turning.poles.real, relative, flow, turning, adjoint)

    def pushed(self, forces: NDArray[Any]) -> NDArray[Any]:
        """What these take of modal forces, which without Coriolis forces are those of the modes.

        `forces` (J, m): forces of the modes.
        """
        return forces if self.turning is None else (self.turning.dual @ forces[..., None])[..., 0]

    def rows(self, shapes: NDArray[Any]) -> NDArray[Any]:
        """What these make of an output, which without Coriolis forces is that of the modes.

        `shapes` (m,): the output of the modes.
        """
        if self.turning is None:
            return shapes
        return (np.broadcast_to(shapes, self.turning.shapes.shape[:2])[:, None] @ self.turning.shapes)[:, 0]

    def works(self, coordinates: ComplexArray, harmonics: Array, omega: float | Array) -> tuple[Array, Array]:
        """Work of the flow and work that damping dissipates per cycle, J.

        `coordinates` (..., J, m): modal coordinates in the harmonic of each wave; `harmonics` (J,): the harmonics h;
        `omega` (...): excitation frequency, rad/s. Returns `flow, damping` (...): pi sum_h h abs(q)^2 times -(Im k +
        h w Re c) of the flow, h w c_m of the damping.
        """
        squared = coordinates.real**2 + coordinates.imag**2
        damping = np.pi * omega * ((self.damping * squared).sum(axis=-1) @ harmonics**2)
        if self.flow is None:
            return np.zeros_like(damping), damping
        springs, dashpots = ((part * squared).sum(axis=-1) for part in (self.flow[0].imag, self.flow[1].real))
        return -np.pi * (springs @ harmonics + omega * (dashpots @ harmonics**2)), damping


@dataclass(frozen=True)
class ModalDamping:
    """2 zeta_m w_m of modes: ratios zeta_m, or C = a M + b K."""

    # zeta, one number for all modes or one for each of the first modes; the last one holds for the modes above
    ratio: ArrayLike | None = None
    rayleigh: tuple[float, float] | None = None  # (a, b), 2 zeta_m w_m = a + b w_m^2

    def times(self, factor: float) -> "ModalDamping":
        """The damping times a factor."""
        if self.rayleigh is not None:
            return ModalDamping(rayleigh=(factor * self.rayleigh[0], factor * self.rayleigh[1]))
        return ModalDamping(factor * np.asarray(self.ratio, dtype=float))

    def coefficients(self, frequency: Array) -> Array:
        """2 zeta_m w_m, (m,), 1/s.

        Shapes: `frequency` (m,).
        """
        if (self.ratio is None) == (self.rayleigh is None):
            raise ReducedModelError("damping: give either a damping ratio or Rayleigh coefficients, not both or none")
        if self.rayleigh is not None:
            damping = self.rayleigh[0] + self.rayleigh[1] * frequency**2
        else:
            ratios = np.atleast_1d(np.asarray(self.ratio, dtype=float))
            if ratios.ndim != 1 or ratios.size == 0:
                raise ReducedModelError("damping_ratio: allowed: a number or a list of numbers, one a mode")
            elastic = np.flatnonzero(frequency)  # a ratio of a rigid motion means nothing
            if ratios.size > elastic.size:
                allowed = f"allowed: at most one for each of the {elastic.size} modes"
                raise ReducedModelError(f"damping_ratio: {ratios.size} values, {allowed}")
            zeta = np.full(frequency.size, ratios[-1])
            zeta[elastic[: ratios.size]] = ratios
            damping = 2.0 * zeta * frequency
        if not np.all(np.isfinite(damping)) or np.any(damping < 0.0):
            raise ReducedModelError("damping: negative or not finite in some mode, allowed: 0 or more in every mode")
        return damping


@dataclass(frozen=True)
class ModalModel(ModalCoefficients):
    """All modes of a reduced system, mass-normalised, and its vectors in modal coordinates.

    Those of a blade alone are real. Those of a sector with a disk belong to one wave (`SectorModes.at`) and are
    complex but for waves of 0 and N_b / 2 nodal diameters.

    Attributes
    ----------
    angular_frequency : (m,) array
        Natural frequencies w_m in rad/s, ascending.
    damping : (m,) array
        Modal damping coefficients 2 zeta_m w_m, 1/s.
    right, left : (3 n_c, m) array
        Contact motions of the modes; left None: contact against ground.
    force : (m,) array
        Modal force of 1 N of excitation, real or complex.
    static_force : (m,) array
        Modal static force at the rotational speed, N / sqrt(kg).
    outputs : mapping of str to (m,) array
        Outputs of the modes.
    shapes : (n, m) array
        Modes in the reduced coordinates.
    position : (n_c, 3) array
        Positions of the contact nodes, as in `ReducedModel`.
    area : (n_c,) array or None
        Areas of the contact nodes, as in `ReducedModel`.
    n_blades : int or None
        Number of blades of the ring.
    harmonic_forces : mapping of int to (m,) array
        Modal forces of 1 N of excitation in harmonics 2 and more that have a force of their own.
    floating : int
        Number of the first modes that are rigid motions of bodies that contacts alone hold: w = 0.
    influence : tuple of InfluenceCoefficients
        Those of the mode families that the flow around the blades acts on.
    flow : (2, m) complex array or None
        What the flow adds in this wave to w_m^2 and to the damping coefficients; None of all waves together.
    coriolis : (m, m) array or None
        Coriolis forces of modal velocities at the speed, skew-Hermitian, 1/s; None: left out.

    Examples
    --------
    The mode of 4 kg on 4 MN/m, normalised to 1 kg:

    >>> from rom import ReducedModel, modal_model
    >>> n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(4 * np.eye(1), 4e6 * np.eye(1), n, np.zeros((1, 3)), one, {"tip": one}, n_blades=40)
    >>> modal = modal_model(model, damping_ratio=0.01)
    >>> modal.angular_frequency.round(6).tolist(), abs(modal.outputs["tip"]).round(6).tolist()
    ([1000.0], [0.5])
    """

    angular_frequency: Array
    damping: Array
    right: NDArray[Any]
    left: NDArray[Any] | None
    force: NDArray[Any]
    static_force: NDArray[Any]
    outputs: Mapping[str, NDArray[Any]]
    shapes: NDArray[Any]
    position: Array
    area: Array | None
    n_blades: int | None
    harmonic_forces: Mapping[int, NDArray[Any]] = field(default_factory=dict)
    floating: int = 0
    influence: tuple[InfluenceCoefficients, ...] = ()
    flow: ComplexArray | None = None
    coriolis: NDArray[Any] | None = None
    _known: dict[float, "ModalModel"] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def n_contacts(self) -> int:
        """Number of contact nodes on a face."""
        return self.right.shape[0] // 3

    @property
    def is_felt(self) -> NDArray[np.bool_]:
        """Modes that are elastic or that contacts hold, (m,): all but rigid motions of a disk."""
        return (self.angular_frequency > 0.0) | (np.arange(self.angular_frequency.size) < self.floating)

    def phase(self, engine_order: int) -> float:
        """Inter-blade phase angle psi, rad; see `inter_blade_phase`.

        Parameters
        ----------
        engine_order : int
            Engine order EO.
        """
        return inter_blade_phase(engine_order, self.n_blades)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(self.outputs)

    @property
    def waves_differ(self) -> bool:
        """Whether each wave has modes of its own: with a disk that joins sectors, in a flow, with Coriolis forces."""
        return bool(self.influence) or self.coriolis is not None

    @property
    def turns(self) -> bool:
        """Whether Coriolis forces act."""
        return self.coriolis is not None

    @property
    def blades_may_differ(self) -> bool:
        """Whether mistuning of the blades can be described: with a disk only where their own stiffness is known."""
        return True

    @property
    def joined(self) -> bool:
        """Whether the blades move each other without contacts: through a disk, or the flow."""
        return bool(self.influence)

    @property
    def neighbours_coupled(self) -> bool:
        """Whether neighbouring blades move each other: through contacts that are not against ground, or the flow."""
        return self.left is not None or self.joined

    def at(self, nodal_diameter: int) -> "ModalModel":
        """The modes in a wave of a number of nodal diameters: for a blade alone the same in all but for the flow.

        Parameters
        ----------
        nodal_diameter : int
            n, of any sign.
        """
        return self if not self.influence else self.at_phase(self.phase(nodal_diameter))

    def at_phase(self, phase: float) -> "ModalModel":
        """The modes in a wave of an inter-blade phase angle: for a blade alone the same in all but for the flow.

        Parameters
        ----------
        phase : float
            Phase from one blade to the next, rad.
        """
        if not self.influence:
            return self
        wave = round(phase % (2.0 * np.pi), SAME_WAVE)
        if wave not in self._known:
            self._known[wave] = replace(self, flow=flow_in_wave(self.influence, self.angular_frequency, phase))
        return self._known[wave]

    @cached_property
    def turning(self) -> PoleModes:
        """The poles in this wave with Coriolis forces; rigid motions are softly held."""
        assert self.coriolis is not None
        return PoleModes.of(self.held_stiffness, np.diag(self.total_damping) + self.coriolis)

    @property
    def held_stiffness(self) -> NDArray[Any]:
        """`total_stiffness` with soft springs on rigid motions, (m,), (rad/s)^2."""
        soft = np.where(self.angular_frequency > 0.0, 0.0, self._soft**2)
        held: NDArray[Any] = self.total_stiffness + soft
        return held

    @property
    def without_coriolis(self) -> "ModalModel":
        """The same without Coriolis forces."""
        return self if self.coriolis is None else replace(self, coriolis=None)

    @property
    def _soft(self) -> float:
        """Natural frequency of softly held bodies; of one alone below what any contact makes of it, rad/s."""
        elastic = self.angular_frequency[self.angular_frequency > 0.0]
        return SOFT * (float(elastic.min()) if elastic.size else 1.0)

    @property
    def softly_held(self) -> "ModalModel":
        """The same with bodies that contacts alone hold on springs so soft that no vibration notices them."""
        if not self.floating:
            return self
        frequency = self.angular_frequency.copy()
        frequency[: self.floating] = self._soft
        return replace(self, angular_frequency=frequency, floating=0)

    def with_damping_times(self, factor: float) -> "ModalModel":
        """The same modes with all damping coefficients times a factor.

        Parameters
        ----------
        factor : float
            The factor.
        """
        return replace(self, damping=self.damping * factor)

    def waves(self, phases: Array, rigid: bool | Sequence[bool] = False) -> WaveModes:
        """The modes in several waves.

        Parameters
        ----------
        phases : (J,) array
            Phases from one blade to the next, rad.
        rigid : bool or (J,) sequence of bool
            Not used: see `SectorModes.waves`.
        """
        relative = relative_contact_motion(self.right, self.left, phases)
        shape = len(phases), self.angular_frequency.size
        frequency, damping = (np.broadcast_to(row, shape) for row in (self.angular_frequency, self.damping))
        flow = None
        if self.influence:
            flow = np.stack([flow_in_wave(self.influence, self.angular_frequency, p) for p in phases], axis=1)
        return WaveModes(frequency, damping, relative, flow)

    def in_motion(self, waves: WaveModes, phases: Array, moves: Sequence[bool]) -> WaveModes:
        """What vibrates in several waves: their modes, or with Coriolis forces their poles.

        Parameters
        ----------
        waves : WaveModes
            The modes, (J, m).
        phases : (J,) array
            Phases from one blade to the next, rad.
        moves : (J,) sequence of bool
            Where it vibrates. Elsewhere the motion is static, and the modes stay what they are.
        """
        return (
            waves if self.coriolis is None else with_coriolis(waves, [self.at_phase(float(p)) for p in phases], moves)
        )

    def wave_outputs(self, name: str, phases: Array) -> NDArray[Any]:
        """An output of the modes in several waves: (m,), the same in all.

        Parameters
        ----------
        name : str
            Name of the output.
        phases : (J,) array
            Phases from one blade to the next, rad.
        """
        return self.outputs[name]

    def reduced_coordinates(self, coordinates: NDArray[Any], phases: Array) -> NDArray[Any]:
        """Coordinates of the reduced model, (J, n), from modal ones (J, m) in several waves.

        Parameters
        ----------
        coordinates : (J, m) array
            Modal coordinates.
        phases : (J,) array
            Phases from one blade to the next, rad.
        """
        return coordinates @ self.shapes.T


def with_coriolis(waves: WaveModes, own: Sequence[ModalModel], moves: Sequence[bool]) -> WaveModes:
    """The poles of several waves; where nothing moves, and of what fills a row up, the modes themselves."""
    count, size = waves.angular_frequency.shape
    poles = 1j * np.concatenate([waves.angular_frequency, -waves.angular_frequency], axis=1)
    shapes, dual = np.zeros((count, size, 2 * size), complex), np.zeros((count, 2 * size, size), complex)
    for row, (each, moving) in enumerate(zip(own, moves, strict=True)):
        if not moving:
            shapes[row, :, :size] = dual[row, :size] = np.eye(size)
            continue
        found = each.turning
        m = len(found.shapes)
        place = np.concatenate([np.arange(m), size + np.arange(m)])
        poles[row, place], shapes[row, :m, place], dual[row, place, :m] = found.poles, found.shapes.T, found.dual
    return waves.poles_apart(PoleModes(poles, shapes, dual), ~np.asarray(moves))
