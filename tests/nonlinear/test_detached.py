"""Isolated and detached branches: they are found, closed or open, and solve the equations of a ring of blades."""

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import modal_model

LOW, HIGH = 0.08, 1.0


def solve(harmonics=1, detached=True, *, n_blades=2, damping=0.005, stiffness=0.81, friction=0.05, interference=-2.0):
    modal = modal_model(lumped_blade(n_blades), damping_ratio=damping)
    contact = ContactParameters.shared(
        2,
        normal_stiffness=stiffness,
        tangential_stiffness=0.75 * stiffness,
        friction=friction,
        interference=interference,
    )
    options = SolverOptions((LOW, HIGH), harmonics=harmonics, detached=detached, truncation=False, search="off")
    return modal, contact, forced_response(modal, contact, Excitation(1, 1.0), options)


@pytest.mark.parametrize(
    "parameters",
    [
        {},  # found from the linear responses
        # cut off by the harmonics 2 and 3: found from the peak of the curve with one
        {"harmonics": 3, "stiffness": 9.0, "interference": -1.0, "damping": 0.01},
    ],
)
def test_an_isola_is_found_and_closes(parameters):
    modal, contact, curve = solve(**parameters)
    assert curve.termination.complete
    (isola,) = curve.detached
    assert isola.termination.complete
    assert "detached branch, closed" in isola.termination.message
    # closed: it comes back to where it began, with two folds, and stays inside the range
    assert isola.frequency_hz[0] == pytest.approx(isola.frequency_hz[-1], rel=1e-12)
    assert isola.amplitude_m[0] == pytest.approx(isola.amplitude_m[-1], rel=1e-9)
    assert isola.turning_points.size == 2
    assert LOW < isola.frequency_hz.min() < isola.frequency_hz.max() < HIGH
    assert isola.energy_error.max() < 1e-8
    # and it is apart from the main branch at all of its frequencies
    options = SolverOptions((LOW, HIGH), harmonics=parameters.get("harmonics", 1))
    balance = build_harmonic_balance(modal, contact, Excitation(1, 1.0), options)
    for index in range(0, isola.points, 5):
        omega = 2.0 * np.pi * isola.frequency_hz[index]
        unknown = rows(isola.relative_displacement[index])
        assert balance.relative_error(balance.evaluate(unknown, omega).residual, unknown) < 1e-10
        apart = np.abs(curve.relative_displacement - isola.relative_displacement[index]).max(axis=(1, 2, 3))
        near = np.abs(curve.frequency_hz - isola.frequency_hz[index]) < 0.02
        assert apart[near].min() > 1e-2 * np.abs(isola.relative_displacement[index]).max()


def test_there_is_no_search_unless_asked_for():
    assert solve(detached=False)[2].detached == ()


def test_motion_inside_the_gap_beside_motion_with_contact():
    """Above the folds motions with contact coexist with motions inside the gap."""
    parameters = {"damping": 0.02, "stiffness": 85.28, "friction": 0.4, "interference": -0.3}
    _, _, curve = solve(**parameters)
    assert curve.termination.complete
    assert len(curve.detached) == 1
    branch = curve.detached[0]
    assert branch.frequency_hz.max() == pytest.approx(HIGH)
    open_part = branch.separating == 2
    assert np.any(open_part & (branch.iterations == 0))  # part of it is the linear response without contact


def test_a_stable_point_of_the_isola_holds_in_time():
    """A ring of two blades, started on the upper side of the isola, stays there."""
    harmonics = 9
    modal, contact, curve = solve(harmonics)
    isola = curve.detached[0]
    middle = 0.5 * (isola.frequency_hz.min() + isola.frequency_hz.max())
    top = int(np.argmin(np.where(isola.stable, np.abs(isola.frequency_hz - middle), np.inf)))
    omega = 2.0 * np.pi * isola.frequency_hz[top]
    displacement = to_real(isola.relative_displacement[top])
    integrator = RingIntegrator.of(Ring(modal, contact, Excitation(1, 1.0)), omega)
    wave = integrator.wave_output(displacement)
    integrated = integrator.march(integrator.on_wave(displacement), 200).output_m[-1]
    assert np.max(np.abs(integrated - wave)) < 3e-3 * np.max(np.abs(wave))


def rows(displacement):
    """Real unknown of complex coefficients (H+1, n_c, 3)."""
    real = [displacement[0].real]
    for harmonic in displacement[1:]:
        real += [harmonic.real, harmonic.imag]
    return np.array(real).reshape(-1)
