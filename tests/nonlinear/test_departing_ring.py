"""A ring that leaves an unstable solution: which pattern it is disturbed in, and how many blades that takes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from lumped import lumped_blade

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
from nonlinear.worst_motion.candidates import coexistences
from nonlinear.worst_motion.ring_integration import (
    PERSISTENT,
    USUAL_PERIODS,
    RingIntegration,
    Solution,
    counts,
    recurrence,
    what_persists,
)
from nonlinear.worst_motion.ring_starts import RingStarts
from nonlinear.worst_motion.stepped_sweep import SteppedSweep
from nonlinear.worst_motion.worst_motion import find_worst_motion
from rom import ReducedModel, modal_model


def solved(n_blades, excitation, frequency_hz, interference, tangential_stiffness=2.0):
    """A ring of blades of one mass, the options, and the response."""
    modal = modal_model(lumped_blade(n_blades, 1), damping_ratio=0.02)
    values = {"normal_stiffness": 3.0, "tangential_stiffness": tangential_stiffness, "friction": 0.3}
    contact = ContactParameters.shared(1, **values, interference=interference)
    options = SolverOptions(frequency_hz, harmonics=3, detached=False, truncation=False, search="off")
    return Ring(modal, contact, excitation), options, forced_response(modal, contact, excitation, options)


@cache
def unstable():
    """The ring, and a solution that grows fastest in a pattern of 15 blades, less than half as fast in one of 3."""
    ring, options, curve = solved(60, Excitation(20, 1.0), (0.1, 0.2), -0.3)
    blades = np.array([ring.blades(int(k)) for k in curve.growth_nodal_diameter])
    index = int(np.argmin(np.where(blades == 15, np.abs(curve.frequency_hz - 0.18647), np.inf)))
    assert blades[index] == 15
    assert curve.growth_rate[index] > 0.04
    return RingIntegration(ring, options), Solution.of(curve, index)


def test_a_ring_of_many_blades_where_there_is_time():
    integration, solution = unstable()
    motion, failure = integration(solution, 15 * USUAL_PERIODS, 0.0)
    assert (motion.n_blades, motion.nodal_diameter, failure) == (15, solution.nodal_diameter, "")
    assert not motion.stays


def test_else_one_of_few_blades_that_leaves_too():
    """It is said that the other one was left out. Where the motion is higher than all known, 6 blades confirm it."""
    integration, solution = unstable()
    motion, failure = integration(solution, 15 * USUAL_PERIODS - 1, 0.0)
    assert failure == "of 15 blades would take too long"
    assert (motion.n_blades, motion.stays, motion.settled) == (6, False, True)
    confirmed, _ = integration.confirmed(solution.omega, motion, 0.0)
    assert (confirmed.n_blades, confirmed.stays, counts(confirmed)) == (6, False, True)
    assert min(motion.amplitude_m, confirmed.amplitude_m) > 1.5 * motion.started_m


def test_what_would_be_the_highest_is_followed_on():
    """Two windows that agree are often a transient. What kept its height for long, or is known to be low, is not."""
    integration, solution = unstable()
    motion = integration.motion(solution, USUAL_PERIODS)
    brief = replace(motion, stays=False, settled=True, persistence=80)
    after = integration.kept(solution.omega, brief, 0.9 * brief.amplitude_m)
    assert after.periods == brief.periods + PERSISTENT
    assert integration.kept(solution.omega, brief, 1.1 * brief.amplitude_m) is brief
    long = replace(brief, persistence=PERSISTENT)
    assert integration.kept(solution.omega, long, 0.0) is long


def test_what_few_blades_confirm_persists_in_the_whole_ring():
    integration, solution = unstable()
    motion, _ = integration(solution, 15 * USUAL_PERIODS - 1, 0.0)
    motion, _ = integration.confirmed(solution.omega, motion, 0.0)
    limits = RingLimits(most_periods=200, window=100)
    whole = integrate_ring(integration.ring, solution.omega, motion.final, nodal_diameter=1, limits=limits)
    assert whole.n_blades == 60
    assert whole.amplitude_m == pytest.approx(motion.amplitude_m, rel=0.1)


def test_a_motion_is_followed_in_frequency_both_ways():
    """Where it is highest it is as high with steps half as long; beyond both ends of its range it is lost or low."""
    integration, solution = unstable()
    motion, _ = integration(solution, 15 * USUAL_PERIODS - 1, 0.0)
    start_hz = solution.omega / (2.0 * np.pi)
    sweep = SteppedSweep(integration)(start_hz, motion, 40_000, 0.0)
    assert sweep.complete
    assert sweep.frequency_hz[0] < start_hz < sweep.frequency_hz[-1]
    assert np.all(np.diff(sweep.frequency_hz) > 0.0)
    assert sweep.top is not None
    assert sweep.top.amplitude_m > 1.02 * motion.amplitude_m
    assert sweep.amplitude_m.max() == sweep.top.amplitude_m
    limits = RingLimits(most_periods=200, window=100, finer=2)
    omega, pattern = 2.0 * np.pi * sweep.top_hz, integration.pattern_of(sweep.top)
    again = integrate_ring(integration.ring, omega, sweep.top.final, nodal_diameter=pattern, limits=limits)
    assert again.amplitude_m == pytest.approx(sweep.top.amplitude_m, rel=0.05)
    low = SteppedSweep(integration)(start_hz, motion, 40_000, 2.0 * motion.amplitude_m)
    assert low.top is None
    assert low.blade_periods < 2_000  # after some time the motion is still low
    short = SteppedSweep(integration)(start_hz, motion, 1_000, 0.0)
    assert not short.complete
    assert short.frequency_hz.size < sweep.frequency_hz.size


def test_what_persists_comes_again():
    """A burst counts where half of the time later another one comes near it; before a fall nothing counts."""
    bursts = np.ones((960, 4))
    bursts[[100, 700], 2] = 3.0, 2.2
    assert len(what_persists(bursts)) == 960
    bursts[[700, 900], 2] = 1.0, 2.0
    assert what_persists(bursts).max() == 2.0
    assert len(what_persists(bursts)) == 480
    falling = np.repeat(np.exp(-np.arange(960) / 100.0)[:, None], 4, axis=1)
    assert len(what_persists(falling)) < PERSISTENT


def test_every_stretch_of_a_bursting_motion_has_its_height():
    """Windows of 40 periods reach 1.58 to 2.07: by five of them the height of 40 stretches was 1.63 to 2.0."""
    modal = modal_model(lumped_blade(4, 1), damping_ratio=0.0082)
    values = {"normal_stiffness": 37.43, "tangential_stiffness": 26.2, "friction": 0.3, "interference": -0.62}
    ring, omega = Ring(modal, ContactParameters.shared(1, **values), Excitation(1, 0.3)), 1.2288
    integration = RingIntegration(ring, SolverOptions((0.1, 0.3)))
    integrator = integration.coarse(omega, 1)
    state = integrator.march(integrator.disturbed(integrator.at_rest(), 1, 2.0), 600).final
    fine = RingIntegrator.of(ring, omega, nodal_diameter=1, retention=20, finer=0.5)
    envelope = fine.march(state, 2000).envelope_m
    windows = envelope.reshape(50, -1).max(axis=1)
    assert windows.max() > 1.2 * windows.min()
    for _ in range(3):
        motion = integrate_ring(ring, omega, state, nodal_diameter=1, limits=integration.limits(200, 0.0))
        found, seen = integration.confirmed(omega, motion, 0.0)
        assert counts(found)
        assert found.persistence > 1500
        assert seen >= found.amplitude_m > 0.9 * envelope.max()
        assert 0.0 < recurrence(found) < 200.0
        state = integrator.march(state, 300).final


def test_arrangements_are_those_that_no_turn_makes_alike():
    """A thorough search of a ring of 8 has all 34 two-coloured necklaces with both colours, of 6 as many more."""
    ring, options, curve = solved(72, Excitation(36, 0.3), (0.12, 0.14), -0.8)
    for search, blades, count in (("standard", [8], 7), ("thorough", [8, 6], 34 + 12)):
        mix = RingStarts(RingIntegration(ring, replace(options, search=search)), [curve])
        assert list(dict.fromkeys(len(start.shares) for start in mix.starts)) == blades
        assert len(mix.starts) == count
        assert [len(start.shares) for start in mix.random_starts] == [8, 6] * (12 if search == "standard" else 24)
    problem = ring.modal, ring.contact, ring.excitation, replace(options, search="thorough")
    found = replace(curve.worst, amplitude_m=9.0, motion="irregular", unresolved="much")
    kept = find_worst_motion(problem, curve, found)  # of a standard search
    assert (kept.amplitude_m, kept.motion) == (9.0, "irregular")
    assert kept.unresolved == find_worst_motion(problem, curve).unresolved


def test_a_localised_motion_is_found_from_another_state():
    """From a random state swept upwards: blades move unlike, far more than in any wave that persists, for good."""
    ring, options, curve = solved(8, Excitation(4, 0.3), (0.12, 0.3), -0.8, tangential_stiffness=2.1)
    (between,) = coexistences([curve])
    assert between.start_hz > between.end_hz  # a hardening contact: the high solution falls with the frequency
    mix = RingStarts(RingIntegration(ring, replace(options, search="standard")), [curve])
    frequency_hz = between.at(0.25)
    assert [sum(start.shares) for start in mix.starts] == [7, 6, 4, 4, 4, 2, 1]
    assert mix(frequency_hz, mix.starts[-1], 8 * 199, 0.0) == (None, "from mixed states was left out")
    start, known = mix.swept_starts[0], curve.amplitude_m[curve.stable].max()
    assert mix.swept(start, 8 * 299, known)[1] == (None, "from random states was left out")
    frequency_hz, (motion, _) = mix.swept(start, 30_000, known)
    assert motion is not None
    blades = motion.envelope_m[-40:].max(axis=0)
    assert blades.max() > 1.4 * blades.min()
    assert motion.amplitude_m > 2.0 * known
    limits = RingLimits(most_periods=400, window=100, finer=2)
    pattern = {"nodal_diameter": start.pattern, "limits": limits}
    again = integrate_ring(ring, 2.0 * np.pi * frequency_hz, motion.final, **pattern)
    assert again.settled
    assert again.amplitude_m == pytest.approx(motion.amplitude_m, rel=0.02)


def test_none_where_there_is_no_time():
    integration, solution = unstable()
    assert integration(solution, 300, 0.0) == (None, "of 15 blades would take too long")


@pytest.mark.parametrize("interference", [-0.3, 30.0])
def test_a_quick_look_says_whether_the_highest_solution_is_stable(interference):
    """What exponents along the whole curve say of its highest solution, whichever one comes to stand there."""
    ring, full, curve = solved(60, Excitation(20, 1.0), (0.1, 0.4), interference)
    folds = replace(full, stability="folds")
    quick = forced_response(ring.modal, ring.contact, ring.excitation, folds).worst
    peak, worst = curve.peak, curve.worst
    assert (quick.amplitude_m, quick.frequency_hz) == pytest.approx((peak.amplitude_m, peak.frequency_hz), rel=1e-6)
    assert quick.unstable == (not curve.stable[peak.index]) == (interference < 0.0)
    assert not worst.unstable
    assert ("unstable against nodal diameter" in quick.unresolved) == quick.unstable
    assert quick.nodal_diameter == (curve.growth_nodal_diameter[peak.index] if quick.unstable else 0)
    assert "at the worst motion against nodal diameters 0 to 30;" in quick.searched
    assert "no time integration" in quick.searched


def test_a_deflection_that_sliders_hold_is_no_vibration():
    """Sliders under constant normal loads dissipate any difference of two motions: what is stuck vibrates in one way.

    Random states slip and lock, and the blades then stand bent: other residual tractions, which are not searched.
    """
    one, face = np.ones(1), np.eye(3)[:, :1]
    model = ReducedModel(np.eye(1), np.eye(1), face, np.zeros((1, 3)), one, {"tip": one}, face, n_blades=2)
    values = {"normal_stiffness": 1.0, "tangential_stiffness": 20.0, "friction": 0.5}
    contact = ContactParameters.shared(1, **values, interference=0.12)
    options = SolverOptions(
        (0.08, 0.35), harmonics=1, truncation=False, detached=False, search="standard", effort=0.1
    )
    curve = forced_response(modal_model(model, damping_ratio=0.0044), contact, Excitation(1, 0.043), options)
    assert curve.worst.amplitude_m == curve.peak.amplitude_m == pytest.approx(5.6e-4, rel=0.05)
