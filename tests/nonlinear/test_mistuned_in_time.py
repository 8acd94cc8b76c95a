"""A mistuned ring in time and as one structure: against central differences, and against the tuned ring."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade
from test_mistuned_ring import chain_blade, chain_contact, stepped_amplitudes

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.mistuned_ring import mistuned_curve as module
from nonlinear.mistuned_ring.mistuned_curve import mistuned_curve
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_receptance import ring_in_time
from nonlinear.mistuned_ring.ring_response import mistuned_response
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import modal_model

CONTACT = ContactParameters.shared(
    2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.4, interference=0.2, preload=0.1
)


def test_different_blades_with_sliders_against_central_differences():
    """Frequencies, friction and stiffness differ: the amplitude of each blade, with an error of second order."""
    deviations = Mistuning.of(4, frequency=[0.02, -0.03, 0.01, 0.04], stiffness=[0.1, 0.0, -0.2, 0.05])
    deviations = replace(deviations, friction=np.array([0.0, 0.3, -0.2, 0.1]))
    problem = chain_blade(4, 0.04), chain_contact(0.3, 0.25), Excitation(engine_order=1, force=0.3)
    stepped = stepped_amplitudes(deviations, 0.3, 0.25, 1.12)
    integrator = RingIntegrator.of(ring_in_time(*problem, deviations), 1.12, finer=2)
    assert integrator.n_blades == 4
    assert integrator.march(integrator.at_rest(), 60).envelope_m[-1] == pytest.approx(stepped, rel=6e-5)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_without_deviations_it_is_the_tuned_ring(law):
    """The same motion, with slip and lift-off, from the same state of the same wave; high modes follow at once."""
    contact, excitation = replace(CONTACT, law=law), Excitation(2, 1.0)
    modal = modal_model(lumped_blade(5, 2), damping_ratio=0.02)
    tuned = RingIntegrator.of(Ring(modal, contact, excitation), 0.9, nodal_diameter=1)
    apart = RingIntegrator.of(ring_in_time(modal, contact, excitation, Mistuning.of(5)), 0.9)
    assert not tuned.structure.retained.all()
    assert (apart.n_blades, apart.steps) == (5, tuned.steps)
    wave = 0.3 * np.random.default_rng(1).standard_normal((5, 2, 3))
    start, other = tuned.on_wave(wave), apart.on_wave(np.tile(wave, (1, 5, 1)))
    for name in ("coordinates", "rates", "slider", "force"):
        np.testing.assert_allclose(getattr(other, name), getattr(start, name), atol=1e-13)
    every = np.tile(wave, (1, 5, 1))
    np.testing.assert_allclose(apart.wave_output(every), tuned.wave_output(wave), atol=1e-13)
    found, expected = apart.march(other, 10).output_m, tuned.march(start, 10).output_m
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


GAP = replace(CONTACT, interference=np.full(2, -0.4), preload=np.zeros(2))
PROBLEM = modal_model(lumped_blade(4, 2), damping_ratio=0.02), GAP, Excitation(2, 0.3)
OPTIONS = SolverOptions((0.1935, 0.1955), harmonics=3, detached=False, truncation=False)


def whole_curve(deviations, monkeypatch, options=OPTIONS, small=True):
    monkeypatch.setattr(module, "MOST_UNKNOWNS", 10_000 if small else 0)
    return mistuned_curve(*PROBLEM, options, deviations, mistuned_response(*PROBLEM, options, deviations))


@pytest.fixture(scope="module")
def tuned():
    """The response of the tuned ring."""
    return forced_response(*PROBLEM, OPTIONS)


@pytest.mark.parametrize("small", [True, pytest.param(False, marks=pytest.mark.long)])
def test_without_deviations_the_worst_motion_is_that_of_the_tuned_ring(tuned, small, monkeypatch):
    """Where travelling waves are unstable: they grow as fast, and by either way the ring gets as high."""
    ring = whole_curve(Mistuning.of(4), monkeypatch, small=small)
    assert ring.peak.amplitude_m == pytest.approx(tuned.peak.amplitude_m, rel=1e-6)
    assert tuned.worst.motion != "periodic"
    assert ring.worst.motion != "periodic"
    assert tuned.worst.amplitude_m > 1.1 * tuned.peak.amplitude_m
    assert ring.worst.amplitude_m == pytest.approx(tuned.worst.amplitude_m, rel=0.12)  # irregular
    if small:
        assert not tuned.stable.any()
        assert not ring.stable.any()
        growth = np.interp(tuned.frequency_hz, ring.frequency_hz, ring.growth_rate)
        assert (growth > 0.98 * tuned.growth_rate).all()  # that of the tuned ring may follow a slower pattern
