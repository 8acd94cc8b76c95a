"""The ring in a flow, in time: waves told apart, growth of small motions, cycles that last, what grows for ever."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from turning import turning

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.contact.fourier import to_real
from nonlinear.nonlinear_modes.limit_cycles import self_excitation
from nonlinear.nonlinear_modes.ring_in_flow import ring_in_flow, waves_of
from nonlinear.time_integration.ring import RetainedModes, Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import InfluenceCoefficients, modal_model
from rom.cyclic.natural_frequencies import aeroelastic_modes

N = 6
OPTIONS = SolverOptions((0.05, 0.5), harmonics=7, stability="ring")
STIFF = {"normal_stiffness": 6.0, "tangential_stiffness": 4.0, "friction": 0.3, "interference": 0.3}
SHROUD = ContactParameters.shared(1, **STIFF)
SLIDER = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=1.0, preload=1.0)


def fed_waves(fed, blades=4):
    """m = k = 1 with the damping coefficients -fed of each wave."""
    flow = InfluenceCoefficients.of_waves(1, 1j * np.array(fed))
    return modal_model(oscillator(n_blades=blades), damping_ratio=0.0, influence=[flow])


def shrouded(feeding, damping_ratio=0.0005):
    """A flow that feeds backward waves through the neighbours, and damps each blade alone."""
    flow = InfluenceCoefficients(1, np.array([-1, 0, 1]), np.array([-feeding, -0.02j, feeding]))
    return modal_model(lumped_blade(N, 1), damping_ratio=damping_ratio, influence=[flow])


def state_on(modal, cycle, n):
    """State of the ring near a limit cycle, where what decays fast has decayed."""
    omega = 2.0 * np.pi * cycle.frequency_hz
    ring = Ring(modal, SHROUD, Excitation(n, 0.0))
    relative = ring.receptance(len(cycle.coordinates) - 1).relative
    motion = np.einsum("hrm,hm->hr", relative, cycle.coordinates)
    integrator = RingIntegrator.of(ring, omega, nodal_diameter=1)
    state = integrator.on_wave(to_real(motion).reshape(-1, SHROUD.n_contacts, 3))
    disturbed = integrator.disturbed(state, 1, 0.2 * integrator.vibration(state))
    return integrator.march(disturbed, 200).final


def test_waves_are_told_apart():
    """Forward and backward, of different frequencies, beside a static part and higher harmonics."""
    rng, n = np.random.default_rng(1), np.arange(-2, 4)
    amplitude, frequency = rng.uniform(0.5, 1.0, N), rng.uniform(0.95, 1.05, N)
    time = np.arange(1, 8 * 60 + 1) / 60.0
    angle = 2.0 * np.pi * (time[:, None, None] * frequency + n * np.arange(N)[:, None] / N) + rng.uniform(0, 6, N)
    output = 2.0 + (amplitude * (np.cos(angle) + 0.1 * np.cos(3.0 * angle))).sum(axis=2)
    found, at = waves_of(output, 1.0 / 60.0)
    assert found == pytest.approx(amplitude, rel=1e-3)
    assert at == pytest.approx(frequency, rel=1e-3)


def test_small_motions_grow_as_their_poles():
    """Without damping of the modes that follow their forces at once, which do not lose it in time."""
    modal = shrouded(0.03, damping_ratio=0.0)
    found = ring_in_flow(modal, SHROUD, OPTIONS, 40, disturbance=0.01)
    springs = {"normal": SHROUD.normal_stiffness, "tangential": SHROUD.tangential_stiffness}
    period = 2.0 * np.pi / found.omega
    for place, n in enumerate(found.nodal_diameter):
        values = aeroelastic_modes(lumped_blade(N, 1), modal, int(n), count=2, **springs)
        pole = values[np.argmin(np.abs(values))]
        rate = np.polyfit(found.periods * period, np.log(found.amplitude_m[:, place]), 1)[0]
        assert rate == pytest.approx(pole.real, rel=0.01, abs=1e-5)
        if n:  # that of 0 is half of the largest motion's
            assert 2.0 * np.pi * found.frequency_hz[place] == pytest.approx(abs(pole.imag), rel=1e-3)


@pytest.fixture(scope="module")
def competing():
    """Waves of 1 and 2 nodal diameters grow from rest; the larger cycle lasts."""
    modal = shrouded(0.15)
    found = [self_excitation(modal, SHROUD, n, OPTIONS) for n in (1, 2)]
    assert [(each.damping_ratio < 0.0, each.held.persists) for each in found] == [(True, True), (True, False)]
    return modal, [each.held for each in found]


@pytest.mark.parametrize("disturbance", [0.9, 1e-3])
def test_the_wave_that_prevails_is_the_cycle_that_lasts(competing, disturbance):
    modal, (cycle, _) = competing
    found = ring_in_flow(modal, SHROUD, OPTIONS, 1000, disturbance=disturbance)
    assert (found.ending, found.prevailing) == ("one wave", 1)
    assert found.share == pytest.approx(1.0, abs=1e-5)
    harmonic = abs(modal.at(1).outputs["tip"] @ cycle.coordinates[1])
    assert found.amplitude_m[-1].max() == pytest.approx(harmonic, rel=1e-3)
    assert np.nanmax(found.frequency_hz[found.nodal_diameter == 1]) == pytest.approx(cycle.frequency_hz, rel=1e-3)
    assert found.largest_m[-1] == pytest.approx(cycle.amplitude_m, rel=5e-3)


def test_sectors_that_turn_settle_on_the_cycle_of_a_wave():
    """With a disk and Coriolis forces: the wave that grows fastest, whose cycle lasts."""
    flow = InfluenceCoefficients(2, np.array([-1, 0, 1]), np.array([-0.02, -0.01j, 0.02]))
    modal = modal_model(turning(N, disk=True), damping_ratio=0.0002, influence=[flow], coriolis=True)
    contact = ContactParameters.shared(2, **STIFF)
    cycle = self_excitation(modal, contact, 1, OPTIONS).held
    found = ring_in_flow(modal, contact, OPTIONS, 1300, disturbance=0.9)
    assert cycle.persists
    assert found.prevailing == 1
    assert np.nanmax(found.frequency_hz[found.nodal_diameter == 1]) == pytest.approx(cycle.frequency_hz, rel=2e-4)
    assert found.largest_m[-1] == pytest.approx(cycle.amplitude_m, rel=5e-3)


def test_a_ring_leaves_a_cycle_on_which_another_wave_grows(competing):
    """To a motion of several waves at once, which differs from every cycle.

    A disturbance of a twentieth seeds the departure; in the irregular motion that follows other waves have 3 to 4 %
    of the energy, by whichever path it is reached.
    """
    modal, (_, unstable) = competing
    start, omega = state_on(modal, unstable, 2), 2.0 * np.pi * unstable.frequency_hz
    integrator = RingIntegrator.of(Ring(modal, SHROUD, Excitation(2, 0.0)), omega, nodal_diameter=1)
    seeded = integrator.disturbed(start, 3, 0.05 * integrator.vibration(start))
    motion = ring_in_flow(modal, SHROUD, OPTIONS, 1000, start=seeded, omega=omega)
    squares = motion.amplitude_m**2
    others = 1.0 - squares.max(axis=1) / squares.sum(axis=1)
    assert np.all(motion.nodal_diameter[motion.amplitude_m.argmax(axis=1)] == 2)
    assert others[motion.periods < 100].max() < 0.005
    assert others[-1] > 0.015
    assert motion.ending in ("several waves", "not settled")


@pytest.mark.parametrize(("amplitude", "ending"), [(10.5, "one wave"), (12.5, "grows for ever")])
def test_a_threshold_parts_motions(amplitude, ending):
    """m = k = kt = mu N = 1, c = -0.1: the cycle of 11.4 repels."""
    modal = fed_waves([-0.1, 0.1, -0.1, -0.1])
    integrator = RingIntegrator(
        ring := Ring(modal, SLIDER, Excitation(1, 0.0)), 1.1, 4, 240, RetainedModes.of(ring, 1.1)
    )
    turn = amplitude * np.exp(0.5j * np.pi * np.arange(4))[:, None]
    start = replace(integrator.at_rest(), coordinates=turn.real, rates=(1.05j * turn).real)
    assert ring_in_flow(modal, SLIDER, OPTIONS, 600, start=start, omega=1.1).ending == ending


@pytest.mark.parametrize("fed", [[-0.1, 0.1, 0.1, -0.1], [-0.1, 0.1, 0.05, -0.1], [-0.1, 0.05, 0.1, -0.1, -0.1]])
def test_the_wave_that_is_left_lasts(fed):
    """Blades that rub on each other, of several waves that grow."""
    blade = replace(oscillator(n_blades=len(fed)), contact_right=np.eye(3, 1) / 2.0, contact_left=np.eye(3, 1) / 2.0)
    flow = InfluenceCoefficients.of_waves(1, 1j * np.array(fed))
    modal = modal_model(blade, damping_ratio=0.0, influence=[flow])
    found = ring_in_flow(modal, SLIDER, OPTIONS, 1500)
    cycle = self_excitation(modal, SLIDER, found.prevailing, OPTIONS).held
    assert (found.ending, cycle.persists) == ("one wave", True)
    assert found.amplitude_m[-1].max() == pytest.approx(abs(cycle.coordinates[1, 0]), rel=1e-3)
    assert np.nanmax(found.frequency_hz[found.amplitude_m[-1].argmax()]) == pytest.approx(
        cycle.frequency_hz, rel=1e-4
    )


def test_what_needs_no_time():
    """No wave grows; contacts that never touch: said, not integrated."""
    calm = ring_in_flow(fed_waves([-0.1] * 4), SLIDER, OPTIONS, 400)
    absent = replace(SLIDER, tangential_stiffness=np.zeros(1))
    free = ring_in_flow(fed_waves([-0.1, 0.1, -0.1, -0.1]), absent, OPTIONS, 400)
    assert [(each.ending, len(each.periods)) for each in (calm, free)] == [("decays", 0), ("grows for ever", 0)]


def test_more_than_friction_takes_grows_for_ever():
    found = ring_in_flow(fed_waves([-0.1, 0.3, -0.1, -0.1]), SLIDER, OPTIONS, 2000)
    assert (found.ending, found.prevailing) == ("grows for ever", 1)
    assert found.periods[-1] < 400


def test_progress_may_stop_it():
    def stop(periods):
        raise KeyboardInterrupt(periods)

    with pytest.raises(KeyboardInterrupt):
        ring_in_flow(fed_waves([-0.1, 0.1, -0.1, -0.1]), SLIDER, OPTIONS, 400, progress=stop)
