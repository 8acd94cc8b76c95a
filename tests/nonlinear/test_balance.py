"""Derivatives of the balance and of the amplitude along the curve against finite differences."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, StaticContact
from nonlinear.branches.range_continuation import continue_over_range
from nonlinear.contact.parameters import SLIP
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.corrector import BorderedSystem
from nonlinear.continuation.response_quantities import amplitude_derivative, largest_amplitude, output_amplitude
from nonlinear.harmonic_balance.initial_solution import periodic_start, static_displacement
from nonlinear.response_solver import build_continuation, build_harmonic_balance
from rom import modal_model


def build(harmonics=2, method="coupled", interference=0.5, law="two_sliders"):
    modal = modal_model(lumped_blade(), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=interference, law=law
    )
    options = SolverOptions((0.1, 0.7), harmonics=harmonics, method=method, samples=256)
    return build_harmonic_balance(modal, contact, Excitation(4, 1.0), options), contact, options


@pytest.mark.parametrize("method", ["coupled", "static-first"])
@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_jacobian_and_frequency_derivative(method, law):
    balance, _, _ = build(method=method, law=law)
    rng = np.random.default_rng(0)
    x = rng.normal(size=balance.size)
    omega, step = 2.1, 1e-6
    linearised = balance.evaluate(x, omega)
    ahead, behind = (balance.evaluate(x, omega + shift).residual for shift in (step, -step))
    assert linearised.dR_dp == pytest.approx((ahead - behind) / (2 * step), rel=1e-7, abs=1e-8)
    for _ in range(6):
        direction = rng.normal(size=balance.size)
        ahead, behind = (balance.evaluate(x + shift * direction, omega).residual for shift in (step, -step))
        assert linearised.jacobian @ direction == pytest.approx((ahead - behind) / (2 * step), rel=1e-6, abs=2e-7)


@pytest.mark.parametrize("harmonics", [1, 3])
@pytest.mark.parametrize("interference", [-2.0, 0.5])
def test_derivative_of_the_amplitude_along_the_curve(harmonics, interference):
    balance, contact, options = build(harmonics, interference=interference)
    solver = Continuation(balance, options).solver
    static = static_displacement(balance.receptance, contact, options)
    omega = 2.0 * np.pi * 0.2
    start = periodic_start(balance, omega, static, options)
    point = solver.starting_point(start.solution, omega, 1.0, 0)
    for _ in range(12):
        step = 1e-4
        points = [point, *(solver.step(point, n * step) for n in (1, 2))]
        heights = [output_amplitude(p, "tip") for p in points]
        numerical = (-3.0 * heights[0] + 4.0 * heights[1] - heights[2]) / (2.0 * step)
        assert amplitude_derivative(point, "tip") == pytest.approx(numerical, rel=1e-4, abs=1e-6 * heights[0])
        point = solver.step(point, 0.1, refactorise=True)


def test_largest_amplitude_of_several_harmonics():
    rng = np.random.default_rng(4)
    theta = np.linspace(0.0, 2.0 * np.pi, 400001)
    for size in (2, 3, 6):
        for _ in range(5):
            harmonics = rng.normal(size=size) + 1j * rng.normal(size=size)
            harmonics[0] = harmonics[0].real
            samples = (np.exp(1j * np.outer(theta, np.arange(size))) @ harmonics).real
            found = largest_amplitude(harmonics)
            assert found.value == pytest.approx(np.abs(samples).max(), rel=1e-9)
            at = (harmonics * np.exp(1j * np.arange(size) * found.angle)).sum().real
            assert found.sign * at == pytest.approx(found.value, rel=1e-12)


@pytest.mark.parametrize("harmonics", [1, 3, 5])
@pytest.mark.parametrize("interference", [-2.0, -0.3, 0.0, 0.5])
def test_newton_converges_quadratically(interference, harmonics):
    """At points with slip and lift-off all along a curve, folds included, the exact Jacobian squares the error."""
    balance, contact, options = build(harmonics, interference=interference)
    continuation = Continuation(balance, options, contact=contact)
    static = static_displacement(balance.receptance, contact, options)
    points = continue_over_range(continuation, static)[0].points
    hard = [point for point in points if point.contact.state.max() > 0 and point.linear is None]
    assert len(hard) > 20
    residuals, converges = [], []
    for point in hard[:: len(hard) // 12]:
        plane = point.unknown, point.omega
        metric = continuation.solver.metric(point.unknown)
        direction = metric.unit(point.tangent)
        ripple = 1e-4 * metric.length * np.sin(1.0 + np.arange(point.unknown.size)) / np.sqrt(point.unknown.size)
        x, w, errors = plane[0] + ripple, plane[1], []
        for _ in range(5):
            errors.append(metric.norm(x - plane[0], w - plane[1]))
            linearised = balance.evaluate(x, w)
            dx, dw = BorderedSystem.factorise(linearised, direction, metric).newton_step(linearised.residual)
            x, w = x + dx, w + dw
        # a root of the plane near the point: the start is moved off it along the plane, so the end may be beside it
        residuals.append(balance.relative_error(balance.evaluate(x, w).residual, x))
        # e1 <= C e0^2 and e2 <= C e1^2: C = 100 is five times the largest seen, the errors are relative, and what a
        # step leaves of them cannot be less than round-off. The error at the start is 1e-4, so e1 < 1e-6, e2 < 1e-10
        first, second, third = (abs(error - errors[-1]) for error in errors[:3])
        converges.append(second < 100.0 * first**2 and third < 100.0 * second**2 + 1e-13)
    assert max(residuals) < 1e-12
    assert np.mean(converges) >= 0.9  # the law has kinks: a step across one does not square the error


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
@pytest.mark.parametrize("preload", [0.6, 3.0])
def test_even_harmonics_that_nothing_excites_are_left_out(preload, law):
    """Friction under a constant load: half a period later motion and forces have the opposite sign."""
    model = lumped_blade(3)
    modal = modal_model(replace(model, force_static=0.3 * model.force_excitation), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=0.0, tangential_stiffness=4.0, friction=0.5, preload=preload, law=law
    )
    options = SolverOptions((0.1, 0.8), harmonics=6)
    balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), options)
    assert balance.odd
    all_harmonics = replace(balance, odd=False)
    static = static_displacement(balance.receptance, contact, options)
    points = continue_over_range(Continuation(balance, options, contact=contact), static)[0].points
    slipping = [point for point in points if point.contact.state.max() == SLIP]
    assert len(slipping) > 10
    for point in slipping[::5]:
        linearised = all_harmonics.evaluate(point.unknown, point.omega)  # the even harmonics are balanced too
        assert all_harmonics.relative_error(linearised.residual, point.unknown) < 1e-11
        assert (
            np.abs(point.displacement[[3, 4, 7, 8, 11, 12]]).max() < 1e-12 * np.abs(point.displacement).max()
        )  # even ones
        odd, full = (part.evaluate(point.unknown, point.omega) for part in (balance, all_harmonics))
        assert odd.coupling[1].size == 7 * 4  # of 13 rows harmonics 0, 1, 3 and 5; no normal displacement
        assert full.coupling[1].size == 13 * 4
        shift = np.sin(1.0 + np.arange(point.unknown.size)).reshape(13, -1)
        shift[3:5] = shift[7:9] = shift[11:13] = 0.0
        difference = (odd.jacobian - full.jacobian) @ shift.reshape(-1)
        assert np.abs(difference).max() < 1e-7 * np.abs(full.jacobian).max()


def test_a_load_that_varies_excites_all_harmonics():
    balance, _, _ = build(3, interference=5.0)
    assert not balance.odd


@pytest.mark.parametrize(("pull", "interference"), [(0.0, 0.4), (3.0, 0.4), (-3.0, -0.2), (12.0, 0.4), (3.0, -0.2)])
def test_static_contact_against_all_states_of_its_nodes(pull, interference):
    """Without friction: of the 8 sets of closed nodes one is in equilibrium, K q = f - sum over it of n N."""
    blade = lumped_blade(n_contacts=3)
    rng = np.random.default_rng(2)
    force = np.zeros(len(blade.stiffness))
    force[3:] = pull * rng.normal(1.0, 0.6, size=force.size - 3)  # on the contact nodes of both faces
    force[3:12] *= -1.0  # takes the right face from the left one
    model = replace(blade, force_static=force)
    v0 = interference + np.array([0.0, 0.1, -0.15])
    contact = ContactParameters.shared(
        3, normal_stiffness=6.0, tangential_stiffness=0.0, friction=0.0, interference=v0
    )
    static = build_continuation(
        modal_model(model, damping_ratio=0.01), contact, Excitation(4, 1.0), SolverOptions((0.1, 0.2))
    )[2]
    found = StaticContact.of(contact, static)
    normals = (blade.contact_right - blade.contact_left)[2::3]
    solutions = []
    for states in product((False, True), repeat=3):
        closed = np.array(states)
        rows = normals[closed]
        matrix = blade.stiffness + 2.0 * rows.T @ rows
        v = v0 + normals @ np.linalg.solve(matrix, force - 2.0 * rows.T @ v0[closed])
        if np.array_equal(v > 0.0, closed):
            solutions.append((2.0 * v[closed].sum(), 1.0 - closed.mean(), v.min(), v.max()))
    ((load, share, lowest, highest),) = solutions
    assert found.force_n == pytest.approx(load, rel=1e-9, abs=1e-12)
    assert found.open_share == pytest.approx(share)
    assert (found.lowest_m, found.highest_m) == pytest.approx((lowest, highest), rel=1e-9)
    assert found.opened == bool(np.any((v0 > 0.0) & (v0 + static[:, 2] <= 0.0)))
