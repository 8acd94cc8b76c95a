"""What is recorded of a solved point: Floquet exponents, for any number of harmonics and all nodal diameters of the
ring, and the derivative of the amplitude.

While no contact changes its state the exponents are the poles of the ring with linear contact springs.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Literal, TypeVar

import numpy as np

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.linear_segments import LinearSegments
from nonlinear.continuation.response_quantities import amplitude_derivative
from nonlinear.continuation.solution_point import LinearState, SolutionPoint
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import WorkBudget
from nonlinear.stability.floquet import Basis, FloquetAnalysis
from nonlinear.stability.ring_stability import (
    LinearisedContact,
    PatternExponent,
    RingStability,
    largest_nodal_diameter,
)
from rom.cyclic.contact_springs import spring_stiffness
from rom.cyclic.cyclic_symmetry import relative_contact_motion
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.natural_frequencies import coupled_frequencies
from rom.cyclic.sector_modes import RingModes

FLOATING = 1e-11  # square of the frequency of a body that slides over the highest one: round-off
SAMPLED = 7  # nodal diameters of a ring at which a search starts


def least_damped_pole(modal: RingModes, phase: float, springs: Array) -> complex:
    """The pole with the largest real part of the ring at one phase; with Im s < 0 the wave runs the other way.

    With the modal coordinates q and the relative contact motion B = right - exp(i phase) left of the modes,

        s^2 q + diag(c_m) s q + (diag(omega_m^2) + B^H k B) q = 0,

    with the Coriolis forces beside diag(c_m).

    Shapes: `springs` (n_c, 3).
    """
    own = modal.at_phase(phase)
    if not springs.any() and own.coriolis is None:
        elastic = own.angular_frequency > 0.0
        half, squared = own.total_damping[elastic] / 2.0, own.total_stiffness[elastic]
        apart = np.sqrt((half**2 - squared).astype(complex))
        return _leading(np.concatenate([-half + apart, -half - apart]))
    stiffness, damping = _sprung(own, phase, springs)
    size = len(stiffness)
    # velocities in units of this frequency, so that all entries are of one size
    scale = float(np.sqrt(np.abs(np.diag(stiffness)).max()))
    system = np.zeros((2 * size, 2 * size), dtype=stiffness.dtype)
    system[:size, size:] = np.eye(size)
    system[size:, :size] = -stiffness / scale**2
    system[size:, size:] = -damping / scale
    return _leading((scale * np.linalg.eigvals(system)).astype(complex))


def least_damped_of_ring(modal: RingModes, springs: Array) -> tuple[complex, int]:
    """The pole with the largest real part over all nodal diameters n of the ring, and n; n and -n are conjugates.

    For light damping the decay of a mode x, x^H x = 1, is that of its undamped shape, c = x^H diag(c_m) x / 2. It
    is formed at some nodal diameters and then at the neighbours of the least one, until there is no lesser one; in a
    flow at all of them.
    Shapes: `springs` (n_c, 3).
    """
    assert modal.n_blades is not None
    pitch, last = 2.0 * np.pi / modal.n_blades, modal.n_blades // 2
    decays: dict[int, float] = {}

    def decay(n: int) -> float:
        if n not in decays:
            decays[n] = _undamped_decay(modal, n * pitch, springs)
        return decays[n]

    one_way = bool(modal.influence) or modal.turns  # forward and backward poles differ
    first = np.arange(last + 1) if one_way else np.unique(np.linspace(0, last, SAMPLED).round().astype(int))
    best = min(first.tolist(), key=decay)
    while (lower := min(range(max(best - 1, 0), min(best + 1, last) + 1), key=decay)) != best:
        best = lower
    pole = least_damped_pole(modal, best * pitch, springs)
    backward = one_way and pole.imag < 0.0
    return (pole.conjugate(), -best) if backward else (complex(pole.real, abs(pole.imag)), best)


def _undamped_decay(modal: RingModes, phase: float, springs: Array) -> float:
    """The least x^H diag(c_m) x / 2 over the undamped modes x at one phase, 1/s.

    The part of the stiffness that is not Hermitian, of the flow, takes as much from one sense of rotation as it adds
    to the other. Coriolis forces change the frequencies.
    """
    stiffness, damping = _sprung(modal.at_phase(phase), phase, springs)
    squared, shapes = np.linalg.eigh((stiffness + stiffness.conj().T) / 2.0)
    decays = np.sum(shapes.conj() * (damping @ shapes), axis=0).real
    turning = np.abs(np.sum(shapes.conj() * (stiffness @ shapes), axis=0).imag)
    return float((decays - turning / np.sqrt(np.abs(squared))).min()) / 2.0


def _sprung(own: ModalModel, phase: float, springs: Array) -> tuple[ComplexArray | Array, ComplexArray | Array]:
    """Stiffness diag(omega_m^2) + B^H k B and damping in coordinates without motions that nothing holds.

    Those are rigid motions of a disk, which do not move the contacts, and those of bodies that slide.
    """
    felt = own.is_felt
    motion, damping = _relative_motion(own, phase)[:, felt], np.diag(own.total_damping[felt])
    if own.coriolis is not None:
        damping = damping + own.coriolis[np.ix_(felt, felt)]
    stiffness = np.diag(own.total_stiffness[felt]) + spring_stiffness(motion, springs)
    if own.floating:
        values, shapes = np.linalg.eigh(stiffness)
        held = shapes[:, values > FLOATING * values[-1]]
        stiffness, damping = held.conj().T @ stiffness @ held, held.conj().T @ damping @ held
    return stiffness, damping


def _relative_motion(modal: ModalModel, phase: float) -> ComplexArray | Array:
    """Relative contact motion of the modes, real where it can be."""
    motion = relative_contact_motion(modal.right, modal.left, np.array([phase]))[0]
    return motion.real if modal.left is None or abs(np.sin(phase)) < 1e-12 else motion


def _leading(poles: ComplexArray) -> complex:
    return complex(poles[np.argmax(poles.real)])


MOST_HARMONICS = 25  # of a perturbation
# work of the exponents of the wave, those of all nodal diameters, and one that is followed, millions of operations,
# as measured: in few modes for the square of the unknowns, else for each unknown up to so many
Work = Literal["wave", "ring", "followed"]
IN_FEW_MODES: dict[Work, float] = {"wave": 1e-4, "ring": 4e-4, "followed": 1e-4}
IN_MANY: dict[Work, float] = {"wave": 0.5, "ring": 2.5, "followed": 0.2}
MOST_COUNTED = 140
UNKNOWN = complex(np.nan, 0.0)  # in place of an exponent that is not computed, as the budget is spent
Found = TypeVar("Found")


@dataclass(frozen=True)
class PointStability:
    """Floquet exponents of solved points.

    `exponents` are those of perturbations with the symmetry of the travelling wave (kappa = 0, `FloquetAnalysis`),
    `worst_pattern` and `follow_pattern` those of the other nodal diameters that the ring allows (`RingStability`).

    On a linear segment these are the free vibrations of the ring with the springs of its contacts: with the symmetry
    of the wave at the phases h psi of the harmonics balanced, else at those of all nodal diameters. The exponent
    recorded is that of the least damped one, at whatever frequency: its real part is the same all along the segment.
    """

    contact: ContactParameters  # parameters of the contact nodes
    # the balances with other numbers of harmonics. With them the perturbation of a point gets more harmonics than its
    # motion where the frequency is so low that no natural frequency lies within omega / 2 of those balanced
    balances: TruncatedBalances | None = None
    ring: bool = False  # whether nodal diameters other than that of the wave are looked at
    budget: WorkBudget = field(default_factory=WorkBudget)  # with which points become undecided
    _analyses: dict[int, FloquetAnalysis] = field(default_factory=dict, init=False, repr=False, compare=False)
    _rings: dict[int, RingStability] = field(default_factory=dict, init=False, repr=False, compare=False)
    _segments: dict[int, LinearSegments] = field(default_factory=dict, init=False, repr=False, compare=False)
    _first: list[tuple[float, float]] = field(default_factory=list, init=False, repr=False, compare=False)
    _linear: dict[tuple[int, bytes], tuple[complex, int]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def exponents(self, point: SolutionPoint) -> ComplexArray:
        """Exponents (1/s) of a point that has its contact Jacobian, the least stable first; NaN: undecided."""
        state = self.linear_state(point)
        if state is not None:
            return self._of_linear_motion(point, state)
        if self.budget.is_spent:
            return np.array([UNKNOWN])
        for balance, contact in self._linearised(point):
            self._spend("wave", balance, point.omega)
            found = self._analysis(balance).exponents(*contact)
            if found.size:
                return found
        return np.zeros(0, dtype=complex)

    def follow_wave(self, point: SolutionPoint, start: complex) -> complex | None:
        """The exponent (1/s) with the symmetry of the wave that the one of a neighbouring point, `start`, leads to.

        None if it leads to none, or where contacts do not change their state.
        """
        if self.linear_state(point) is not None or self.budget.is_spent:
            return None
        self._spend("followed", point.balance, point.omega)
        balance, contact = next(self._linearised(point))
        return self._analysis(balance).followed(*contact, start)

    def linear_state(self, point: SolutionPoint) -> LinearState | None:
        """State of the contacts where none of them changes its state in the cycle."""
        return point.linear or self._linear_segments(point.balance).state(point.displacement)

    def has_patterns(self, point: SolutionPoint) -> bool:
        """Whether perturbations of other nodal diameters are looked at, and exist."""
        return self.ring and largest_nodal_diameter(point.balance.receptance.modal) > 0

    def worst_pattern(self, point: SolutionPoint, any_growing: bool = False) -> PatternExponent | None:
        """The least stable exponent over all nodal diameters but that of the wave; None: none, NaN: undecided.

        `any_growing`: one that grows suffices, of whichever nodal diameter.
        """
        state = self.linear_state(point)
        if state is not None:
            return self._pattern_of_linear_motion(point, state)
        if self.budget.is_spent:
            return PatternExponent(UNKNOWN, 0)
        return self._of_ring(point, "ring", lambda ring, contact: ring.leading(contact, any_growing))

    def follow_pattern(self, point: SolutionPoint, start: PatternExponent) -> PatternExponent | None:
        """The exponent that the one of a neighbouring point, `start`, leads to; see `RingStability.followed`."""
        if self.budget.is_spent:
            return None
        return self._of_ring(point, "followed", lambda ring, contact: ring.followed(contact, start))

    def _of_ring(
        self, point: SolutionPoint, work: Work, solve: Callable[[RingStability, LinearisedContact], Found | None]
    ) -> Found | None:
        for balance, contact in self._linearised(point):
            self._spend(work, balance, point.omega)
            number = balance.n_harmonics
            if number not in self._rings:
                n_blades = balance.receptance.modal.n_blades
                assert n_blades is not None
                self._rings[number] = RingStability(self._analysis(balance), n_blades)
            found = solve(self._rings[number], contact)
            if found is not None:
                return found
        return None

    def _spend(self, work: Work, balance: HarmonicBalance, omega: float) -> None:
        """Count the work of exponents of a point."""
        size = balance.size
        if self._analysis(balance).basis(omega) is Basis.FEW_MODES:
            self.budget.spend(IN_FEW_MODES[work] * size**2)
        else:
            self.budget.spend(IN_MANY[work] * min(size, MOST_COUNTED))

    def _of_linear_motion(self, point: SolutionPoint, state: LinearState) -> ComplexArray:
        """The exponent lambda = s - i h omega of the least damped pole s at the phases h psi."""
        n_harmonics = point.balance.n_harmonics
        key = n_harmonics, state.pressed.tobytes()
        if key not in self._linear:
            receptance = point.balance.receptance
            springs = self._linear_segments(point.balance).system(state).springs
            first = 0 if point.balance.frozen_static is None else 1
            poles: dict[float, tuple[complex, int]] = {}  # by the cosine of the phase: -phase has the same decay
            for h in range(first, n_harmonics + 1):
                phase = h * receptance.phase
                cosine = round(float(np.cos(phase)), 12)
                if cosine not in poles:
                    pole = least_damped_pole(receptance.modal, phase, springs)
                    poles[cosine] = complex(pole.real, abs(pole.imag)), h
            self._linear[key] = max(poles.values(), key=lambda pole: pole[0].real)
        pole, h = self._linear[key]
        return np.array([pole - 1j * h * point.omega])

    def _pattern_of_linear_motion(self, point: SolutionPoint, state: LinearState) -> PatternExponent | None:
        """The least damped pole s of all nodal diameters n, as lambda = s - i h omega, k = n - h EO, h next to Im s.

        None with open contacts and without a disk: blades vibrate alone, every nodal diameter has the poles of the
        wave.
        """
        springs = self._linear_segments(point.balance).system(state).springs
        modal, psi = point.balance.receptance.modal, point.balance.receptance.phase
        alone = not modal.waves_differ and not springs.any()
        if alone or modal.n_blades is None:
            return None
        key = -1, state.pressed.tobytes()
        if key not in self._linear:
            self._linear[key] = least_damped_of_ring(modal, springs)
        pole, n = self._linear[key]
        h = min(round(pole.imag / point.omega), point.balance.n_harmonics)
        k = round(n - h * psi * modal.n_blades / (2.0 * np.pi)) % modal.n_blades
        return PatternExponent(pole - 1j * h * point.omega, min(k, modal.n_blades - k))

    def _linearised(self, point: SolutionPoint) -> Iterator[tuple[HarmonicBalance, LinearisedContact]]:
        """The contact of a point with its own harmonics, then with more and more of them."""
        jacobian = point.contact.jacobian
        if jacobian.size == 0:
            jacobian = point.balance.element.evaluate(point.displacement).jacobian
        yield point.balance, LinearisedContact(point.displacement, jacobian, point.omega)
        if self.balances is None:
            return
        lowest, stiffest = (value / point.omega for value in self._first_natural_frequencies(point.balance))
        highest = min(int(np.ceil(stiffest + 0.5)), MOST_HARMONICS)
        for n_harmonics in range(max(point.balance.n_harmonics + 1, int(lowest)), highest + 1):
            wider = self.balances.balance(n_harmonics)
            displacement = point.with_balance(wider).displacement
            jacobian = wider.element.evaluate(displacement).jacobian
            yield wider, LinearisedContact(displacement, jacobian, point.omega)

    def _first_natural_frequencies(self, balance: HarmonicBalance) -> tuple[float, float]:
        """The first natural frequency with open contacts, and the highest of a nodal diameter with stuck ones, rad/s.

        Contacts are no stiffer than stuck ones: so the first one of any nodal diameter lies between the two.
        """
        if self._first:
            return self._first[0]
        modal, p = balance.receptance.modal, self.contact
        own = balance.receptance.phase
        phases = [own, *(modal.phase(n) for n in range(largest_nodal_diameter(modal) + 1))]
        kn, kt = p.normal_stiffness, p.tangential_stiffness
        stuck = [coupled_frequencies(modal, phase, normal=kn, tangential=kt) for phase in phases]
        free = modal.at_phase(own).angular_frequency
        first = float(free[free > 0.0].min())
        self._first.append((first, max(float(each[each > 0.5 * first].min()) for each in stuck)))
        return self._first[0]

    def _linear_segments(self, balance: HarmonicBalance) -> LinearSegments:
        if balance.n_harmonics not in self._segments:
            self._segments[balance.n_harmonics] = LinearSegments(balance, self.contact, as_sampled=False)
        return self._segments[balance.n_harmonics]

    def _analysis(self, balance: HarmonicBalance) -> FloquetAnalysis:
        if balance.n_harmonics not in self._analyses:
            static = balance.frozen_static is None
            self._analyses[balance.n_harmonics] = FloquetAnalysis.of(balance.receptance, self.contact, static=static)
        return self._analyses[balance.n_harmonics]


@dataclass(frozen=True)
class PointRecorder:
    """Adds derived quantities to solved points."""

    output: str  # name of the output whose amplitude is recorded
    stability: PointStability | None = None  # computes Floquet exponents; None: they are not asked for
    limit: float = np.inf  # work spent, beyond which points stay undecided

    def record(self, point: SolutionPoint, exponents: bool = False) -> SolutionPoint:
        """The point with dA/ds and, if asked for, its exponents. Its contact Jacobian is dropped, to save memory."""
        dA_ds = point.dA_ds if point.linear is not None else amplitude_derivative(point, self.output)
        found = self.stability.exponents(point) if self.stability is not None and exponents else None
        return point.changed(dA_ds=dA_ds, exponents=found, contact=point.contact.without_jacobian())

    def with_exponents(self, point: SolutionPoint) -> SolutionPoint:
        """A recorded point with its exponents, if they are asked for."""
        if self.stability is None or point.exponents is not None:
            return point
        if self.stability.budget.spent > self.limit and self.stability.linear_state(point) is None:
            return replace(point, exponents=np.array([UNKNOWN]))
        contact = point.balance.element.evaluate(point.displacement)
        return replace(point, exponents=self.stability.exponents(replace(point, contact=contact)))
