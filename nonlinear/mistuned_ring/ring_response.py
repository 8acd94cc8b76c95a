"""The nonlinear forced response of a mistuned ring over the frequency, and the highest maximum of any blade."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.branches.special_points import locate_zero
from nonlinear.contact.fourier import ComplexArray, to_complex, to_real
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.point_stability import PointRecorder
from nonlinear.continuation.response_quantities import largest_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.continuation.step_control import ContinuationParameters, Resonances
from nonlinear.harmonic_balance.initial_solution import NewtonResult, continue_homotopy, periodic_start, solve_at
from nonlinear.mistuned_ring.linear_contacts import NEARLY_HIGHEST, strain_directions
from nonlinear.mistuned_ring.mistuning import Mistuning, MistuningError, check_blades
from nonlinear.mistuned_ring.ring_balance import RingBalance
from nonlinear.mistuned_ring.ring_receptance import RingReceptance
from nonlinear.mistuned_ring.sector_ring import SectorRing
from nonlinear.options import Excitation, OptionsError, SolverOptions
from nonlinear.response_solver import build_continuation
from rom.cyclic.natural_frequencies import coupled_frequencies
from rom.cyclic.sector_modes import RingModes
from rom.linear_algebra.threads import one_blas_thread

UNCERTAIN = 5e-3  # relative error of the height expected of a maximum between two points


@dataclass(frozen=True)
class RingPeak:
    """The highest amplitude of any blade."""

    frequency_hz: float
    amplitude_m: float  # amplitude of the vibration of the output about its mean, m
    blade: int  # number of the blade, 0 ... N_b - 1
    blade_amplitude_m: Array  # (N_b,) amplitudes of all blades there, m
    index: int  # index among the points of the curve
    located: bool  # whether the maximum was solved for. False where the largest amplitude lies at an end of the curve


def ring_output(point: SolutionPoint, output: str) -> ComplexArray:
    """Fourier coefficients of an output of all blades, each in its own time: (N_b, H+1), m."""
    balance = ring_of(point)
    coordinates, _ = balance.structure.coordinates(point.omega, balance.by_harmonic(point.contact.force))
    return balance.structure.output(output, coordinates)


def ring_of(point: SolutionPoint) -> RingBalance:
    """The balance of a point, which is that of a ring."""
    assert isinstance(point.balance, RingBalance)
    return point.balance


def vibration_amplitudes(harmonics: ComplexArray) -> Array:
    """Largest abs(x(t) - x_0) over a period of coefficients (..., H+1), (...)."""
    if harmonics.shape[-1] == 2:
        return np.abs(harmonics[..., 1])
    rows = harmonics.reshape(-1, harmonics.shape[-1]).copy()
    rows[:, 0] = 0.0
    return np.array([largest_amplitude(row).value for row in rows]).reshape(harmonics.shape[:-1])


def amplitude_slopes(point: SolutionPoint, output: str) -> Array:
    """Derivatives of the amplitudes of all blades with respect to the arc length, (N_b,), m.

    With the coefficients x_h of the output and the angle theta at which its vibration is largest, dA/ds =
    sign(x(theta)) Re sum_h dx_h/ds exp(i h theta).
    """
    balance = ring_of(point)
    jacobian = balance.forces(point.unknown).jacobian  # that of a recorded point is not kept
    dx_ds = balance.displacement(point.tangent[0])
    dforce = balance.by_harmonic(np.einsum("kabij,jkb->ika", jacobian, dx_ds))
    ring = balance.structure
    value, by_omega = ring.coordinates(point.omega, balance.by_harmonic(point.contact.force))
    by_force = ring.increments(point.omega, dforce)
    harmonics = ring.output(output, value)
    changes = ring.output(output, by_force + by_omega * point.tangent[1])
    harmonics[:, 0] = changes[:, 0] = 0.0
    order = np.arange(changes.shape[1])
    largest = [largest_amplitude(row) for row in harmonics]
    rates = [
        each.sign * (change * np.exp(1j * order * each.angle)).sum().real
        for each, change in zip(largest, changes, strict=True)
    ]
    return np.array(rates)


def with_peak(
    continuation: Continuation, points: Sequence[SolutionPoint], amplitudes: Array, output: str
) -> tuple[list[SolutionPoint], int | None]:
    """The points with the highest maximum of any blade located and inserted; its index, None if it lies at an end.

    Shapes: `amplitudes` (P, N_b).
    """
    best, place, height = None, -1, 0.0
    for expected, first, blade in _expected_maxima(points, amplitudes, output):
        if expected < (1.0 - UNCERTAIN) * height:
            break

        def slope(point: SolutionPoint, blade: int = blade) -> float:
            return float(amplitude_slopes(point, output)[blade])

        found = locate_zero(continuation, points[first], points[first + 1], slope)
        if found is None:
            continue
        reached = float(vibration_amplitudes(ring_output(found, output))[blade])
        if reached > height:
            best, place, height = found, first + 1, reached
    if best is None or height < amplitudes.max():
        return list(points), None
    return [*points[:place], best, *points[place:]], place


def _expected_maxima(points: Sequence[SolutionPoint], amplitudes: Array, output: str) -> list[tuple[float, int, int]]:
    """(height, index of the point before, blade) of maxima that may be the highest, the highest first.

    The height is that of the cubic with the amplitudes and slopes of the points on both sides.
    """
    slopes: dict[int, Array] = {}

    def slope(index: int, blade: int) -> float:
        if index not in slopes:
            slopes[index] = amplitude_slopes(points[index], output)
        return float(slopes[index][blade])

    found = []
    for index, blade in _candidates(amplitudes):
        first = index if slope(index, blade) > 0.0 else index - 1
        if not 0 <= first < len(points) - 1:
            continue
        length = points[first + 1].arc - points[first].arc
        rates = length * slope(first, blade), length * slope(first + 1, blade)
        at = np.linspace(0.0, 1.0, 101)
        rise = amplitudes[first + 1, blade] - amplitudes[first, blade]
        cubic = rates[0] * at * (1.0 - at) ** 2 - rates[1] * at**2 * (1.0 - at) + rise * at**2 * (3.0 - 2.0 * at)
        found.append((float(amplitudes[first, blade] + cubic.max()), first, blade))
    return sorted(found, reverse=True)


def _candidates(amplitudes: Array) -> list[tuple[int, int]]:
    """(index, blade) of the samples that may be next to the highest maximum: local maxima of one blade."""
    padded = np.pad(amplitudes, ((1, 1), (0, 0)), constant_values=-np.inf)
    local = (amplitudes >= padded[:-2]) & (amplitudes >= padded[2:])
    high = amplitudes >= NEARLY_HIGHEST * amplitudes.max()
    return [(int(index), int(blade)) for index, blade in np.argwhere(local & high)]


Progress = Callable[[float, int], bool | None]
STEPS = ContinuationParameters(target_deviation=0.2, max_mean_tangent_deviation=0.1)  # the kinks of many pairs
FINER = 4.0  # ratio of the step limits of the first attempt and of the finer ones


@dataclass(frozen=True)
class RingRecorder(PointRecorder):
    """Recorder of the points of a ring: nothing is added, the contact Jacobian is dropped."""

    def record(self, point: SolutionPoint, exponents: bool = False) -> SolutionPoint:
        """The point without its contact Jacobian."""
        return point.changed(contact=point.contact.without_jacobian())


@dataclass(frozen=True)
class RingContinuation(Continuation):
    """Continuation of the solutions of a ring in the frequency."""

    @cached_property
    def recorder(self) -> PointRecorder:
        """Records points."""
        return RingRecorder(self.options.output)


@dataclass(frozen=True)
class MistunedResponse:
    """Forced response of a mistuned ring at P frequencies."""

    frequency_hz: Array  # (P,) frequencies, Hz, along the curve
    amplitude_m: Array  # (P, N_b) amplitude of the vibration of the output about its mean, blade by blade, m
    output: ComplexArray  # (P, N_b, H+1) Fourier coefficients of the output, each in the time of its own blade, m
    # (P, H+1, N_b n_c, 3) those of the relative displacements of the contact nodes, pair after pair, m
    relative_displacement: ComplexArray
    iterations: NDArray[np.int64]  # (P,) Newton iterations
    peak: RingPeak | None  # the highest amplitude of any blade; None without points
    complete: bool  # whether the curve spans the frequency range
    message: str  # how it ended
    harmonics: int  # number of harmonics H
    seconds: float  # what it took, s

    @property
    def envelope_m(self) -> Array:
        """Largest amplitude of any blade at each point, (P,), m."""
        largest: Array = self.amplitude_m.max(axis=1, initial=0.0)
        return largest


def mistuned_response(
    modal: RingModes,
    contact: ContactParameters,
    excitation: Excitation,
    options: SolverOptions,
    mistuning: Mistuning | None = None,
    progress: Progress | None = None,
) -> MistunedResponse:
    """The forced response of a ring of blades that differ, under an excitation that travels around it.

    `mistuning`: deviations of all blades of the ring; None: the tuned ring, of which one blade is solved for. Returns
    the branch from one end of the frequency range; where it is not complete, its message says why.
    """
    if options.method != "coupled":
        raise OptionsError(f'method: {options.method!r}, allowed for a mistuned ring: "coupled"')
    options = replace(options, harmonics=options.fixed_harmonics, stability="folds")
    pattern = Mistuning.of(1) if mistuning is None else mistuning
    if mistuning is not None and mistuning.n_blades != modal.n_blades:
        known = "the model of a ring" if modal.n_blades is None else f"{modal.n_blades}, as the model"
        raise MistuningError(f"mistuning: of {mistuning.n_blades} blades, allowed: {known}")
    check_blades(modal, pattern)
    started = time.perf_counter()
    with one_blas_thread():
        tuned, _, static = build_continuation(modal, contact, excitation, options)
        problem = _Ring(tuned, contact, pattern, static, _strain(tuned, contact, pattern))
        points, complete, message = problem.traced(progress)
        response = _assembled(problem.continuation(options), points, options)
    seconds = max(0.0, time.perf_counter() - started)
    return replace(response, complete=complete, message=message, seconds=seconds)


def _strain(tuned: Continuation, contact: ContactParameters, mistuning: Mistuning) -> Array:
    """The strains on which the deviating stiffness acts of blades that a disk or a flow joins, (t, n); else none."""
    receptance = tuned.balance.receptance
    if not receptance.modal.joined:
        return np.zeros((0, 0))
    if not mistuning.frequency.any():
        return np.zeros((0, len(receptance.modal.at(0).shapes)))
    return strain_directions(receptance, contact, tuned.options.omega_range[1])


@dataclass(frozen=True)
class _Ring:
    """A mistuned ring and the tuned blade that its first solution starts from."""

    tuned: Continuation
    contact: ContactParameters
    mistuning: Mistuning
    static: Array
    strain: Array

    @cached_property
    def balance(self) -> RingBalance:
        return self._scaled(1.0)

    def continuation(self, options: SolverOptions) -> RingContinuation:
        """The continuation of the ring, with no step across a resonance of the tuned ring."""
        return RingContinuation(self.balance, options, self._resonances, parameters=STEPS, budget=self.tuned.budget)

    @cached_property
    def _resonances(self) -> Resonances:
        """Frequencies of the tuned ring with free and with stuck contacts, at all nodal diameters."""
        contact, modal = self.contact, self.tuned.balance.receptance.modal
        low, high = self.tuned.options.omega_range
        n_blades = modal.n_blades or 1
        kn, kt = contact.normal_stiffness, contact.tangential_stiffness
        found = []
        for nodal_diameter in range(n_blades // 2 + 1):
            phase = modal.phase(nodal_diameter)
            found.append(modal.at(nodal_diameter).angular_frequency)
            found.append(coupled_frequencies(modal, phase, normal=kn, tangential=kt, highest=high))
        values = np.unique(np.concatenate(found))
        inside = tuple(values[(values > low) & (values < high)].tolist())
        return Resonances(inside, inside)

    def _scaled(self, factor: float) -> RingBalance:
        options, receptance = self.tuned.options, self.tuned.balance.receptance
        mistuning = self.mistuning.scaled(factor)
        apart = not receptance.modal.joined
        structure = RingReceptance(receptance, 1.0 + mistuning.frequency) if apart else self._sectors
        return RingBalance.of(structure, self.contact, mistuning, options)

    @cached_property
    def _sectors(self) -> SectorRing:
        return SectorRing(self.tuned.balance.receptance, self.mistuning.n_blades, self.strain)

    def traced(self, progress: Progress | None) -> tuple[list[SolutionPoint], bool, str]:
        """The points of the most complete attempt in rising frequency, whether they span the range, a message."""
        options = self.tuned.options
        finer = replace(options, max_step=options.max_step / FINER, min_step=options.min_step / FINER)
        longest: list[SolutionPoint] = []
        said = []
        for upwards, attempt in ((True, options), (False, options), (True, finer), (False, finer)):
            points = self._from_end(self.continuation(attempt), upwards, progress)
            limit = options.omega_range[1 if upwards else 0]
            if points and abs(points[-1].omega - limit) <= 1e-12 * limit:
                low, high = options.frequency_hz
                return points, True, f"complete: {low:g} to {high:g} Hz in {len(points)} points"
            end = f"ended at {points[-1].omega / (2.0 * np.pi):.6g} Hz" if points else "found no start"
            end += ", given up: a larger response.effort goes further" if self.tuned.budget.is_spent else ""
            said.append(f"the curve from the {'low' if upwards else 'high'} end {end}")
            longest = points if len(points) > len(longest) else longest
            if len(points) >= options.most_points or self.tuned.budget.is_spent:
                break
        return longest, False, "; ".join(said)

    def _from_end(
        self, continuation: RingContinuation, upwards: bool, progress: Progress | None
    ) -> list[SolutionPoint]:
        """The branch from one end of the range; none without a start."""
        found = self._low_start if upwards else self._high_start
        if found is None:
            return []
        omega, direction = continuation.options.omega_range[0 if upwards else 1], 1.0 if upwards else -1.0
        first = continuation.solver.starting_point(found.solution, omega, direction, found.iterations)
        return list(continuation.continue_branch(first, progress))

    @cached_property
    def _low_start(self) -> NewtonResult | None:
        return self._start(self.tuned.options.omega_range[0])

    @cached_property
    def _high_start(self) -> NewtonResult | None:
        return self._start(self.tuned.options.omega_range[1])

    def _start(self, omega: float) -> NewtonResult | None:
        """The solution at one end of the range, from the tuned one; None where none is found."""
        options = self.tuned.options
        tuned = periodic_start(self.tuned.balance, omega, self.static, options, self.contact)
        if not tuned.converged:
            return None
        guess = self._repeated(tuned.solution, omega)
        found = solve_at(self.balance, omega, guess, options)
        if not found.converged:
            found = continue_homotopy(self._scaled, omega, guess, options)
        return found if found.converged else None

    def _repeated(self, tuned: Array, omega: float) -> Array:
        """The unknown of the tuned ring from that of one blade (n,), with the strains of its blades."""
        balance, count = self.balance, self.balance.n_blades
        own = tuned.reshape(2 * balance.n_harmonics + 1, 1, -1)
        guess = np.zeros((len(own), count, balance.pair_dofs))
        guess[:, :, : own.shape[2]] = own
        if balance.pair_dofs > own.shape[2]:
            force = np.zeros_like(guess)
            force[:, :, : own.shape[2]] = self.tuned.balance.forces(tuned).force.reshape(own.shape)
            moved, _ = balance.structure.response(omega, balance.by_harmonic(force))
            strain = to_real(moved.reshape(len(moved), -1)).reshape(guess.shape)
            guess[:, :, own.shape[2] :] = strain[:, :, own.shape[2] :]
        return guess.reshape(-1)


def _assembled(
    continuation: RingContinuation, points: list[SolutionPoint], options: SolverOptions
) -> MistunedResponse:
    """The response of the points, with its highest maximum located."""
    balance = continuation.balance
    assert isinstance(balance, RingBalance)
    outputs = [ring_output(point, options.output) for point in points]
    amplitude = vibration_amplitudes(np.array(outputs)) if points else np.empty((0, balance.n_blades))
    index = None
    if points:
        points, index = with_peak(continuation, points, amplitude, options.output)
    if index is not None:
        outputs.insert(index, ring_output(points[index], options.output))
        amplitude = np.insert(amplitude, index, vibration_amplitudes(outputs[index]), axis=0)
    frequency_hz = np.array([point.omega for point in points]) / (2.0 * np.pi)
    displacement = [_contact_motion(balance, point) for point in points]
    return MistunedResponse(
        frequency_hz=frequency_hz,
        amplitude_m=amplitude,
        output=np.array(outputs).reshape(len(points), balance.n_blades, balance.n_harmonics + 1),
        relative_displacement=np.array(displacement).reshape(len(points), balance.n_harmonics + 1, -1, 3),
        iterations=np.array([point.iterations for point in points], dtype=np.int64),
        peak=_peak(frequency_hz, amplitude, index) if points else None,
        complete=False,
        message="",
        harmonics=balance.n_harmonics,
        seconds=0.0,
    )


def _contact_motion(balance: RingBalance, point: SolutionPoint) -> ComplexArray:
    """Relative displacements of the contact nodes of all pairs, (H+1, N_b, n_c, 3), without the strains of blades."""
    found = to_complex(balance.displacement(point.unknown)).reshape(balance.n_harmonics + 1, balance.n_blades, -1, 3)
    return found[:, :, : balance.receptance.modal.n_contacts]


def _peak(frequency_hz: Array, amplitude: Array, index: int | None) -> RingPeak:
    """The peak at the located point; at the largest sample where there is none."""
    at = int(np.argmax(amplitude.max(axis=1))) if index is None else index
    blade = int(np.argmax(amplitude[at]))
    return RingPeak(float(frequency_hz[at]), float(amplitude[at, blade]), blade, amplitude[at], at, index is not None)
