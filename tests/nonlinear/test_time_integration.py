"""Harmonic balance of one blade against time integration of a whole ring, at points with lift-off and slip."""

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_complex
from nonlinear.harmonic_balance.initial_solution import periodic_start, solve_at
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import modal_model

HARMONICS, PERIODS = 21, 20
MAIN_BRANCH = {"detached": False, "truncation": False, "search": "off"}


def contact(interference, law="two_sliders"):
    return ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.4, interference=interference, law=law
    )


@pytest.mark.parametrize(
    ("n_blades", "interference", "fraction", "law"),
    [
        (2, -6.0, 0.9, "two_sliders"),  # a gap that closes: on the upper stable branch above the free resonance
        (3, -4.0, 0.97, "two_sliders"),  # the same with a travelling wave of 120 degrees
        (3, 0.5, 1.0, "two_sliders"),  # pressed together: stick, slip and partial lift-off
        (2, 0.0, 1.0, "two_sliders"),
        (3, 0.5, 1.0, "cone"),
    ],
)
def test_ring_of_blades(n_blades, interference, fraction, law):
    modal = modal_model(lumped_blade(n_blades), damping_ratio=0.02)
    parameters, excitation = contact(interference, law), Excitation(1, 1.0)
    coarse = forced_response(modal, parameters, excitation, SolverOptions((0.1, 0.8), harmonics=3, **MAIN_BRANCH))
    assert coarse.termination.complete
    # the stable point nearest to a fraction of the peak's frequency, highest amplitude first
    omega = 2.0 * np.pi * fraction * coarse.peak.frequency_hz
    near = np.abs(2.0 * np.pi * coarse.frequency_hz / omega - 1.0) < 0.02
    start = int(np.argmax(np.where(near & coarse.stable, coarse.amplitude_m, 0.0)))
    state, difference = against_the_ring(modal, parameters, excitation, coarse, start)
    assert state.max() == 2  # a hard point: at least one node lifts off
    assert difference < 3e-3


@pytest.mark.parametrize("n_blades", [2, 3])
def test_grazing(n_blades):
    """Where a gap has just begun to close: the contacts touch for a moment of the cycle, one after another."""
    modal = modal_model(lumped_blade(n_blades), damping_ratio=0.02)
    parameters, excitation = contact(-3.0), Excitation(1, 1.0)  # wider gaps make other patterns of the ring unstable
    coarse = forced_response(modal, parameters, excitation, SolverOptions((0.1, 0.8), harmonics=3, **MAIN_BRANCH))
    first = int(np.argmax(coarse.iterations > 0))  # the first point beyond the linear segment without contact
    assert first > 1
    assert coarse.separating[first] == 2
    depth = parameters.interference + np.abs(coarse.relative_displacement[first, 1, :, 2])
    assert 0.0 < depth.max() < 0.05 * np.abs(parameters.interference).max()
    _, difference = against_the_ring(modal, parameters, excitation, coarse, first)
    assert difference < 1e-3


def against_the_ring(modal, parameters, excitation, coarse, start):
    """States of the nodes at a point of a curve, and its relative difference from a ring integrated in time."""
    omega = 2.0 * np.pi * coarse.frequency_hz[start]
    options = SolverOptions((0.1, 0.8), harmonics=HARMONICS)
    balance = build_harmonic_balance(modal, parameters, excitation, options)
    guess = np.zeros((2 * HARMONICS + 1, 2, 3))
    for h in range(4):
        value = coarse.relative_displacement[start, h]
        if h == 0:
            guess[0] = value.real
        else:
            guess[2 * h - 1], guess[2 * h] = value.real, value.imag
    result = solve_at(balance, omega, guess.reshape(-1), options)
    assert result.converged
    solved = result.solution
    integrator = RingIntegrator.of(Ring(modal, parameters, excitation), omega, retention=200.0)
    displacement = balance.displacement(solved)
    integrated = integrator.march(integrator.on_wave(displacement), PERIODS).output_m[-1]
    balanced = integrator.wave_output(displacement)
    difference = np.max(np.abs(integrated - balanced)) / np.max(np.abs(balanced))
    return balance.forces(solved).state, difference


def test_start_finds_the_same_solution_as_the_curve():
    modal = modal_model(lumped_blade(3), damping_ratio=0.02)
    options = SolverOptions((0.2, 0.8), harmonics=3, **MAIN_BRANCH)
    curve = forced_response(modal, contact(0.5), Excitation(1, 1.0), options)
    balance = build_harmonic_balance(modal, contact(0.5), Excitation(1, 1.0), options)
    at = int(np.argmin(np.abs(curve.frequency_hz - 0.3)))
    start = periodic_start(balance, 2.0 * np.pi * curve.frequency_hz[at], np.zeros((2, 3)), options)
    assert start.converged
    assert to_complex(balance.displacement(start.solution)) == pytest.approx(
        curve.relative_displacement[at], abs=1e-8
    )
