"""Several harmonics of the excitation: superposition, engine orders, rings in time, energy."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from ring_energy import energy_balance

from nonlinear import ContactParameters, Excitation, ExcitationHarmonic, OptionsError, SolverOptions, forced_response
from nonlinear.contact.fourier import smallest_values
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import linear_response, modal_model

SECOND, THIRD = ExcitationHarmonic(2, 0.6, 40.0), ExcitationHarmonic(3, 0.3, -70.0)
TWO = Excitation(1, 1.0, (SECOND,))
FREE = {"normal_stiffness": 6.0, "tangential_stiffness": 4.0, "friction": 0.4, "interference": -1e3}
STUCK = {**FREE, "interference": 1e4}
RUBBING = {**FREE, "interference": 0.5}


def contact(values, nodes=2, law="two_sliders"):
    return ContactParameters.shared(nodes, **values, law=law)


def by_matrices(model, excitation, frequency_hz, springs, zeta):
    """Harmonics 1 .. 3 of the tip from the dynamic stiffness of all dofs, no modes; largest abs over a period."""
    from scipy.linalg import eigh

    squared, shapes = eigh(model.stiffness, model.mass)
    inverse = shapes.T @ model.mass
    damping = inverse.T @ np.diag(2.0 * zeta * np.sqrt(squared)) @ inverse
    factors = {1: 1.0, **{each.order: each.factor for each in excitation.harmonics}}
    theta, total = 2.0 * np.pi * np.arange(4096) / 4096, 0.0
    for h, factor in factors.items():
        psi = 2.0 * np.pi * excitation.engine_order * h / model.n_blades
        relative = model.contact_right - np.exp(1j * psi) * model.contact_left
        stiffness = model.stiffness + relative.conj().T @ np.diag(springs) @ relative
        omega = 2.0 * np.pi * h * frequency_hz
        dynamic = stiffness + 1j * omega * damping - omega**2 * model.mass
        motion = np.linalg.solve(dynamic, factor * excitation.force * model.force_excitation)
        total = total + (model.outputs["tip"] @ motion * np.exp(1j * h * theta)).real
    return np.abs(total).max()


@pytest.mark.parametrize(("values", "springs"), [(FREE, 0.0), (STUCK, 1.0)])
@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_open_and_stuck_contacts_superpose(values, springs, law):
    model = lumped_blade(3)
    excitation = Excitation(1, 1.0, (SECOND, THIRD))
    options = SolverOptions((0.05, 0.5), harmonics=5, stability="wave", detached=False, search="off")
    curve = forced_response(modal_model(model, damping_ratio=0.02), contact(values, law=law), excitation, options)
    assert curve.termination.complete
    assert not curve.slipping.any()
    assert np.count_nonzero(curve.iterations) <= len(curve.peaks)  # one linear segment; the peaks are refined
    stiffness = springs * np.tile([2.0, 2.0, 3.0], 2)  # 4, 4 and 6 N/m shared by two nodes
    stride = max(1, curve.points // 25)
    for index in range(0, curve.points, stride):
        exact = by_matrices(model, excitation, curve.frequency_hz[index], stiffness, 0.02)
        alternating = np.abs(curve.output[index])
        assert alternating[4:].max() < 1e-12 * alternating.max()
        mean = curve.static_m[index]
        phases = np.exp(1j * np.outer(2.0 * np.pi * np.arange(4096) / 4096, np.arange(1, 6)))
        vibration = (phases @ curve.output[index, 1:]).real
        assert np.abs(vibration).max() == pytest.approx(exact, rel=1e-9)
        assert curve.amplitude_m[index] == pytest.approx(np.abs(vibration + mean).max(), rel=1e-5)
    assert curve.energy_error.max() < 1e-9
    # resonances of harmonics 2 and 3 are met: the peaks are local maxima of the superposition
    assert len(curve.peaks) >= 2


def test_peaks_of_a_linear_segment_are_located():
    """dA/ds of several harmonics vanishes at a maximum of the superposed amplitude."""
    model = lumped_blade(3)
    options = SolverOptions((0.05, 0.5), harmonics=2, detached=False, stability="wave", search="off")
    curve = forced_response(modal_model(model, damping_ratio=0.02), contact(FREE), TWO, options)
    for peak in curve.peaks:
        around = peak.frequency_hz * (1.0 + np.array([-1e-4, 0.0, 1e-4]))
        low, top, high = (by_matrices(model, TWO, f, np.zeros(6), 0.02) for f in around)
        assert top > low
        assert top > high


def test_a_second_harmonic_alone_is_twice_the_engine_order():
    """EO 1 with the amplitude of its second harmonic only is EO 2 at half the frequency: the same motion."""
    modal = modal_model(lumped_blade(5), damping_ratio=0.02)
    only_second = Excitation(1, 1.0, (ExcitationHarmonic(1, 0.0), ExcitationHarmonic(2, 1.0)))
    options = {"stability": "wave", "detached": False, "truncation": False, "search": "off"}
    one = SolverOptions((0.2, 0.8), harmonics=3, **options)
    two = SolverOptions((0.1, 0.4), harmonics=6, **options)
    direct = forced_response(modal, contact(RUBBING), Excitation(2, 1.0), one)
    through = forced_response(modal, contact(RUBBING), only_second, two)
    assert direct.termination.complete
    assert through.termination.complete
    assert direct.slipping.any()
    assert through.peak.amplitude_m == pytest.approx(direct.peak.amplitude_m, rel=1e-6)
    assert 2.0 * through.peak.frequency_hz == pytest.approx(direct.peak.frequency_hz, rel=1e-6)
    assert np.abs(through.output[:, 1::2]).max() < 1e-9 * direct.peak.amplitude_m
    assert through.energy_error.max() < 1e-9


@pytest.mark.parametrize(
    ("n_blades", "interference", "law", "omega"),
    [(2, 0.1, "two_sliders", 1.0), (3, 0.5, "two_sliders", 1.3), (3, 0.5, "cone", 1.3)],
)
def test_ring_in_time(n_blades, interference, law, omega):
    """Stick, slip and lift-off under two harmonics: the balance of one blade against the ring in time."""
    modal = modal_model(lumped_blade(n_blades), damping_ratio=0.03)
    parameters = contact({**RUBBING, "interference": interference}, law=law)
    options = SolverOptions((0.1, 0.8), harmonics=21)
    balance = build_harmonic_balance(modal, parameters, TWO, options)
    start = periodic_start(balance, omega, np.zeros((2, 3)), options, parameters)
    assert start.converged
    assert balance.forces(start.solution).state.max() >= 1
    displacement = balance.displacement(start.solution)
    integrator = RingIntegrator.of(Ring(modal, parameters, TWO), omega, retention=200.0)
    state = integrator.on_wave(displacement)
    record = integrator.march(state, 30)
    balanced = integrator.wave_output(displacement)
    assert np.abs(record.output_m[-1] - balanced).max() < 3e-3 * np.abs(balanced).max()
    assert energy_balance(integrator, record.final).error < 1e-3
    # without the second harmonic it is another motion
    other = Ring(modal, parameters, Excitation(1, 1.0))
    alone = RingIntegrator.of(other, omega, retention=200.0).march(state, 30).output_m[-1]
    assert np.abs(alone - balanced).max() > 0.1 * np.abs(balanced).max()


def marched(excitation, omega, slip_limit, stiffness, damping, periods=80, steps=4000):
    """A unit mass on a unit spring with a Jenkins slider, central differences: largest abs(x) of the last period."""
    step = 2.0 * np.pi / omega / steps
    factors = {1: 1.0, **{each.order: each.factor for each in excitation.harmonics}}
    theta = omega * step * np.arange(steps)
    force = sum((excitation.force * c * np.exp(1j * h * theta)).real for h, c in factors.items())
    x, before, slider, largest = 0.0, 0.0, 0.0, 0.0
    for _ in range(periods):
        largest = 0.0
        for value in force.tolist():
            friction = max(-slip_limit, min(slip_limit, stiffness * (x - slider)))
            slider = x - friction / stiffness
            half = 0.5 * damping * step
            following = (step**2 * (value - x - friction) + 2.0 * x - (1.0 - half) * before) / (1.0 + half)
            before, x = x, following
            largest = max(largest, abs(x))
    return largest


def test_friction_against_central_differences():
    """One mass and a slider under harmonics 1 and 2, marched by a scheme of this test."""
    modal = modal_model(oscillator(), damping_ratio=0.05)
    friction = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=0.5, preload=1.0)
    options = SolverOptions((0.05, 0.4), harmonics=31)
    balance = build_harmonic_balance(modal, friction, TWO, options)
    assert not balance.odd  # a second harmonic: half a period later the force is not opposite
    assert build_harmonic_balance(modal, friction, Excitation(1, 1.0, (THIRD,)), options).odd
    for omega in (0.5, 1.1):
        start = periodic_start(balance, omega, np.zeros((1, 3)), options, friction)
        assert start.converged
        integrator = RingIntegrator.of(Ring(modal, friction, TWO), omega)
        found = np.abs(integrator.wave_output(balance.displacement(start.solution))).max()
        exact = marched(TWO, omega, slip_limit=0.5, stiffness=1.0, damping=0.1)
        assert found == pytest.approx(exact, rel=2e-3)


def test_the_response_scales_with_force_and_interference():
    modal = modal_model(lumped_blade(3), damping_ratio=0.03)
    quick = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}
    options = SolverOptions((0.1, 0.5), harmonics=3, **quick)
    one = forced_response(modal, contact(RUBBING), TWO, options)
    scaled = contact({**RUBBING, "interference": 7.0 * 0.5})
    seven = forced_response(modal, scaled, replace(TWO, force=7.0), options)
    assert seven.peak.amplitude_m == pytest.approx(7.0 * one.peak.amplitude_m, rel=1e-9)
    assert seven.peak.frequency_hz == pytest.approx(one.peak.frequency_hz, rel=1e-9)


def test_adaptive_harmonics_begin_at_the_highest_of_the_excitation():
    modal = modal_model(lumped_blade(3), damping_ratio=0.03)
    quick = {"truncation": False, "search": "off"}
    options = SolverOptions((0.1, 0.25), harmonics="auto", stability="wave", harmonic_tolerance=1e-2, **quick)
    curve = forced_response(modal, contact(RUBBING), TWO, options)
    assert curve.termination.complete
    assert curve.kept_harmonics.min() >= 3  # 3: the first number that is tried from 2 on
    for branch in curve.detached:
        assert branch.kept_harmonics.min() >= 2
    fixed = SolverOptions((0.1, 0.25), harmonics=11, stability="folds", detached=False, **quick)
    finer = forced_response(modal, contact(RUBBING), TWO, fixed)
    assert curve.peak.amplitude_m == pytest.approx(finer.peak.amplitude_m, rel=2e-2)


def test_too_few_harmonics_are_refused_in_one_line():
    modal = modal_model(lumped_blade(3), damping_ratio=0.03)
    with pytest.raises(OptionsError, match=r"^harmonics: 1, allowed: 2 or more, the highest harmonic of the excit"):
        forced_response(modal, contact(RUBBING), TWO, SolverOptions((0.1, 0.4), harmonics=1))
    with pytest.raises(OptionsError, match="each order once"):
        Excitation(1, 1.0, (SECOND, SECOND))
    with pytest.raises(OptionsError, match=r"^order: 0, allowed: 1 to 31"):
        ExcitationHarmonic(0, 1.0)


def test_a_harmonic_with_a_pattern_of_its_own():
    """A force of its own in harmonic 2 acts with factor 1, or with the one that is given."""
    model = lumped_blade(3)
    pattern = np.roll(model.force_excitation, 1) * (0.2 - 0.1j)
    own = modal_model(replace(model, force_harmonics={2: pattern}), damping_ratio=0.02)
    alone = modal_model(replace(model, force_excitation=pattern), damping_ratio=0.02)
    frequency = [0.1, 0.21]
    expected = linear_response(alone, frequency, phase=own.phase(2), force=3.0)
    given = {"phase": own.phase(1), "force": 3.0, "harmonic": 2}
    doubled = [0.05, 0.105]
    assert linear_response(own, doubled, **given) == pytest.approx(expected, rel=1e-12)
    halved = linear_response(own, doubled, **given, harmonic_factors=((2, 0.5j),))
    assert halved == pytest.approx(0.5j * expected, rel=1e-12)


def test_smallest_value_of_a_trigonometric_polynomial():
    rng = np.random.default_rng(3)
    coefficients = rng.normal(size=(5, 40)) + 1j * rng.normal(size=(5, 40))
    theta = 2.0 * np.pi * np.arange(200_000) / 200_000
    dense = (np.exp(1j * np.outer(theta, np.arange(5))) @ coefficients).real.min(axis=0)
    assert smallest_values(coefficients) == pytest.approx(dense, abs=1e-7)


def test_further_outputs_and_the_largest_length():
    """Components and a vector: the default output again, and a length that lies between bounds of the components."""
    model = lumped_blade(3)
    select = np.eye(model.size)
    named = {f"mass_{axis}": select[row] for row, axis in enumerate("xyz")}
    modal = modal_model(replace(model, outputs={**model.outputs, **named}), damping_ratio=0.03)
    quick = {"stability": "folds", "detached": False, "truncation": False, "search": "off"}
    options = SolverOptions((0.1, 0.4), harmonics=3, outputs=("mass_y", "mass"), **quick)
    curve = forced_response(modal, contact(RUBBING), TWO, options)
    assert curve.outputs["mass"].shape == (curve.points, 4, 3)
    # the force is along y; a row of a product of matrices may be summed in another order than one with a vector
    round_off = 1e-12 * np.abs(curve.output).max()
    np.testing.assert_allclose(curve.outputs["mass_y"][:, :, 0], curve.output, rtol=0.0, atol=round_off)
    assert curve.amplitude_of("mass_y") == pytest.approx(curve.amplitude_m, rel=1e-9)
    theta = 2.0 * np.pi * np.arange(20_000) / 20_000
    at = int(np.argmax(curve.amplitude_m))
    dense = (np.exp(1j * np.outer(theta, np.arange(4))) @ curve.outputs["mass"][at]).real
    assert curve.amplitude_of("mass")[at] == pytest.approx(np.linalg.norm(dense, axis=1).max(), rel=1e-7)
    with pytest.raises(OptionsError, match=r"^outputs: 'nose', allowed: tip, mass_x, "):
        forced_response(modal, contact(RUBBING), TWO, replace(options, outputs=("nose",)))
