"""How many harmonics: the estimate of the truncation error against many harmonics, and the adaptive selection."""

from functools import cache

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, OptionsError, SolverOptions, forced_response
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.fourier import largest_lengths
from nonlinear.continuation.predictor_corrector import PredictorCorrector
from rom import modal_model

MANY = 17
CASES = [(-3.0, 4), (-0.5, 6), (0.0, 3), (0.5, 4), (1.0, 2), (2.0, 6)]  # interference, engine order


@cache
def solve(interference, engine_order, harmonics, tolerance=1e-3):
    modal = modal_model(lumped_blade(), damping_ratio=0.03)
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=interference
    )
    options = SolverOptions(
        (0.1, 0.7),
        harmonics=harmonics,
        harmonic_tolerance=tolerance,
        detached=False,
        stability="folds",
        search="off",
    )
    return forced_response(modal, contact, Excitation(engine_order, 1.0), options)


@pytest.mark.long
def test_the_estimate_bounds_the_true_error_within_a_factor():
    """Against 17 harmonics, over gaps, open and pressed contacts, H = 1, 3 and 5."""
    bounded = []
    for interference, engine_order in CASES:
        reference = solve(interference, engine_order, MANY).peak.amplitude_m
        for harmonics in (1, 3, 5):
            curve = solve(interference, engine_order, harmonics)
            true = abs(curve.peak.amplitude_m / reference - 1.0)
            bounded.append(true <= 3.0 * curve.truncation_error + 1e-6)
    assert np.mean(bounded) >= 0.9


@pytest.mark.parametrize(("interference", "engine_order"), [(-0.5, 6), (0.5, 4)])
def test_auto_reaches_its_tolerance(interference, engine_order):
    reference = solve(interference, engine_order, MANY).peak.amplitude_m
    for tolerance in (2e-2, 2e-3):
        curve = solve(interference, engine_order, "auto", tolerance)
        assert curve.termination.complete
        assert curve.truncation_error <= tolerance
        assert abs(curve.peak.amplitude_m / reference - 1.0) <= 3.0 * tolerance
    assert 1 < curve.harmonics < MANY


def test_a_tolerance_that_the_most_harmonics_do_not_reach_is_told_after_one_curve(monkeypatch):
    """Solving again could not raise their number."""
    monkeypatch.setattr("nonlinear.harmonic_selection.adaptive_harmonics.HARMONIC_NUMBERS", (1, 3))
    solved = []

    def count(*arguments):
        solved.append(continue_over_range(*arguments))
        return solved[-1]

    monkeypatch.setattr("nonlinear.response_solver.continue_over_range", count)
    curve = solve(-0.5, 6, "auto", 1e-6)
    assert len(solved) == 1
    assert curve.harmonics == 3
    assert curve.truncation_error > 1e-6
    assert "3 harmonics, the most there are, do not reach 1e-06" in curve.termination.message


def test_harmonics_are_dropped_where_fewer_are_enough():
    """Behind the resonance, where the amplitude is small; the peak keeps as many as it needs."""
    curve = solve(-0.5, 6, "auto", 2e-3)
    peak = curve.kept_harmonics[curve.peak.index]
    assert curve.kept_harmonics[curve.peak.index :].min() < peak
    assert curve.truncation_error <= 2e-3


def test_auto_keeps_one_harmonic_where_the_response_is_linear():
    for interference in (-1e4, 1e4):
        curve = solve(interference, 4, "auto")
        assert curve.harmonics == 1
        assert curve.truncation_error < 1e-9


def test_the_estimate_tells_that_one_harmonic_is_too_few():
    """A pressed contact that opens: one harmonic is wrong by some per cent, and the estimate says so."""
    curve = solve(0.5, 4, 1)
    reference = solve(0.5, 4, MANY).peak.amplitude_m
    true = abs(curve.peak.amplitude_m / reference - 1.0)
    assert true > 5e-3
    assert curve.truncation_error > true / 3.0


def test_stiff_contacts_that_the_ring_leaves_keep_few_harmonics():
    """Its height says nothing of what the ring does instead."""
    contact = ContactParameters.shared(
        2, normal_stiffness=400.0, tangential_stiffness=400.0, friction=0.4, interference=-0.5
    )
    options = SolverOptions((0.1, 0.7), harmonics="auto", harmonic_tolerance=1e-2, detached=False, search="off")
    curve = forced_response(modal_model(lumped_blade(), damping_ratio=0.03), contact, Excitation(6, 1.0), options)
    left = curve.kept_harmonics > 1
    assert curve.termination.complete
    assert "no ring keeps the periodic motion in parts of" in curve.termination.message
    assert np.median(curve.kept_harmonics[left]) <= 5
    assert not curve.stable[curve.peak.index]
    assert curve.truncation_error > 0.01  # and the estimate tells it


def test_a_solution_that_is_not_found_with_more_harmonics_does_not_raise_their_number(monkeypatch):
    """Neither does it end the curve."""
    monkeypatch.setattr(PredictorCorrector, "refit", lambda solver, point: None)
    curve = solve(0.5, 4, "auto", 1e-2)
    assert curve.termination.complete
    assert curve.harmonics == 1


def test_bad_harmonics_are_named():
    for bad in (0, "many"):
        with pytest.raises(OptionsError, match=r"harmonics: .*allowed: 1 or more, or \"auto\""):
            SolverOptions((1.0, 2.0), harmonics=bad)
    with pytest.raises(OptionsError, match="harmonic_tolerance"):
        SolverOptions((1.0, 2.0), harmonic_tolerance=0.0)
    with pytest.raises(OptionsError, match="allowed here: a number"):
        _ = SolverOptions((1.0, 2.0), harmonics="auto").fixed_harmonics


def test_the_largest_length_of_a_vector_is_that_of_the_motion_as_a_whole():
    """On a circle of radius 2 about the origin, on one about (1, 0), and along a line."""
    circle = [2.0, 2.0j]
    motions = np.array([[[0.0, 0.0], circle], [[1.0, 0.0], circle], [[0.0, 0.0], [3.0, 4.0]]])
    np.testing.assert_allclose(largest_lengths(motions), [2.0, 3.0, 5.0], rtol=1e-6)
