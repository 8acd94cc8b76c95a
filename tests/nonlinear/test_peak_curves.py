"""Peaks followed over a parameter: closed form of a mass with a slider, derivatives, brute force."""

import numpy as np
import pytest
from lumped import lumped_blade, oscillator

from nonlinear import ContactParameters, Excitation, OptionsError, SolverOptions, find_optimum, forced_response
from nonlinear.peak_curves.parameter_family import ParameterFamily, parameter_value, with_parameter
from nonlinear.peak_curves.peak_curve import PeakContinuation
from nonlinear.peak_curves.peak_derivatives import peak_derivatives
from rom import modal_model

QUICK = {"detached": False, "stability": "folds", "truncation": False, "time_integration": False}


def slider(preload: float = 1.2, harmonics: int = 1):
    """A mass on a spring with a slider to ground, all ones, no other damping."""
    modal = modal_model(oscillator(), damping_ratio=1e-13)
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=1.0, preload=preload
    )
    return modal, contact, Excitation(0, 1.0), SolverOptions((0.1, 0.25), harmonics=harmonics, **QUICK)


def closed_form(limit: np.ndarray) -> np.ndarray:
    """Amplitude of the peak under unit force and stiffness, for a limit of the slider above pi/4."""
    return limit**2 / (limit - np.pi / 4.0)


def test_optimum_of_a_slider_in_closed_form() -> None:
    """X = r^2 / (r - pi/4) is least at r = pi/2: X = pi, omega^2 = 3/2, d2X/dr2 = 8/pi, dX/dP = X, dX/dkt = -X."""
    found = find_optimum(slider(), "preload", 1.0, 3.0)
    assert found.kind == "smooth"
    assert found.value == pytest.approx(np.pi / 2.0, rel=1e-9)
    assert found.amplitude_m == pytest.approx(np.pi, rel=1e-10)
    assert 2.0 * np.pi * found.frequency_hz == pytest.approx(np.sqrt(1.5), rel=1e-8)
    assert found.curvature == pytest.approx(8.0 / np.pi, rel=1e-4)
    assert found.derivatives["force"] == pytest.approx(np.pi, rel=1e-8)
    assert found.derivatives["tangential_stiffness"] == pytest.approx(-np.pi, rel=1e-8)
    assert found.derivatives["preload"] == pytest.approx(0.0, abs=1e-8)
    limits = np.linspace(1.0, 3.0, 23)
    np.testing.assert_allclose(found.envelope(limits), closed_form(limits), rtol=2e-5)
    within = np.array(found.within)
    np.testing.assert_allclose(closed_form(within), 1.1 * np.pi, rtol=5e-3)
    every = [point for piece in found.pieces for point in piece.points]
    exact = closed_form(np.array([found.family.value(point.share) for point in every]))
    np.testing.assert_allclose([point.amplitude for point in every], exact, rtol=1e-9)


@pytest.mark.parametrize(("harmonics", "limit", "first"), [(3, 1.54194, 3.13789), (9, 1.54601, 3.13908)])
def test_least_first_harmonic_with_more_harmonics(harmonics: int, limit: float, first: float) -> None:
    """Values of another program for the amplitude of harmonic 1 alone."""
    amplitudes = []
    for factor in (0.99, 1.0, 1.01):
        curve = forced_response(*slider(factor * limit, harmonics))
        amplitudes.append(curve.harmonic_m[:, 0].max())
    assert amplitudes[1] == pytest.approx(first, abs=2e-5)
    assert amplitudes[1] < amplitudes[0]
    assert amplitudes[1] < amplitudes[2]


def contact_of_blade(interference: float) -> ContactParameters:
    springs = {"normal_stiffness": 1.0, "tangential_stiffness": 0.7, "friction": 0.5}
    return ContactParameters.shared(2, **springs, interference=interference)


def test_derivatives_of_a_peak_against_differences() -> None:
    """By the adjoint, against peaks solved with changed parameters; and Euler's rule for homogeneous functions."""
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    options = SolverOptions((0.15, 0.4), harmonics=3, **QUICK)
    problem = modal, contact_of_blade(0.1), Excitation(5, 0.05), options
    found = find_optimum(problem, "friction", 0.4, 0.6)
    at = with_parameter(problem, "friction", found.value)
    follower = PeakContinuation(found.family)
    piece = max(found.pieces, key=lambda each: each.amplitude.max())
    share = float(np.mean(piece.share))
    start = follower.peak_near(share, piece.nearest(share).point)
    assert start is not None
    at = found.family.at(share)
    derivatives = peak_derivatives(at, start.point)
    for name, derivative in derivatives.items():
        value = parameter_value(at, name)
        step = 1e-4 * value
        family = ParameterFamily(at, name, value - step, value + step)
        sides = [PeakContinuation(family).peak_near(side, start.point) for side in (0.0, 1.0)]
        difference = (sides[1].amplitude - sides[0].amplitude) / (2.0 * step)
        assert derivative == pytest.approx(difference, rel=1e-5, abs=1e-9), name
    scaled = derivatives["force"] * 0.05 + derivatives["interference"] * 0.1
    assert scaled == pytest.approx(start.amplitude, rel=1e-6)


def test_envelope_against_single_responses() -> None:
    """Highest peak over the interference: followed, and solved at single values."""
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    options = SolverOptions((0.12, 0.4), **QUICK)
    problem = modal, contact_of_blade(0.0), Excitation(5, 0.05), options
    found = find_optimum(problem, "interference", -0.3, 0.6)
    values = np.linspace(-0.25, 0.55, 9)
    single = [
        forced_response(modal, contact_of_blade(v0), Excitation(5, 0.05), options).peak.amplitude_m for v0 in values
    ]
    np.testing.assert_allclose(found.envelope(values), single, rtol=5e-3)
    assert found.amplitude_m <= min(single) * (1.0 + 1e-6)


def test_a_parameter_without_effect_and_an_optimum_at_the_end_are_told() -> None:
    problem = slider()
    flat = find_optimum(problem, "damping", 0.5, 2.0)  # of 1e-13 times critical damping
    assert flat.kind == "flat"
    assert "changes by less than 0.1 %" in flat.message
    edge = find_optimum(problem, "preload", 1.7, 3.0)
    assert edge.kind == "edge"
    assert "no minimum inside the range" in edge.message
    with pytest.raises(OptionsError, match="allowed: normal_stiffness, "):
        find_optimum(problem, "angle", 0.0, 1.0)
