"""Floquet exponents of the wave against time integration of the whole ring, on all branches of curves with folds."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from lumped import lumped_blade
from ring_map import ring_map

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis, Instability, floquet_exponents, instability_of
from nonlinear.stability.hill import RETENTION_HARMONIC
from rom import modal_model

RANGE, COARSE = (0.1, 0.8), 5


@lru_cache
def response(n_blades, interference, friction, law="two_sliders"):
    """Contact, modes and the curve with a few harmonics."""
    modal = modal_model(lumped_blade(n_blades, 1), damping_ratio=0.01)
    contact = ContactParameters.shared(
        1,
        normal_stiffness=6.0,
        tangential_stiffness=4.2,
        friction=friction,
        interference=interference,
        law=law,
    )
    quick = {"detached": False, "truncation": False, "search": "off"}
    options = SolverOptions(RANGE, harmonics=COARSE, stability="folds", **quick)
    curve = forced_response(modal, contact, Excitation(1, 1.0), options)
    assert curve.termination.complete
    return modal, contact, curve


@lru_cache
def solutions(n_blades, interference, friction, omega, harmonics, law="two_sliders"):
    """The balance with many harmonics and its solutions at omega, near those of the curve, largest first."""
    modal, contact, curve = response(n_blades, interference, friction, law)
    balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), SolverOptions(RANGE, harmonics=harmonics))
    omegas, found = 2.0 * np.pi * curve.frequency_hz, []
    for i in np.flatnonzero((omegas[:-1] - omega) * (omegas[1:] - omega) < 0.0):
        share = (omega - omegas[i]) / (omegas[i + 1] - omegas[i])
        rows = to_real((1.0 - share) * curve.relative_displacement[i] + share * curve.relative_displacement[i + 1])
        unknown = np.zeros(balance.size)
        unknown[: rows.size] = rows.reshape(-1)[: unknown.size]
        for _ in range(40):
            at = balance.evaluate(unknown, omega)
            step = np.linalg.solve(at.jacobian, -at.residual)
            unknown = unknown + step
            if np.abs(step).max() < 1e-12 * np.abs(unknown).max():
                break
        else:
            raise AssertionError("no solution near that of the curve")
        found.append(unknown)
    return balance, sorted(found, key=np.linalg.norm, reverse=True)


def ring_kappas(n_blades):
    """Phase shifts of all perturbations of the ring, 0 to pi; -kappa has the complex conjugate exponents."""
    return [2.0 * np.pi * k / n_blades for k in range(n_blades // 2 + 1)]


def exponents(balance, contact, unknown, omega, n_blades):
    """kappa -> exponents / omega."""
    displacement, jacobian = balance.displacement(unknown), balance.forces(unknown).jacobian
    return {
        kappa: FloquetAnalysis.of(balance.receptance, contact, kappa=kappa).exponents(displacement, jacobian, omega)
        / omega
        for kappa in ring_kappas(n_blades)
    }


CASES = [
    # blades, interference, friction, omega, branch; what grows with the symmetry of the wave, and what without
    (2, -4.0, 0.4, 1.17, 0, None, Instability.REAL),  # upper branch: the two blades stop moving alike
    (2, -4.0, 0.4, 1.17, 1, Instability.REAL, None),  # between the folds
    (2, -4.0, 0.4, 1.17, 2, None, None),  # lower branch: open
    (3, -4.0, 0.4, 1.2, 1, Instability.REAL, None),
    (3, 0.3, 0.4, 3.6, 1, Instability.REAL, Instability.COMPLEX),  # slip, and lift-off in part of the cycle
    (2, -0.5, 0.0, 1.54, 0, Instability.COMPLEX, None),  # no fold anywhere near
    (2, -0.5, 0.4, 1.5, 0, Instability.COMPLEX, None),  # the same with friction
]


@pytest.mark.parametrize(("n_blades", "interference", "friction", "omega", "branch", "own", "other"), CASES)
def test_exponents_are_those_of_the_ring(n_blades, interference, friction, omega, branch, own, other):
    """Every multiplier near the unit circle or beyond, in growth and in frequency."""
    _, contact, _ = response(n_blades, interference, friction)
    balance, found = solutions(n_blades, interference, friction, omega, 25)
    unknown = found[branch]
    hill = exponents(balance, contact, unknown, omega, n_blades)
    ring = ring_map(balance, contact, omega, n_blades, unknown, steps=800 if n_blades == 2 else 600)
    state, jacobian = ring.fixed_point(ring.start)
    assert np.abs(state - ring.start)[: ring.positions].max() < 0.02

    pool = np.concatenate([value for row in hill.values() for value in (row, row.conj())])
    marched = ring.exponents(jacobian) / omega
    for value in marched[marched.real > -0.03]:
        assert np.abs(pool - value).min() < 0.006 + 0.05 * abs(value.real)
    leading = max(row[0].real for row in hill.values())
    assert leading == pytest.approx(marched[0].real, rel=0.06, abs=1e-3)

    kappas = list(hill)
    grows = [None if hill[kappa][0].real < 0.0 else instability_of(hill[kappa][0], 1.0) for kappa in kappas]
    assert grows[0] is own
    assert next((item for item in grows[1:] if item), None) is other
    sign = np.linalg.slogdet(balance.evaluate(unknown, omega).jacobian)[0]
    assert (sign < 0) == (own is Instability.REAL)


@pytest.mark.parametrize(("case", "periods"), [(0, 10), (2, 200)])
def test_a_small_disturbance_grows_or_decays_as_foretold(case, periods):
    """Marched in time from the periodic motion and a little beside it: no derivative of the map."""
    n_blades, interference, friction, omega, branch, own, other = CASES[case]
    _, contact, _ = response(n_blades, interference, friction)
    balance, found = solutions(n_blades, interference, friction, omega, 25)
    hill = exponents(balance, contact, found[branch], omega, n_blades)
    leading = max((row[0] for row in hill.values()), key=lambda value: value.real)
    ring = ring_map(balance, contact, omega, n_blades, found[branch], steps=500)
    periodic, _ = ring.fixed_point(ring.start)
    disturbance = 1e-6 * np.random.default_rng(2).normal(size=periodic.size)
    disturbance[2 * ring.positions :] = 0.0
    disturbed, apart = periodic + disturbance, []
    for _ in range(periods):
        periodic, disturbed = ring(periodic), ring(disturbed)
        apart.append((disturbed - periodic)[: ring.positions])
    # what decays fast has gone: d_(k+2) = a d_(k+1) + b d_k, whose roots are the leading pair of multipliers
    first, second, third = (np.concatenate(apart[-4 - shift : -2 - shift]) for shift in (2, 1, 0))
    (a, b), *_ = np.linalg.lstsq(np.stack([second, first], axis=1), third, rcond=None)
    root = max(np.roots([1.0, -a, -b]).astype(complex), key=abs)
    marched = np.log(root) / (2.0 * np.pi)
    assert marched.real == pytest.approx(leading.real, rel=0.08, abs=2e-4)
    assert abs(marched.imag) == pytest.approx(abs(leading.imag), abs=0.005)
    assert (marched.real > 0.0) == (own is not None or other is not None)


@pytest.mark.parametrize(
    ("n_blades", "interference", "omega", "branch"),
    [
        (3, 0.3, 3.6, 1),  # slip, and lift-off in part of the cycle; grows in both ways
        (2, -0.5, 1.5, 0),  # quasi-periodic
    ],
)
def test_exponents_of_sliders_under_the_cone(n_blades, interference, omega, branch):
    """In growth and in frequency, those that nearly grow too; without memory they are far off."""
    _, contact, _ = response(n_blades, interference, 0.4, "cone")
    balance, found = solutions(n_blades, interference, 0.4, omega, 15, "cone")
    hill = exponents(balance, contact, found[branch], omega, n_blades)
    ring = ring_map(balance, contact, omega, n_blades, found[branch], steps=600)
    marched = ring.exponents(ring.fixed_point(ring.start)[1]) / omega
    kept = marched[marched.real > -0.01]
    assert kept[0].real > 0.05
    jacobian = balance.forces(found[branch]).jacobian
    errors = []
    for forgetful in (False, True):
        if forgetful:
            problems = [FloquetAnalysis.of(balance.receptance, contact, kappa=k).problem for k in hill]
            rows = [floquet_exponents(problem, jacobian, omega) / omega for problem in problems]
        else:
            rows = list(hill.values())
        pool = np.concatenate([value for row in rows for value in (row, row.conj())])
        errors.append(max(np.abs(pool - value).min() for value in kept))
    assert errors[0] < 0.008
    assert errors[1] > 3.0 * errors[0]


def test_poles_of_high_harmonics_matter_little():
    n_blades, interference, friction, omega = 2, -0.5, 0.4, 1.5
    _, contact, _ = response(n_blades, interference, friction)
    balance, found = solutions(n_blades, interference, friction, omega, 15)
    analysis = FloquetAnalysis.of(balance.receptance, contact)
    analysis, whole = (  # as with many contact nodes, and with few
        replace(analysis, problem=replace(analysis.problem, retention_harmonic=h)) for h in (RETENTION_HARMONIC, 15)
    )
    point = balance.displacement(found[0]), balance.forces(found[0]).jacobian, omega
    assert len(whole.problem.eigenproblem(*point[1:]).state_matrix) > 2 * len(
        analysis.problem.eigenproblem(*point[1:]).state_matrix
    )
    assert np.abs(analysis.exponents(*point)[:2] - whole.exponents(*point)[:2]).max() < 1e-4 * omega


def test_more_harmonics_come_nearer_to_the_ring():
    n_blades, interference, friction, omega = 2, -0.5, 0.0, 1.54
    _, contact, _ = response(n_blades, interference, friction)
    marched, errors = None, []
    for harmonics in (15, 7):
        balance, found = solutions(n_blades, interference, friction, omega, harmonics)
        if marched is None:
            ring = ring_map(balance, contact, omega, n_blades, found[0], steps=2000)
            marched = ring.exponents(ring.fixed_point(ring.start)[1])[0] / omega
        leading = exponents(balance, contact, found[0], omega, n_blades)[0.0][0]
        errors.append(abs(leading.real - marched.real) / marched.real)
    assert errors[0] < 0.005
    assert errors[0] < errors[1] < 0.05
