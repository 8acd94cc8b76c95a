"""Nonlinear modes: closed forms of a mass with a slider, derivatives, linear limits, and resonances against peaks."""

import numpy as np
import pytest
from lumped import lumped_blade, oscillator

from nonlinear import (
    ContactParameters,
    Excitation,
    SolverOptions,
    contact_element,
    forced_response,
    nonlinear_mode,
)
from nonlinear.nonlinear_modes.extended_motion import ExtendedMotion, MotionState
from nonlinear.nonlinear_modes.mode_curve import ModeContinuation
from rom import RelativeReceptance, modal_model, natural_frequencies

SLIDER = {"normal_stiffness": 0.0, "tangential_stiffness": 1.0, "friction": 1.0, "preload": 1.0}
QUICK = {"detached": False, "stability": "folds", "truncation": False, "time_integration": False}


def motion_of(modal, contact, harmonics: int) -> ExtendedMotion:
    receptance = RelativeReceptance(modal, 0.0, tuple(range(harmonics + 1)), 0.0)
    options = SolverOptions((0.05, 0.5), harmonics=harmonics)
    return ExtendedMotion(receptance, contact_element(contact, harmonics, options), 0)


def state_of(amplitude: float, harmonics: int) -> MotionState:
    displacement = np.zeros((2 * harmonics + 1, 1, 3))
    displacement[1, 0, 0] = amplitude
    return MotionState(displacement, amplitude, 1.2, 0.1, np.log(amplitude))


@pytest.mark.parametrize("amplitude", [1.5, 2.0, 3.0])
def test_closed_form_of_a_mass_with_a_slider(amplitude: float) -> None:
    """omega^2 = (k + a1/X)/m, zeta = -b1/(2 m omega^2 X), with the slider's first Fourier coefficients."""
    motion = motion_of(modal_model(oscillator(), damping_ratio=1e-13), ContactParameters.shared(1, **SLIDER), 1)
    found = ModeContinuation(motion, (3, 1, 3)).solve_at_level(state_of(amplitude, 1))
    turning = np.arccos(1.0 - 2.0 / amplitude)
    a1 = amplitude / np.pi * (turning - 0.5 * np.sin(2.0 * turning))
    b1 = -4.0 / np.pi * (1.0 - 1.0 / amplitude)
    omega = np.sqrt(1.0 + a1 / amplitude)
    assert found is not None
    assert found.state.omega == pytest.approx(omega, rel=1e-12)
    assert found.state.damping == pytest.approx(-b1 / (2.0 * omega**2 * amplitude), rel=1e-11)


def test_many_harmonics_of_a_mass_with_a_slider() -> None:
    """Values of another program with 21 harmonics: 1.225969 rad/s, damping ratio 0.105734."""
    motion = motion_of(modal_model(oscillator(), damping_ratio=1e-13), ContactParameters.shared(1, **SLIDER), 21)
    found = ModeContinuation(motion, (43, 1, 3)).solve_at_level(state_of(2.0, 21))
    assert found is not None
    assert (found.state.omega, found.state.damping) == pytest.approx((1.225969, 0.105734), abs=6e-7)


def test_derivatives() -> None:
    blade = modal_model(lumped_blade(), damping_ratio=0.01)
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=0.2
    )
    receptance = RelativeReceptance(blade, blade.phase(5), (0, 1, 2), 0.0)
    motion = ExtendedMotion(receptance, contact_element(contact, 2, SolverOptions((0.1, 1.0), harmonics=2)), 1)
    rng = np.random.default_rng(3)
    shape = (5, 2, 3)
    values = MotionState(0.3 * rng.normal(size=shape), 0.7, 0.8, 0.05, -0.2).packed()

    def residual(at: np.ndarray) -> np.ndarray:
        return motion.evaluate(MotionState.unpacked(at, shape)).residual

    step = 1e-6 * np.eye(values.size)
    numeric = np.column_stack([(residual(values + e) - residual(values - e)) / 2e-6 for e in step])
    found = motion.evaluate(MotionState.unpacked(values, shape)).jacobian
    np.testing.assert_allclose(found, numeric, rtol=1e-6, atol=1e-7 * np.abs(numeric).max())


def test_small_and_open_motions_are_linear_modes() -> None:
    """Pressed: the mode with stuck contacts and its damping, as long as nothing slips; wide open: the free mode."""
    blade = lumped_blade()
    modal, options = modal_model(blade, rayleigh=(0.02, 0.0)), SolverOptions((0.1, 1.0))
    springs = {"normal_stiffness": 1.0, "tangential_stiffness": 0.7, "friction": 0.5}
    pressed = ContactParameters.shared(2, **springs, interference=1.0)
    mode = nonlinear_mode(modal, pressed, 5, (1e-4, 1e-3), options)
    stuck = natural_frequencies(blade, modal.phase(5), normal=0.5, tangential=0.35)[0]
    np.testing.assert_allclose(mode.frequency_hz, stuck, rtol=1e-10)
    np.testing.assert_allclose(np.diff(mode.force / mode.modal_amplitude), 0.0, atol=1e-12)
    wide = ContactParameters.shared(2, **springs, interference=-50.0)
    mode = nonlinear_mode(modal, wide, 5, (1e-3, 1e-2), options, number=2)
    np.testing.assert_allclose(mode.frequency_hz, natural_frequencies(blade, modal.phase(5))[1], rtol=1e-12)
    np.testing.assert_allclose(4.0 * np.pi * mode.frequency_hz * mode.damping_ratio, 0.02, rtol=1e-10)


def test_amplitude_scales_with_the_interference() -> None:
    """The laws are positively homogeneous: twice the interference, twice the amplitude and force."""
    modal, options = modal_model(lumped_blade(), damping_ratio=0.01), SolverOptions((0.1, 1.0))
    springs = {"normal_stiffness": 1.0, "tangential_stiffness": 0.7, "friction": 0.5}
    one, two = (
        nonlinear_mode(modal, ContactParameters.shared(2, **springs, interference=v0), 5, (v0 / 100, 3 * v0), options)
        for v0 in (0.1, 0.2)
    )
    np.testing.assert_allclose(two.frequency_hz, one.frequency_hz, rtol=1e-8)
    np.testing.assert_allclose(two.force, 2.0 * one.force, rtol=1e-7)
    np.testing.assert_allclose(two.amplitude_m, 2.0 * one.amplitude_m, rtol=1e-7)


@pytest.mark.parametrize("force", [0.02, 0.05, 0.3])
def test_resonances_are_the_peaks_of_the_traced_curve(force: float) -> None:
    """A lightly damped mode: the peak of the response lies on the nonlinear mode."""
    modal = modal_model(oscillator(), damping_ratio=1e-3)
    contact = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=0.02, friction=1.0, preload=0.02)
    options = SolverOptions((0.12, 0.2), harmonics=3, **QUICK)
    mode = nonlinear_mode(modal, contact, 0, (0.05, 400.0), options)
    curve = forced_response(modal, contact, Excitation(0, force), options)
    resonances = mode.resonances(force)
    assert len(resonances) == 1
    assert resonances[0].stable
    assert resonances[0].amplitude_m == pytest.approx(curve.peak.amplitude_m, rel=2e-3)
    assert resonances[0].frequency_hz == pytest.approx(curve.peak.frequency_hz, rel=1e-4)


def test_a_resonance_of_the_mode_leads_to_an_isolated_branch() -> None:
    """Friction damps well until the contacts lift off: the force falls again, and the response has an isola.

    It lies 25 times above the main peak.
    """
    modal = modal_model(lumped_blade(), rayleigh=(0.0005, 0.0))
    springs = {"normal_stiffness": 1.0, "tangential_stiffness": 0.3, "friction": 1.0, "interference": 0.1}
    contact, force = ContactParameters.shared(2, **springs), 0.003
    mode = nonlinear_mode(modal, contact, 6, (0.01, 20.0), SolverOptions((0.05, 0.9)))
    resonances = mode.resonances(force)
    assert [each.stable for each in resonances] == [True, False, True]
    options = SolverOptions((0.19, 0.26), truncation=False, time_integration=False)
    curve = forced_response(modal, contact, Excitation(6, force), options)
    peaks = [curve.detached[0].peak, curve.peak]
    for peak, resonance in zip(peaks, (resonances[0], resonances[2]), strict=True):
        assert peak.amplitude_m == pytest.approx(resonance.amplitude_m, rel=1e-2)
        assert peak.frequency_hz == pytest.approx(resonance.frequency_hz, rel=5e-4)
    assert peaks[0].amplitude_m > 25.0 * peaks[1].amplitude_m
    assert curve.detached[0].origin == "a resonance of nonlinear mode 1"


def test_without_friction_the_contacts_slide() -> None:
    blade = lumped_blade()
    modal, options = modal_model(blade, rayleigh=(0.01, 0.0)), SolverOptions((0.1, 1.0))
    contact = ContactParameters.shared(
        2, normal_stiffness=1.0, tangential_stiffness=0.7, friction=0.0, interference=0.5
    )
    mode = nonlinear_mode(modal, contact, 5, (1e-4, 1e-2), options)
    np.testing.assert_allclose(
        mode.frequency_hz, natural_frequencies(blade, modal.phase(5), normal=0.5)[0], rtol=1e-9
    )
    quick = SolverOptions((0.1, 1.0), stability="folds", truncation=False, time_integration=False)
    assert forced_response(modal, contact, Excitation(5, 0.01), quick).termination.complete
