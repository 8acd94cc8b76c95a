"""Derivatives of the whole balance and of the amplitude along the curve against finite differences."""

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, harmonic_balance
from nonlinear.continuation import Continuation
from nonlinear.quantities import amplitude_slope, largest_amplitude, output_harmonics
from nonlinear.start import periodic_start, static_displacement
from rom import modal_model


def build(harmonics=2, method="coupled", interference=0.5, law="uncoupled"):
    modal = modal_model(lumped_blade(), damping_ratio=0.02)
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=interference, law=law
    )
    options = SolverOptions((0.1, 0.7), harmonics=harmonics, method=method, samples=256)
    return harmonic_balance(modal, contact, Excitation(4, 1.0), options), contact, options


@pytest.mark.parametrize("method", ["coupled", "static-first"])
@pytest.mark.parametrize("law", ["uncoupled", "coupled"])
def test_jacobian_and_frequency_derivative(method, law):
    balance, _, _ = build(method=method, law=law)
    rng = np.random.default_rng(0)
    x = rng.normal(size=balance.size)
    omega, step = 2.1, 1e-6
    at = balance.evaluate(x, omega)
    ahead, behind = (balance.evaluate(x, omega + shift).residual for shift in (step, -step))
    assert at.slope == pytest.approx((ahead - behind) / (2 * step), rel=1e-7, abs=1e-8)
    for _ in range(6):
        direction = rng.normal(size=balance.size)
        ahead, behind = (balance.evaluate(x + shift * direction, omega).residual for shift in (step, -step))
        assert at.jacobian @ direction == pytest.approx((ahead - behind) / (2 * step), rel=1e-6, abs=2e-7)


@pytest.mark.parametrize("harmonics", [1, 3])
@pytest.mark.parametrize("interference", [-2.0, 0.5])
def test_slope_of_the_amplitude_along_the_curve(harmonics, interference):
    balance, contact, options = build(harmonics, interference=interference)
    continuation = Continuation(balance, options)
    static = static_displacement(balance.receptance, contact, options)
    omega = 2.0 * np.pi * 0.2
    start = periodic_start(balance, omega, static, options)
    at = balance.evaluate(start.solution, omega)
    onward = np.linalg.solve(at.jacobian, -at.slope), 1.0
    point = continuation.point(start.solution, omega, onward, 0, 0.0, 0.05)
    for _ in range(12):
        step = 1e-4
        points = [point, *(continuation.correct(point, n * step) for n in (1, 2))]
        heights = [largest_amplitude(output_harmonics(p, "tip")).value for p in points]
        numerical = (-3.0 * heights[0] + 4.0 * heights[1] - heights[2]) / (2.0 * step)
        assert amplitude_slope(point, "tip") == pytest.approx(numerical, rel=1e-4, abs=1e-6 * heights[0])
        point = continuation.correct(point, 0.1, sharp=True)


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


def test_newton_converges_quadratically():
    """Near a solution with slip and lift-off the exact Jacobian squares the error at each step."""
    balance, contact, options = build(3, interference=0.5)
    static = static_displacement(balance.receptance, contact, options)
    omega = 2.0 * np.pi * 0.33
    solved = periodic_start(balance, omega, static, options).solution
    assert balance.forces(solved).state.max() > 0
    x = solved * (1.0 + 1e-3 * np.sin(np.arange(solved.size)))
    errors = []
    for _ in range(4):
        errors.append(np.linalg.norm(x - solved) / np.linalg.norm(solved))
        at = balance.evaluate(x, omega)
        x = x - np.linalg.solve(at.jacobian, at.residual)
    assert errors[2] < 1e4 * errors[1] ** 2 + 1e-13
    assert errors[3] < 1e-10
