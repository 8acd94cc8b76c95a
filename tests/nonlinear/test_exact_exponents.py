"""Floquet exponents of rings against the exact monodromy matrix of all blades, and against published digits."""

from dataclasses import replace

import numpy as np
import pytest
from ring_monodromy import ImpactingRing

from nonlinear import (
    ContactParameters,
    Excitation,
    Mistuning,
    Ring,
    RingIntegrator,
    RingPatterns,
    SolverOptions,
    build_harmonic_balance,
    forced_response,
)
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.mistuned_ring.mistuned_curve import whole_ring
from nonlinear.mistuned_ring.ring_receptance import ring_in_time
from rom import ReducedModel, modal_model

# blades, force, omega, amplitude of harmonic 1, exponents in the strip: c 0.01, kn 0.6, v0 0.1, engine order 1
RINGS = {
    5: (0.2, 1.25, 1.897508, (-0.005 + 0.046295j, -0.005 + 0.250013j, 0.044408 + 0.105431j, -0.054408 + 0.105431j)),
    6: (0.2, 1.4, 0.364661, (-0.005 + 0.230392j, -0.005 + 0.024197j, -0.005 + 0.22578j, 0.099004, -0.109004)),
}


def problem(blades, force):
    """One mass on a spring a blade, with one node on either face that moves with it along the normal."""
    one, face = np.ones(1), np.eye(3)[:, 2:]
    model = ReducedModel(np.eye(1), np.eye(1), face, np.zeros((1, 3)), one, {"tip": one}, face, n_blades=blades)
    contact = ContactParameters.shared(
        1, normal_stiffness=0.6, tangential_stiffness=0.0, friction=0.0, interference=0.1
    )
    return modal_model(model, damping_ratio=0.005), contact, Excitation(engine_order=1, force=force)


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
        whole = whole_ring(modal, contact, excitation, deviations)
        balance = build_harmonic_balance(*whole, excitation, options)
        solved = solve_at(balance, omega, balance.unknown(guess), options)
        assert solved.converged
        motion = balance.displacement(solved.solution)
        growth = RingPatterns(Ring(*whole, excitation, "tip_0"), options, omega, motion).growth_rate(0)
        own = to_real(to_complex(motion).reshape(8, blades, 1, 3) / turns)
        integrator = RingIntegrator.of(ring_in_time(modal, contact, excitation, deviations), omega)
        state = integrator.on_wave(own.reshape(15, blades, 3))
        ring = ImpactingRing(1.0 + deviations.frequency, 0.01, 0.6, 0.1, force, omega)
        found = ring.exponents(np.concatenate([state.coordinates.ravel(), state.rates.ravel()]))
        assert growth == pytest.approx(found.real.max(), abs=4e-5)
        if not deviations.frequency.any():
            assert tuned.harmonic_m[0, 0] == pytest.approx(amplitude, rel=1e-4)
            for exponent in exponents:
                assert np.abs(found - exponent).min() < 2e-6
