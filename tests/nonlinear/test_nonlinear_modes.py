"""Nonlinear modes: closed forms of a mass with a slider, derivatives, linear limits, and resonances against peaks."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from turning import circling, turning

from nonlinear import ContactParameters, Excitation, OptionsError, SolverOptions, forced_response, nonlinear_mode
from nonlinear.contact.element_choice import contact_element
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.mode_agreement import compare_with_peaks
from nonlinear.nonlinear_modes.extended_motion import ExtendedMotion, MotionState
from nonlinear.nonlinear_modes.mode_curve import ModeContinuation, harmonic_shares
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import modal_model, natural_frequencies
from rom.cyclic.receptance import RelativeReceptance

SLIDER = {"normal_stiffness": 0.0, "tangential_stiffness": 1.0, "friction": 1.0, "preload": 1.0}
QUICK = {"detached": False, "stability": "folds", "truncation": False, "search": "off"}


def motion_of(modal, contact, harmonics: int) -> ExtendedMotion:
    receptance = RelativeReceptance(modal, 0.0, tuple(range(harmonics + 1)), 0.0)
    options = SolverOptions((0.05, 0.5), harmonics=harmonics)
    return ExtendedMotion(receptance, contact_element(contact, harmonics, options), 0, every_harmonic=True)


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


@pytest.mark.parametrize("number", [1, 2])
def test_closed_form_of_circles_in_a_turning_frame(number: int) -> None:
    """A mass on an isotropic spring under a friction cone: |T| = mu N at every instant, one harmonic is exact.

    Of the stretch s = mu N / kt of the contact spring s^2 / X is along the displacement, s (X^2 - s^2)^(1/2) / X is
    along the velocity: w^2 +- 2 W w = w0^2 - W^2 + kt s^2 / X^2, zeta = kt s (X^2 - s^2)^(1/2) / (2 w^2 X^2).
    """
    speed, stretch, kt = 0.1, 1.0, 0.5
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=kt, friction=1.0, preload=stretch * kt, law="cone"
    )
    modal = modal_model(circling(speed), damping_ratio=1e-13, coriolis=True)
    options = SolverOptions((0.05, 0.5), harmonics=1)
    mode = nonlinear_mode(modal, contact, 0, (1.2, 6.0), options, number=number)
    assert mode.complete
    size = np.abs(mode.coordinates[:, 1, 0])
    squared = 1.0 - speed**2 + kt * stretch**2 / size**2
    sense = 1.0 if number == 1 else -1.0
    omega = np.sqrt(squared + speed**2) - sense * speed
    assert 2.0 * np.pi * mode.frequency_hz == pytest.approx(omega, rel=1e-9)
    across = kt * stretch * np.sqrt(size**2 - stretch**2)
    assert mode.damping_ratio == pytest.approx(across / (2.0 * omega**2 * size**2), rel=1e-7)
    assert np.abs(mode.coordinates[:, 1, 1]) == pytest.approx(size, rel=1e-9)
    assert size[0] < 1.5
    assert size[-1] > 5.0


def test_many_harmonics_of_a_mass_with_a_slider() -> None:
    """Values of another program with 21 harmonics: 1.225969 rad/s, damping ratio 0.105734."""
    modal, contact = modal_model(oscillator(), damping_ratio=1e-13), ContactParameters.shared(1, **SLIDER)
    options = SolverOptions((0.05, 0.5), harmonics=21)
    mode = nonlinear_mode(modal, contact, 0, (2.0, 2.1), options, damping="all_harmonics")
    found = 2.0 * np.pi * mode.frequency_hz[0], mode.damping_ratio[0]
    assert found == pytest.approx((1.225969, 0.105734), abs=6e-7)


def test_resonances_with_damping_in_harmonic_1_are_nearer_to_the_peak() -> None:
    """The reason for the default: a mass with a slider has its peak where the force is in phase with the velocity."""
    modal, contact = modal_model(oscillator(), damping_ratio=1e-3), ContactParameters.shared(1, **SLIDER)
    options = SolverOptions((0.15, 0.25), harmonics=5, **QUICK)
    peak = forced_response(modal, contact, Excitation(0, 0.9), options).peak.amplitude_m
    off = {}
    for damping in ("first_harmonic", "all_harmonics"):
        mode = nonlinear_mode(modal, contact, 0, (2.0, 5.0), options, damping=damping)
        (resonance,) = mode.resonances(0.9)
        off[damping] = abs(resonance.amplitude_m / peak - 1.0)
    assert off["first_harmonic"] < 2e-5
    assert 2e-3 < off["all_harmonics"] < 4e-3
    default = nonlinear_mode(modal, contact, 0, (2.0, 5.0), options).resonances(0.9)[0].amplitude_m
    assert default == pytest.approx(peak, rel=2e-5)


@pytest.mark.parametrize("coriolis", [False, True])
@pytest.mark.parametrize("every_harmonic", [False, True])
def test_derivatives(every_harmonic: bool, coriolis: bool) -> None:
    blade = modal_model(turning(12), damping_ratio=0.01, coriolis=coriolis)
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=0.4, interference=0.2
    )
    receptance = RelativeReceptance(blade, blade.phase(5), (0, 1, 2), 0.0)
    element = contact_element(contact, 2, SolverOptions((0.1, 1.0), harmonics=2))
    motion = ExtendedMotion(receptance, element, 1, every_harmonic)
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
    mode = nonlinear_mode(modal, wide, 5, (1e-6, 1e-5), options, number=2)
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
    options = SolverOptions((0.19, 0.26), truncation=False, search="off")
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
    quick = SolverOptions((0.1, 1.0), stability="folds", truncation=False, search="off")
    assert forced_response(modal, contact, Excitation(5, 0.01), quick).termination.complete


SPRINGS = {"normal_stiffness": 0.25, "tangential_stiffness": 0.05, "friction": 0.3, "interference": 0.1}


@pytest.mark.parametrize(("law", "coriolis"), [("two_sliders", False), ("cone", False), ("two_sliders", True)])
def test_a_mode_is_a_forced_response_in_phase_with_its_velocity(law: str, coriolis: bool) -> None:
    """The force 2 i zeta omega^2 q on the modes in harmonic 1 makes the balance of the forced response vanish."""
    modal = modal_model(turning(12), damping_ratio=0.01, coriolis=coriolis)
    options = SolverOptions((0.05, 0.9), harmonics=3)
    contact = ContactParameters.shared(2, **SPRINGS, law=law)
    mode = nonlinear_mode(modal, contact, 5, (0.05, 2.0), options)
    for place in (0, len(mode.force) // 2, -1):
        state, damping = mode.motions.states[place], mode.damping_ratio[place]
        push = 2j * damping * state.omega**2 * mode.coordinates[place, 1]
        forced = RelativeReceptance(replace(modal, force=push), modal.phase(5), (0, 1, 2, 3), 1.0)
        balance = HarmonicBalance(forced, contact_element(contact, 3, options))
        residual = balance.evaluate(balance.unknown(state.displacement), state.omega).residual
        assert np.abs(residual).max() < 1e-10 * np.abs(state.displacement).max()
    assert mode.slipping.max() > 0
    assert mode.separating.max() == 2


def free_decay(modal, contact, mode, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and output of a ring of two blades that is left alone on the largest motion of a mode."""
    state, q = mode.motions.states[-1], mode.coordinates[-1]
    ring = RingIntegrator.of(Ring(modal, contact, Excitation(6, 0.0)), state.omega, finer=4)
    h = np.arange(len(q))
    turned = np.exp(1j * np.outer(np.pi * np.arange(ring.n_blades), h))
    rates = (turned @ (1j * state.omega * h[:, None] * q)).real
    start = replace(ring.on_wave(state.displacement), coordinates=(turned @ q).real, rates=rates)
    output = ring.march(start, periods).output_m.reshape(-1, ring.n_blades)[:, 0]
    return ring.period / ring.steps * np.arange(output.size), output


def test_frequency_and_damping_are_those_of_a_free_decay() -> None:
    """Time integration: the free motion dies away through lift-off and slip down to stick, and follows the mode."""
    modal = modal_model(lumped_blade(), rayleigh=(0.002, 0.0))
    contact = ContactParameters.shared(2, **SPRINGS)
    mode = nonlinear_mode(modal, contact, 6, (0.05, 6.0), SolverOptions((0.05, 0.9), harmonics=7))
    times, output = free_decay(modal, contact, mode, 150)
    up = np.flatnonzero((output[:-1] < 0.0) & (output[1:] >= 0.0))
    crossing = times[up] - output[up] * (times[up + 1] - times[up]) / (output[up + 1] - output[up])
    size = np.array([0.5 * np.ptp(output[a:b]) for a, b in pairwise(up)])
    frequency, damping = 1.0 / np.diff(crossing)[1:-1], np.log(size[:-2] / size[2:]) / (4.0 * np.pi)
    size, known = size[1:-1], mode.modal_amplitude / mode.modal_amplitude[-1] * mode.amplitude_m[-1]
    order = np.argsort(known)
    np.testing.assert_allclose(frequency, np.interp(size, known[order], mode.frequency_hz[order]), rtol=6e-4)
    slow = (size > 0.15) | (size < 0.07)  # in between the damping ratio falls by a factor of 15 within four periods
    expected = np.interp(size, known[order], mode.damping_ratio[order])
    np.testing.assert_allclose(damping[slow], expected[slow], rtol=0.03)
    assert frequency.max() / frequency.min() > 1.07
    assert damping.max() > 10.0 * damping.min()


@pytest.mark.parametrize(("harmonics", "pieces"), [(3, 1), (5, 3)])
def test_a_mode_goes_on_across_an_internal_resonance(harmonics: int, pieces: int) -> None:
    """Harmonic 3 resonates with another mode on the way: the curve runs through, or is found again above."""
    blade, options = lumped_blade(), SolverOptions((0.05, 0.9), harmonics=harmonics)
    modal = modal_model(blade, rayleigh=(0.001, 0.0))
    springs = {"normal_stiffness": 5.0, "tangential_stiffness": 3.5, "friction": 0.3}
    contact = ContactParameters.shared(2, **springs, interference=0.1)
    mode = nonlinear_mode(modal, contact, 2, (0.01, 60.0), options)
    assert mode.complete
    assert mode.piece[-1] + 1 == pieces
    assert pieces == 1 or "internal resonance 1:3" in mode.message
    assert harmonic_shares(mode.coordinates)[:, 1].max() > 0.5
    stuck = natural_frequencies(blade, modal.phase(2), normal=2.5, tangential=1.75)[0]
    assert mode.frequency_hz[0] == pytest.approx(stuck, rel=1e-9)
    half = np.interp(30.0, mode.amplitude_m, mode.frequency_hz)
    assert mode.frequency_hz[-1] == pytest.approx(half, rel=2e-3)  # of a motion much larger than the interference


def test_sampled_integration_agrees() -> None:
    modal, amplitudes = modal_model(lumped_blade(), damping_ratio=0.01), (0.05, 2.0)
    contact, options = ContactParameters.shared(2, **SPRINGS), SolverOptions((0.05, 0.9), harmonics=3)
    exact = nonlinear_mode(modal, contact, 5, amplitudes, options).resonances(0.05)
    sampled = replace(options, integration="sampled", samples=2048)
    other = nonlinear_mode(modal, contact, 5, amplitudes, sampled).resonances(0.05)
    assert other[0].amplitude_m == pytest.approx(exact[0].amplitude_m, rel=1e-5)
    assert other[0].frequency_hz == pytest.approx(exact[0].frequency_hz, rel=1e-5)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"options": SolverOptions((0.1, 1.0), method="static-first")}, "method: 'static-first'"),
        ({"amplitudes_m": (1.0, 0.1)}, "amplitudes: "),
        ({"number": 16}, "number: 16, allowed: 1 to 15"),
        ({"damping": "all"}, "damping: 'all', allowed: 'first_harmonic' or 'all_harmonics'"),
    ],
)
def test_what_has_no_mode_is_refused(changed: dict, message: str) -> None:
    modal, contact = modal_model(lumped_blade(), damping_ratio=0.01), ContactParameters.shared(2, **SPRINGS)
    given = {"amplitudes_m": (0.1, 1.0), "options": SolverOptions((0.1, 1.0)), "number": 1} | changed
    with pytest.raises(OptionsError, match=message):
        nonlinear_mode(modal, contact, 5, **given)


def test_deviations_from_the_peaks() -> None:
    """A light mode agrees; where another mode takes part in the motion at the peak the comparison says how much."""
    modal, contact = modal_model(lumped_blade(), damping_ratio=0.01), ContactParameters.shared(2, **SPRINGS)
    options = SolverOptions((0.1, 0.24), harmonics=3, **QUICK)
    excitation = Excitation(5, 0.05)
    curve = forced_response(modal, contact, excitation, options)
    mode = nonlinear_mode(modal, contact, 5, (0.05, 4.0), options)
    (pair,), missed = compare_with_peaks([mode], curve, modal, excitation)
    assert missed == ()
    assert pair.peak.amplitude_m == pytest.approx(curve.peak.amplitude_m, rel=1e-12)
    assert abs(pair.amplitude_deviation) < 4e-3
    assert pair.other_motion < 0.02
    far = compare_with_peaks([nonlinear_mode(modal, contact, 5, (0.05, 0.1), options)], curve, modal, excitation)
    assert far[0] == ()
    assert [peak.amplitude_m for peak in far[1]] == [pytest.approx(curve.peak.amplitude_m, rel=1e-12)]
