"""Continuation: folds, the located peak, termination reasons of incomplete curves, two-step method."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from scipy.optimize import brentq

from nonlinear import ContactError, ContactParameters, Excitation, OptionsError, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.response_solver import build_harmonic_balance
from rom import ReducedModel, linear_response, modal_model


def stop(interference, stiffness=1.0):
    """A one-sided elastic stop without friction."""
    one = np.ones(1)
    return ContactParameters(stiffness * one, 0 * one, 0 * one, interference * one, 0 * one)


def gap_curve(**keys):
    modal = modal_model(oscillator(tangential=False), damping_ratio=0.02)
    return forced_response(
        modal, stop(-3.0), Excitation(0, 1.0), SolverOptions((0.05, 0.4), **{"search": "off"} | keys)
    )


def describing_function(amplitude, static):
    """Mean and first coefficient of N = max(-g + static + A cos, 0), g = 3, stiffness 1."""
    threshold = (3.0 - static) / amplitude
    half = np.arccos(np.clip(threshold, -1.0, 1.0))
    mean = amplitude * (np.sin(half) - threshold * half) / np.pi
    first = amplitude * (half - 0.5 * np.sin(2.0 * half)) / np.pi
    return mean, first


def test_every_point_of_a_one_sided_stop_satisfies_the_describing_function():
    """Closed form of the one-harmonic balance: static -N0 = x0, and |1 - w^2 + N1 / A + i c w| A = 1."""
    curve = gap_curve()
    assert curve.termination.complete
    assert len(curve.turning_points) == 2
    amplitude, static = curve.harmonic_m[:, 0], curve.static_m
    omega = 2.0 * np.pi * curve.frequency_hz
    mean, first = describing_function(amplitude, static)
    assert -mean == pytest.approx(static, abs=1e-11)
    residual = amplitude * np.abs(1.0 - omega**2 + first / amplitude + 0.04j * omega) - 1.0
    assert np.max(np.abs(residual)) < 1e-9


def test_the_peak_is_located_to_a_millionth():
    """At the top of the first harmonic c w A = 1 in phase resonance; of |x0| + A, maximised in closed form."""
    curve = gap_curve()

    def static_of(amplitude):
        return brentq(lambda x0: x0 + describing_function(amplitude, x0)[0], -amplitude, 0.0, xtol=1e-14)

    def frequencies(amplitude):
        """Both w at a given amplitude: |a - w^2 + i c w| = 1 / A is quadratic in w^2."""
        static = static_of(amplitude)
        stiffness = 1.0 + describing_function(amplitude, static)[1] / amplitude
        half = stiffness - 0.5 * 0.04**2  # c = 0.04
        root = np.sqrt(max(half**2 - stiffness**2 + amplitude**-2, 0.0))
        return np.sqrt(half - root), np.sqrt(half + root)

    highest = brentq(
        lambda a: 1.0 / a - 0.04 * np.sqrt(1.0 + describing_function(a, static_of(a))[1] / a - 4e-4), 5, 40
    )
    # |x0| + A grows with A along the curve, so both peak together
    assert curve.peak.located
    assert curve.peak.amplitude_m == pytest.approx(highest + abs(static_of(highest)), rel=1e-9)
    assert 2.0 * np.pi * curve.peak.frequency_hz == pytest.approx(frequencies(highest * (1 - 1e-15))[0], rel=1e-6)


def test_stability_changes_at_the_folds():
    curve = gap_curve()
    first, second = curve.turning_points
    assert np.all(curve.stable[: first - 1])
    assert np.all(~curve.stable[first + 1 : second - 1])
    assert np.all(curve.stable[second + 1 :])
    assert np.count_nonzero(~curve.stable) > 3


def test_the_end_points_lie_on_the_limits():
    curve = gap_curve()
    assert curve.frequency_hz[0] == pytest.approx(0.05, rel=1e-12)
    assert curve.frequency_hz[-1] == pytest.approx(0.4, rel=1e-12)
    assert np.all(np.diff(curve.arc) > 0.0)


def test_progress_is_reported():
    seen = []
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    contact = ContactParameters.shared(2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4)
    curve = forced_response(
        modal,
        contact,
        Excitation(4, 1.0),
        SolverOptions((0.1, 0.7), detached=False, truncation=False, search="off"),
        lambda hertz, points: seen.append((hertz, points)),
    )
    assert [count for _, count in seen] == list(range(1, len(seen) + 1))
    assert len(seen) >= 0.8 * curve.points


def test_progress_may_give_up_the_branch():
    modal = modal_model(lumped_blade(), damping_ratio=0.01)
    contact = ContactParameters.shared(2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4)
    options = SolverOptions((0.1, 0.7), detached=False, truncation=False, search="off")
    parts = modal, contact, Excitation(4, 1.0), options
    whole, part = forced_response(*parts), forced_response(*parts, lambda hertz, points: points == 5)
    assert part.termination.kind == "too many points"
    assert "given up at" in part.termination.message
    assert 6 <= part.points < whole.points
    assert np.array_equal(part.frequency_hz[:6], whole.frequency_hz[:6])


def test_too_few_points_end_the_curve_with_a_reason():
    curve = gap_curve(max_points=10)
    assert not curve.termination.complete
    assert curve.termination.kind == "too many points"
    assert "10 points" in curve.termination.message
    assert curve.points >= 10  # what was reached is there
    assert f"{curve.termination.frequency_hz:.6g}" in curve.termination.message


def two_undamped_modes():
    """Resonances at 1 and 3 rad/s, both driven, no damping."""
    return ReducedModel(
        mass=np.eye(2),
        stiffness=np.diag([1.0, 9.0]),
        contact_right=np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]]),
        contact_position=np.zeros((1, 3)),
        force_excitation=np.ones(2),
        outputs={"tip": np.ones(2)},
    )


def test_a_start_that_fails_says_so():
    # excited exactly at an undamped resonance at both ends of the range, a structure has no periodic solution there
    modal = modal_model(two_undamped_modes(), damping_ratio=0.0)
    low, high = modal.angular_frequency / (2.0 * np.pi)
    with np.errstate(all="ignore"):
        curve = forced_response(modal, stop(-1e6, 0.0), Excitation(0, 1.0), SolverOptions((low, high), search="off"))
    assert curve.termination.kind == "start failed"
    assert curve.points == 0
    assert curve.peak is None
    assert f"no start at {low:.6g} Hz" in curve.termination.message


def test_the_high_end_is_the_start_where_the_low_end_fails():
    """A softening stop, range cut in its overhang: the branch from below turns back, the other covers the range."""
    modal = modal_model(oscillator(tangential=False), damping_ratio=0.02)
    whole = forced_response(modal, stop(3.0), Excitation(0, 1.0), SolverOptions((0.05, 0.4), search="off"))
    assert len(whole.turning_points) == 2
    low = float(whole.frequency_hz[whole.turning_points].mean())  # three solutions
    part = forced_response(modal, stop(3.0), Excitation(0, 1.0), SolverOptions((low, 0.4), search="off"))
    assert part.termination.complete
    assert "from the high end down" in part.termination.message
    assert part.frequency_hz[0] == pytest.approx(low, rel=1e-9)
    assert part.frequency_hz[-1] == pytest.approx(0.4, rel=1e-9)
    assert np.all(np.diff(part.arc) > 0.0)
    assert part.peak.amplitude_m == pytest.approx(whole.peak.amplitude_m, rel=1e-9)
    balance = build_harmonic_balance(modal, stop(3.0), Excitation(0, 1.0), SolverOptions((low, 0.4), search="off"))
    for hertz, displacement in zip(part.frequency_hz, part.relative_displacement, strict=True):
        unknown = to_real(displacement).reshape(-1)
        residual = balance.evaluate(unknown, 2.0 * np.pi * hertz).residual
        assert balance.relative_error(residual, unknown) < 1e-9


@pytest.mark.parametrize("interference", [-1e6, 1e6])
def test_a_resonance_narrower_than_a_step_is_not_stepped_over(interference):
    """A second mode that is hardly excited, damping ratio 1e-4, contact open or pressed all the time: linear."""
    model = replace(two_undamped_modes(), force_excitation=np.array([1.0, 2e-5]))
    modal = modal_model(model, damping_ratio=1e-4)
    curve = forced_response(modal, stop(interference), Excitation(0, 1.0), SolverOptions((0.05, 0.6), search="off"))
    assert curve.termination.complete
    stiffness = 1.0 if interference > 0 else 0.0
    squared = np.linalg.eigvalsh(np.diag([1.0, 9.0]) + stiffness * np.ones((2, 2)))
    assert [peak.frequency_hz for peak in curve.peaks] == pytest.approx(np.sqrt(squared) / (2 * np.pi), rel=1e-3)


def test_a_curve_that_only_rises_has_no_located_peak():
    modal = modal_model(oscillator(tangential=False), damping_ratio=0.02)
    curve = forced_response(modal, stop(-50.0), Excitation(0, 1.0), SolverOptions((0.05, 0.12), search="off"))
    assert curve.termination.complete
    assert not curve.peak.located
    assert curve.peak.index == curve.points - 1


def test_peak_of_the_linear_response_is_the_closed_form():
    modal = modal_model(oscillator(tangential=False), damping_ratio=0.02)
    curve = forced_response(modal, stop(-1e6), Excitation(0, 1.0), SolverOptions((0.05, 0.4), search="off"))
    assert 2.0 * np.pi * curve.peak.frequency_hz == pytest.approx(np.sqrt(1.0 - 2.0 * 0.02**2), rel=1e-6)
    assert curve.peak.amplitude_m == pytest.approx(1.0 / (0.04 * np.sqrt(1.0 - 0.02**2)), rel=1e-12)


class TestStaticFirst:
    """The classical two steps against the coupled balance."""

    def solve(self, interference, method, harmonics=1):
        modal = modal_model(lumped_blade(), damping_ratio=0.01)
        contact = ContactParameters.shared(
            2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=interference
        )
        quick = {"detached": False, "truncation": False, "search": "off"}
        options = SolverOptions((0.1, 0.7), harmonics=harmonics, method=method, **quick)
        return forced_response(modal, contact, Excitation(4, 1.0), options)

    def test_agrees_where_the_contact_is_linear(self):
        modal = modal_model(lumped_blade(), damping_ratio=0.01)
        for interference in (-1e3, 1e3):
            curve = self.solve(interference, "static-first")
            springs = {"normal": 2.0, "tangential": 1.5} if interference > 0 else {}
            linear = linear_response(modal, curve.frequency_hz, phase=modal.phase(4), force=1.0, **springs)
            assert np.max(np.abs(curve.output[:, 1] - linear)) < 1e-10 * np.max(np.abs(linear))

    def test_freezes_the_static_displacement(self):
        curve = self.solve(1.0, "static-first")
        static = curve.relative_displacement[:, 0]
        assert np.all(static == static[0])
        free = self.solve(1.0, "coupled").relative_displacement[:, 0]
        assert np.max(np.abs(free - free[0])) > 1e-3

    def test_differs_where_lift_off_shifts_the_mean_load(self):
        coupled, classical = (self.solve(-2.0, method) for method in ("coupled", "static-first"))
        assert coupled.termination.complete
        assert classical.termination.complete
        assert abs(classical.peak.amplitude_m / coupled.peak.amplitude_m - 1.0) > 0.01


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"frequency_hz": (2.0, 1.0)}, "frequency"),
        ({"frequency_hz": (0.0, 1.0)}, "frequency"),
        ({"frequency_hz": (1.0, 2.0), "harmonics": 0}, "harmonics"),
        ({"frequency_hz": (1.0, 2.0), "samples": 4}, "samples"),
        ({"frequency_hz": (1.0, 2.0), "integration": "fine"}, "integration"),
        ({"frequency_hz": (1.0, 2.0), "method": "both"}, "method"),
    ],
)
def test_bad_options_are_named(keys, words):
    with pytest.raises(OptionsError, match=words + r".*allowed"):
        SolverOptions(**keys)


def test_bad_contact_parameters_are_named():
    one = np.ones(2)
    with pytest.raises(ContactError, match=r"friction: -1\.0, allowed: 0 or more"):
        ContactParameters(one, one, -one, one, one)
    with pytest.raises(ContactError, match=r"interference.*finite"):
        ContactParameters(one, one, one, np.nan * one, one)
    with pytest.raises(ContactError, match="no contact nodes, allowed: one node or more"):
        ContactParameters.shared(0, normal_stiffness=1.0, tangential_stiffness=1.0, friction=0.5)
    with pytest.raises(ContactError, match=r"preload: shape"):
        ContactParameters(one, one, one, one, np.ones(3))
    with pytest.raises(ContactError, match="law"):
        ContactParameters(one, one, one, one, one, "both")
    modal = modal_model(oscillator(), damping_ratio=0.01)
    with pytest.raises(ContactError, match="2 nodes, allowed: 1"):
        forced_response(modal, ContactParameters(one, one, one, one, one), Excitation(0, 1.0), SolverOptions((1, 2)))


def test_what_is_not_asked_for_is_not_done():
    modal = modal_model(lumped_blade(3), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=0.5
    )
    options = SolverOptions((0.1, 0.8), detached=False, stability="folds", truncation=False, search="off")
    bare = forced_response(modal, contact, Excitation(1, 1.0), options)
    whole = forced_response(modal, contact, Excitation(1, 1.0), SolverOptions((0.1, 0.8), search="off"))
    assert np.isnan(bare.truncation_error)
    assert np.isnan(bare.growth_rate).all()
    assert whole.truncation_error > 0.0
    assert np.isfinite(whole.growth_rate).any()
    assert np.array_equal(bare.frequency_hz, whole.frequency_hz)


def test_a_static_force_that_moves_both_sides_alike():
    """The static relative displacement is round-off, and counts as solved."""
    model = lumped_blade(3)
    modal = modal_model(replace(model, force_static=0.3 * model.force_excitation), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=0.0, tangential_stiffness=4.0, friction=0.5, preload=3.0, law="two_sliders"
    )
    curve = forced_response(modal, contact, Excitation(1, 1.0), SolverOptions((0.1, 0.8), search="off"))
    assert curve.termination.complete
    assert np.abs(curve.relative_displacement[:, 0]).max() < 1e-12 * np.abs(curve.relative_displacement[:, 1]).max()
    assert curve.output[:, 0].real == pytest.approx(0.3, rel=1e-10)  # tip spring 1 N/m against 0.3 N
