"""Frequency and damping of a nonlinear mode over its amplitude, and the resonances of any excitation from them.

Where no node slips, lifts off or touches, the motion of the smallest amplitude is a linear mode, exactly. Elsewhere
Newton's method starts from linear modes with parts of the contact springs; if that does not converge, with one
harmonic and then more; and last from the free mode, while the contacts become as stiff as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactParameters
from nonlinear.continuation.response_quantities import largest_amplitude
from nonlinear.continuation.step_control import IterationControl
from nonlinear.harmonic_balance.initial_solution import on_support, static_displacement
from nonlinear.nonlinear_modes.extended_motion import (
    ExtendedMotion,
    MotionState,
    end_of_linear_motion,
    first_state,
    linear_mode,
)
from nonlinear.nonlinear_modes.mode_curve import STEPS, ModeContinuation, ModePath, MotionPoint, follow_mode
from nonlinear.options import OptionsError, SolverOptions
from rom.cyclic.contact_springs import contact_springs
from rom.cyclic.receptance import RelativeReceptance
from rom.cyclic.sector_modes import RingModes
from rom.linear_algebra.threads import one_blas_thread

LINEAR_STEP = 0.4  # of ln a between points in the linear range
BEFORE_LIMIT, LARGER = 1.0 - 1e-9, 1.0 + 1e-6  # factors on the end of the linear range and on the largest amplitude
SHARES = (1.0, 0.5, 0.25, 0.0)  # of the contact springs in the linear modes that a first motion is sought from
FIRST_STIFFNESS, STIFFNESS_STEP, SMALLEST_STIFFNESS_STEP = 0.01, 2.0, 1.01  # of the contacts, in a homotopy to 1


@dataclass(frozen=True)
class FirstMotion:
    """The search for the first motion of a mode."""

    receptance: RelativeReceptance  # the structure, with harmonics 0 .. H
    contact: ContactParameters  # the contact
    static: Array  # (n_c, 3), static relative displacement, m
    options: SolverOptions  # contact integration and output
    number: int  # number of the mode, from 1
    amplitude: float  # amplitude of the output, m
    every_harmonic: bool = False  # whether damping is compensated in all harmonics, and not in harmonic 1 alone
    steps: IterationControl = STEPS  # arc lengths of the continuation

    def find(self) -> tuple[MotionPoint, ModeContinuation]:
        """The motion, and the continuation that goes on from it."""
        harmonics = len(self.receptance.harmonics) - 1
        springs = list(self._springs())
        found = self._from_springs(springs, harmonics)
        if found is None and harmonics > 1:
            found = self._with_more(self._from_springs(springs, 1), harmonics)
        if found is None:
            found = self._with_more(self._stiffened(), harmonics)
        if found is None:
            raise ArithmeticError(f"no motion of mode {self.number} with {self.amplitude:.3g} m was found")
        return found

    def linear_levels(self, start: MotionState, largest: float) -> tuple[float, ...]:
        """Levels ln a, ascending, from above that of `start` to where its motion ceases to be linear.

        Empty where the start is not linear. The last is that of the first slip, lift-off or touch, or of the largest
        amplitude of the output, m.
        """
        shape = self.at_rest()[2]
        limit = self.modal_limit(shape)
        if not self.amplitude < limit * self.output(shape):
            return ()
        highest = np.log(min(limit * BEFORE_LIMIT, LARGER * largest / max(self.output(shape), 1e-300)))
        count = int(np.ceil((highest - start.level) / LINEAR_STEP))
        return tuple(float(level) for level in np.linspace(start.level, highest, count + 1)[1:])

    def at_rest(self) -> tuple[float, float, ComplexArray]:
        """Frequency, rad/s, damping ratio and shape of the linear mode of small motions about the equilibrium."""
        return linear_mode(self.receptance, self.contact, self._pressed(), self.number)

    def linear_limit(self) -> float:
        """Amplitude of the output, m, at which the linear mode first slips, lifts off or touches; inf: nowhere."""
        shape = self.at_rest()[2]
        return self.modal_limit(shape) * self.output(shape)

    def linear_forces(self, shape: ComplexArray) -> ComplexArray:
        """Contact forces (n_c, 3) on the right nodes in small motions about the equilibrium."""
        contact, held = self.contact, self._pressed()
        kt = contact.tangential_stiffness * held * (contact.friction > 0.0)
        springs = contact_springs(len(held), contact.normal_stiffness * held, kt)
        return -springs * (self.receptance.modes.relative[1] @ shape).reshape(-1, 3)

    def _from_springs(self, springs: list[Array], harmonics: int) -> tuple[MotionPoint, ModeContinuation] | None:
        """From linear modes with some springs (n_c,) after others."""
        for holds in springs:
            state, continuation = self._guess(holds, harmonics)
            point = continuation.solve_at_level(state)
            if point is not None:
                return point, continuation
        return None

    def _stiffened(self) -> tuple[MotionPoint, ModeContinuation] | None:
        """With one harmonic, from the free mode, by a homotopy in the stiffness of the contacts."""
        state, continuation = self._guess(np.zeros(len(self.static)), 1)
        factor, step = FIRST_STIFFNESS, STIFFNESS_STEP
        while step > SMALLEST_STIFFNESS_STEP:
            now = self._continuation(softer(self.contact, min(factor, 1.0)), 1, continuation.motion.carrier)
            point = now.solve_at_level(state)
            if point is not None and factor >= 1.0:
                return point, now
            if point is None:
                factor, step = factor / step, float(np.sqrt(step))
            else:
                state = point.state
            factor *= step
        return None

    def _with_more(
        self, found: tuple[MotionPoint, ModeContinuation] | None, harmonics: int
    ) -> tuple[MotionPoint, ModeContinuation] | None:
        """The same motion with more harmonics, one after another."""
        while found is not None and len(found[1].motion.receptance.harmonics) - 1 < harmonics:
            point, before = found
            displacement = point.state.displacement
            more = np.concatenate([displacement, np.zeros((2, *displacement.shape[1:]))])
            now = self._continuation(self.contact, (len(more) - 1) // 2, before.motion.carrier)
            next_point = now.solve_at_level(replace(point.state, displacement=more))
            found = None if next_point is None else (next_point, now)
        return found

    def _guess(self, holds: Array, harmonics: int) -> tuple[MotionState, ModeContinuation]:
        """A linear mode at the amplitude, and the continuation for it."""
        receptance = replace(self.receptance, harmonics=tuple(range(harmonics + 1)))
        mode = linear_mode(receptance, self.contact, holds, self.number)
        level = np.log(self.amplitude / max(self.output(mode[2]), 1e-300))
        carrier, state = first_state(receptance, mode, self.static, level)
        return state, self._continuation(self.contact, harmonics, carrier)

    def _continuation(self, contact: ContactParameters, harmonics: int, carrier: int) -> ModeContinuation:
        receptance = replace(self.receptance, harmonics=tuple(range(harmonics + 1)))
        element = contact_element(contact, harmonics, self.options)
        motion = ExtendedMotion(receptance, element, carrier, self.every_harmonic)
        return ModeContinuation(motion, (2 * harmonics + 1, *self.static.shape), self.steps)

    def _springs(self) -> Iterator[Array]:
        """Shares (n_c,) of the springs that hold in the linear modes to start from."""
        pressed = self._pressed()
        if self.amplitude < self.linear_limit():
            yield pressed
            return
        yield from (share * (pressed if pressed.any() else np.ones_like(pressed)) for share in SHARES)

    def _pressed(self) -> Array:
        """1 for the nodes that are in contact at rest, 0 for the others, (n_c,)."""
        return (self.contact.normal_load(self.static[:, 2]) > 0.0).astype(np.float64)

    def modal_limit(self, shape: ComplexArray) -> float:
        """Modal amplitude at which the motion of a linear mode ceases to be linear."""
        motion = (self.receptance.modes.relative[1] @ shape).reshape(-1, 3)
        return end_of_linear_motion(self.contact, self.static, motion)

    def output(self, shape: ComplexArray) -> float:
        """Amplitude of the output in a mode of unit amplitude, m."""
        coordinates = np.zeros((len(self.receptance.harmonics), shape.size), dtype=complex)
        coordinates[1] = shape
        return float(abs(self.receptance.output(self.options.output, coordinates)[1]))


def softer(contact: ContactParameters, factor: float) -> ContactParameters:
    """Contacts with a part of their stiffness, and as much smaller a preload."""
    return replace(
        contact,
        normal_stiffness=factor * contact.normal_stiffness,
        tangential_stiffness=factor * contact.tangential_stiffness,
        preload=factor * contact.preload,
    )


ModeDamping = Literal["first_harmonic", "all_harmonics"]


@dataclass(frozen=True)
class ModeResonance:
    """A resonance of one nonlinear mode under an excitation.

    Attributes
    ----------
    frequency_hz : float
        Frequency, Hz.
    amplitude_m : float
        Largest displacement of the output over a period, static part included, m.
    damping_ratio : float
        Damping ratio of the mode there.
    stable : bool
        Whether the resonant force grows with the amplitude; where it falls the resonance is unstable.
    force_exponent : float
        d ln F / d ln A of the resonant force F over the amplitude A of the output's vibration, 1 in a linear mode:
        where it is small, a small error of the force is a large one of the amplitude.
    coordinates : (H+1, m) complex array
        Modal coordinates of the m modes of the structure.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import nonlinear_mode
    >>> mode = nonlinear_mode(modal, contact, 3, (0.1, 3.0), options)
    >>> resonance = mode.resonances(1.0)[0]
    >>> print(f"{resonance.amplitude_m:.2f} m, the peak of the curve {curve.peak.amplitude_m:.2f} m")
    1.38 m, the peak of the curve 1.38 m
    """

    frequency_hz: float
    amplitude_m: float
    damping_ratio: float
    stable: bool
    force_exponent: float
    coordinates: ComplexArray = field(repr=False, compare=False)


@dataclass(frozen=True)
class NonlinearMode:
    """A nonlinear mode at P amplitudes.

    Attributes
    ----------
    amplitude_m : (P,) array
        Largest displacement of the output over a period, static part included, m.
    frequency_hz : (P,) array
        Frequency, Hz.
    damping_ratio : (P,) array
        Damping ratio: of the structure and of the contacts; see `damping` of `nonlinear_mode`.
    modal_amplitude : (P,) array
        Norm a of the mass-normalised modal coordinates of harmonic 1, m sqrt(kg).
    force : (P,) array
        Amplitude of the excitation that has its resonance there, N.
    coordinates : (P, H+1, m) complex array
        Modal coordinates of the m modes of the structure.
    piece : (P,) int
        Number of the piece, from 0: between two pieces an internal resonance was passed over.
    sticking, slipping, separating : (P,) int
        Number of contact nodes that stick all the time, that slip at some time without opening, that open at some
        time.
    complete : bool
        Whether the largest amplitude was reached.
    message : str
        Why the curve ends where it does.
    motions : ModeMotions
        What the points were solved with: motions between them are found with it.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from nonlinear import nonlinear_mode
    >>> mode = nonlinear_mode(modal, contact, 3, (0.1, 3.0), options)
    >>> print(mode.message, bool(np.all(np.diff(mode.force) > 0.0)))
    the largest amplitude was reached True
    """

    amplitude_m: Array
    frequency_hz: Array
    damping_ratio: Array
    modal_amplitude: Array
    force: Array
    coordinates: ComplexArray
    piece: NDArray[np.int64]
    sticking: NDArray[np.int64]
    slipping: NDArray[np.int64]
    separating: NDArray[np.int64]
    complete: bool
    message: str
    motions: ModeMotions = field(repr=False, compare=False)

    @property
    def vibration_m(self) -> Array:
        """Largest displacement of the output over a period without its mean, (P,), m."""
        receptance, output = self.motions.receptance, self.motions.output
        return np.array([vibration_of(motion, receptance, output) for motion in self.coordinates])

    def resonances(self, force: float) -> tuple[ModeResonance, ...]:
        """Resonances under an excitation of some amplitude, the largest motion first.

        At resonance the excitation balances the damping, 2 zeta omega^2 a^2 = F abs(q^(1)^H phi^T f). More than one
        for a force: there are isolated branches. Each is solved for, not interpolated.

        Parameters
        ----------
        force : float
            Amplitude of the excitation, N; more than 0.

        Raises
        ------
        ValueError
            The force is not positive.
        """
        if not force > 0.0:
            raise ValueError(f"force: {force}, allowed: more than 0")
        excess = np.log(self.force / force)
        passed = (excess[1:] > 0.0) != (excess[:-1] > 0.0)
        places = np.flatnonzero(passed & (self.piece[1:] == self.piece[:-1]))
        found = [self.motions.resonance(place, force) for place in places.tolist()]
        return tuple(sorted(found, key=lambda each: -each.amplitude_m))


@dataclass(frozen=True)
class ModeMotions:
    """The states of a nonlinear mode, with the equations that they solve."""

    continuation: ModeContinuation  # solves the equations
    states: tuple[MotionState, ...]  # the P motions
    output: str  # the output whose amplitude is told

    @property
    def receptance(self) -> RelativeReceptance:
        """The structure."""
        return self.continuation.motion.receptance

    @one_blas_thread()
    def resonance(self, place: int, force: float) -> ModeResonance:
        """The motion between two successive ones whose resonant force is the one given."""

        def excess(state: MotionState, coordinates: ComplexArray) -> float:
            return float(np.log(resonant_force(state, coordinates, self.receptance) / force))

        def size(_: MotionState, coordinates: ComplexArray) -> float:
            return float(np.log(vibration_of(coordinates, self.receptance, self.output)))

        ends = self.states[place], self.states[place + 1]
        point = self.continuation.between(*ends, lambda at: excess(at.state, at.linearised.coordinates))
        if point is None:  # a kink between the two that Newton's method does not pass: the nearer of them
            known = [(state, self.continuation.motion.evaluate(state).coordinates) for state in ends]
            values = [excess(*each) for each in known]
            state, coordinates = known[int(np.argmin(np.abs(values)))]
            exponent = (values[1] - values[0]) / ((size(*known[1]) - size(*known[0])) or 1e-300)
        else:
            state, coordinates = point.state, point.linearised.coordinates
            exponent = self.continuation.rate(point, excess) / (self.continuation.rate(point, size) or 1e-300)
        return ModeResonance(
            frequency_hz=state.omega / (2.0 * np.pi),
            amplitude_m=float(largest_amplitude(self.receptance.output(self.output, coordinates)).value),
            damping_ratio=state.damping,
            stable=exponent > 0.0,
            force_exponent=exponent,
            coordinates=coordinates,
        )


def resonant_force(state: MotionState, coordinates: ComplexArray, receptance: RelativeReceptance) -> float:
    """Amplitude of the excitation that balances the damping of a motion, N.

    Shapes: `coordinates` (H+1, m).
    """
    work = max(abs(np.vdot(coordinates[1], receptance.unit_force(1))), 1e-300)
    lost = 2.0 * state.damping * state.omega**2 * np.exp(2.0 * state.level)
    return float(max(lost, 1e-300) / work)


@one_blas_thread()
def nonlinear_mode(
    modal: RingModes,
    contact: ContactParameters,
    nodal_diameter: int,
    amplitudes_m: tuple[float, float],
    options: SolverOptions,
    *,
    number: int = 1,
    damping: ModeDamping = "first_harmonic",
) -> NonlinearMode:
    """A nonlinear mode of a travelling wave, from one amplitude of the output to another.

    Parameters
    ----------
    modal : rom.ModalModel or rom.SectorModes
        Modes of the blade with free contacts, with their damping.
    contact : ContactParameters
        Parameters of the contact nodes.
    nodal_diameter : int
        Number of waves around the ring, as an engine order: its inter-blade phase angle is that of the mode.
    amplitudes_m : (float, float)
        Smallest and largest amplitude of the output's vibration, m.
    options : SolverOptions
        Harmonics (a number), contact integration and the output.
    number : int
        Number of the mode, from 1, in the order of frequency at the smallest amplitude.
    damping : str
        Harmonics in which a negative damping makes up for what is dissipated: "first_harmonic", whose resonances are
        nearest to traced peaks, or "all_harmonics", the definition of Krack (2015). Equal with one harmonic.

    Returns
    -------
    NonlinearMode
        The mode at increasing arc length; it ends early, and says so, where the motion cannot be followed.

    Raises
    ------
    ArithmeticError
        No static equilibrium, or no motion of the smallest amplitude was found.
    OptionsError
        The number of harmonics is "auto", the method is "static-first", the amplitudes do not ascend from a positive
        one, the structure has no mode of this number, or `damping` is none of the two.

    Examples
    --------
    With the names of the example of `forced_response`: stuck, the mass of 1 kg is on 1 + 3 N/m, at 2 / (2 pi) Hz.

    >>> from nonlinear import nonlinear_mode
    >>> mode = nonlinear_mode(modal, contact, 3, (0.1, 3.0), options)
    >>> print(mode.frequency_hz[[0, -1]].round(3), bool(mode.damping_ratio.max() > 0.1))
    [0.318 0.172] True
    """
    if damping not in get_args(ModeDamping):
        raise OptionsError(f"damping: {damping!r}, allowed: {' or '.join(map(repr, get_args(ModeDamping)))}")
    _check(amplitudes_m)
    first = first_motion(modal, contact, nodal_diameter, options, number)
    first = replace(first, amplitude=amplitudes_m[0], every_harmonic=damping == "all_harmonics")
    return followed_mode(first, amplitudes_m[1])


def followed_mode(first: FirstMotion, largest: float) -> NonlinearMode:
    """The mode from its first motion to the largest amplitude of the output, m."""
    receptance, options = first.receptance, first.options
    start, continuation = first.find()
    levels = first.linear_levels(start.state, largest)
    size = partial(vibration, receptance=receptance, output=options.output)
    path = follow_mode(continuation, start, size, largest, levels)
    return _assembled(path, continuation, options.output)


def first_motion(
    modal: RingModes, contact: ContactParameters, nodal_diameter: int, options: SolverOptions, number: int
) -> FirstMotion:
    """The search for the first motion of a mode about its equilibrium; the amplitude is not chosen yet."""
    if options.method != "coupled":
        raise OptionsError(f'method: {options.method!r}, allowed for a nonlinear mode: "coupled"')
    modes = modal.at(nodal_diameter).angular_frequency.size
    if not 1 <= number <= modes:
        raise OptionsError(f"number: {number}, allowed: 1 to {modes}, the modes of the model")
    harmonics = tuple(range(options.fixed_harmonics + 1))
    receptance = RelativeReceptance(modal, modal.phase(nodal_diameter), harmonics, 0.0)
    receptance = on_support(receptance, contact, options)
    return FirstMotion(receptance, contact, static_displacement(receptance, contact, options), options, number, 0.0)


def _check(amplitudes_m: tuple[float, float]) -> None:
    """Refuse amplitudes that do not ascend."""
    if not 0.0 < amplitudes_m[0] < amplitudes_m[1] < float("inf"):
        raise OptionsError(f"amplitudes: {list(amplitudes_m)}, allowed: 0 < smallest < largest (m)")


def vibration(point: MotionPoint, receptance: RelativeReceptance, output: str) -> float:
    """Largest displacement of an output over a period without its mean, m."""
    return vibration_of(point.linearised.coordinates, receptance, output)


def vibration_of(coordinates: ComplexArray, receptance: RelativeReceptance, output: str) -> float:
    """Largest displacement over a period without its mean, m, of modal coordinates (H+1, m)."""
    values = receptance.output(output, coordinates)
    values[0] = 0.0
    return largest_amplitude(values).value


def _assembled(path: ModePath, continuation: ModeContinuation, output: str) -> NonlinearMode:
    """The mode of its points."""
    points = [point for piece in path.pieces for point in piece]
    nodes, receptance = np.array([point.nodes for point in points]), continuation.motion.receptance
    return NonlinearMode(
        amplitude_m=np.array(
            [largest_amplitude(receptance.output(output, point.coordinates)).value for point in points]
        ),
        frequency_hz=np.array([point.state.omega for point in points]) / (2.0 * np.pi),
        damping_ratio=np.array([point.state.damping for point in points]),
        modal_amplitude=np.exp([point.state.level for point in points]),
        force=np.array([resonant_force(point.state, point.coordinates, receptance) for point in points]),
        coordinates=np.array([point.coordinates for point in points]),
        piece=np.repeat(np.arange(len(path.pieces)), [len(piece) for piece in path.pieces]),
        sticking=(nodes == STICK).sum(axis=1),
        slipping=(nodes == SLIP).sum(axis=1),
        separating=(nodes == LIFT_OFF).sum(axis=1),
        complete=path.complete,
        message=path.message,
        motions=ModeMotions(continuation, tuple(point.state for point in points), output),
    )
