"""Peaks followed over a parameter: closed form of a mass with a slider, derivatives, stability, single responses."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator

from nonlinear import ContactParameters, Excitation, SolverOptions, find_optimum, forced_response
from nonlinear.peak_curves.parameter_family import PARAMETERS, ParameterFamily, parameter_value, with_parameter
from nonlinear.peak_curves.peak_curve import PeakContinuation
from nonlinear.peak_curves.peak_search import PeakSearch
from nonlinear.peak_curves.peak_sensitivity import peak_derivatives
from rom import modal_model

QUICK = {"detached": False, "stability": "folds", "truncation": False, "search": "off"}


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
    assert found.slopes == pytest.approx((0.0, 0.0), abs=1e-8)
    expected = {"force": 1.0, "tangential_stiffness": -1.0, "preload": 0.0, "friction": 0.0, "damping": 0.0}
    assert {name: found.elasticities[name] for name in expected} == pytest.approx(expected, abs=1e-8)
    assert found.derivatives["force"] == pytest.approx(np.pi, rel=1e-8)
    limits = np.linspace(1.0, 3.0, 23)
    np.testing.assert_allclose(found.envelope.at(limits), closed_form(limits), rtol=1e-4)
    # 1.1 pi = r^2 / (r - pi/4): r = pi/2 (1.1 -+ sqrt(0.11))
    np.testing.assert_allclose(found.within, np.pi / 2.0 * (1.1 + np.sqrt(0.11) * np.array([-1.0, 1.0])), rtol=1e-4)
    (curve,) = found.curves
    np.testing.assert_allclose(curve.amplitude_m, closed_form(curve.value), rtol=1e-9)
    assert curve.stable.all()
    assert set(found.envelope.source) == {"followed"}
    assert min(response.amplitude_m for response in found.responses) >= found.amplitude_m * (1.0 - 1e-9)


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


def contact_of_blade(interference: float, preload: float = 0.0) -> ContactParameters:
    springs = {"normal_stiffness": 1.0, "tangential_stiffness": 0.7, "friction": 0.5, "preload": preload}
    return ContactParameters.shared(2, **springs, interference=interference)


@pytest.mark.parametrize("preload", [0.0, 0.02])
def test_derivatives_of_a_peak_against_differences(preload: float) -> None:
    """By the adjoint, against peaks solved with changed parameters; and Euler's rule for homogeneous functions."""
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    options = SolverOptions((0.15, 0.4), harmonics=3, **QUICK)
    problem = modal, contact_of_blade(0.1, preload), Excitation(5, 0.05), options
    family = ParameterFamily.over(problem, "friction", 0.4, 0.6)
    follower = PeakContinuation(family)
    search = PeakSearch(family, lambda line: None)
    search.solve([0.5], "first")
    piece = max(search.pieces, key=lambda each: each.amplitude.max())
    start = follower.moved(piece.nearest(0.5), 0.5)
    assert start is not None
    at = family.at(0.5)
    derivatives = peak_derivatives(at, start.point)
    assert set(derivatives) == set(PARAMETERS)
    for name, derivative in derivatives.items():
        value = parameter_value(at, name)
        step = 1e-3 * value if value else 2e-5  # of a preload that is 0
        reached = with_parameter(at, name, value if value else 2.0 * step)
        line = PeakContinuation(ParameterFamily.over(reached, name, value, value + 2.0 * step))
        if value:
            line = PeakContinuation(ParameterFamily.over(at, name, value - 2.0 * step, value + 2.0 * step))
        peaks = [line.peak_near(share, start.point) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
        a = [peak.amplitude for peak in peaks]
        h = 0.5 * step if not value else step
        weights = [1.0, -8.0, 0.0, 8.0, -1.0] if value else [-25.0, 48.0, -36.0, 16.0, -3.0]  # fourth order
        assert derivative == pytest.approx(np.dot(weights, a) / (12.0 * h), rel=1e-6, abs=1e-9), name
    scaled = {"force": 0.05, "interference": 0.1, "preload": preload}
    assert sum(derivatives[name] * value for name, value in scaled.items()) == pytest.approx(
        start.amplitude, rel=1e-6
    )


def test_envelope_against_single_responses() -> None:
    """Highest peak over the interference: followed, and solved at single values."""
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    options = SolverOptions((0.12, 0.4), **QUICK)
    problem = modal, contact_of_blade(0.0), Excitation(5, 0.05), options
    found = find_optimum(problem, "interference", 0.05, 0.4)
    values = np.linspace(0.06, 0.39, 5)
    single = [
        forced_response(modal, contact_of_blade(v0), Excitation(5, 0.05), options).peak.amplitude_m for v0 in values
    ]
    np.testing.assert_allclose(found.envelope.at(values), single, rtol=1e-3)
    assert found.amplitude_m <= min(single) * (1.0 + 1e-9)


@pytest.mark.long
def test_stability_of_followed_peaks_is_that_of_responses() -> None:
    """Four blades that touch across a gap: the highest peak loses its stability against another nodal diameter."""
    modal = modal_model(lumped_blade(4, 1), damping_ratio=0.01)
    springs = {"normal_stiffness": 6.0, "tangential_stiffness": 4.2, "friction": 0.4}
    contact = ContactParameters.shared(1, **springs, interference=0.0)
    options = SolverOptions((0.1, 0.4), detached=False, truncation=False, search="off")
    family = ParameterFamily.over((modal, contact, Excitation(2, 1.0), options), "interference", -0.5, 0.45)
    search = PeakSearch(family, lambda line: None)
    search.solve([0.3], "first")
    piece = max(search.pieces, key=lambda each: each.amplitude.max())
    changes = np.flatnonzero(np.diff(piece.persists.astype(int)))
    assert changes.size == 2
    stable = {}
    for change in changes:
        before, after = piece.points[change], piece.points[change + 1]
        assert after.share - before.share < 2e-6
        for share, expected in ((before.share - 0.004, before), (after.share + 0.004, after)):
            curve = forced_response(*family.at(share))
            top = curve.peak.index
            at = follower_peak(search, piece, share)
            assert curve.peak.amplitude_m == pytest.approx(at.amplitude, rel=1e-6)
            stable[share] = bool(curve.stable[top])
            assert stable[share] == expected.persists
    assert set(stable.values()) == {True, False}


def follower_peak(search: PeakSearch, piece, share: float):
    found = search.follower.moved(piece.nearest(share), share)
    assert found is not None
    return found


def test_a_motion_that_only_responses_know_counts() -> None:
    """Responses tell of a motion 30 % above the peak for limits of the slider from 1.45 to 1.8.

    The followed peak knows nothing of it. The lowest peak outside is that at 1.45.
    """

    def solver(problems):
        for problem in problems:
            curve = forced_response(*problem)
            limit = float(problem[1].preload.mean())
            factor = 1.3 if 1.45 < limit < 1.8 else 1.0
            worst = replace(curve.worst, amplitude_m=factor * curve.worst.amplitude_m)
            yield replace(curve, worst=worst)

    found = find_optimum(slider(), "preload", 1.0, 3.0, solver=lambda problems: list(solver(problems)))
    assert found.kind in ("jump", "sampled")
    assert found.value == pytest.approx(1.45, abs=0.01)
    assert found.value < 1.45
    assert found.amplitude_m == pytest.approx(closed_form(found.value), rel=1e-6)
    assert found.slopes[1] == np.inf or found.kind == "sampled"
    values = np.array([1.46, 1.6, 1.79])
    np.testing.assert_allclose(found.envelope.at(values), 1.3 * closed_form(values), rtol=0.02)
    assert {"followed", "responses"} <= set(found.envelope.source)
    assert len(found.responses) < 30


def test_harmonics_chosen_for_the_optimum() -> None:
    problem = slider(harmonics="auto")
    found = find_optimum(problem, "preload", 1.3, 1.9)
    assert found.harmonics > 1
    assert "harmonics, as many as the tolerance asks for" in found.remarks[0]
    curve = forced_response(*with_parameter(problem, "preload", found.value))
    assert max(curve.harmonics, 3) <= found.harmonics
    assert found.amplitude_m == pytest.approx(curve.peak.amplitude_m, rel=1e-3)
