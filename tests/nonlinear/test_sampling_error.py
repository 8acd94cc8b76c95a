"""The sampling error of a peak (AFT): against curves solved with the event-driven element and with many samples."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from rom import modal_model

MANY = 8192  # samples whose own error is far below those that are estimated
FACTOR = 2.0  # between the estimate and the true error
RESOLVED = 1e-6  # relative differences below this are those of the located peaks
CASES = {  # interference, harmonics: contacts that open and close; that stick and slip; that do both
    "separation": (-1.5, 3),
    "stick and slip": (6.0, 1),
    "both": (0.2, 3),
}


def problem(case, law="two_sliders"):
    interference, harmonics = CASES[case]
    modal = modal_model(lumped_blade(6, 1), damping_ratio=0.02)
    contact = ContactParameters.shared(
        1, normal_stiffness=3.0, tangential_stiffness=2.0, friction=0.3, interference=interference, law=law
    )
    options = SolverOptions((0.1, 0.5), harmonics=harmonics, detached=False, stability="folds", truncation=False)
    return modal, contact, Excitation(2, 1.0), options


def solved(case, law="two_sliders", **changes):
    *parts, options = problem(case, law)
    return forced_response(*parts, replace(options, **changes))


def errors(curve, truth):
    """True and estimated relative errors of the peak: amplitude, frequency."""
    amplitude = abs(curve.peak.amplitude_m / truth.peak.amplitude_m - 1.0)
    frequency = abs(curve.peak.frequency_hz / truth.peak.frequency_hz - 1.0)
    return (amplitude, curve.sampling_error), (frequency, curve.sampling_frequency_error)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("case", CASES)
def test_estimated_and_true_error(case, law):
    """With few and with many samples, against the peak of a curve that is event-driven from end to end."""
    truth = solved(case, law)
    assert truth.termination.complete
    assert truth.slipping.max() + truth.separating.max() > 0
    largest = 0.0
    for samples in (16, 32, 64, 256):
        for true, estimated in errors(solved(case, law, integration="sampled", samples=samples), truth):
            assert true <= FACTOR * estimated + RESOLVED
            assert estimated <= FACTOR * true + RESOLVED
            largest = max(largest, true)
    assert largest > 3e-3  # an error that matters


@pytest.mark.parametrize("case", CASES)
def test_against_many_samples(case):
    """The truth without the event-driven element."""
    truth = solved(case, integration="sampled", samples=MANY)
    assert truth.sampling_error < 1e-5
    for true, estimated in errors(solved(case, integration="sampled", samples=16), truth):
        assert true == pytest.approx(estimated, rel=0.05, abs=3e-5)


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
    half = {"frequency_hz": (0.1, 0.97 * whole.peak.frequency_hz)}
    truth = solved("stick and slip", **half)
    curve = solved("stick and slip", integration="sampled", samples=16, **half)
    assert not truth.peak.located
    assert not curve.peak.located
    (true, estimated), (_, of_frequency) = errors(curve, truth)
    assert true > 1e-4
    assert estimated == pytest.approx(true, rel=1e-6)
    assert of_frequency == 0.0


def test_with_a_frozen_static_displacement_and_adaptive_harmonics():
    for changes in ({"method": "static-first"}, {"harmonics": "auto", "harmonic_tolerance": 1e-2}):
        truth = solved("both", **changes)
        curve = solved("both", integration="sampled", samples=16, **changes)
        true, estimated = errors(curve, truth)[0]
        assert true > 1e-3
        assert estimated == pytest.approx(true, rel=1.0)


def test_no_points_no_estimate():
    modal, contact, excitation, options = problem("both")
    pinned = replace(options, integration="sampled", samples=16, max_points=1)
    curve = forced_response(modal, contact, excitation, pinned)
    assert not curve.termination.complete
    assert curve.sampling_error >= 0.0  # of the only point, an end of the range
