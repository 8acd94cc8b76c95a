"""The sampling error of a peak (AFT): against curves solved with the event-driven element and with many samples."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import modal_model

MANY = 65536  # samples whose own error is far below those that are estimated
FACTOR = 2.0  # between the estimate and the true error
RESOLVED = 1e-6  # relative differences below this are those of the located peaks
CASES = {  # interference and frequency range: contacts that open and close; that stick and slip; that do both
    "separation": (-1.5, (0.14, 0.24)),
    "stick and slip": (6.0, (0.3, 0.5)),
    "both": (0.2, (0.17, 0.21)),
}


def problem(case, law="two_sliders"):
    interference, frequency = CASES[case]
    modal = modal_model(lumped_blade(6, 1), damping_ratio=0.02)
    contact = ContactParameters.shared(
        1, normal_stiffness=3.0, tangential_stiffness=2.0, friction=0.3, interference=interference, law=law
    )
    options = SolverOptions(frequency, detached=False, stability="folds", truncation=False)
    return modal, contact, Excitation(2, 1.0), options


@cache
def solved(case, law="two_sliders", **changes):
    *parts, options = problem(case, law)
    return forced_response(*parts, replace(options, **changes))


def errors(curve, truth):
    """True and estimated relative errors of the peak: amplitude, frequency."""
    amplitude = abs(curve.peak.amplitude_m / truth.peak.amplitude_m - 1.0)
    frequency = abs(curve.peak.frequency_hz / truth.peak.frequency_hz - 1.0)
    return (amplitude, curve.sampling_error), (frequency, curve.sampling_frequency_error)


@pytest.mark.parametrize(
    ("case", "law", "samples"),
    [
        ("separation", "two_sliders", (16, 64)),
        ("stick and slip", "two_sliders", (16, 32, 64, 256)),
        ("stick and slip", "cone", (16, 64)),
        ("both", "two_sliders", (16, 64)),
        ("both", "cone", (16,)),
    ],
)
def test_estimated_and_true_error(case, law, samples):
    """With few and with many samples, against the peak of a curve that is event-driven from end to end."""
    truth = solved(case, law)
    assert truth.termination.complete
    assert truth.slipping.max() + truth.separating.max() > 0
    for number in samples:
        curve = solved(case, law, integration="sampled", samples=number)
        for true, estimated in errors(curve, truth):
            assert true <= FACTOR * estimated + RESOLVED
            assert estimated <= FACTOR * true + RESOLVED
        if number == 16:
            assert max(curve.sampling_error, curve.sampling_frequency_error) > 4e-3
            assert np.nanmax(curve.energy_error) < 1e-8  # which tells nothing of it


def test_against_many_samples():
    """The truth without the event-driven element."""
    truth = solved("stick and slip", integration="sampled", samples=MANY)
    assert truth.sampling_error < 1e-5
    for true, estimated in errors(solved("stick and slip", integration="sampled", samples=16), truth):
        assert true == pytest.approx(estimated, rel=0.02)


def test_event_driven_integration_has_no_sampling_error():
    curve = solved("both")
    assert (curve.sampling_error, curve.sampling_frequency_error) == (0.0, 0.0)


def test_a_linear_peak_has_no_sampling_error():
    """Contacts that stay open: few samples integrate them exactly."""
    modal, contact, excitation, options = problem("separation")
    apart = replace(contact, interference=np.full(1, -1e3))
    curve = forced_response(modal, apart, excitation, replace(options, integration="sampled", samples=16))
    assert curve.peak.located
    assert curve.sampling_error < 1e-9
    assert curve.sampling_frequency_error < 1e-6


def test_an_end_of_the_range_has_an_amplitude_error_only():
    """The highest point at the end of a range below the peak."""
    whole = solved("stick and slip")
    half = {"frequency_hz": (0.3, 0.995 * whole.peak.frequency_hz)}
    truth = solved("stick and slip", **half)
    curve = solved("stick and slip", integration="sampled", samples=16, **half)
    assert not truth.peak.located
    assert not curve.peak.located
    (true, estimated), (_, of_frequency) = errors(curve, truth)
    assert true > 1e-3
    assert estimated == pytest.approx(true, rel=1e-6)
    assert of_frequency == 0.0


def test_with_a_frozen_static_displacement():
    changes = {"method": "static-first"}
    truth = solved("stick and slip", **changes)
    true, estimated = errors(solved("stick and slip", integration="sampled", samples=16, **changes), truth)[0]
    assert true > 1e-3
    assert 1.0 / FACTOR < estimated / true < FACTOR


def test_with_adaptive_harmonics_the_peak_keeps_its_harmonics():
    """The estimate is the one of a curve that has the harmonics of the peak all along."""
    adaptive = solved("stick and slip", integration="sampled", samples=48, harmonics="auto", harmonic_tolerance=5e-3)
    kept = int(adaptive.kept_harmonics[adaptive.peak.index])
    fixed = solved("stick and slip", integration="sampled", samples=48, harmonics=kept)
    assert kept > 1
    assert fixed.sampling_error > 1e-4
    assert adaptive.sampling_error == pytest.approx(fixed.sampling_error, rel=1e-3)


def test_a_curve_that_was_given_up_is_climbed_to_its_peak():
    """Its highest point is its last one, but no end of the range."""
    modal, contact, excitation, options = problem("stick and slip")
    truth, whole = solved("stick and slip"), solved("stick and slip", integration="sampled", samples=16)
    few = replace(options, integration="sampled", samples=16, max_points=whole.peak.index - 1)
    curve = forced_response(modal, contact, excitation, few)
    assert not curve.termination.complete
    assert curve.amplitude_m.max() < whole.peak.amplitude_m
    assert curve.sampling_error == pytest.approx(abs(curve.peak.amplitude_m / truth.peak.amplitude_m - 1.0), rel=1e-6)
