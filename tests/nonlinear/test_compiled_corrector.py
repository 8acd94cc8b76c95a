"""The compiled corrector: its solutions against the equations, and its iterations against the corrector in Python."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.branches.parameter_continuation import FixedFrequencyBalance, Homotopy, rate_of_change
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.element_choice import contact_element
from nonlinear.continuation import corrector
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.corrector import NormalPlane, compiled_corrector, correct
from nonlinear.harmonic_balance.initial_solution import static_displacement
from nonlinear.response_solver import build_harmonic_balance
from rom import modal_model

# Slip, lift-off and a node that stays open; no friction; a constant normal load, which is odd.
CASES = {
    "slip": {"normal_stiffness": 4.0, "tangential_stiffness": 3.0, "friction": 0.4, "interference": 0.3},
    "gap": {"normal_stiffness": 4.0, "tangential_stiffness": 3.0, "friction": 0.4, "interference": -1.0},
    "smooth": {"normal_stiffness": 4.0, "tangential_stiffness": 3.0, "friction": 0.0, "interference": 0.3},
    "odd": {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.4, "preload": 1.0},
}


FEW, MANY = 2, 6  # contact nodes: of dense and of condensed factors


def curve(case, harmonics, nodes=FEW):
    modal, law = modal_model(lumped_blade(12, nodes), damping_ratio=0.02), dict(CASES[case])
    if case == "gap":
        law["interference"] = np.array([-1.0, *[-1e3] * (nodes - 1)])
    contact = ContactParameters.shared(nodes, **law)
    options = SolverOptions((0.1, 0.7), harmonics=harmonics)
    balance = build_harmonic_balance(modal, contact, Excitation(4, 1.0), options)
    continuation = Continuation(balance, options, contact=contact)
    static = static_displacement(balance.receptance, contact, options)
    points = continue_over_range(continuation, static)[0].points
    assert len(points) > 20
    assert (compiled_corrector(balance, options).condensed.motions.shape[1] > 0) == (nodes == MANY)
    return balance, options, points[5::9]


def planes(points):
    for point in points:
        (dx, domega), step = point.tangent, 0.01
        yield NormalPlane(point.unknown + step * dx, point.omega + step * domega, point.tangent, point.metric, 1.0)


@pytest.mark.parametrize("nodes", [FEW, MANY])
@pytest.mark.parametrize("harmonics", [1, 4])
@pytest.mark.parametrize("case", CASES)
def test_solution_tangent_and_signs_satisfy_the_dense_equations(case, harmonics, nodes):
    balance, options, points = curve(case, harmonics, nodes)
    compiled = compiled_corrector(balance, options)
    for plane in planes(points):
        found = compiled.correct(plane, None, refactorise=True)
        linearised, metric = balance.evaluate(found.unknown, found.parameter), plane.metric
        assert balance.relative_error(linearised.residual, found.unknown) <= options.tolerance
        off = found.unknown - plane.unknown, found.parameter - plane.parameter
        assert metric.product(off, plane.direction) == pytest.approx(0.0, abs=1e-12)
        (dx, domega), sign, jacobian_sign = found.tangent
        change = linearised.jacobian @ dx + linearised.dR_dp * domega
        assert np.abs(change).max() < 1e-9 * np.abs(linearised.dR_dp * domega).max() + 1e-12 * metric.length
        assert metric.norm(dx, domega) == pytest.approx(1.0)
        row = np.append(plane.direction[0] / metric.length**2, plane.direction[1] / metric.parameter**2)
        bordered = np.vstack([np.column_stack([linearised.jacobian, linearised.dR_dp]), row])
        assert sign == np.linalg.slogdet(bordered).sign
        assert jacobian_sign == np.linalg.slogdet(linearised.jacobian).sign
        contact = balance.forces(found.unknown)
        assert found.contact.force == pytest.approx(contact.force, abs=1e-12)
        assert found.contact.jacobian == pytest.approx(contact.jacobian, abs=1e-12)
        assert np.array_equal(found.contact.state, contact.state)


@pytest.mark.parametrize("nodes", [FEW, MANY])
@pytest.mark.parametrize("case", CASES)
def test_solutions_are_those_of_the_corrector_in_python_without_more_iterations(case, nodes):
    """There a Jacobian serves several steps, here each step is solved with its own."""
    balance, options, points = curve(case, 3, nodes)
    iterations = []
    compiled = compiled_corrector(balance, options)
    offset = 1e-3 * points[0].metric.length * np.random.default_rng(0).normal(size=balance.size)
    if balance.odd:
        offset.reshape(-1, 3 * nodes)[[3, 4]] = 0.0
    for plane in planes(points):
        for start in (None, (offset, 0.0)):
            one, other = compiled.correct(plane, start, False), correct(balance, options, plane, start, True)
            iterations.append((one.iterations, other.iterations))
            assert one.unknown == pytest.approx(other.unknown, abs=1e-8 * plane.metric.length)
            assert one.parameter == pytest.approx(other.parameter, rel=1e-8)
            assert one.tangent[0][0] == pytest.approx(other.tangent[0][0], abs=1e-5 * plane.metric.length)
            assert one.tangent[1:] == other.tangent[1:]
    compiled_ones, others = np.transpose(iterations)
    assert compiled_ones.sum() <= others.sum()
    assert np.all(compiled_ones <= others + 1)


@pytest.mark.parametrize("dense", [True, False])
def test_motions_too_few_to_converge_do_not_serve(dense, monkeypatch):
    """Dense factors take over, those of the corrector in Python where the kernels have none."""
    balance, options, points = curve("slip", 3, MANY)
    monkeypatch.setattr(corrector, "motion_count", lambda balance, left: 1)
    monkeypatch.setattr(corrector, "MOST_UNKNOWNS", balance.size if dense else 0)
    compiled = compiled_corrector(balance, options)
    for plane in planes(points):
        for refactorise in (False, True):
            expected = correct(balance, options, plane, None, dense or refactorise)
            one, other = compiled.correct(plane, None, refactorise), expected
            assert one.unknown == pytest.approx(other.unknown, abs=1e-8 * plane.metric.length)
            assert one.tangent[0][0] == pytest.approx(other.tangent[0][0], abs=1e-5 * plane.metric.length)
            assert one.tangent[1:] == other.tangent[1:]


def test_the_number_of_motions_follows_from_what_they_leave():
    balance, _, _ = curve("slip", 3, MANY)
    size = 3 * MANY
    decay = 10.0 ** -np.arange(size)
    assert corrector.motion_count(balance, np.ones(size) * 1e3) == 0
    counts = [corrector.motion_count(balance, factor * decay) for factor in (1.0, 1e2, 1e4)]
    assert 0 < counts[0] < counts[1] < counts[2]


def test_a_face_of_many_nodes_is_left_to_dense_factors():
    """From 50 nodes on the receptance has no motions that serve for all harmonics; so has a ring of few blades."""
    modal = modal_model(lumped_blade(60, 50), damping_ratio=0.02)
    contact, options = ContactParameters.shared(50, **CASES["slip"]), SolverOptions((0.1, 0.7))
    balance = build_harmonic_balance(modal, contact, Excitation(4, 1.0), options)
    assert balance.receptance.large
    assert compiled_corrector(balance, options) is None


@pytest.mark.parametrize("case", CASES)
def test_a_defect_is_what_the_equations_leave(case):
    """Solved up to a given residual, the balance without it leaves that residual; both correctors agree."""
    balance, options, points = curve(case, 3)
    defect = 1e-4 * points[0].metric.length * np.random.default_rng(1).normal(size=balance.size)
    if balance.odd:
        defect.reshape(-1, 6)[[3, 4]] = 0.0
    shifted = replace(balance, defect=defect)
    compiled = compiled_corrector(shifted, options)
    for plane in planes(points):
        found, other = compiled.correct(plane, None, True), correct(shifted, options, plane, None)
        left = balance.evaluate(found.unknown, found.parameter).residual
        assert np.abs(left - defect).max() < 1e-6 * np.abs(defect).max()
        assert found.unknown == pytest.approx(other.unknown, abs=1e-8 * plane.metric.length)
        assert found.parameter == pytest.approx(other.parameter, rel=1e-8)


def interference_balances(balance, options, points):
    """Balances over the interference: the same at all nodes; to another problem, with what it leaves."""
    point, limits = points[len(points) // 2], (-0.5, 2.5)
    contact = balance.element.parameters
    below = contact.with_interference(contact.interference - 0.1)
    homotopy = Homotopy(balance, (below, contact), (1.0, 1.0), options)
    yield FixedFrequencyBalance.of(homotopy, point.omega, limits), point, 1.0
    shift = np.resize([0.05, -0.1], balance.n_contacts)
    first = balance.element.parameters.with_interference(balance.element.parameters.interference + shift)
    homotopy = Homotopy(balance, (first, balance.element.parameters), (1.0, 1.0), options)
    homotopy = homotopy.from_solution(point.unknown, point.omega)
    assert homotopy.defect is not None
    yield FixedFrequencyBalance.of(homotopy, point.omega, limits), point, 0.0


@pytest.mark.parametrize("nodes", [FEW, MANY])
@pytest.mark.parametrize("harmonics", [1, 4])
@pytest.mark.parametrize("case", ["slip", "gap", "smooth"])
def test_curves_over_the_interference_are_those_of_the_equations(case, harmonics, nodes):
    balance, options, points = curve(case, harmonics, nodes)
    for over, point, parameter in interference_balances(balance, options, points):
        continuation = Continuation(over, options)
        solver = continuation.solver
        assert compiled_corrector(over, continuation.options) is not None
        at, step = solver.point(point.unknown, parameter, (0.0 * point.unknown, 1.0), 0, 0.0, 0.01), 0.01
        for _ in range(3):
            following = solver.step(at, step, refactorise=True)
            linearised = over.evaluate(following.unknown, following.parameter)
            assert over.relative_error(linearised.residual, following.unknown) <= 10.0 * options.tolerance
            (dx, dp), change = following.tangent, linearised.jacobian @ following.tangent[0]
            left = np.abs(change + linearised.dR_dp * dp).max()  # dR/ds is a difference
            assert left < 1e-4 * np.abs(linearised.dR_dp * dp).max() + 1e-9
            predicted = at.unknown + step * at.tangent[0], at.parameter + step * at.tangent[1]
            other = correct(
                over, continuation.options, NormalPlane(*predicted, at.tangent, at.metric, 1.0), None, True
            )
            assert following.unknown == pytest.approx(other.unknown, abs=1e-7 * at.metric.length)
            refined = solver.step(at, step).tangent
            assert at.metric.norm(refined[0] - dx, refined[1] - dp) < 3e-3
            at = following


@pytest.mark.parametrize("nodes", [FEW, MANY])
@pytest.mark.parametrize("case", ["slip", "gap", "smooth"])
def test_the_change_with_the_interference_is_that_of_neighbouring_solutions(case, nodes):
    balance, options, points = curve(case, 3, nodes)
    shift = np.resize([0.05, -0.1], nodes)
    parameters = balance.element.parameters
    contacts = parameters, parameters.with_interference(parameters.interference + shift)
    homotopy = Homotopy(balance, contacts, (1.0, 1.0), options)
    solver, point = Continuation(homotopy.balance(0.0), options).solver, points[len(points) // 2]
    rate = solver.interference_rate(point, homotopy.interference_change)
    by_difference = rate_of_change(homotopy.balance(0.0), homotopy.balance(1e-6), 1e-6, point)
    assert np.linalg.norm(rate[0]) > 0.0
    assert rate[0] == pytest.approx(by_difference[0], abs=1e-4 * np.abs(rate[0]).max())
    assert rate[1] == pytest.approx(by_difference[1], rel=1e-4)
    assert replace(homotopy, forces=(1.0, 2.0)).interference_change is None


def test_a_solution_too_far_from_the_prediction_is_refused():
    balance, options, points = curve("slip", 1)
    compiled = compiled_corrector(balance, options)
    plane = next(planes(points))
    away = NormalPlane(3.0 * plane.unknown, plane.parameter, plane.direction, plane.metric, 1e-3)
    assert compiled.correct(away, None, False) is None
    assert correct(balance, options, away) is None


@pytest.mark.parametrize("nodes", [FEW, MANY])
def test_tangent_from_old_factors_is_that_of_the_solution(nodes):
    """Without a factorisation at the solution the tangent is refined."""
    balance, options, points = curve("slip", 4, nodes)
    compiled = compiled_corrector(balance, options)
    for plane in planes(points):
        refined, exact = (compiled.correct(plane, None, again).tangent for again in (False, True))
        difference = refined[0][0] - exact[0][0], refined[0][1] - exact[0][1]
        assert plane.metric.norm(*difference) < 1e-5
        assert refined[1:] == exact[1:]


def test_balances_with_other_equations_or_contacts_are_left_to_python():
    balance, options, _ = curve("slip", 1)
    assert compiled_corrector(balance, options) is not None
    sampled = contact_element(balance.element.parameters, 1, replace(options, integration="sampled"))
    stiffer = replace(balance.element.parameters, normal_stiffness=2.0 * balance.element.parameters.normal_stiffness)
    homotopy = Homotopy(balance, (stiffer, balance.element.parameters), (1.0, 1.0), options)
    others = [
        FixedFrequencyBalance.of(homotopy, 1.0),
        replace(balance, element=sampled),
        replace(balance, frozen_static=np.zeros((2, 3))),
    ]
    assert [compiled_corrector(other, options) for other in others] == [None] * 3
