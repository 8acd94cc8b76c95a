"""What becomes of periodic motions in a ring of blades: as their Floquet exponents say, and as the equations say."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingLimits, _grows_no_more, integrate_ring, keeps_height_for
from rom import modal_model

LIMITS = RingLimits(most_periods=500, window=40, settling=60)


@pytest.mark.parametrize(("end", "ended"), [(np.inf, False), (0.03, True)])
def test_a_departure_that_ends_in_a_motion_close_by_is_told_from_one_that_grows(end, ended):
    """Amplitude equation a' = rate a (1 - (a / end)^2), in closed form; with a quasi-periodic ripple."""
    rate, period = 0.01, np.arange(600)
    grown = 1e-3 * np.exp(rate * period)
    distance = grown / np.sqrt(1.0 + (grown / end) ** 2) * (1.0 + 0.3 * np.sin(0.7 * period))
    judged = [_grows_no_more(list(distance[:n]), rate, 40) for n in range(1, 600)]
    assert judged[-1] is ended
    assert not any(judged[:300])


def test_a_motion_persists_from_where_it_keeps_its_height():
    """Two blades; the first 50 periods are lower, and 7 of them begin no window."""
    envelope = np.tile([1.0, 0.1], (167, 1)) * (1.0 + 0.2 * np.sin(np.arange(167)))[:, None]
    envelope[:50] *= 0.6
    assert keeps_height_for(envelope, 20) == 120
    assert keeps_height_for(np.ones((90, 2)), 40) == 80


@lru_cache
def solution(n_blades, interference, omega, harmonics=15, contacts=1):
    """Ring, displacement of the wave at omega, and nodal diameter -> largest growth rate."""
    modal = modal_model(lumped_blade(n_blades, contacts), damping_ratio=0.01)
    contact = ContactParameters.shared(
        contacts, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=interference
    )
    ring = Ring(modal, contact, Excitation(n_blades // 2, 1.0))
    options = SolverOptions((0.1, 0.8), harmonics=harmonics)
    balance = build_harmonic_balance(modal, contact, ring.excitation, options)
    start = periodic_start(balance, omega, np.zeros((contacts, 3)), options, contact)
    assert start.converged
    displacement, jacobian = balance.displacement(start.solution), balance.forces(start.solution).jacobian
    rates = {}
    for k in range(n_blades // 2 + 1):
        analysis = FloquetAnalysis.of(balance.receptance, contact, kappa=ring.shift(k))
        rates[k] = analysis.exponents(displacement, jacobian, omega)[0].real
    return ring, displacement, rates


def test_a_motion_that_is_stable_stays():
    ring, displacement, rates = solution(2, -0.5, 0.9)
    assert max(rates.values()) < -0.005
    motion = integrate_ring(ring, 0.9, displacement, nodal_diameter=1, limits=LIMITS)
    assert motion.stays
    assert motion.settled
    assert motion.repeats_after == 1
    assert motion.growth_rate == pytest.approx(max(rates.values()), rel=0.1)
    assert motion.amplitude_m == pytest.approx(motion.started_m, rel=2e-3)
    # from rest the ring comes to the same motion
    risen = integrate_ring(ring, 0.9, None, limits=RingLimits(most_periods=300, window=40))
    assert not risen.stays
    assert np.isnan(risen.growth_rate)
    assert risen.settled
    assert risen.periodic
    assert risen.amplitude_m == pytest.approx(motion.amplitude_m, rel=2e-3)


def test_a_ring_leaves_for_another_pattern():
    """Stable in the ring of two that carries the wave, left in the ring of four that carries one diameter more."""
    ring, displacement, rates = solution(4, 0.0, 1.2)
    assert rates[0] < -0.005
    assert rates[1] > 0.03
    assert (ring.blades(0), ring.blades(1)) == (2, 4)
    own = integrate_ring(ring, 1.2, displacement, limits=LIMITS)
    assert own.stays
    other = integrate_ring(ring, 1.2, displacement, nodal_diameter=1, limits=LIMITS)
    assert not other.stays
    assert other.growth_rate == pytest.approx(rates[1], rel=0.05)
    assert abs(other.amplitude_m / other.started_m - 1.0) > 0.1
    assert other.envelope_m.shape == (other.periods, 4)
    # one that is to be seen at once is not measured by a smaller one
    seen = integrate_ring(ring, 1.2, displacement, nodal_diameter=1, limits=replace(LIMITS, disturbance=0.05))
    assert not seen.stays
    assert np.isnan(seen.growth_rate)
    assert seen.amplitude_m == pytest.approx(other.amplitude_m, rel=0.1)
    # where it has gone it can go on from
    further = integrate_ring(ring, 1.2, other.final, nodal_diameter=1, limits=RingLimits(most_periods=20, window=10))
    integrator = RingIntegrator.of(ring, 1.2, nodal_diameter=1)
    assert further.envelope_m[0] == pytest.approx(integrator.march(other.final, 1).envelope_m[0], rel=1e-12)
    assert not further.stays


def test_beyond_a_neimark_sacker_bifurcation_the_motion_is_not_periodic():
    ring, displacement, rates = solution(2, -0.5, 1.5)
    assert rates[0] > 0.05
    motion = integrate_ring(ring, 1.5, displacement, limits=LIMITS)
    assert not motion.stays
    assert not motion.periodic
    assert motion.lowest_m < 0.95 * motion.amplitude_m


def test_the_wave_of_many_harmonics_is_that_of_the_ring_to_second_order():
    """Slip and separation: the distance from the harmonic balance falls with the step."""
    ring, displacement, _ = solution(2, 0.3, 0.8, 31, contacts=2)
    distances = []
    for finer in (1, 3):
        integrator = RingIntegrator.of(ring, 0.8, finer=finer, retention=200.0)
        record = integrator.march(integrator.on_wave(displacement), 4)
        wave = integrator.wave_output(displacement)
        distances.append(np.abs(record.output_m[-1] - wave).max() / np.abs(wave).max())
    assert distances[0] < 1e-3
    assert distances[1] < 0.25 * distances[0]


def test_slip_under_the_cone_is_followed_to_second_order():
    """Contacts that slip in turning directions: halving the step quarters the change."""
    modal = modal_model(lumped_blade(3, 2), damping_ratio=0.01)
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.02, interference=1.0, law="cone"
    )
    ring = Ring(modal, contact, Excitation(1, 1.0))
    ends = []
    for finer in (1, 2, 4):
        integrator = RingIntegrator.of(ring, 0.9, finer=finer, retention=200.0)
        final = integrator.march(integrator.at_rest(), 2).final
        ends.append(final.coordinates)
        assert np.abs(final.slider).max() > 0.0
    first, second = (np.abs(ends[i] - ends[i + 1]).max() for i in range(2))
    assert second < 0.35 * first
