"""The estimate of the truncation error at a peak: against exact solutions, and where the peak is hard to follow."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from scipy.optimize import minimize_scalar, root

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.continuation.acceptance import distance, distance_along_tangent
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.step_control import find_resonances
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances, static_displacement
from nonlinear.harmonic_selection.peak_following import reference_harmonics
from nonlinear.harmonic_selection.truncation_error import TruncationErrorEstimator, WaySampling, way_to_peak
from nonlinear.response_solver import build_harmonic_balance
from rom import ReducedModel, modal_model

DAMPING = 0.02


def segment(stiffness, omega, start, phase):
    """x(t), x'(t) of x'' + c x' + k x = cos(omega t + phase) from `start` = (x, x') at t = 0; c = 2 DAMPING."""
    steady = 1.0 / (stiffness - omega**2 + 2j * DAMPING * omega)
    own = -DAMPING + 1j * np.sqrt(stiffness - DAMPING**2)
    x, v = start[0] - (steady * np.exp(1j * phase)).real, start[1] - (1j * omega * steady * np.exp(1j * phase)).real
    free = x + (own.real * x - v) / own.imag * 1j

    def motion(t):
        forced, decaying = steady * np.exp(1j * (omega * t + phase)), free * np.exp(own * t)
        return (forced + decaying).real, (1j * omega * forced + own * decaying).real

    return motion


class Bilinear:
    """Exact periodic motion of x'' + c x' + x + k max(x, 0) = cos(omega t): one interval on each side per period."""

    def __init__(self, stiffness):
        self.stiffness = stiffness
        free = np.sqrt(1.0 + stiffness)
        self.resonance = 2.0 * free / (1.0 + free)
        self.guess = np.array([0.5 / DAMPING, 0.0, np.pi / free])  # speed and phase at x = 0, time pressed

    def pieces(self, omega, unknown):
        speed, phase, pressed = unknown
        first = segment(1.0 + self.stiffness, omega, (0.0, speed), phase)
        second = segment(1.0, omega, first(pressed), phase + omega * pressed)
        return first, second, 2.0 * np.pi / omega - pressed

    def amplitude(self, omega):
        def closes(unknown):
            first, second, apart = self.pieces(omega, unknown)
            x, v = second(apart)
            return first(unknown[2])[0], x, v - unknown[0]

        solved = root(closes, self.guess, tol=1e-13)
        assert solved.success
        self.guess = solved.x
        first, second, apart = self.pieces(omega, solved.x)
        pressed, away = first(np.linspace(0.0, solved.x[2], 20001))[0], second(np.linspace(0.0, apart, 20001))[0]
        assert pressed[1:-1].min() > 0.0 > away[1:-1].max()
        return max(pressed.max(), -away.min())

    def peak(self):
        near = (0.97 * self.resonance, 1.03 * self.resonance)
        self.amplitude(self.resonance)
        return -minimize_scalar(lambda omega: -self.amplitude(omega), bounds=near, options={"xatol": 1e-7}).fun


def bilinear(stiffness):
    """The oscillator's modes and contact: pressed for x > 0, without friction."""
    one = np.ones(1)
    contact = ContactParameters(stiffness * one, one, 0.0 * one, 0.0 * one, 0.0 * one)
    return modal_model(oscillator(tangential=False), damping_ratio=DAMPING), contact


def opening(engine_order, damping, stiffness, interference):
    """A lumped blade whose contacts open: modes, contact, excitation."""
    modal = modal_model(lumped_blade(), damping_ratio=damping)
    contact = ContactParameters.shared(
        2,
        normal_stiffness=stiffness,
        tangential_stiffness=0.75 * stiffness,
        friction=0.4,
        interference=interference,
    )
    return modal, contact, Excitation(engine_order, 1.0)


def solve(problem, frequency, harmonics, **options):
    chosen = SolverOptions(frequency, harmonics=harmonics, detached=False, stability="folds", search="off", **options)
    return forced_response(*problem, chosen)


@pytest.mark.parametrize("stiffness", [0.5, 3.0, 10.0])
def test_bounds_the_error_against_an_exact_solution(stiffness):
    exact = Bilinear(stiffness).peak()
    problem = (*bilinear(stiffness), Excitation(0, 1.0))
    for harmonics in (1, 2, 3, 5, 7):
        curve = solve(problem, (0.14, 0.32), harmonics)
        error = abs(curve.peak.amplitude_m / exact - 1.0)
        assert error <= 3.0 * curve.truncation_error
        assert curve.truncation_error <= 10.0 * error
        assert curve.truncation_branch == "kept"


def test_a_range_that_ends_before_the_peak():
    """The highest amplitude is that of the end then, and so is the error."""
    motion = Bilinear(3.0)
    omega = 0.985 * motion.resonance
    motion.amplitude(motion.resonance)
    exact = motion.amplitude(omega)
    problem = (*bilinear(3.0), Excitation(0, 1.0))
    for harmonics in (2, 3, 5):
        curve = solve(problem, (0.14, omega / (2.0 * np.pi)), harmonics)
        assert not curve.peak.located
        error = abs(curve.peak.amplitude_m / exact - 1.0)
        assert error <= 3.0 * curve.truncation_error
        assert curve.truncation_error <= 10.0 * error


@pytest.mark.parametrize(
    ("engine_order", "damping", "stiffness", "interference", "harmonics"),
    [
        (4, 0.02, 20.0, -1.0, 1),
        pytest.param(4, 0.02, 20.0, -1.0, 3, marks=pytest.mark.long),
        pytest.param(4, 0.01, 10.0, -0.3, 1, marks=pytest.mark.long),
        (6, 0.02, 20.0, -1.0, 1),  # with more harmonics there is no such peak
        (6, 0.02, 20.0, -1.0, 2),
    ],
)
def test_a_peak_that_is_lost_in_its_plane(engine_order, damping, stiffness, interference, harmonics):
    """Its error is bounded too, against 11 harmonics (good to half a per cent here)."""
    problem = opening(engine_order, damping, stiffness, interference)
    truncation, main = main_branch(problem, (0.1, 0.9), harmonics)
    peak = max((main.points[place] for place in main.peak_indices), key=lambda point: height(truncation, point))
    sets = (harmonics + 2, reference_harmonics(harmonics), reference_harmonics(reference_harmonics(harmonics)))
    found = [truncation.continuation.with_balance(truncation.balances.balance(n)).solver.refit(peak) for n in sets]
    assert any(point is None for point in found)
    reference = solve(problem, (0.1, 0.9), 11).peak.amplitude_m
    estimate = truncation.of_branch(main.points, main.peak_indices).error
    assert abs(height(truncation, peak) / reference - 1.0) <= 3.0 * estimate
    assert np.isfinite(estimate)


def main_branch(problem, frequency, harmonics):
    """The estimator and the main curve, as `forced_response` makes them."""
    modal, contact, excitation = problem
    options = SolverOptions(frequency, harmonics=harmonics)
    balance = build_harmonic_balance(modal, contact, excitation, options)
    resonances = find_resonances(balance.receptance, contact, options)
    continuation = Continuation(balance, options, resonances, contact)
    main = continue_over_range(continuation, static_displacement(balance.receptance, contact, options))[0]
    assert main.termination.complete
    return TruncationErrorEstimator(continuation, TruncatedBalances(balance, contact, options)), main


def height(truncation, point):
    return output_amplitude(point, truncation.continuation.options.output)


@pytest.mark.parametrize("method", ["coupled", "static-first"])
def test_force_and_interference_scale_together(method):
    modal, contact, excitation = opening(4, 0.03, 4.0, 0.5)
    larger = replace(contact, interference=1e3 * contact.interference)
    small = solve((modal, contact, excitation), (0.1, 0.7), 1, method=method)
    large = solve((modal, larger, Excitation(excitation.engine_order, 1e3)), (0.1, 0.7), 1, method=method)
    assert 1e-3 < small.truncation_error < 1.0
    assert large.truncation_error == pytest.approx(small.truncation_error, rel=1e-6)


def test_nothing_to_look_at():
    modal, contact, excitation = opening(4, 0.03, 4.0, 0.5)
    truncation, main = main_branch((modal, contact, excitation), (0.1, 0.2), 1)
    assert np.isnan(truncation.of_branch([], []).error)
    assert truncation.along_curve([], []) == {}
    still, main = main_branch((modal, contact, Excitation(4, 0.0)), (0.1, 0.2), 1)
    assert still.of_branch(main.points, main.peak_indices).error == 0.0
    assert not any(still.along_curve(main.points, main.peak_indices).values())


def two_modes(omega2):
    """Two modes that meet a stop beyond a gap; harmonic 5 drives the second mode at a fifth of its frequency."""
    right = np.zeros((3, 2))
    right[2] = 1.0
    model = ReducedModel(
        mass=np.eye(2),
        stiffness=np.diag([1.0, omega2**2]),
        contact_right=right,
        contact_position=np.zeros((1, 3)),
        force_excitation=np.array([1.0, 0.0]),
        outputs={"tip": np.array([1.0, 0.0])},
        n_blades=None,
        producer="test",
    )
    one = np.ones(1)
    contact = ContactParameters(5.0 * one, one, 0.0 * one, -10.0 * one, 0.0 * one)
    return modal_model(model, damping_ratio=0.01), contact, Excitation(0, 1.0)


@pytest.mark.parametrize("omega2", [5.6, 6.0])
def test_a_peak_that_detaches_with_more_harmonics(omega2):
    """With 3 harmonics the curve climbs past the superharmonic resonance of order 5, with more it turns there."""
    truncation, main = main_branch(two_modes(omega2), (0.12, 0.3), 3)
    estimate = truncation.of_branch(main.points, main.peak_indices)
    peak = max(main.points, key=lambda point: height(truncation, point))
    wider, reference = main_branch(two_modes(omega2), (0.12, 0.3), 9)
    top = max(reference.points, key=lambda point: height(wider, point))
    error = abs(height(truncation, peak) / height(wider, top) - 1.0)
    assert estimate.branch == "detached"
    assert error <= 3.0 * estimate.error <= 30.0 * error
    assert estimate.omega == pytest.approx(top.omega, rel=0.01)
    # the motion itself is still there, on an isolated branch, nearly as high
    moved = [truncation.continuation.with_balance(truncation.balances.balance(n)).solver.refit(peak) for n in (5, 9)]
    assert (
        max(abs(height(truncation, peak) / height(truncation, p) - 1.0) for p in moved) <= 3.0 * estimate.motion_error
    )
    assert 3.0 * estimate.motion_error < error


def sampled_way(problem, frequency, harmonics, wider):
    """The way to the highest peak, and the place up to which it is sampled with more harmonics."""
    truncation, main = main_branch(problem, frequency, harmonics)
    index = max(main.peak_indices, key=lambda place: height(truncation, main.points[place]))
    way = way_to_peak(truncation.continuation, main.points, index)
    more = truncation.continuation.with_balance(truncation.balances.balance(wider))
    sampling = WaySampling(way.points, lambda point, shift: more.solver.refit(point))
    return more, sampling, sampling.reached_from(0)


def test_the_way_is_sampled_where_the_branch_only_shifts():
    """All the way to the peak, and every solution lies on the curve that is continued with as many harmonics."""
    problem = opening(4, 0.03, 4.0, 0.5)
    more, sampling, reached = sampled_way(problem, (0.1, 0.7), 3, 5)
    assert reached == sampling.last
    solved = sampling.solved_up_to(reached)
    assert 3 <= len(solved) < len(sampling.points)
    _, reference = main_branch(problem, (0.1, 0.7), 5)
    for point in solved:
        near = min(reference.points, key=lambda each: distance(each, point, point.metric))
        along = distance_along_tangent(near, point)
        if abs(along) > 1e-9:
            near = more.solver.step(near if along > 0.0 else near.reversed(), abs(along))
        assert distance(near, point, point.metric) < 1e-6


def test_the_way_is_not_sampled_across_a_parting():
    _, sampling, reached = sampled_way(two_modes(5.6), (0.12, 0.3), 3, 5)
    assert reached < sampling.last


def test_a_way_that_is_too_long_leaves_the_peak_lost(monkeypatch):
    monkeypatch.setattr("nonlinear.harmonic_selection.truncation_error.RETRACING", (0.0, 5))
    truncation, main = main_branch(two_modes(5.6), (0.12, 0.3), 3)
    assert truncation.of_branch(main.points, main.peak_indices).branch == "lost"


def test_a_detached_branch_has_errors_of_its_own():
    """The isolated branch that the curve with 3 harmonics still reaches; against 9 harmonics."""
    modal, contact, excitation = two_modes(5.6)
    options = SolverOptions((0.12, 0.3), harmonics=5, stability="folds", search="off")
    curve, reference = (
        forced_response(modal, contact, excitation, replace(options, harmonics=n, truncation=n == 5)) for n in (5, 9)
    )
    assert curve.truncation_branch == "kept"
    isola, true = curve.detached[0], reference.detached[0]
    assert isola.peak.amplitude_m > 2.0 * curve.peak.amplitude_m
    assert isola.truncation_branch == "kept"
    error = abs(isola.peak.amplitude_m / true.peak.amplitude_m - 1.0)
    assert error <= 3.0 * isola.truncation_error + 1e-6
    assert isola.truncation_error < 0.5
    assert isola.sampling_error == 0.0
    assert np.isnan(true.truncation_error)
