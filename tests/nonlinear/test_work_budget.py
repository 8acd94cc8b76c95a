"""What a curve may take is counted: what is not finished by then is named, with what is known so far."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, OptionsError, SolverOptions, forced_response
from nonlinear import options as solver_options
from nonlinear.continuation.arclength_continuation import PointsPassed
from nonlinear.response_solver import build_continuation
from nonlinear.time_integration.ring import Ring
from nonlinear.worst_motion.ring_integration import RingIntegration, Solution
from nonlinear.worst_motion.worst_motion import affordable
from rom import modal_model

FURTHER = "a larger response.effort goes further"


def problem(**keys):
    """Two blades with a wide gap: an isolated branch beside the main one."""
    modal = modal_model(lumped_blade(2), damping_ratio=0.005)
    values = {"normal_stiffness": 0.81, "tangential_stiffness": 0.61, "friction": 0.05, "interference": -2.0}
    keys = {"truncation": False, "search": "off", "harmonics": 3} | keys
    return modal, ContactParameters.shared(2, **values), Excitation(1, 1.0), SolverOptions((0.08, 1.0), **keys)


@pytest.fixture(scope="module")
def whole():
    return forced_response(*problem())


def solved_with(monkeypatch, **most):
    monkeypatch.setattr(solver_options, "MOST_WORK", solver_options.MOST_WORK | most)
    return forced_response(*problem())


def test_a_branch_ends_with_its_work_and_says_so(whole, monkeypatch):
    curve = solved_with(monkeypatch, branch=20.0)
    assert not curve.termination.complete
    assert curve.termination.kind == "too many points"
    assert curve.termination.message.startswith("given up at ")
    assert curve.termination.message.endswith(FURTHER)
    assert 2 <= curve.points < whole.points
    last = curve.frequency_hz < curve.termination.frequency_hz
    assert np.allclose(curve.amplitude_m[last][:10], whole.amplitude_m[:10], rtol=1e-6)
    assert "the main branch is incomplete" in curve.worst.unresolved


def test_effort_is_a_factor_on_work_and_points(whole):
    few = replace(problem()[3], effort=1e-3)
    assert few.budget("branch").most == 1e-3 * solver_options.MOST_WORK["branch"]
    assert few.most_points == 20
    assert forced_response(*problem(effort=1e-3)).points <= 30 < whole.points
    with pytest.raises(OptionsError, match="effort: 0"):
        SolverOptions((1.0, 2.0), effort=0.0)


def test_points_without_a_verdict_are_undecided_and_the_highest_are_looked_at_first(whole, monkeypatch):
    curve = solved_with(monkeypatch, stability=600.0)
    undecided = np.isnan(curve.growth_rate)
    assert 0 < undecided.sum() < curve.points
    assert not curve.stable[undecided].any()
    assert undecided.sum() > np.isnan(whole.growth_rate).sum()
    assert not undecided[int(np.argmax(curve.amplitude_m))]
    assert "not decided: " + FURTHER in curve.worst.unresolved
    assert len(curve.bifurcations) <= len(whole.bifurcations)
    assert FURTHER not in whole.worst.unresolved


def test_a_search_for_detached_branches_that_is_not_finished_is_named(whole, monkeypatch):
    assert whole.detached
    curve = solved_with(monkeypatch, detached=5.0)
    assert curve.branches_left_out == -1
    assert f"detached branches were not searched for to the end: {FURTHER}" in curve.worst.unresolved
    assert whole.branches_left_out >= 0


def test_time_integration_gets_fewer_periods_where_a_period_takes_more_work(whole):
    """The friction cone was counted as ninety times as dear as two sliders, and takes as long."""
    modal, contact, excitation, options = problem(search="standard")
    highest = Solution.of(whole, int(np.argmax(whole.amplitude_m)))

    def cost(contact, solution):
        return RingIntegration(Ring(modal, contact, excitation), options).with_cost(solution).cost

    assert cost(contact, highest) == cost(replace(contact, law="cone"), highest) == 1.0
    assert cost(contact, replace(highest, omega=0.01)) > 2.0  # more steps a period
    assert affordable([whole], replace(options, effort=2.0)) == 2 * affordable([whole], options)


def test_a_branch_in_a_loop_beyond_its_start_ends():
    """As if the closed branch had been reached from elsewhere."""
    continuation = build_continuation(*problem(stability="folds"))[0]
    curve = forced_response(*problem(stability="folds"))
    closed = next(each for each in curve.detached if ", closed: " in each.termination.message)
    at = int(np.argmax(closed.amplitude_m))
    motion = closed.relative_displacement[at]
    rows = np.concatenate([motion[:1].real, np.stack([motion[1:].real, motion[1:].imag], 1).reshape(-1, 2, 3)])
    start = continuation.solver.point(rows.reshape(-1), 2.0 * np.pi * closed.frequency_hz[at])
    points = list(continuation.continue_branch(start))
    assert points[-1].unknown is points[0].unknown
    elsewhere = continuation.solver.starting_point(start.unknown, start.omega + 1.0, 1.0, 0)
    passed = PointsPassed(elsewhere)
    steps = list(pairwise(points))
    ends = [passed.met(continuation.solver, *step) is not None for step in 8 * steps]
    assert any(ends)
    assert ends.index(True) > len(steps)  # not in the first lap
