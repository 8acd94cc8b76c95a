"""Branches carried from one problem to another by continuation in a homotopy parameter."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade
from test_branch_search import known, problem

from nonlinear import forced_response
from nonlinear.branches.branch_collection import BranchStart, branch_starts
from nonlinear.branches.parameter_continuation import (
    FixedFrequencyBalance,
    Homotopy,
    carry_solution,
    continue_in_parameter,
    over_parameter,
)
from nonlinear.contact.fourier import to_real
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.response_extension import carry_branches, extend_response
from nonlinear.response_solver import build_continuation
from rom import modal_model

HOME = "wide gap"
LABEL = "contact.interference = -2 m"


def at(interference, **options):
    modal, contact, excitation, solver = problem(HOME, 3, **options)
    return modal, contact.with_interference(interference), excitation, solver


@pytest.fixture(scope="module")
def home():
    return forced_response(*at(-2.0))


@pytest.fixture(scope="module")
def starts(home):
    _, contact, excitation, _ = at(-2.0)
    return branch_starts(home, contact, excitation, LABEL)


def main_only(given):
    modal, contact, excitation, options = given
    return forced_response(modal, contact, excitation, replace(options, detached=False))


def test_starts_are_solutions_on_every_branch(home, starts):
    balance = build_continuation(*at(-2.0))[0].balance
    for start in starts:
        unknown = balance.unknown(start.displacement).reshape(-1)
        evaluated = balance.evaluate(unknown, 2.0 * np.pi * start.frequency_hz)
        assert balance.relative_error(evaluated.residual, unknown) < 1e-10
    for branch in (home, *home.detached):
        highest = branch.frequency_hz[np.argmax(branch.amplitude_m)]
        assert highest in [start.frequency_hz for start in starts]


@pytest.mark.parametrize(("interference", "force", "friction"), [(-2.2, 1.0, 0.05), (-1.8, 1.05, 0.1)])
def test_a_branch_of_a_neighbour_is_found(starts, interference, force, friction):
    """The branch carried is the one that the search finds there itself."""
    modal, contact, excitation, options = at(interference)
    contact = replace(contact, friction=np.full(2, friction))
    given = modal, contact, replace(excitation, force=force), options
    searched, alone = forced_response(*given), main_only(given)
    assert len(searched.detached) == 1
    assert alone.detached == ()
    extended = extend_response(given, alone, starts)
    (branch,) = extended.detached
    assert branch.amplitude_m.max() == pytest.approx(searched.detached[0].amplitude_m.max(), rel=1e-8)
    assert branch.origin == f"carried from {LABEL}"
    assert branch.peak.located
    assert extended.frequency_hz is alone.frequency_hz


def test_another_structure_is_no_obstacle(starts):
    _, contact, excitation, options = at(-2.0)
    model = lumped_blade(2)
    stiffer = modal_model(replace(model, stiffness=1.02 * model.stiffness), damping_ratio=0.005)
    given = stiffer, contact, excitation, options
    (branch,) = extend_response(given, main_only(given), starts).detached
    balance = build_continuation(*given)[0].balance
    for index in range(0, branch.points, 10):
        unknown = balance.unknown(to_real(branch.relative_displacement[index])).reshape(-1)
        evaluated = balance.evaluate(unknown, 2.0 * np.pi * branch.frequency_hz[index])
        assert balance.relative_error(evaluated.residual, unknown) < 1e-10
    assert branch.frequency_hz[0] == pytest.approx(branch.frequency_hz[-1], rel=1e-12)  # closed


def test_nothing_new_is_the_same_object(home, starts):
    assert extend_response(at(-2.0), home, starts) is home
    assert extend_response(at(-2.0), home, []) is home


def test_a_branch_that_dies_on_the_way_says_where(home):
    """The top is lost at the value at which the branch is born: it exists just before, and not just beyond."""
    _, contact, excitation, _ = at(-2.0)
    top = branch_starts(home, contact, excitation, LABEL)[0]
    far = -2.0 - 6.0
    lost = carry_branches(at(far), main_only(at(far)), [top]).lost
    assert [item.start for item in lost] == [top]
    assert 0.0 < lost[0].at < 1.0
    born = -2.0 + lost[0].at * (far + 2.0)
    for interference, exists in ((born + 0.1, True), (born - 0.1, False)):
        given = at(interference)
        assert bool(extend_response(given, main_only(given), [top]).detached) == exists
    assert forced_response(*given).detached == ()


def test_curves_at_fixed_frequency_pass_folds(home):
    """From the upper side of an isolated branch over the interference: each point is a solution, folds are passed."""
    branch = home.detached[0]
    middle = 0.5 * (branch.frequency_hz.min() + branch.frequency_hz.max())
    upper = max(np.flatnonzero(np.abs(branch.frequency_hz - middle) < 0.05), key=lambda i: branch.amplitude_m[i])
    continuation = build_continuation(*at(-2.0))[0]
    balance, contact = continuation.balance, continuation.contact
    last = build_continuation(*at(-2.05))[0]
    homotopy = Homotopy(last.balance, (contact, last.contact), (1.0, 1.0), continuation.options)
    omega = 2.0 * np.pi * branch.frequency_hz[upper]
    unknown = balance.unknown(to_real(branch.relative_displacement[upper])).reshape(-1)
    over_s = over_parameter(FixedFrequencyBalance.of(homotopy, omega), continuation.options)
    points = list(continue_in_parameter(over_s, unknown, 0.0, 1.0, 200))
    s = np.array([point.parameter for point in points])
    assert 0.1 < s.max() < 1.0  # it turns back: at this frequency the branch ends
    assert s[-1] < 0.0
    for point in points[::5]:
        at_s = homotopy.balance(point.parameter)
        residual = at_s.evaluate(point.unknown, omega).residual
        assert at_s.relative_error(residual, point.unknown) < 1e-10


def test_a_defect_is_taken_away():
    """A motion that solves nothing is the solution of the first problem; the last one is solved without defect."""
    continuation = build_continuation(*at(-2.0))[0]
    balance, contact = continuation.balance, continuation.contact
    omega = 2.0
    unknown = 1e-2 * np.random.default_rng(1).normal(size=balance.size)
    homotopy = Homotopy(balance, (contact, contact), (1.0, 1.0), continuation.options).from_solution(unknown, omega)
    first = homotopy.balance(0.0).evaluate(unknown, omega).residual
    defect = balance.evaluate(unknown, omega).residual
    assert np.abs(first).max() < 1e-11 * np.abs(defect).max()  # the defect taken from itself: round-off
    carried = carry_solution(homotopy, unknown, omega)
    assert carried.lost_at == 1.0
    (point,) = carried.points
    residual = balance.evaluate(point.unknown, point.omega).residual
    assert balance.relative_error(residual, point.unknown) < 1e-10


def test_stuck_contacts_follow_the_interference_with_free_frequency():
    """The static displacement moves by many times the vibration, which stays; the problem is linear in s."""
    continuation, low = build_continuation(*at(2.0))[0], 0.3
    last = build_continuation(*at(100.0))[0]
    homotopy = Homotopy(last.balance, (continuation.contact, last.contact), (1e-3, 1e-3), continuation.options)
    first, options = homotopy.balance(0.0), continuation.options
    solved = solve_at(first, low, np.zeros(first.size), options, 30)
    assert solved.converged
    carried = carry_solution(homotopy, solved.solution, low, thorough=False, fixed_frequency=False)
    (point,) = carried.points
    assert point.omega == pytest.approx(low, rel=1e-6)
    moved = point.unknown - solved.solution
    assert np.linalg.norm(moved) > 10.0 * first.vibration(solved.solution)
    assert first.vibration(moved) < 1e-6 * first.vibration(solved.solution)
    exact = homotopy.balance(1.0)
    residual = exact.evaluate(point.unknown, point.omega).residual
    assert exact.relative_error(residual, point.unknown) < 1e-10


def test_a_start_may_have_any_number_of_harmonics(home):
    """Branches with one harmonic carried to the same problem with three."""
    one = forced_response(*problem(HOME, 1))
    _, contact, excitation, _ = at(-2.0)
    alone = replace(home, detached=())
    extended = extend_response(at(-2.0), alone, branch_starts(one, contact, excitation, "one harmonic"))
    assert len(extended.detached) == len(home.detached)
    assert isinstance(branch_starts(one, contact, excitation, "")[0], BranchStart)
    assert known(extended.detached[0], build_continuation(*at(-2.0))[0].balance).omega.size > 10
