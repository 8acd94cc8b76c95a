"""Time integration of a ring of blades: closed forms, second order, energy, and the judgement of a motion."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from ring_energy import energy_balance
from scipy.linalg import expm

from nonlinear import ContactError, ContactParameters, Excitation
from nonlinear.time_integration.ring import Ring, RingState, StepError
from nonlinear.time_integration.ring_integrator import ContactIterationError, RingIntegrator
from nonlinear.time_integration.ring_motion import growth_rate, repeats_after, same_mean, same_statistics
from rom import modal_model

OPEN = ContactParameters.shared(2, normal_stiffness=0.0, tangential_stiffness=0.0, friction=0.0)


def ring_of(n_blades=3, contact=OPEN, damping=0.02, force=1.0, engine_order=1):
    modal = modal_model(lumped_blade(n_blades, contact.n_contacts), damping_ratio=damping)
    return Ring(modal, contact, Excitation(engine_order, force))


def random_state(ring, n_blades, seed=3):
    rng = np.random.default_rng(seed)
    size = n_blades, ring.modal.angular_frequency.size
    weight = 1.0 / ring.modal.angular_frequency
    nodes = n_blades, ring.contact.n_contacts
    return RingState(
        rng.normal(size=size) * weight, rng.normal(size=size), np.zeros((*nodes, 2)), np.zeros((*nodes, 3))
    )


def test_number_of_blades():
    """The smallest ring in which wave and perturbation close."""
    ring = ring_of(12, engine_order=4)
    for k in range(7):
        blades = ring.blades(k)
        closes = [q for q in range(1, 13) if (q * 4) % 12 == 0 and (q * k) % 12 == 0]
        assert blades == closes[0]
    ground = Ring(modal_model(oscillator(n_blades=12), damping_ratio=0.02), ground_contact(), Excitation(5, 1.0))
    assert ground.blades(3) == 1
    with pytest.raises(ContactError, match="2 nodes, allowed: 1"):
        replace(ground, contact=OPEN)


def ground_contact(**changed):
    values = {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0, **changed}
    return ContactParameters.shared(1, **values)


def test_free_vibration_and_excitation_are_exact():
    """Without contact: every mode in closed form, in a step as long as any."""
    ring, omega = ring_of(), 0.7
    integrator = RingIntegrator.of(ring, omega, retention=1e6)
    start = random_state(ring, 3)
    record = integrator.march(start, 2)
    modal, time = ring.modal, 2 * integrator.period
    for m, (w, c) in enumerate(zip(modal.angular_frequency, modal.damping, strict=True)):
        generator = np.array([[0.0, 1.0], [-(w**2), -c]])
        forced = modal.force[m] / (w**2 - omega**2 + 1j * c * omega) * np.exp(1j * ring.phase * np.arange(3))
        particular = np.array([forced.real, (1j * omega * forced).real])
        state = np.array([start.coordinates[:, m], start.rates[:, m]])
        exact = expm(generator * time) @ (state - particular) + particular
        assert record.final.coordinates[:, m] == pytest.approx(exact[0], abs=1e-10)
        assert record.final.rates[:, m] == pytest.approx(exact[1], abs=1e-9)


@pytest.mark.parametrize("n_blades", [1, 2, 3])
def test_stuck_contacts_are_springs_and_the_error_is_of_second_order(n_blades):
    """A ring in which nothing slips or opens, against the matrix exponential of all its blades with springs."""
    contact = ContactParameters.shared(
        2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=50.0, interference=5.0, preload=30.0
    )
    ring, omega = ring_of(n_blades, replace(contact, interference=np.zeros(2)), force=0.0), 1.0
    start = random_state(ring, n_blades)
    start = replace(start, coordinates=0.1 * start.coordinates, rates=0.1 * start.rates)
    modal, errors = ring.modal, []
    size = modal.angular_frequency.size
    relative = np.zeros((n_blades, contact.n_contacts * 3, n_blades, size))
    for j in range(n_blades):
        relative[j, :, j] += modal.right
        relative[j, :, (j + 1) % n_blades] -= modal.left
    relative = relative.reshape(-1, n_blades * size)
    springs = np.tile(np.tile([1.5, 1.5, 2.0], 2), n_blades)
    stiffness = np.diag(np.tile(modal.angular_frequency**2, n_blades)) + relative.T @ (springs[:, None] * relative)
    damping = np.diag(np.tile(modal.damping, n_blades))
    generator = np.block([[np.zeros_like(stiffness), np.eye(len(stiffness))], [-stiffness, -damping]])
    both = np.concatenate([start.coordinates.ravel(), start.rates.ravel()])
    motion = relative @ start.coordinates.ravel()
    start = replace(start, force=-(springs * motion).reshape(n_blades, 2, 3))
    for finer in (1, 2):
        integrator = RingIntegrator.of(ring, omega, retention=1e6, finer=finer)
        after = integrator.march(start, 1).final
        exact = (expm(generator * integrator.period) @ both)[: n_blades * size]
        errors.append(np.abs(after.coordinates.ravel() - exact).max() / np.abs(both[: n_blades * size]).max())
    assert errors[0] < 2e-3
    assert errors[1] == pytest.approx(errors[0] / 4.0, rel=0.1)


def test_hysteresis_loop_of_one_slider():
    """Friction under a constant load: dissipated work 4 mu N (A - mu N / kt) per cycle of amplitude A."""
    modal = modal_model(oscillator(), damping_ratio=0.01)
    ring = Ring(modal, ground_contact(), Excitation(1, 3.0))
    integrator = RingIntegrator.of(ring, 1.6, finer=2)
    settled = integrator.march(integrator.at_rest(), 40).final
    states, output = integrator.history(settled)
    amplitude = 0.5 * np.ptp(output)
    limit = 0.5 * 2.0
    energy = energy_balance(integrator, settled)
    assert amplitude > 2.0 * limit / 3.0
    assert energy.contact == pytest.approx(4.0 * limit * (amplitude - limit / 3.0), rel=1e-4)
    assert energy.error < 2e-5
    assert max(np.abs(state.force[0, 0, 0]) for state in states) == pytest.approx(limit, rel=1e-12)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_energy_is_balanced_to_second_order(law):
    """From an arbitrary state, with slip, separation and re-contact on all faces."""
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.4, interference=0.2, preload=0.1, law=law
    )
    ring = ring_of(3, contact)
    errors = []
    for finer in (1, 4):
        integrator = RingIntegrator.of(ring, 0.9, finer=finer, retention=1e6)
        errors.append(energy_balance(integrator, integrator.march(integrator.at_rest(), 3).final).error)
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 6.0


def test_a_motion_that_runs_away_is_refused(monkeypatch):
    """After three tries with half the step; as long as nothing does, a step is what was asked for."""
    integrator = RingIntegrator.of(
        Ring(modal_model(oscillator(), damping_ratio=0.01), ground_contact(), Excitation(1, 3.0)), 1.0
    )
    assert integrator.march(integrator.at_rest(), 20).output_m.shape[:2] == (20, integrator.steps)
    monkeypatch.setattr("nonlinear.time_integration.ring_integrator.RUNAWAY", 1e-3)
    with pytest.raises(ContactIterationError, match="grows without bound"):
        integrator.march(integrator.at_rest(), 20)


def test_stiff_contacts_need_no_short_steps():
    """A penalty of 1e7 times the stiffness of a node acts in series with its flexibility."""
    contact = ContactParameters.shared(
        2, normal_stiffness=1e9, tangential_stiffness=1e9, friction=0.3, interference=1e-9, preload=0.5
    )
    ring, omega = ring_of(2, contact), 0.8
    integrator = RingIntegrator.of(ring, omega)
    assert integrator.steps < 2000
    record = integrator.march(integrator.at_rest(), 60)
    assert energy_balance(integrator, record.final).error < 1e-3
    with pytest.raises(StepError, match="steps a period, allowed: 50000"):
        RingIntegrator.of(ring, omega, retention=1e6)


def test_growth_rate_of_a_linear_map():
    """A slowly growing pair beside what decays; too few states; nothing that a multiplier explains."""
    angle, growth = 1.1, 0.03
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    matrix = np.zeros((5, 5))
    matrix[:2, :2], matrix[2, 2], matrix[3, 3], matrix[4, 4] = np.exp(growth) * turn, 0.9, -0.5, 1.0
    basis = np.linalg.qr(np.random.default_rng(1).normal(size=(5, 5)))[0] + 0.3 * np.eye(5)
    matrix = basis @ matrix @ np.linalg.inv(basis)
    states = [np.ones(5)]
    for _ in range(40):
        states.append(matrix @ states[-1])
    assert growth_rate(np.array(states), 0.5) == pytest.approx(growth / 0.5, rel=0.01)
    assert np.isnan(growth_rate(np.array(states[:20]), 0.5))
    noise = np.random.default_rng(2).normal(size=(40, 5))
    assert not growth_rate(noise, 0.5) > 0.1


def test_only_what_repeats_itself_is_periodic():
    """Period 1, 2 and 5; a slow beat, irregular motion and a slow decay are not periodic."""
    time = np.arange(60)
    assert repeats_after(np.ones((60, 2, 3))) == 1
    assert repeats_after(np.where(time % 2, 1.0, 1.2)[:, None]) == 2
    assert repeats_after(np.cos(2.0 * np.pi * time / 5.0)[:, None]) == 5
    beat = 1.0 + 0.1 * np.cos(2.0 * np.pi * time / 600.0)
    assert repeats_after(beat[:, None]) == 0
    logistic = [0.3]
    for _ in range(59):
        logistic.append(3.9 * logistic[-1] * (1.0 - logistic[-1]))
    assert repeats_after(np.array(logistic)[:, None]) == 0
    assert repeats_after(1.0 + np.exp(-0.01 * time)[:, None]) == 0
    left = 1e-3 * np.exp(-0.05 * time)[:, None]  # of a part of the motion, once the contacts have opened for good
    assert (repeats_after(left), repeats_after(left, vibration=1.0)) == (0, 1)


def test_windows_of_a_settled_motion_agree():
    """A growing or decaying amplitude has not settled, nor has a scatter that changes; a mean is looked at apart."""
    rng = np.random.default_rng(5)
    wild = 1.0 + 0.2 * rng.random((400, 4))
    assert same_statistics(wild[:200], wild[200:])
    assert not same_statistics(wild[:200], 1.03 * wild[200:])
    assert not same_statistics(np.full((60, 4), 1.0), np.full((60, 4), 0.98))
    assert not same_statistics(wild[:200], 1.2 - 0.7 * (1.2 - wild[200:]))
    share = rng.random((400, 4))  # its square has the same largest and smallest values
    assert same_mean(0.2 + share[:200], 0.2 + share[200:])
    assert same_statistics(0.2 + share[:200], 0.2 + share[200:] ** 2)
    assert not same_mean(0.2 + share[:200], 0.2 + share[200:] ** 2)
