"""Search of branches: more harmonics find no less, each branch is listed once, its upper end is located."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.branches.branch_collection import BranchCollection, KnownBranch, lies_on, representative_indices
from nonlinear.branches.detached_branches import HIGH, LOW, straight_end
from nonlinear.branches.parameter_continuation import FixedFrequencyBalance, Homotopy
from nonlinear.contact.fourier import to_real
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.harmonic_balance.initial_solution import pad_or_truncate
from nonlinear.response_solver import build_continuation
from rom import modal_model

# Three harmonics cut an isolated branch off the main one; without friction, and with it.
PROBLEMS = {
    "light friction": (9.0, -1.0, 0.05, 0.01),
    "wide gap": (0.81, -2.0, 0.05, 0.005),
}


def problem(name, harmonics=3, **options):
    stiffness, interference, friction, damping = PROBLEMS[name]
    modal = modal_model(lumped_blade(2), damping_ratio=damping)
    contact = ContactParameters.shared(
        2,
        normal_stiffness=stiffness,
        tangential_stiffness=0.75 * stiffness,
        friction=friction,
        interference=interference,
    )
    options = {"stability": "folds", "truncation": False, "search": "off", "harmonic_tolerance": 0.03} | options
    return modal, contact, Excitation(1, 1.0), SolverOptions((0.08, 1.0), harmonics=harmonics, **options)


@pytest.fixture(scope="module")
def solved():
    curves = {}

    def curve(name, harmonics=3):
        if (name, harmonics) not in curves:
            curves[name, harmonics] = forced_response(*problem(name, harmonics))
        return curves[name, harmonics]

    return curve


def branches(curve):
    return (curve, *curve.detached)


def known(branch, balance):
    rows = np.stack([balance.unknown(to_real(row)) for row in branch.relative_displacement])
    return KnownBranch(2.0 * np.pi * branch.frequency_hz, rows)


def point_of(continuation, branch, index):
    """A stored point, as a point of the continuation, which may have more harmonics; None if Newton loses it."""
    balance = continuation.balance
    unknown = pad_or_truncate(balance.unknown(to_real(branch.relative_displacement[index])).reshape(-1), balance)
    omega = 2.0 * np.pi * branch.frequency_hz[index]
    point = continuation.solver.point(unknown, omega, (0.0 * unknown, 1.0), 0, 0.0, 0.05)
    return continuation.solver.refit(point)


@pytest.mark.parametrize(("name", "more"), [("wide gap", 7), ("wide gap", "auto")])
def test_more_harmonics_find_no_less(solved, name, more):
    """What Newton's method with 7 harmonics reaches from the branches with 3 lies on a branch of the curve with 7."""
    few, many = solved(name, 3), solved(name, more)
    assert few.detached
    continuation = build_continuation(*problem(name, 7))[0]
    listed = [known(branch, continuation.balance) for branch in branches(many)]
    survived = 0
    for branch in branches(few):
        for index in representative_indices(branch.amplitude_m, branch.frequency_hz, branch.arc):
            point = point_of(continuation, branch, index)
            if point is None or not 0.08 <= point.omega / (2.0 * np.pi) <= 1.0:
                continue
            survived += 1
            assert any(lies_on(continuation, item, point) for item in listed)
    assert survived > 10


@pytest.mark.parametrize(("name", "harmonics"), [("wide gap", 3), ("wide gap", 7), ("light friction", 3)])
def test_a_branch_is_listed_once(solved, name, harmonics):
    curve = solved(name, harmonics)
    continuation = build_continuation(*problem(name, harmonics))[0]
    for one in branches(curve):
        others = [known(branch, continuation.balance) for branch in branches(curve) if branch is not one]
        for index in range(1, one.points - 1, 7):
            point = point_of(continuation, one, index)
            assert not any(lies_on(continuation, other, point) for other in others)


def test_the_highest_branch_comes_first_and_says_how_it_was_found(solved):
    for name, harmonics in (("wide gap", 3), ("wide gap", 7), ("light friction", 3)):
        detached = solved(name, harmonics).detached
        heights = [branch.amplitude_m.max() for branch in detached]
        assert heights == sorted(heights, reverse=True)
        assert all(branch.origin for branch in detached)
        assert solved(name, harmonics).origin == ""


def test_the_upper_end_of_a_closed_branch_is_located(solved):
    """Many more points find no higher one."""
    name = "wide gap"
    found = solved(name).detached[0]
    finer = forced_response(*problem(name, 3, max_step=0.1)).detached[0]
    assert found.peak.located
    assert found.amplitude_m.max() == pytest.approx(finer.amplitude_m.max(), rel=1e-9)
    assert found.peak.frequency_hz == pytest.approx(finer.peak.frequency_hz, rel=1e-6)
    assert found.frequency_hz.max() == pytest.approx(finer.frequency_hz.max(), rel=1e-9)  # the fold too
    assert found.frequency_hz.min() == pytest.approx(finer.frequency_hz.min(), rel=1e-9)


def over_interference(balance, contact, omega, unit, options):
    """The balances of all interferences at one frequency: that of the contact at 1, more by `unit` at 2."""
    contacts = contact.with_interference(contact.interference - unit), contact
    return FixedFrequencyBalance.of(Homotopy(balance, contacts, (1.0, 1.0), options), omega, (LOW, HIGH))


def test_a_balance_over_the_interference_is_that_of_a_shifted_contact():
    modal, contact, excitation, options = problem("light friction")
    balance = build_continuation(modal, contact, excitation, options)[0].balance
    omega, shift = 2.0, 0.37
    over = over_interference(balance, contact, omega, 0.5, options)
    shifted = contact.with_interference(contact.interference + shift)
    expected = build_continuation(modal, shifted, excitation, options)[0].balance
    unknown = 2.0 * np.random.default_rng(3).normal(size=balance.size)
    found = over.evaluate(unknown, 1.0 + shift / 0.5)
    wanted = expected.evaluate(unknown, omega)
    assert np.allclose(found.residual, wanted.residual, rtol=1e-12)
    assert np.allclose(found.jacobian, wanted.jacobian, rtol=1e-9)
    step = 1e-6
    ends = [over.evaluate(unknown, 1.0 + shift / 0.5 + side * step).residual for side in (-1.0, 1.0)]
    assert np.allclose(found.dR_dp, (ends[1] - ends[0]) / (2.0 * step), rtol=1e-6, atol=1e-8)


def test_the_straight_end_of_a_curve_over_the_interference_solves_the_balance():
    modal, contact, excitation, options = problem("light friction")
    continuation = build_continuation(modal, contact, excitation, options)[0]
    omega, unit = 2.0, 60.0  # far enough for open contacts at the one end, for stuck ones at the other
    over = over_interference(continuation.balance, contact, omega, unit, options)
    solver = Continuation(over, continuation.options).solver
    segments = continuation.linear.segments
    for first, last, wanted in ((0.5, LOW, False), (1.5, HIGH, True)):
        solved = newton_solution(over, first)
        point = solver.point(solved, first, (0.0 * solved, last - first), 0, 0.0, 0.05)
        end = straight_end(over, segments, point)
        assert end is not None
        assert end.parameter == last
        assert segments.state(over.shifted(end.unknown, last)).pressed.all() == wanted
        for share in (0.5, 1.0):  # the whole line, not only its end
            unknown = solved + share * (end.unknown - solved)
            residual = over.evaluate(unknown, first + share * (last - first)).residual
            assert np.abs(residual).max() < 1e-8 * np.abs(unknown).max()
        back = replace(point, tangent=(-point.tangent[0], -point.tangent[1]))
        assert straight_end(over, segments, back) is None  # contacts change their state on the way


def newton_solution(balance, parameter):
    unknown = np.zeros(balance.size)
    for _ in range(30):
        linearised = balance.evaluate(unknown, parameter)
        unknown = unknown - np.linalg.solve(linearised.jacobian, linearised.residual)
    assert np.abs(linearised.residual).max() < 1e-10
    return unknown


def test_no_search_where_the_normal_load_is_constant():
    """Friction under a constant load has one steady response: nothing is found, and no curve over v0 is solved."""
    modal, contact, excitation, options = problem("light friction", 1)
    constant = replace(contact, normal_stiffness=np.zeros(2), preload=np.full(2, 3.0))
    assert forced_response(modal, constant, excitation, options).detached == ()


def test_branches_beyond_the_limit_are_counted(monkeypatch):
    monkeypatch.setattr("nonlinear.branches.branch_collection.MOST_BRANCHES", 0)
    curve = forced_response(*problem("wide gap", 1))
    assert curve.detached == ()
    assert curve.branches_left_out > 0


def test_parts_of_a_longer_branch_are_dropped_from_both_lists():
    """Found branches are known too, after those given: of each that is dropped, its own entry goes."""
    given, first, second, third = "given", "first", "second", "third"
    collection = BranchCollection(None, [given, first, second, third], [first, second, third])
    collection._drop([0, 2])
    assert collection.known == [given, second]
    assert collection.found == [second]
