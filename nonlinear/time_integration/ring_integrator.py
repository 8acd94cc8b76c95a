"""A ring of blades at one frequency: its states, disturbances of them, and what becomes of them in time.

A ring starts from the periodic motion with more harmonics than it was solved with: few harmonics make another motion,
and its distance from that of the ring would count as a disturbance.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.element_choice import contact_cycle, contact_element
from nonlinear.contact.fourier import ComplexArray, to_complex
from nonlinear.contact.parameters import Array
from nonlinear.harmonic_balance.initial_solution import on_support, solve_at
from nonlinear.harmonic_balance.residual import HarmonicBalance, has_odd_harmonics_only
from nonlinear.options import SolverOptions
from nonlinear.time_integration.contact_step import RingWork, padded
from nonlinear.time_integration.ring import RETENTION, RetainedModes, Ring, RingState
from nonlinear.time_integration.ring_structure import ClampedBlades, JoinedSectors, Kernel, RingStructure
from nonlinear.time_integration.turning_blades import TurningBlades
from nonlinear.time_integration.turning_sectors import TurningSectors

HARMONICS = 15
SAME_MOTION = 0.2  # largest relative change of the displacement by the harmonics added
MAX_ITERATIONS = 12  # a solution near one with few harmonics takes 2 to 5, one far away is not looked for


def with_more_harmonics(ring: Ring, omega: float, displacement: Array, harmonics: int = HARMONICS) -> Array:
    """The periodic solution with more harmonics near one with few.

    Shapes: `displacement` (2H+1, n_c, 3), returns (2H'+1, n_c, 3).
    """
    few = len(displacement)
    if few >= 2 * harmonics + 1 or ring.blades_apart is not None:  # many blades: the ring settles by itself
        return displacement
    options = SolverOptions((1.0, 2.0), harmonics=harmonics)
    element = contact_element(ring.contact, harmonics, options)
    receptance = on_support(ring.receptance(harmonics), ring.contact, options)
    balance = HarmonicBalance(receptance, element, odd=has_odd_harmonics_only(receptance, ring.contact))
    start = np.zeros((2 * harmonics + 1, *displacement.shape[1:]))
    start[:few] = displacement
    found = solve_at(balance, omega, balance.unknown(start), options, MAX_ITERATIONS)
    solution = balance.displacement(found.solution)
    same = np.linalg.norm(solution - start) <= SAME_MOTION * np.linalg.norm(start)
    return solution if found.converged and same else displacement


STATE = "coordinates", "rates", "slider", "force"  # parts of `RingWork` that a `RingState` is formed of
MOST_DENSE = 128  # contact displacements of a pair of faces, up to which its forces are solved at once
MOST_HALVED = 3  # times that the step is halved
# the excitation adds as much to a motion in each period as in the first; so many times more no step is to be trusted
STRAIGHT = 1e-15  # bend of three samples, of the largest, from which no parabola is drawn through them
RUNAWAY = 10.0
LARGEST_EXPONENT = 600.0  # of the growth that a flow can feed
NOT_FOUND = "the contact forces of a step were not found"
# displacement over that of gaps, slip limits and the excitation alone, above which a motion is beyond the contacts:
# relative displacement where each node moves more than its own, and the largest of any node or of the output
BEYOND, FAR_BEYOND = 100.0, 1e4
CYCLE_SAMPLES = 4096  # instants of the contact cycle from which the sliders start


def ring_structure(modes: RetainedModes, n_blades: int) -> RingStructure:
    """The structure of q blades: joined in waves or by their contacts alone, with Coriolis forces or without."""
    modal = modes.ring.modal
    if modes.ring.blades_apart is not None and modal.waves_differ:
        raise ValueError("time integration: blades that differ, allowed: on a rigid disk, without Coriolis forces")
    if modal.turns:
        return (TurningSectors if modal.joined else TurningBlades)(modes, n_blades)
    return (JoinedSectors if modal.joined else ClampedBlades)(modes, n_blades)


class ContactIterationError(ArithmeticError):
    """The contact forces of a step were not found."""


@dataclass(frozen=True)
class RingRecord:
    """P periods of a ring."""

    final: RingState  # state at the end
    output_m: Array  # (P, n, q) output of every blade at the ends of the n steps of each period, m
    # (P, q, 2 m) coordinates, and rates divided by omega, of the retained modes at the end of each period: the
    # contact-driven part, in the units of modal coordinates
    ends: Array
    moves: int  # changes of the forces of a node until those of each step were found

    @property
    def vibration_m(self) -> float:
        """Half the range of the output of a blade over all periods, the largest of all blades, m."""
        return 0.5 * float(np.ptp(self.output_m, axis=(0, 1)).max())

    @property
    def envelope_m(self) -> Array:
        """Largest abs(x) of every period and blade, (P, q), m: the largest sample, with a parabola through it.

        Through the first or the last three samples where it is the first or the last one: what does not repeat goes
        on elsewhere.
        """
        size = np.abs(self.output_m)
        at = size.argmax(axis=1)[:, None]
        middle = np.clip(at, 1, size.shape[1] - 2)
        low, high, next_one = (np.take_along_axis(size, middle + shift, axis=1)[:, 0] for shift in (-1, 0, 1))
        bend = 2.0 * high - low - next_one
        curvature = np.maximum(bend, STRAIGHT * np.maximum(high, 1e-300))
        inside = high + np.minimum((next_one - low) / 8.0 * ((next_one - low) / curvature), 0.125 * bend)
        aside = (at - middle)[:, 0]
        vertex = (next_one - low) / (2.0 * curvature)
        at_end = np.where(np.abs(vertex - aside) <= 0.5, high + (next_one - low) * vertex / 4.0, size.max(axis=1))
        return np.where(aside == 0, inside, at_end)


@dataclass(frozen=True)
class RingIntegrator:
    """Time integration of q blades at one frequency (see `RingSystem` and `march_steps`)."""

    ring: Ring
    omega: float  # excitation frequency, rad/s
    n_blades: int  # number q of blades
    steps: int  # steps a period
    modes: RetainedModes  # modes that are integrated
    halved: int = 0  # how often the step was halved, see `march`
    # coordinates of the blades, their contact motions and forces
    structure: RingStructure = field(init=False, repr=False, compare=False)
    _march: Kernel = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Form the arrays."""
        object.__setattr__(self, "structure", ring_structure(self.modes, self.n_blades))
        object.__setattr__(self, "_march", self.structure.kernel(self.omega, self.steps))

    @classmethod
    def of(
        cls, ring: Ring, omega: float, *, nodal_diameter: int = 0, retention: float = RETENTION, finer: float = 1.0
    ) -> "RingIntegrator":
        """The smallest ring that carries the wave and a perturbation, with its own number of modes and steps."""
        modes = RetainedModes.of(ring, omega, retention)
        return cls(ring, omega, ring.blades(nodal_diameter), modes.steps(omega, finer), modes)

    @property
    def period(self) -> float:
        """Period of the excitation, s."""
        return 2.0 * np.pi / self.omega

    def at_rest(self) -> RingState:
        """All blades and sliders where they are without any force; contacts loaded by their interference."""
        contact, nodes = self.ring.contact, self.ring.modal.n_contacts
        force = np.zeros((self.n_blades, nodes, 3))
        force[:, :, 2] = (contact.preload - contact.normal_load(np.zeros(contact.n_contacts))).reshape(-1, nodes)
        shape = self.n_blades, self.structure.angular_frequency.shape[-1]
        return RingState(np.zeros(shape), np.zeros(shape), np.zeros((*force.shape[:2], 2)), force)

    def on_wave(self, displacement: Array) -> RingState:
        """State of the travelling wave that solves the harmonic balance.

        `displacement` (2H+1, n_c, 3): real Fourier coefficients of the relative displacement, m.
        """
        contact, nodes = self.ring.contact, self.ring.modal.n_contacts
        coordinates, order = self._wave_coordinates(displacement)
        coordinates = self._padded(coordinates)
        angle = self.ring.phase * np.arange(self.n_blades)
        phases = np.exp(1j * np.outer(angle, order))  # blade j: e^(i h j psi)
        samples = self.ring.wave_blades * -(-CYCLE_SAMPLES // self.ring.wave_blades)
        cycle = contact_cycle(to_complex(displacement), contact, samples)
        instant = np.rint(angle / (2.0 * np.pi) * samples).astype(int) % samples
        pair = np.arange(self.n_blades) % (contact.n_contacts // nodes)
        stiffness = np.where(contact.tangential_stiffness > 0.0, contact.tangential_stiffness, np.inf)
        sliders = cycle.displacement - cycle.force / stiffness[:, None]
        traction = cycle.force.reshape(samples, -1, nodes, 3)[instant, pair]
        traction[:, :, 2] -= contact.preload.reshape(-1, nodes)
        return RingState(
            coordinates=np.einsum("qh,hqm->qm", phases, coordinates).real,
            rates=np.einsum("qh,hqm->qm", 1j * self.omega * order * phases, coordinates).real,
            slider=sliders.reshape(samples, -1, nodes, 3)[instant, pair, :, :2],
            force=-traction,
        )

    def wave_output(self, displacement: Array) -> Array:
        """Output (n, q) of the travelling wave at the ends of the steps, m.

        `displacement` (2H+1, n_c, 3): real Fourier coefficients of the relative displacement, m.
        """
        coordinates, order = self._wave_coordinates(displacement)
        harmonics = self.ring.outputs(coordinates)
        theta = 2.0 * np.pi * np.arange(1, self.steps + 1) / self.steps
        angle = theta[:, None] + self.ring.phase * np.arange(self.n_blades)
        return (np.exp(1j * angle[:, :, None] * order) * harmonics).sum(axis=-1).real

    def vibration(self, state: RingState) -> float:
        """Largest rate of the retained modal coordinates over omega: a scale for disturbances."""
        kept = self.structure.retained
        moved = self.structure.scaled(state.coordinates - state.coordinates.mean(axis=0), kept)
        rates = self.structure.scaled(state.rates, kept)
        return float(np.hypot(moved, rates / self.omega).max())

    def is_beyond_contacts(self, state: RingState, height_m: float) -> bool:
        """Whether a motion is so large that gaps, preloads and the excitation hardly matter to it any more.

        All nodes slip or open then, and what comes is the same for any size of the motion, but for a factor. Or the
        contacts do not feel it.

        `height_m`: largest displacement of the output, m.
        """
        contact, structure = self.ring.contact, self.structure
        shape = -1, self.ring.modal.n_contacts
        positions, speeds = structure.motion(state.coordinates), structure.motion(state.rates / self.omega)
        size = np.hypot(positions, speeds).reshape(self.n_blades, -1, 3).max(axis=2)
        kn, kt = (np.where(k > 0.0, k, np.inf) for k in (contact.normal_stiffness, contact.tangential_stiffness))
        load = np.abs(contact.initial_load)
        contact_scale = np.maximum(load / kn, contact.friction * load / kt).reshape(shape)
        free = np.abs(self.ring.relative(self.ring.free_response(self.omega))).sum(axis=0).max(initial=0.0)
        scale = max(float(contact_scale.max()), float(free))
        all_move = size.max() > BEYOND * scale and bool(np.all(size >= contact_scale))
        return all_move or max(float(size.max()), height_m) > FAR_BEYOND * scale

    def disturbed(self, state: RingState, nodal_diameter: int, size: float) -> RingState:
        """A state with a disturbance of its retained modes: a tenth of it different on every blade."""
        rng = np.random.default_rng(17)
        frequency = self.structure.angular_frequency
        moves = self.structure.retained & (frequency > 0.0)  # a free disk drifts
        weight = np.zeros(frequency.shape)
        weight[moves] = (frequency[moves].min() / frequency[moves]) ** 2
        modes = frequency.shape[-1]
        turn = np.exp(1j * self.ring.shift(nodal_diameter) * np.arange(self.n_blades))[:, None]
        parts = []
        for _ in range(2):
            same = rng.normal(size=modes) + 1j * rng.normal(size=modes)
            each = rng.normal(size=(self.n_blades, modes))
            parts.append(self.structure.scaled((turn * same).real + 0.1 * each, weight))
        largest = max(np.abs(part).max() for part in parts)
        add, speed = (size / largest * part for part in parts)
        return replace(state, coordinates=state.coordinates + add, rates=state.rates + self.omega * speed)

    def march(self, state: RingState, periods: int) -> RingRecord:
        """Integrate whole periods; again with half the step one in which the contact forces are not found.

        And all of them where the motion runs away faster than the flow can feed it.
        """
        work = self._loaded(state)
        output = np.empty((periods, self.steps, self.n_blades))
        ends, moves = list[Array](), 0
        scale = float(np.abs(work.force).max())
        last = (
            np.flatnonzero(self.structure.retained.any(axis=tuple(range(self.structure.retained.ndim - 1))))[-1] + 1
        )
        for period in range(periods):
            before = work._replace(**{name: getattr(work, name).copy() for name in STATE})
            scale = self._march(work, 0, self.steps, scale, output[period])
            if scale < 0.0:
                finer = self._finer(self._stored(before), 1, NOT_FOUND)
                moves += int(before.moves[0]) + finer.moves
                work, output[period] = self._loaded(finer.final), finer.output_m[0]
                scale = float(np.abs(work.force).max())
            ends.append(np.stack([work.coordinates, work.rates / self.omega]))
        first, largest = (np.abs(part).max(initial=0.0) for part in (output[:1], output))
        fed = np.exp(min(self.structure.feeding * self.period * periods, LARGEST_EXPONENT))
        if not largest <= RUNAWAY * (periods + 1) * fed * first:
            return self._finer(state, periods, "the motion grows without bound")
        both = self.structure.unpacked_state(*np.stack(ends, axis=1))
        kept = np.concatenate([part[..., :last] for part in both], axis=-1)
        return RingRecord(self._stored(work), output, kept, moves + int(work.moves[0]))

    def _finer(self, state: RingState, periods: int, reason: str) -> RingRecord:
        """The same with half the step, the output at the ends of the steps of this one."""
        if self.halved == MOST_HALVED:
            raise ContactIterationError(f"time integration: {reason}")
        found = replace(self, steps=2 * self.steps, halved=self.halved + 1).march(state, periods)
        return replace(found, output_m=found.output_m[:, 1::2])

    def history(self, state: RingState) -> tuple[list[RingState], Array]:
        """States at the ends of all steps of one period, and the output (n, q)."""
        work, output, states = self._loaded(state), np.empty((self.steps, self.n_blades)), []
        scale = float(np.abs(work.force).max())
        for step in range(self.steps):
            scale = self._march(work, step, step + 1, scale, output)
            if scale < 0.0:
                raise ContactIterationError(f"time integration: {NOT_FOUND}")
            states.append(self._stored(work, 2.0 * np.pi * (step + 1) / self.steps))
        return states, output

    def _wave_coordinates(self, displacement: Array) -> tuple[ComplexArray, NDArray[np.int64]]:
        """Modal coordinates (H+1, s, m) of the wave, see `Ring.coordinates`, and its harmonics 0 .. H."""
        order = np.arange((len(displacement) + 1) // 2)
        options = SolverOptions((1.0, 2.0), harmonics=len(order) - 1)
        force = contact_element(self.ring.contact, len(order) - 1, options).evaluate(displacement).force
        by_pair = to_complex(force).reshape(len(order), self.ring.frequency_ratio.size, -1)
        coordinates = self.ring.coordinates(self.omega, by_pair)
        if count := self.ring.static_push.size:
            mean = self.ring.floating_positions(displacement[0].reshape(by_pair.shape[1:]), coordinates)
            coordinates[0, :, :count] = mean
        return coordinates, order

    def contact_free(self, theta: float) -> tuple[Array, Array]:
        """Modal coordinates and rates of all modes in the response to the excitation without contact.

        `theta`: omega t, rad. Returns `coordinates, rates` (q, m): modal coordinates and their rates.
        """
        coordinates = self._free_response
        angle = theta + self.ring.phase * np.arange(self.n_blades)
        turn = np.exp(1j * angle)[:, None]
        position = coordinates[0].real + (turn * coordinates[1]).real
        rate = (1j * self.omega * turn * coordinates[1]).real
        for h in range(2, len(coordinates)):
            turn = np.exp(1j * h * angle)[:, None]
            position += (turn * coordinates[h]).real
            rate += (1j * h * self.omega * turn * coordinates[h]).real
        return position, rate

    @cached_property
    def _free_response(self) -> ComplexArray:
        """Modal coordinates without contact, (n_h, s, m)."""
        return self._padded(self.ring.free_response(self.omega))

    def _padded(self, coordinates: ComplexArray) -> ComplexArray:
        """Modal coordinates (n_h, s, m) of a wave with as many modes as the waves of the ring have."""
        missing = self.structure.angular_frequency.shape[-1] - coordinates.shape[-1]
        return np.pad(coordinates, ((0, 0), (0, 0), (0, missing)))

    def _loaded(self, state: RingState) -> RingWork:
        """Arrays of the kernels at a state."""
        structure = self.structure
        free, free_rate = self.contact_free(0.0)
        coordinates, rates = structure.packed_state(state.coordinates - free, state.rates - free_rate)
        force = state.force.reshape(self.n_blades, -1)
        contact_driven = structure.modal_force(force)
        moved = structure.unpacked_state(coordinates, rates)[0] + structure.following(contact_driven)[0] + free
        motion, nodes = structure.motion(moved), state.slider.shape[:2]
        packed_force, packed_motion = padded(force, 1), padded(motion, 1)
        width = packed_force.shape[1]
        own = self._march.system.own
        at_once = width <= MOST_DENSE and not self.ring.contact.cone.any()
        closed = np.tile(own, (self.n_blades // len(own), 1, 1))
        return RingWork(
            coordinates=coordinates,
            rates=rates,
            modal_force=structure.packed(contact_driven),
            slider=state.slider.copy(),
            keeps=np.zeros((*nodes, 2), dtype=bool),
            motion=packed_motion,
            guess=packed_motion.copy(),
            force=packed_force,
            last_force=packed_force.copy(),
            earlier_force=packed_force.copy(),
            change=np.zeros(width),
            residual=np.zeros(width),
            load=np.zeros(nodes),
            slip=np.zeros((*nodes, 2)),
            tangent=np.zeros((nodes[1], 3, 3)),
            tangents=np.zeros((*nodes, 3, 3)),
            closed=closed if at_once else closed[:, :0],
            kept=np.zeros((2, *packed_force.shape)),
            updates=np.zeros(self.n_blades, dtype=np.int64),
            moved=np.zeros(width),
            moves=np.zeros(1, dtype=np.int64),
        )

    def _stored(self, work: RingWork, theta: float = 0.0) -> RingState:
        """The state that the arrays of the kernels hold."""
        structure = self.structure
        coordinates, rates = self.contact_free(theta)
        flat = work.force[:, : 3 * work.load.shape[1]]
        kept = structure.unpacked_state(work.coordinates, work.rates)
        for total, part, follows in zip(
            (coordinates, rates), kept, structure.following(structure.modal_force(flat)), strict=True
        ):
            total += part
            total += follows
        force = flat.reshape(*work.load.shape, 3).copy()
        return RingState(coordinates, rates, work.slider.copy(), force)
