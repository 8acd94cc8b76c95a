"""Harmonic balance of one blade against time integration of a whole ring, at points with lift-off and slip."""

import numpy as np
import pytest
from lumped import lumped_blade
from ring_integration import integrate_ring

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response, harmonic_balance
from nonlinear.fourier import to_complex
from nonlinear.start import periodic_start, solve_at
from rom import modal_model

HARMONICS, PERIODS, STEPS = 21, 40, 2000


def contact(interference):
    return ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.4, interference=interference
    )


@pytest.mark.parametrize(
    ("n_blades", "interference", "fraction"),
    [
        (2, -6.0, 0.9),  # a gap that closes: on the upper stable branch above the free resonance
        (3, -4.0, 0.97),  # the same with a travelling wave of 120 degrees
        (3, 0.5, 1.0),  # pressed together: stick, slip and partial lift-off
        (2, 0.0, 1.0),
    ],
)
def test_ring_of_blades(n_blades, interference, fraction):
    modal = modal_model(lumped_blade(n_blades), damping_ratio=0.02)
    parameters, excitation = contact(interference), Excitation(1, 1.0)
    coarse = forced_response(modal, parameters, excitation, SolverOptions((0.1, 0.8), harmonics=3))
    assert coarse.outcome.complete
    # the stable point nearest to a fraction of the peak's frequency, highest amplitude first
    omega = 2.0 * np.pi * fraction * coarse.peak.frequency_hz
    near = np.abs(2.0 * np.pi * coarse.frequency_hz / omega - 1.0) < 0.02
    start = int(np.argmax(np.where(near & coarse.stable, coarse.amplitude_m, 0.0)))
    omega = 2.0 * np.pi * coarse.frequency_hz[start]

    options = SolverOptions((0.1, 0.8), harmonics=HARMONICS)
    balance = harmonic_balance(modal, parameters, excitation, options)
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
    force = to_complex(balance.forces(solved).force.reshape(2 * HARMONICS + 1, -1))
    coordinates, _ = balance.receptance.modal_response(omega, force)
    displacement = to_complex(balance.displacement(solved))
    state = balance.forces(solved).state
    assert state.max() == 2  # a hard point: at least one node lifts off

    theta = 2.0 * np.pi * np.arange(STEPS) / STEPS
    harmonics = coordinates @ modal.outputs["tip"]
    balanced = (np.exp(1j * np.outer(theta, np.arange(HARMONICS + 1))) @ harmonics).real
    marched = integrate_ring(
        modal,
        parameters,
        (omega, coordinates, displacement),
        engine_order=1,
        force=1.0,
        periods=PERIODS,
        steps_per_period=STEPS,
    )
    # the last sample is theta = 2 pi: it belongs at theta = 0
    assert np.max(np.abs(np.roll(marched, 1) - balanced)) < 3e-3 * np.max(np.abs(balanced))


def test_start_finds_the_same_solution_as_the_curve():
    modal = modal_model(lumped_blade(3), damping_ratio=0.02)
    options = SolverOptions((0.2, 0.8), harmonics=3)
    curve = forced_response(modal, contact(0.5), Excitation(1, 1.0), options)
    balance = harmonic_balance(modal, contact(0.5), Excitation(1, 1.0), options)
    at = int(np.argmin(np.abs(curve.frequency_hz - 0.3)))
    start = periodic_start(balance, 2.0 * np.pi * curve.frequency_hz[at], np.zeros((2, 3)), options)
    assert start.converged
    assert to_complex(balance.displacement(start.solution)) == pytest.approx(
        curve.relative_displacement[at], abs=1e-8
    )
