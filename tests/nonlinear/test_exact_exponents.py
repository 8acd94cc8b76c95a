"""Floquet exponents of rings against the exact monodromy matrix of all blades, and against published digits."""

from dataclasses import replace

import numpy as np
import pytest
from exact_ring import ExactRing
from period_map import PeriodMap
from scipy.linalg import expm
from scipy.optimize import brentq

from nonlinear import BifurcationKind, ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_receptance import ring_in_time
from nonlinear.options import TRUNCATION_TOLERATED
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.eigenproblem import Refined, all_refined
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.time_integration.ring import Ring, RingState, whole_ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import integrate_ring
from nonlinear.worst_motion.ring_branch import ring_branch
from nonlinear.worst_motion.ring_integration import RingIntegration, RingPatterns
from rom import ReducedModel, modal_model

# blades, force, omega, amplitude of harmonic 1, exponents in the strip: c 0.01, kn 0.6, v0 0.1, engine order 1
RINGS = {
    5: (0.2, 1.25, 1.897508, (-0.005 + 0.046295j, -0.005 + 0.250013j, 0.044408 + 0.105431j, -0.054408 + 0.105431j)),
    6: (0.2, 1.4, 0.364661, (-0.005 + 0.230392j, -0.005 + 0.024197j, -0.005 + 0.22578j, 0.099004, -0.109004)),
}


def problem(blades, force, engine_order=1, stiffness=0.6, interference=0.1, damping_ratio=0.005):
    """One mass on a spring a blade, with one node on either face that moves with it along the normal."""
    one, face = np.ones(1), np.eye(3)[:, 2:]
    model = ReducedModel(np.eye(1), np.eye(1), face, np.zeros((1, 3)), one, {"tip": one}, face, n_blades=blades)
    contact = ContactParameters.shared(
        1, normal_stiffness=stiffness, tangential_stiffness=0.0, friction=0.0, interference=interference
    )
    return (
        modal_model(model, damping_ratio=damping_ratio),
        contact,
        Excitation(engine_order=engine_order, force=force),
    )


@pytest.mark.parametrize("blades", RINGS)
def test_exponents_of_the_whole_ring(blades):
    """Tuned and mistuned: the largest growth rate of Hill's method and the exact one; the published exponents."""
    force, omega, amplitude, exponents = RINGS[blades]
    modal, contact, excitation = problem(blades, force)
    hertz = omega / (2.0 * np.pi)
    options = SolverOptions((hertz, 1.0005 * hertz), harmonics=7, stability="folds", detached=False, truncation=False)
    tuned = forced_response(modal, contact, excitation, replace(options, search="off"))
    turns = np.exp(2j * np.pi * np.outer(np.arange(8), np.arange(blades)) / blades)[..., None, None]
    guess = to_real(tuned.relative_displacement[0][:, None] * turns).reshape(15, blades, 3)
    for deviations in (Mistuning.of(blades), Mistuning.sampled(blades, 2, frequency=1e-3)):
        whole = whole_ring(modal, excitation, 1.0 + deviations.frequency), deviations.contact(contact)
        balance = build_harmonic_balance(*whole, excitation, options)
        solved = solve_at(balance, omega, balance.unknown(guess), options)
        assert solved.converged
        motion = balance.displacement(solved.solution)
        growth = RingPatterns(Ring(*whole, excitation, "tip_0"), options, omega, motion).growth_rate(0)
        own = to_real(to_complex(motion).reshape(8, blades, 1, 3) / turns)
        integrator = RingIntegrator.of(ring_in_time(modal, contact, excitation, deviations), omega)
        state = integrator.on_wave(own.reshape(15, blades, 3))
        ring = ExactRing(1.0 + deviations.frequency, 0.01, 0.6, 0.1, force, omega)
        _, found = ring.periodic(np.concatenate([state.coordinates.ravel(), state.rates.ravel()]))
        assert growth == pytest.approx(found.real.max(), abs=4e-5)
        analysis, jacobian = (
            FloquetAnalysis.of(balance.receptance, whole[1]),
            balance.element.evaluate(motion).jacobian,
        )
        for beside in (-1e-4, 1e-4):
            assert analysis.is_stable(motion, jacobian, omega, found.real.max() + beside) == (beside > 0.0)
        by_map = PeriodMap(integrator, state)
        marched = by_map.exponents(by_map.fixed_point(by_map.start)[1])
        assert marched[0].real == pytest.approx(found.real.max(), rel=0.012)
        if not deviations.frequency.any():
            assert tuned.harmonic_m[0, 0] == pytest.approx(amplitude, rel=1e-4)
            for exponent in exponents:
                assert np.abs(found - exponent).min() < 2e-6


def test_equal_eigenvalues_of_blades_apart_are_refined_once():
    refined = list[complex]()
    starts = np.array([0.1 + 0.2j, -0.3, 0.1 + 0.2j, 0.1 - 0.2j, -0.3 + 1e-15])
    found = all_refined(lambda value: refined.append(value) or Refined(value), starts, True)
    assert len(refined) == 2
    assert found[np.argsort(found.imag)] == pytest.approx([0.1 - 0.2j, -0.3, 0.1 + 0.2j])


def test_a_localised_motion_by_harmonic_balance():
    """One of four blades high: the top of its branch is as high as in the exact ring, which keeps it."""
    omega = 1.12
    modal, contact, excitation = problem(4, 0.02, engine_order=2, stiffness=0.4, interference=-0.5)
    ring, options = Ring(modal, contact, excitation), SolverOptions((0.13, 0.24), harmonics=3)
    integration = RingIntegration(ring, options)
    rest = integration.coarse(omega, 1).at_rest()
    start = replace(rest, rates=np.array([[1.5 * omega], [0.0], [0.0], [0.0]]))
    motion = integrate_ring(ring, omega, start, nodal_diameter=1, limits=integration.limits(400, 0.0))
    branch = ring_branch(integration, omega / (2.0 * np.pi), motion)
    assert branch is not None
    heights = branch.top(motion)
    assert heights.amplitude_m > 1.05 * motion.amplitude_m
    assert heights.lowest_m < 0.1 * heights.amplitude_m
    known = ring_branch(integration, omega / (2.0 * np.pi), motion, 2.0 * heights.amplitude_m)
    assert known.places == branch.places  # whether a lower one persists does not matter: it is not looked at
    assert known.truncation_error == TRUNCATION_TOLERATED > 2.0 * branch.truncation_error
    top = 2.0 * np.pi * branch.top_hz
    state = np.concatenate([motion.final.coordinates.ravel(), motion.final.rates.ravel()])
    exact, found = ExactRing(np.ones(4), 0.01, 0.4, -0.5, 0.02, top, 2).periodic(state)
    assert found.real.max() < 0.0
    again = RingState(*exact.reshape(2, 4, 1), rest.slider, rest.force)
    _, output = RingIntegrator.of(ring, top, nodal_diameter=1).history(again)
    assert np.sort(np.abs(output).max(axis=0)) == pytest.approx(np.sort(branch.heights_m), abs=2e-3)


@pytest.mark.parametrize(
    ("omega", "exact"), [(0.9764, 0.01753), (0.9834, 0.03256), (0.9939, 0.047), (1.0035, 0.05648)]
)
def test_stiff_contacts_that_hit(omega, exact):
    """Hits of a twelfth of a period: the sign, and the rate within its estimated error of the exact one."""
    modal, contact, excitation = problem(4, 0.08, stiffness=15.0, interference=-0.2, damping_ratio=0.01)
    hertz = omega / (2.0 * np.pi)
    options = SolverOptions(
        (0.9 * hertz, 1.05 * hertz), harmonics=21, stability="folds", detached=False, search="off"
    )
    curve = forced_response(modal, contact, excitation, replace(options, truncation=False))
    index = int(np.flatnonzero(np.diff(np.sign(curve.frequency_hz - hertz)))[0])
    balance = build_harmonic_balance(modal, contact, excitation, options)
    found = solve_at(balance, omega, balance.unknown(to_real(curve.relative_displacement[index])), options)
    patterns = RingPatterns(Ring(modal, contact, excitation), options, omega, balance.displacement(found.solution))
    worst = patterns.worst()
    assert worst.nodal_diameter == 1
    assert worst.exponent.real == pytest.approx(exact, abs=patterns.rate_error(1))
    assert 0.0 < patterns.rate_error(1) < 0.005


STOP = ContactParameters.shared(1, normal_stiffness=100.0, tangential_stiffness=0.0, friction=0.0, interference=-1.0)


def two_masses(**options):
    """Response of example 03 of NLvib: two masses, the first against a stop."""
    stop, output = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]]), np.array([0.0, 1.0])
    stiffness = np.array([[1.0, -1.0], [-1.0, 2.0]])
    model = ReducedModel(np.eye(2), stiffness, stop, np.zeros((1, 3)), output, {"tip": output}, None)
    options = SolverOptions((0.08, 0.127), truncation=False, **options)
    return forced_response(modal_model(model, rayleigh=(0.0, 0.03)), STOP, Excitation(0, 0.1), options)


def test_two_masses_against_a_stop_a_hundred_times_stiffer():
    """Where the period doubles, exact from event to event, and the fold."""
    curve = two_masses(harmonics=31, detached=False, search="off")
    places = {kind: [b.frequency_hz for b in curve.bifurcations if b.kind is kind] for kind in BifurcationKind}
    assert places[BifurcationKind.PERIOD_DOUBLING] == pytest.approx([0.117581, 0.12025], rel=3e-4)
    assert max(places[BifurcationKind.FOLD]) == pytest.approx(0.120262, rel=1e-5)


def heights_of_two_masses(omega, state, periods, steps=100):
    """Largest displacement of the second mass in each period, and the state at the end: exact between events.

    State: x, x', 1, cos(w t), -sin(w t).
    """
    generators = []
    for closed in (0.0, 100.0):
        generator = np.zeros((7, 7))
        generator[:2, 2:4] = np.eye(2)
        generator[2:4, :2] = [[-1.0 - closed, 1.0], [1.0, -2.0]]
        generator[2:4, 2:4] = 0.03 * np.array([[-1.0, 1.0], [1.0, -2.0]])
        generator[2, 4], generator[3, 5], generator[5, 6], generator[6, 5] = closed, 0.1, omega, -omega
        generators.append(generator)
    step, heights = 2.0 * np.pi / omega / steps, []
    whole = [expm(generator * step) for generator in generators]
    for _ in range(periods):
        highest = 0.0
        for _ in range(steps):
            closed = int(state[0] > 1.0)
            after = whole[closed] @ state
            if closed != int(after[0] > 1.0):
                time = _event(generators[closed], state, step)
                after = expm(generators[1 - closed] * (step - time)) @ expm(generators[closed] * time) @ state
            state, highest = after, max(highest, abs(after[1]))
        heights.append(highest)
    return heights, state


def _event(generator, state, step):
    """When the first mass comes to the stop or leaves it."""
    return brentq(lambda time: (expm(generator * time) @ state)[0] - 1.0, 0.0, step, xtol=1e-13)


def test_the_worst_motion_of_two_masses_repeats_after_two_periods():
    """Against the exact motion, swept up to its frequency; 2 % higher with steps longer than a hit."""
    worst = two_masses(harmonics=15).worst
    assert worst.motion == "subharmonic 1:2"
    state, top = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0]), 2.0 * np.pi * worst.frequency_hz
    for omega in np.linspace(0.8 * top, top, 60):
        _, state = heights_of_two_masses(omega, state, 10)
    _, state = heights_of_two_masses(top, state, 300)
    heights, _ = heights_of_two_masses(top, state, 4, steps=1000)
    assert worst.amplitude_m == pytest.approx(max(heights), rel=1e-3)
    assert heights[:2] == pytest.approx(heights[2:], rel=1e-6)
    assert heights[0] != pytest.approx(heights[1], rel=1e-2)


@pytest.mark.parametrize("harmonics", [2, 3])
def test_a_height_whose_stability_the_harmonics_do_not_decide_is_marked(harmonics):
    """A ring of four that hits: few harmonics have no motion that more confirm, and the ring leaves theirs."""
    one, face = np.ones(1), np.eye(3)[:, 2:]
    model = ReducedModel(np.eye(1), np.eye(1), face, np.zeros((1, 3)), one, {"tip": one}, face, n_blades=4)
    _, contact, excitation = problem(4, 0.08, stiffness=15.0, interference=-0.2)
    options = SolverOptions((0.143, 0.156), harmonics=harmonics, detached=False, truncation=False)
    curve = forced_response(modal_model(model, damping_ratio=0.01), contact, excitation, options)
    assert curve.worst.motion == "periodic"
    assert "and the ring leaves it" in curve.worst.unresolved
