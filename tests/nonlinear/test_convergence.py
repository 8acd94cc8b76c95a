"""Convergence: in the number of harmonics, of samples towards the exact element, and of the roots of polynomials."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lumped import oscillator

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.contact.element_choice import contact_element
from nonlinear.contact.fourier import basis_at, to_complex
from nonlinear.contact.trigonometric_roots import cell_table, cosine_sine, find_roots
from nonlinear.harmonic_balance.initial_solution import periodic_start, solve_at
from nonlinear.response_solver import build_harmonic_balance
from rom import modal_model


def den_hartog(beta, friction):
    """k A / P of m x'' + k x + F sign(x') = P cos(w t) without stops (Den Hartog 1931), F / P = friction."""
    response = 1.0 / (1.0 - beta**2)
    damping = np.tan(np.pi / (2.0 * beta)) / beta
    return np.sqrt(response**2 - (friction * damping) ** 2)


def nearly_rigid_slider(modal, harmonics, beta):
    """Solve with a slider stiffened step by step, up to an elastic travel of 3e-7 of the static deflection."""
    unit = np.ones(1)
    options = SolverOptions((0.1, 0.2), harmonics=harmonics)
    start = None
    for stiffness in (1e1, 1e2, 1e3, 1e4, 1e5, 1e6):
        contact = ContactParameters(0 * unit, stiffness * unit, unit, 0 * unit, 0.3 * unit)
        balance = build_harmonic_balance(modal, contact, Excitation(0, 1.0), options)
        if start is None:
            start = periodic_start(balance, beta, np.zeros((1, 3)), options)
        else:
            start = solve_at(balance, beta, start.solution, options)
    return start, balance


@pytest.mark.parametrize(("beta", "exact", "one"), [(0.8, 2.626105, 2.567150), (1.25, 1.617065, 1.642976)])
def test_den_hartog(beta, exact, one):
    assert den_hartog(beta, 0.3) == pytest.approx(exact, abs=6e-7)
    modal = modal_model(oscillator(), damping_ratio=0.0)
    errors = []
    for harmonics in (1, 3, 7, 15):
        start, balance = nearly_rigid_slider(modal, harmonics, beta)
        assert start.converged
        x = to_complex(balance.displacement(start.solution))[:, 0, 0]
        theta = np.linspace(0.0, 2.0 * np.pi, 20001)
        amplitude = np.max((np.exp(1j * np.outer(theta, np.arange(x.size))) @ x).real)
        if harmonics == 1:
            assert amplitude == pytest.approx(one, rel=3e-4)
        errors.append(abs(amplitude / exact - 1.0))
    assert errors[-1] < 4e-3
    assert errors[3] < errors[2] < errors[1] < errors[0]


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("harmonics", [1, 3])
def test_samples_converge_to_the_exact_element(harmonics, law):
    """Errors of the sampled force fall at least linearly in the sample spacing, on average over random states."""
    rng = np.random.default_rng(2)
    contact = ContactParameters.shared(
        40, normal_stiffness=40.0, tangential_stiffness=30.0, friction=0.5, interference=rng.normal(size=40), law=law
    )
    rows = rng.normal(size=(2 * harmonics + 1, 40, 3))

    def force(integration, samples):
        options = SolverOptions((1.0, 2.0), harmonics=harmonics, integration=integration, samples=samples)
        return contact_element(contact, harmonics, options).evaluate(rows).force

    exact = force("exact", 64)
    counts = np.array([64, 256, 1024, 4096, 16384])
    errors = np.array([np.sqrt(np.mean((force("sampled", int(n)) - exact) ** 2)) for n in counts])
    rate = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert rate > 0.9
    assert errors[-1] < 1e-4 * np.abs(exact).max()


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("harmonics", [1, 3])
@pytest.mark.parametrize("vibration", [0.0, 1e-25, 1e-20, 1e-16, 1e-12, 1e-6])
def test_motion_of_round_off_size(harmonics, vibration, law):
    """A large static slip under next to no vibration: the slider stands where the limit put it."""
    rng = np.random.default_rng(9)
    contact = ContactParameters.shared(
        50, normal_stiffness=100.0, tangential_stiffness=150.0, friction=0.1, interference=5.0, law=law
    )
    rows = vibration * rng.normal(size=(2 * harmonics + 1, 50, 3))
    rows[0, :, :2] = 10.0 * rng.normal(size=(50, 2))
    options = SolverOptions((1.0, 2.0), harmonics=harmonics)
    forces = contact_element(contact, harmonics, options).evaluate(rows)
    static = 3.0 * rows[0, :, :2]  # kt u, at most mu N = 0.1 * 2 * 5, in each direction or in the plane
    if law == "two_sliders":
        static = np.clip(static, -1.0, 1.0)
    else:
        static /= np.maximum(np.linalg.norm(static, axis=1, keepdims=True), 1.0)
    assert -forces.force[0, :, :2] == pytest.approx(static, abs=1e-14 + 50.0 * vibration)
    assert np.max(np.abs(forces.force[1:])) <= 50.0 * vibration  # 0 where nothing moves: no round-off of the load


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.floats(0.0, 2.0), st.floats(-1.5, 1.5))
def test_exact_and_finely_sampled_agree(seed, harmonics, friction, interference):
    rng = np.random.default_rng(seed)
    contact = ContactParameters.shared(
        4, normal_stiffness=8.0, tangential_stiffness=6.0, friction=friction, interference=interference
    )
    rows = rng.normal(size=(2 * harmonics + 1, 4, 3)) / (1.0 + np.arange(2 * harmonics + 1)[:, None, None] // 2)
    forces = [
        contact_element(
            contact, harmonics, SolverOptions((1.0, 2.0), harmonics=harmonics, integration=kind, samples=16384)
        )
        .evaluate(rows)
        .force
        for kind in ("exact", "sampled")
    ]
    assert np.max(np.abs(forces[0] - forces[1])) < 3e-3


def roots_of(coefficients):
    """All roots of a trigonometric polynomial in [0, 2 pi)."""
    n_harmonics = (coefficients.size - 1) // 2
    cells = np.ascontiguousarray((coefficients @ cell_table(n_harmonics)).reshape(3, -1))
    curves, bounds, roots = np.zeros((4, coefficients.size)), np.empty((4, cells.shape[1])), np.empty(2 * n_harmonics)
    return roots[: find_roots(coefficients, cells, curves, np.empty(4), bounds, roots)]


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.floats(-3.0, 3.0))
def test_all_roots_are_found(seed, harmonics, level):
    """Against the companion matrix: g(theta) = 0 is a polynomial equation of degree 2H in exp(i theta)."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=2 * harmonics + 1)
    rows[0] = level
    found = roots_of(rows)
    complex_rows = (rows[1::2] + 1j * rows[2::2]) / 2.0
    polynomial = np.concatenate([complex_rows[::-1], [rows[0]], np.conj(complex_rows)])
    z = np.roots(polynomial)
    reference = np.sort(np.angle(z[np.abs(np.abs(z) - 1.0) < 1e-9]) % (2.0 * np.pi))
    assert found.size == reference.size
    assert found == pytest.approx(reference, abs=1e-6)
    residual = basis_at(found, harmonics) @ rows
    assert np.abs(residual).max(initial=0.0) < 1e-12 * np.abs(rows).sum() * harmonics


def test_touching_roots_do_not_hang_or_cross():
    """1 + cos(2 theta) touches zero at pi / 2 and 3 pi / 2; lifted by e it has no root, lowered by e two at each."""
    touching = np.array([1.0, 0.0, 0.0, 1.0, 0.0])
    places = np.array([0.5, 0.5, 1.5, 1.5]) * np.pi
    found = roots_of(touching)  # each touch is no root or a pair of roots, at the place of the touch
    assert found.size % 2 == 0
    assert np.all(np.abs(found[:, None] - places[::2]).min(axis=1, initial=np.inf) < 2e-8)
    shifted = touching.copy()
    shifted[0] = 1.0 - 1e-9
    half = 0.5 * np.arccos(1.0 - 1e-9)  # each touch has become two crossings
    assert roots_of(shifted) == pytest.approx(places + half * np.array([-1.0, 1.0, -1.0, 1.0]), abs=1e-10)
    assert roots_of(touching + np.array([1e-9, 0.0, 0.0, 0.0, 0.0])).size == 0


def test_quick_cosine_and_sine():
    angles = np.concatenate([np.linspace(-7.0, 14.0, 4001), np.pi / 2.0 * np.arange(-3, 9), [6000.3, -6000.3]])
    quick = np.array([cosine_sine(float(angle)) for angle in angles])
    assert np.abs(quick - np.stack([np.cos(angles), np.sin(angles)], axis=1)).max() < 3e-16
