"""The compiled corrector: its solutions against the equations, and its iterations against the corrector in Python."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, build_harmonic_balance
from nonlinear.branches.interference_curves import InterferenceBalance
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.element_choice import contact_element
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.compiled_corrector import compiled_corrector
from nonlinear.continuation.corrector import NormalPlane, correct
from nonlinear.harmonic_balance.initial_solution import static_displacement
from rom import modal_model

# Slip, lift-off and a node that stays open; no friction; a constant normal load, which is odd.
CASES = {
    "slip": {"normal_stiffness": 4.0, "tangential_stiffness": 3.0, "friction": 0.4, "interference": 0.3},
    "gap": {
        "normal_stiffness": 4.0,
        "tangential_stiffness": 3.0,
        "friction": 0.4,
        "interference": np.array([-1.0, -1e3]),
    },
    "smooth": {"normal_stiffness": 4.0, "tangential_stiffness": 3.0, "friction": 0.0, "interference": 0.3},
    "odd": {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.4, "preload": 1.0},
}


def curve(case, harmonics):
    modal = modal_model(lumped_blade(), damping_ratio=0.02)
    contact = ContactParameters.shared(2, **CASES[case])
    options = SolverOptions((0.1, 0.7), harmonics=harmonics)
    balance = build_harmonic_balance(modal, contact, Excitation(4, 1.0), options)
    continuation = Continuation(balance, options, contact=contact)
    static = static_displacement(balance.receptance, contact, options)
    points = continue_over_range(continuation, static)[0].points
    assert len(points) > 20
    return balance, options, points[5::9]


def planes(points):
    for point in points:
        (dx, domega), step = point.tangent, 0.01
        yield NormalPlane(point.unknown + step * dx, point.omega + step * domega, point.tangent, point.metric, 1.0)


@pytest.mark.parametrize("harmonics", [1, 4])
@pytest.mark.parametrize("case", CASES)
def test_solution_tangent_and_signs_satisfy_the_dense_equations(case, harmonics):
    balance, options, points = curve(case, harmonics)
    compiled = compiled_corrector(balance, options)
    for plane in planes(points):
        found = compiled.correct(plane, None, refactorise=True)
        linearised, metric = balance.evaluate(found.unknown, found.omega), plane.metric
        assert balance.relative_error(linearised.residual, found.unknown) <= options.tolerance
        off = found.unknown - plane.unknown, found.omega - plane.omega
        assert metric.product(off, plane.direction) == pytest.approx(0.0, abs=1e-12)
        (dx, domega), sign, jacobian_sign = found.tangent
        change = linearised.jacobian @ dx + linearised.dR_domega * domega
        assert np.abs(change).max() < 1e-9 * np.abs(linearised.dR_domega * domega).max() + 1e-12 * metric.length
        assert metric.norm(dx, domega) == pytest.approx(1.0)
        row = np.append(plane.direction[0] / metric.length**2, plane.direction[1] / metric.omega**2)
        bordered = np.vstack([np.column_stack([linearised.jacobian, linearised.dR_domega]), row])
        assert sign == np.linalg.slogdet(bordered).sign
        assert jacobian_sign == np.linalg.slogdet(linearised.jacobian).sign
        contact = balance.forces(found.unknown)
        assert found.contact.force == pytest.approx(contact.force, abs=1e-12)
        assert found.contact.jacobian == pytest.approx(contact.jacobian, abs=1e-12)
        assert np.array_equal(found.contact.state, contact.state)


@pytest.mark.parametrize("case", CASES)
def test_iterations_are_those_of_the_corrector_in_python(case):
    balance, options, points = curve(case, 3)
    compiled = compiled_corrector(balance, options)
    offset = 1e-3 * points[0].metric.length * np.random.default_rng(0).normal(size=balance.size)
    if balance.odd:
        offset.reshape(-1, 6)[[3, 4]] = 0.0
    for plane in planes(points):
        for start in (None, (offset, 0.0)):
            one, other = compiled.correct(plane, start, False), correct(balance, options, plane, start)
            assert one.iterations == other.iterations
            assert one.unknown == pytest.approx(other.unknown, abs=1e-8 * plane.metric.length)
            assert one.omega == pytest.approx(other.omega, rel=1e-8)
            assert one.tangent[0][0] == pytest.approx(other.tangent[0][0], abs=1e-5 * plane.metric.length)
            assert one.tangent[1:] == other.tangent[1:]


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
        left = balance.evaluate(found.unknown, found.omega).residual
        assert np.abs(left - defect).max() < 1e-6 * np.abs(defect).max()
        assert found.unknown == pytest.approx(other.unknown, abs=1e-8 * plane.metric.length)
        assert found.omega == pytest.approx(other.omega, rel=1e-8)


def test_a_solution_too_far_from_the_prediction_is_refused():
    balance, options, points = curve("slip", 1)
    compiled = compiled_corrector(balance, options)
    plane = next(planes(points))
    away = NormalPlane(3.0 * plane.unknown, plane.omega, plane.direction, plane.metric, 1e-3)
    assert compiled.correct(away, None, False) is None
    assert correct(balance, options, away) is None


def test_tangent_from_old_factors_is_that_of_the_solution():
    """Without a factorisation at the solution the tangent is refined: the same to the size of its last change."""
    balance, options, points = curve("slip", 4)
    compiled = compiled_corrector(balance, options)
    for plane in planes(points):
        refined, exact = (compiled.correct(plane, None, again).tangent for again in (False, True))
        difference = refined[0][0] - exact[0][0], refined[0][1] - exact[0][1]
        assert plane.metric.norm(*difference) < 3e-3
        assert refined[1:] == exact[1:]


def test_balances_with_other_equations_or_contacts_are_left_to_python():
    balance, options, _ = curve("slip", 1)
    assert compiled_corrector(balance, options) is not None
    sampled = contact_element(balance.element.parameters, 1, replace(options, integration="sampled"))
    others = [
        InterferenceBalance.of(balance, 1.0, 1.0),
        replace(balance, element=sampled),
        replace(balance, frozen_static=np.zeros((2, 3))),
    ]
    assert [compiled_corrector(other, options) for other in others] == [None] * 3
