"""Periodic motions of several blades by harmonic balance of the ring, and their branches over the frequency.

A localised motion repeats every period, each blade with a height of its own. It is a solution of the balance of all
blades of the ring as one structure: the Fourier coefficients of a period in time are the start of Newton's method,
and the branch through the solution is followed to its highest point. Growth rates are those in the ring of up to 8
blades in which a motion in time is confirmed. A subharmonic motion, that repeats after m periods, is one of the
frequency omega / m, excited in harmonic m.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from nonlinear.branches.branch_collection import with_balance
from nonlinear.branches.special_points import locate_peak
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import amplitude_derivative, largest_amplitude, output_under_forces
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.step_control import ContinuationParameters
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances, on_support
from nonlinear.harmonic_balance.residual import HarmonicBalance, has_odd_harmonics_only
from nonlinear.options import HIGHEST_EXCITED, TRUNCATION_TOLERATED, Excitation, ExcitationHarmonic, SolverOptions
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.time_integration.ring import RETENTION, Ring, whole_ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingMotion
from nonlinear.worst_motion.candidates import LONG
from nonlinear.worst_motion.ring_integration import CONFIRMED, EQUAL_COST, RingIntegration

HARMONICS, MORE_HARMONICS = 3, 5 / 3  # of the branch; factor on them with which its highest point is solved again
# of a subharmonic motion: as many harmonics of the excitation at most, factor on the steps of its period in time
SUBHARMONICS, SUBHARMONIC_STEPS = 31, 2.0
SAFETY = 1.25  # factor on the change by these
MOST_UNKNOWNS = 1600  # of the ring of a motion
STEADY = 0.1  # change of a motion over a period, relative to its size, up to which Newton's method is tried
# distances of heights of a solution and of a motion in time, relative to the highest blade: of any and of that one
SAME_HEIGHTS, SAME_HEIGHT = 0.1, 0.05
ALIKE = 0.01  # relative difference of the blades of a wave
MAX_STEP, TARGET_DEVIATION, MOST_POINTS = 0.5, 0.2, 30  # of the branch
MOST_TOPS = 4  # highest points whose growth rate is looked at


@dataclass(frozen=True)
class RingBranch:
    """The part of a branch of several blades from a motion in time up to its highest point."""

    places: dict[float, float]  # height of the highest blade, m, by frequency, Hz
    top_hz: float  # frequency of the highest stable point
    heights_m: Array  # (q,), of all blades there
    truncation_error: float  # estimated relative error of the highest one
    blade_periods: int  # of time integration, that cost as much

    def top(self, motion: RingMotion) -> RingMotion:
        """The highest stable point, found by a motion in time."""
        highest, lowest = float(self.heights_m.max()), float(self.heights_m.min())
        motion = replace(motion, periodic=True, settled=True, amplitude_m=highest, lowest_m=lowest, height_error=0.0)
        return replace(motion, repeats_after=max(motion.repeats_after, 1))


@dataclass(frozen=True)
class RingBalances:
    """The balances of a ring of so many blades, alike and clamped, as one structure."""

    ring: Ring
    blades: int
    options: SolverOptions
    periods: int = 1  # after which the motion repeats
    harmonics: int = HARMONICS

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the output of all blades."""
        return tuple(f"{self.ring.output}_{blade}" for blade in range(self.blades))

    @cached_property
    def contact(self) -> ContactParameters:
        """Of the nodes of all pairs."""
        return ContactParameters.joined(*[self.ring.contact] * self.blades)

    @cached_property
    def base(self) -> HarmonicBalance:
        """The balance with few harmonics."""
        excitation, periods = self.ring.excitation, self.periods
        modal = whole_ring(self.ring.modal.at(0), excitation, np.ones(self.blades))
        if periods > 1:
            excitation = _subharmonic(excitation, periods)
            forces = {periods * h: force for h, force in {**modal.harmonic_forces, 1: modal.force}.items()}
            modal = replace(modal, harmonic_forces=forces)
        receptance = on_support(
            Ring(modal, self.contact, excitation).receptance(self.harmonics), self.contact, self.options
        )
        element = contact_element(self.contact, self.harmonics, self.options)
        return HarmonicBalance(receptance, element, odd=has_odd_harmonics_only(receptance, self.contact))

    def continuation(self, highest: int) -> Continuation:
        """Over the frequency; `highest`: the blade whose amplitude has its maximum located."""
        names, (low, high) = self.outputs, self.options.frequency_hz
        options = replace(self.options, output=names[highest], outputs=names, max_step=MAX_STEP)
        options = replace(options, frequency_hz=(low / self.periods, high / self.periods))
        options = replace(options, harmonics=self.harmonics, max_points=MOST_POINTS)
        parameters = ContinuationParameters(target_deviation=TARGET_DEVIATION)
        return Continuation(self.base, options, contact=self.contact, parameters=parameters)

    def frequency_hz(self, point: SolutionPoint) -> float:
        """Frequency of the excitation at a point."""
        return self.periods * point.omega / (2.0 * np.pi)

    def heights(self, point: SolutionPoint) -> Array:
        """Largest abs(x(t)) of all blades, (q,), m."""
        found = (
            output_under_forces(point.balance.receptance, point.omega, point.contact, name) for name in self.outputs
        )
        return np.array([largest_amplitude(each).value for each in found])

    def is_stable(self, point: SolutionPoint) -> bool:
        """Whether the motion of a smaller ring persists in this one."""
        displacement = np.tile(point.displacement, (1, self.base.n_contacts // point.balance.n_contacts, 1))
        jacobian = self.base.element.evaluate(displacement).jacobian
        analysis = FloquetAnalysis.of(self.base.receptance, self.contact)
        return analysis.is_stable(displacement, jacobian, point.omega, self.frequency_hz(point) / LONG)


def _subharmonic(excitation: Excitation, periods: int) -> Excitation:
    """The excitation in the harmonics of a motion that repeats after so many periods."""
    factors = {1: 1.0 + 0.0j, **dict(excitation.factors)}
    acting = {periods * h: (abs(factor), float(np.degrees(np.angle(factor)))) for h, factor in factors.items()}
    orders = {1: (0.0, 0.0), **acting}
    return replace(excitation, harmonics=tuple(ExcitationHarmonic(h, *factor) for h, factor in orders.items()))


def ring_branch(
    integration: RingIntegration, frequency_hz: float, motion: RingMotion, height_m: float = 0.0
) -> RingBranch | None:
    """The branch of a motion of several blades or periods; None where it is none, or is unstable or truncated.

    Not with a disk, mistuned blades, or, of one period, contact against ground. Of the motion its final state counts.
    `height_m`: of the highest motion known, m; whether one that is no higher persists does not matter.
    """
    ring, omega, periods = integration.ring, 2.0 * np.pi * frequency_hz, max(motion.repeats_after, 1)
    if ring.blades_apart is not None or ring.modal.waves_differ or (periods == 1 and ring.modal.at(0).left is None):
        return None
    displacement, heights, moved = _in_time(integration, omega, motion, periods)
    if moved > STEADY:
        return None
    blades = heights.size if periods > 1 else _fewest_blades(ring, heights)
    unknown = displacement[:, : blades * ring.contact.n_contacts]
    if unknown.size > MOST_UNKNOWNS or periods * ring.excited.harmonics[-1] > HIGHEST_EXCITED:
        return None
    balances = RingBalances(ring, blades, integration.options, periods, len(unknown) // 2)
    continuation = balances.continuation(int(np.argmax(heights[:blades])))
    start = continuation.solver.solution_at(omega / periods, balances.base.unknown(unknown))
    if start is None or start.jacobian_sign < 0 or not _same(balances, start, heights):
        return None
    points = _rising(continuation, start)
    count = ring.blades(integration.larger_pattern(motion))
    larger = RingBalances(ring, count, integration.options, periods, balances.harmonics)
    highest = sorted(points, key=lambda point: -balances.heights(point).max())[:MOST_TOPS]
    low = bool(highest) and balances.heights(highest[0]).max() <= height_m
    top = next((point for point in highest if low or larger.is_stable(point)), None)
    if top is None:
        return None
    error = TRUNCATION_TOLERATED if low else _truncation_error(continuation, balances, top)
    if error > max(TRUNCATION_TOLERATED, integration.options.harmonic_tolerance):
        return None
    places = {balances.frequency_hz(point): float(balances.heights(point).max()) for point in points}
    cost = EQUAL_COST * blades * (2 * balances.harmonics + 1) * len(points)
    return RingBranch(places, balances.frequency_hz(top), balances.heights(top), error, cost)


def _in_time(
    integration: RingIntegration, omega: float, motion: RingMotion, periods: int
) -> tuple[Array, Array, float]:
    """Real Fourier coefficients (2H+1, q n_c, 3) of d over some periods, heights (q,) of the blades, m.

    And how far they end from their start, relative to the largest modal coordinate. Of several periods in small rings
    with many harmonics.
    """
    modal, state = integration.ring.modal.at(0), motion.final
    pattern, harmonics = integration.pattern_of(motion), HARMONICS * periods
    if periods == 1:
        integrator = integration.coarse(omega, pattern)
    else:
        integrator = RingIntegrator.of(
            integration.ring,
            omega,
            nodal_diameter=pattern,
            retention=CONFIRMED * RETENTION,
            finer=SUBHARMONIC_STEPS,
        )
        affordable = (MOST_UNKNOWNS // (3 * integrator.n_blades * integration.ring.contact.n_contacts) - 1) // 2
        harmonics = max(harmonics, min(SUBHARMONICS * periods, affordable))
    positions, outputs = [state.coordinates], []
    for _ in range(periods):
        states, output = integrator.history(state)
        state = states[-1]
        positions += [each.coordinates for each in states]
        outputs.append(output)
    coordinates = np.array(positions[:-1])
    moved = coordinates @ modal.right.T
    if modal.left is not None:
        moved -= np.roll(coordinates, -1, axis=1) @ modal.left.T
    found = 2.0 * np.fft.rfft(moved, axis=0)[: harmonics + 1] / len(coordinates)
    found[0] /= 2.0
    start = motion.final.coordinates
    change = float(np.abs(state.coordinates - start).max() / np.abs(start).max())
    return to_real(found.reshape(len(found), -1, 3)), np.abs(outputs).max(axis=(0, 1)), change


def _fewest_blades(ring: Ring, heights: Array) -> int:
    """Blades after which the heights (q,) of a ring come again."""
    count, wave = heights.size, ring.wave_blades
    turns = (turn for turn in range(wave, count, wave) if count % turn == 0)
    return next((turn for turn in turns if _alike(heights, np.roll(heights, turn))), count)


def _alike(heights: Array, others: Array) -> bool:
    return bool(np.abs(heights - others).max() <= ALIKE * heights.max())


def _same(balances: RingBalances, point: SolutionPoint, heights: Array) -> bool:
    """Whether the blades of a solution move as high as in time, and it is none of a wave of one period."""
    solved = balances.heights(point)
    every = np.resize(solved, heights.size)
    each = np.abs(every - heights).max() <= SAME_HEIGHTS * heights.max()
    highest = abs(solved.max() - heights.max()) <= SAME_HEIGHT * heights.max()
    if balances.periods == 1:
        another = not _alike(solved, np.roll(solved, 1))
    else:
        size = np.abs(to_complex(point.displacement)).max(axis=(1, 2))
        another = np.delete(size, np.s_[:: balances.periods]).max() > ALIKE * size[1:].max()
    return bool(each and highest and another)


def _rising(continuation: Continuation, start: SolutionPoint) -> list[SolutionPoint]:
    """Points of a branch in the way in which the highest blade rises, up to its maximum.

    They end where det dR/dx changes its sign: at a fold, or where another branch leaves.
    """
    points, rises = list[SolutionPoint](), amplitude_derivative(start, continuation.options.output) > 0.0
    for point in continuation.continue_branch(start if rises else start.reversed()):
        points.append(point)
        if point.jacobian_sign < 0 or point.dA_ds < 0.0:
            break
    peak = locate_peak(continuation, *points[-2:]) if len(points) > 1 else None
    points += [] if peak is None else [peak]
    return [point for point in points if point.jacobian_sign > 0]


def _truncation_error(continuation: Continuation, balances: RingBalances, point: SolutionPoint) -> float:
    """Estimated relative error of the highest blade by neglected harmonics; infinite where more lead nowhere."""
    every = TruncatedBalances(balances.base, balances.contact, continuation.options)
    more = with_balance(continuation, point, every.balance(round(MORE_HARMONICS * balances.harmonics)))
    if more is None:
        return np.inf
    heights = balances.heights(more).max(), balances.heights(point).max()
    return float(SAFETY * abs(heights[0] / heights[1] - 1.0))
