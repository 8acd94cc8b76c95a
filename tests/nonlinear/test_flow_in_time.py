"""Time integration in a flow: one ring as a real equation of motion, poles, exponents, a self-excited cycle."""

from dataclasses import replace

import numpy as np
import pytest
from lumped import lumped_blade, oscillator
from lumped_disk import sector_with_disk
from period_map import PeriodMap
from scipy.linalg import expm

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.mistuned_ring.mistuned_curve import mistuned_curve
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_response import mistuned_response
from nonlinear.nonlinear_modes.limit_cycles import self_excitation
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.time_integration.ring import Ring, RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator, RingRecord, with_more_harmonics
from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
from nonlinear.worst_motion.ring_integration import RingPatterns
from rom import InfluenceCoefficients, ReducedModel, modal_model
from rom.cyclic.contact_springs import contact_springs
from rom.cyclic.natural_frequencies import aeroelastic_modes

N = 6
FLOW = (
    InfluenceCoefficients(
        1, np.array([-1, 0, 1, 2]), np.array([0.03 - 0.02j, -0.02 + 0.03j, -0.05 + 0.04j, 0.01 + 0.02j])
    ),
    InfluenceCoefficients(3, np.array([0, 1]), np.array([-0.02j, 0.05j])),
)
OPEN = ContactParameters.shared(2, normal_stiffness=0.0, tangential_stiffness=0.0, friction=0.0)
SLIDER = ContactParameters.shared(1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=1.0, preload=1.0)
UNIT_HZ = 0.5 / np.pi  # 1 rad/s


def ring_of(model, contact=OPEN, order=1, force=0.7, flow=FLOW, damping_ratio=0.01):
    modal = modal_model(model, damping_ratio=damping_ratio, influence=flow)
    return Ring(modal, contact, Excitation(order, force))


def ring_matrices(ring, blades):
    """Stiffness and damping of all blades in modal coordinates, blade after blade: real springs and dashpots."""
    modal, each = ring.modal, np.eye(blades)
    stiffness, damping = (np.kron(each, np.diag(row)) for row in (modal.angular_frequency**2, modal.damping))
    for flow in modal.influence:
        frequency, family = modal.angular_frequency[flow.mode - 1], np.zeros_like(np.diag(modal.damping))
        family[flow.mode - 1, flow.mode - 1] = 1.0
        for place, value in zip(flow.offset, flow.coefficient, strict=True):
            moving = np.kron(np.roll(each, place, axis=1), family)  # row j: the blade at j + l
            stiffness -= frequency**2 * value.real * moving
            damping -= frequency * value.imag * moving
    return stiffness, damping


def after(ring, matrices, start, omega, time):
    """Coordinates and rates (2, q m) after a time from a state at t = 0, by the matrix exponential."""
    (stiffness, damping), size = matrices, start.coordinates.size
    turns = np.exp(1j * ring.phase * np.arange(start.n_blades))
    force = ring.excitation.force * np.kron(turns, ring.modal.force)
    forced = np.linalg.solve(stiffness + 1j * omega * damping - omega**2 * np.eye(size), force)
    generator = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -damping]])
    particular = np.concatenate([forced, 1j * omega * forced])
    both = np.concatenate([start.coordinates.ravel(), start.rates.ravel()])
    turned = (particular * np.exp(1j * omega * time)).real
    return (expm(generator * time) @ (both - particular.real) + turned).reshape(2, size)


def random_state(integrator, size=1.0):
    rng, nodes = np.random.default_rng(3), integrator.ring.contact.n_contacts
    shape = integrator.n_blades, integrator.structure.angular_frequency.shape[-1]
    parts = size * rng.normal(size=(2, *shape))
    return RingState(*parts, np.zeros((len(parts[0]), nodes, 2)), np.zeros((len(parts[0]), nodes, 3)))


@pytest.mark.parametrize("blades", [1, 2, 5, 6])
def test_vibration_without_contact_is_exact(blades):
    """Any state and an excitation: one real equation of motion of all blades."""
    ring = ring_of(lumped_blade(blades))
    integrator = RingIntegrator.of(ring, 0.9, nodal_diameter=1, retention=1e6)
    start = random_state(integrator)
    final = integrator.march(start, 3).final
    expected = after(ring, ring_matrices(ring, blades), start, 0.9, 3 * integrator.period)
    found = np.array([final.coordinates.ravel(), final.rates.ravel()])
    assert integrator.n_blades == blades
    assert found == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("model", [lumped_blade(N), sector_with_disk(N)], ids=["blade", "disk"])
def test_waves_grow_and_turn_as_their_poles(model):
    ring = ring_of(model, force=0.0)
    integrator = RingIntegrator.of(ring, 1.0, nodal_diameter=1, retention=1e6)
    rest, time = integrator.at_rest(), 4 * integrator.period
    static, _ = integrator.contact_free(0.0)
    growing = []
    for n in range(-2, 4):
        pole = aeroelastic_modes(model, ring.modal, n, count=1)[0]
        turns = np.exp(2j * np.pi * n / N * np.arange(N))
        first = np.eye(rest.coordinates.shape[1])[0]
        moved, rates = np.outer(turns, first).real, np.outer(pole * turns, first).real
        start = replace(rest, coordinates=static + moved, rates=rates)
        final = integrator.march(start, 4).final
        expected = static + np.outer(np.exp(pole * time) * turns, first).real
        assert final.coordinates == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())
        growing.append(pole.real > 0.0)
    assert 0 < sum(growing) < N


def test_stuck_contacts_are_springs_and_the_error_is_of_second_order():
    contact = ContactParameters.shared(2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=50.0, preload=30.0)
    ring, omega, errors = ring_of(lumped_blade(N), contact), 1.0, []
    springs = np.tile(contact_springs(2, contact.normal_stiffness, contact.tangential_stiffness).ravel(), N)
    each, modal = np.eye(N), ring.modal
    relative = np.kron(each, modal.right) - np.kron(np.roll(each, 1, axis=1), modal.left)
    stiffness, damping = ring_matrices(ring, N)
    matrices = stiffness + relative.T @ (springs[:, None] * relative), damping
    for finer in (1, 2):
        integrator = RingIntegrator.of(ring, omega, retention=1e6, finer=finer)
        start = random_state(integrator, 0.1)
        start = replace(start, force=-(springs * (relative @ start.coordinates.ravel())).reshape(N, 2, 3))
        final = integrator.march(start, 1).final
        expected = after(ring, matrices, start, omega, integrator.period)[0]
        errors.append(np.abs(final.coordinates.ravel() - expected).max() / np.abs(expected).max())
    assert errors[0] < 1e-2
    assert errors[1] == pytest.approx(errors[0] / 4.0, rel=0.1)


def test_modes_that_follow_at_once_have_the_springs_of_the_flow():
    ring = ring_of(lumped_blade(N))
    integrator = RingIntegrator.of(ring, 0.1)
    structure = integrator.structure
    kept, modes = structure.retained[0], structure.retained.shape[1]
    assert (kept.sum(), kept[2]) == (2, False)  # the flow acts on the third mode
    force = np.random.default_rng(2).normal(size=(N, modes))
    found, at = structure.scaled(force, structure.flexibility), np.flatnonzero(np.tile(~kept, N))
    inner = ring_matrices(ring, N)[0][np.ix_(at, at)]
    assert found.ravel()[at] == pytest.approx(np.linalg.solve(inner, force.ravel()[at]), rel=1e-12)
    assert np.all(found[:, kept] == 0.0)


def plate(n_blades=N):
    """Two masses, no mode above 3 rad/s: no pole of a perturbation is condensed."""
    right, left = (np.array([[0.8 * a, 0.6], [0.0, 0.0], [-0.6, 0.8 * b]]) for a, b in ((1.0, 1.0), (0.6, 0.625)))
    return ReducedModel(
        mass=np.eye(2),
        stiffness=np.array([[1.0, 0.2], [0.2, 4.0]]),
        contact_right=right,
        contact_left=left,
        contact_position=np.zeros((1, 3)),
        force_excitation=np.array([1.0, 0.3]),
        outputs={"tip": np.ones(2)},
        n_blades=n_blades,
        producer="test",
    )


def one_wave(nodal_diameter, fed, others=-0.03j, n_blades=N):
    """A flow that feeds the first mode in one wave."""
    values = np.full(n_blades, others)
    values[nodal_diameter] = fed
    return (InfluenceCoefficients.of_waves(1, values),)


def balanced(ring, omega, harmonics=15):
    """Options and the displacement of the wave at omega."""
    options = SolverOptions((0.1, 0.8), harmonics=harmonics)
    balance = build_harmonic_balance(ring.modal, ring.contact, ring.excitation, options)
    start = periodic_start(balance, omega, np.zeros((ring.modal.n_contacts, 3)), options, ring.contact)
    assert start.converged
    return options, balance.displacement(start.solution)


@pytest.mark.parametrize(("wave", "order", "growing"), [(-1, 3, 2), (1, 2, 1)])
def test_slipping_and_opening_waves_grow_as_their_exponents(wave, order, growing):
    """The monodromy matrix of six blades in time, against exponents of all nodal diameters."""
    contact = ContactParameters.shared(
        1, normal_stiffness=1.5, tangential_stiffness=1.0, friction=0.4, interference=0.1
    )
    ring = ring_of(plate(), contact, order, 0.5, one_wave(wave, 0.1j + 0.03))
    options, displacement = balanced(ring, 1.2)
    patterns = RingPatterns(ring, options, 1.2, displacement)
    worst = patterns.worst()
    assert worst.nodal_diameter == growing
    assert worst.exponent.real > 0.0
    integrator = RingIntegrator.of(ring, 1.2, nodal_diameter=1, finer=2.0)
    period = PeriodMap(integrator, integrator.on_wave(with_more_harmonics(ring, 1.2, displacement)))
    _, matrix = period.fixed_point(period.start)
    assert period.exponents(matrix).real.max() == pytest.approx(worst.exponent.real, rel=0.01)
    states, _ = RingIntegrator.of(ring, 1.2).history(RingIntegrator.of(ring, 1.2).on_wave(displacement))
    assert np.ptp([state.slider for state in states], axis=0).max() > 0.5
    assert max(state.force[:, :, 2].max() for state in states) == 0.0


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_the_wave_of_the_harmonic_balance_is_that_of_the_ring(disk):
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=0.3
    )
    model, distances = sector_with_disk(N) if disk else lumped_blade(N), []
    ring = ring_of(model, contact, force=1.0, damping_ratio=0.02)
    for harmonics in (7, 31):
        _, displacement = balanced(ring, 0.8, harmonics)
        integrator = RingIntegrator.of(ring, 0.8, retention=60.0)
        record = integrator.march(integrator.on_wave(displacement), 4)
        wave = integrator.wave_output(displacement)
        distances.append(np.abs(record.output_m[-1] - wave).max() / np.abs(wave).max())
    assert np.abs(record.final.slider).max() > 0.1
    assert distances[0] > 1e-3
    assert distances[1] < 3e-4


def between_blades():
    """Two blades whose contact sees the motion of one where they move against each other."""
    return replace(oscillator(n_blades=2), contact_right=np.eye(3, 1) / 2.0, contact_left=np.eye(3, 1) / 2.0)


@pytest.mark.parametrize(
    ("model", "flow", "pattern", "starts"),
    [
        (oscillator(), [InfluenceCoefficients(1, np.array([0]), np.array([0.1j]))], [1.0], (10.0, 1.14)),
        (between_blades(), one_wave(1, 0.1j, -0.1j, 2), [1.0, -1.0], (10.0,)),
        (between_blades(), [InfluenceCoefficients(1, np.array([1]), np.array([-0.1j]))], [1.0, -1.0], (1.14,)),
    ],
    ids=["ground", "neighbours", "next blade"],
)
def test_a_self_excited_cycle_without_excitation(model, flow, pattern, starts):
    """m = k = kt = limit = 1, c = -0.1: amplitude 1.1435, 1.3881 rad/s, from below and above; 12 is too much."""
    ring = ring_of(model, SLIDER, 0, 0.0, flow, damping_ratio=0.0)
    integrator = RingIntegrator.of(ring, 1.388, nodal_diameter=len(pattern) - 1, finer=4)
    limits = RingLimits(most_periods=240, window=40, finer=4)

    def motion(amplitude):
        start = replace(integrator.at_rest(), coordinates=amplitude * np.array(pattern)[:, None])
        return integrate_ring(ring, 1.388, start, nodal_diameter=len(pattern) - 1, limits=limits)

    for amplitude in starts:
        found = motion(amplitude)
        assert (found.settled, found.unbounded, found.n_blades) == (True, False, len(pattern))
        assert (found.lowest_m, found.amplitude_m) == pytest.approx((1.143487, 1.143487), rel=2e-5)
    output = integrator.march(found.final, 60).output_m[:, :, 0].ravel()
    rises = np.flatnonzero((output[:-1] < 0.0) & (output[1:] >= 0.0))
    instants = rises - output[rises] / (output[rises + 1] - output[rises])
    assert 2.0 * np.pi * integrator.steps / integrator.period / np.diff(instants).mean() == pytest.approx(
        1.388135, rel=2e-6
    )
    growing = motion(12.0)
    assert (growing.unbounded, growing.settled, growing.periodic) == (True, False, False)
    assert growing.amplitude_m > 1e4
    assert growing.periods == 80


def test_the_flow_feeds_a_motion_that_contacts_do_not_feel():
    """All blades in phase do not rub: said to grow without bound too, and not where the flow takes energy."""
    flow = [InfluenceCoefficients(1, np.array([0]), np.array([0.1j]))]
    ring = ring_of(between_blades(), SLIDER, 0, 0.1, flow, damping_ratio=0.0)
    limits = RingLimits(most_periods=400, window=40)
    assert integrate_ring(ring, 1.2, None, limits=limits).unbounded
    calm = ring_of(between_blades(), SLIDER, 0, 0.1, [replace(flow[0], coefficient=np.array([-0.1j]))])
    assert not integrate_ring(calm, 1.2, None, limits=limits).unbounded


def worst(force, range_hz=(1.0 * UNIT_HZ, 1.3 * UNIT_HZ)):
    modal = modal_model(oscillator(n_blades=N), damping_ratio=0.0, influence=one_wave(2, 0.1j, -0.1j))
    options = SolverOptions(range_hz, harmonics=3, detached=False, truncation=False, search="quick")
    return forced_response(modal, SLIDER, Excitation(1, force), options)


def slider_ring(ring, omega, start, periods, steps):
    """Largest displacement of each period: Runge-Kutta steps of six blades on sliders, real springs and dashpots."""
    stiffness, damping = ring_matrices(ring, N)
    turns, force, dt = np.arange(N) * ring.phase, ring.excitation.force, 2.0 * np.pi / omega / steps
    x, v, w, found = start.copy(), np.zeros(N), np.zeros(N), np.zeros(periods)

    def rate(t, x, v):
        return force * np.cos(omega * t + turns) - damping @ v - stiffness @ x - np.clip(x - w, -1.0, 1.0)

    for step in range(periods * steps):
        t = step * dt
        v1, a1 = v, rate(t, x, v)
        v2, a2 = v + dt / 2.0 * a1, rate(t + dt / 2.0, x + dt / 2.0 * v1, v + dt / 2.0 * a1)
        v3, a3 = v + dt / 2.0 * a2, rate(t + dt / 2.0, x + dt / 2.0 * v2, v + dt / 2.0 * a2)
        v4, a4 = v + dt * a3, rate(t + dt, x + dt * v3, v + dt * a3)
        x, v = x + dt / 6.0 * (v1 + 2.0 * (v2 + v3) + v4), v + dt / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        w = np.clip(w, x - 1.0, x + 1.0)
        found[step // steps] = max(found[step // steps], np.abs(x).max())
    return found


def test_the_worst_motion_of_an_unstable_wave_is_its_self_excited_one():
    """A small excitation: no solution is stable, and the ring vibrates far higher, at a frequency of its own."""
    curve = worst(0.05)
    found = curve.worst
    assert not curve.stable.any()
    assert (found.motion, found.ring_blades) == ("quasi-periodic", N)
    ring = Ring(
        modal_model(oscillator(n_blades=N), damping_ratio=0.0, influence=one_wave(2, 0.1j, -0.1j)),
        SLIDER,
        Excitation(1, 0.05),
    )
    start = np.cos(2.0 * np.pi * 2 / N * np.arange(N))
    heights = slider_ring(ring, 2.0 * np.pi * found.frequency_hz, start, 110, 80)[50:]
    assert found.amplitude_m == pytest.approx(heights.max(), rel=0.01)
    assert found.amplitude_m > 3.0 * curve.amplitude_m.max()


def test_a_search_ends_where_the_motion_grows_without_bound():
    curve = worst(6.0, (0.9 * UNIT_HZ, 1.1 * UNIT_HZ))
    found = curve.worst
    assert "the motion grows without bound: the contacts do not hold what the flow feeds" in found.unresolved
    assert found.unresolved.startswith("from the unstable solution at")
    assert "random" not in found.searched
    assert found.branch == -1 or curve.stable[found.index]


def test_what_does_not_repeat_is_as_high_as_its_samples_and_a_parabola():
    """A cosine of another frequency: the largest sample is often the first or the last one of a period."""
    time = 2.0 * np.pi * np.arange(1, 60 * 64 + 1) / 64
    fine = 2.0 * np.pi * np.linspace(0.0, 1.0, 2001)
    for factor in (1.0, 1.2733, 2.41):
        record = RingRecord(None, np.cos(factor * time + 0.3).reshape(60, 64, 1), None, 0)
        true = [np.abs(np.cos(factor * (fine + 2.0 * np.pi * period) + 0.3)).max() for period in range(60)]
        assert record.envelope_m[:, 0].max() == pytest.approx(1.0, abs=1e-5)
        assert np.all(record.envelope_m[:, 0] < np.array(true) + 1e-5)


def test_a_flow_that_does_nothing_changes_nothing():
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=0.3
    )
    outputs = []
    for flow in ((), [InfluenceCoefficients(1, np.array([0, 1]), np.zeros(2, complex))]):
        integrator = RingIntegrator.of(ring_of(lumped_blade(N), contact, force=1.0, flow=flow), 0.9)
        outputs.append(integrator.march(integrator.at_rest(), 5).output_m)
    assert outputs[1] == pytest.approx(outputs[0], abs=1e-8)


def test_mistuned_contacts_in_a_flow_are_not_integrated_in_time():
    modal = modal_model(lumped_blade(4, 1), damping_ratio=0.01, influence=FLOW[:1])
    contact = ContactParameters.shared(
        1, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=0.3
    )
    options = SolverOptions((0.1, 0.2), harmonics=1, detached=False, truncation=False)
    problem = modal, contact, Excitation(1, 1.0), options, Mistuning.of(4, friction=[0.1, 0.0, -0.1, 0.0])
    found = mistuned_curve(*problem, mistuned_response(*problem)).worst
    assert "no time integration" in found.searched
    assert found.ring_blades == 0


@pytest.mark.parametrize(("wave", "fed"), [(-1, 0.1j + 0.03), (1, 0.15j)])
def test_the_ring_stays_on_limit_cycles_and_leaves_thresholds(wave, fed):
    """Cycles of harmonic balance without excitation; 10 % above a threshold the ring goes to the next one or on."""
    contact = ContactParameters.shared(
        1, normal_stiffness=1.5, tangential_stiffness=1.0, friction=0.4, interference=0.3
    )
    ring = ring_of(plate(), contact, wave, 0.0, one_wave(wave, fed))
    found = self_excitation(ring.modal, contact, wave, SolverOptions((0.05, 1.0), harmonics=9))
    held = found.held
    assert held is not None
    assert held.persists

    def state(cycle, factor=1.0):
        omega, coordinates = 2.0 * np.pi * cycle.frequency_hz, cycle.coordinates
        relative = ring.receptance(len(coordinates) - 1).relative
        motion = np.einsum("hrm,hm->hr", relative, coordinates).reshape(len(coordinates), -1, 3)
        motion[1:] *= factor
        integrator = RingIntegrator.of(ring, omega, finer=2)
        start = integrator.on_wave(to_real(motion))
        mean = start.coordinates.mean(axis=0)  # harmonics of the forces are not in proportion
        turns = np.exp(1j * ring.phase * np.arange(integrator.n_blades)[:, None] * np.arange(len(coordinates)))
        moved = factor * (turns[:, 1:] @ coordinates[1:]).real
        rates = factor * (turns @ (1j * omega * np.arange(len(coordinates))[:, None] * coordinates)).real
        return omega, integrator, replace(start, coordinates=mean + moved, rates=rates)

    _, integrator, start = state(held)
    assert integrator.march(start, 60).envelope_m[-5:].max() == pytest.approx(held.amplitude_m, rel=2e-3)
    assert [cycle.attracting for cycle in found.cycles[:2]] == [True, False]
    for factor in (0.9, 1.1):
        omega, _, start = state(found.cycles[1], factor)
        motion = integrate_ring(ring, omega, start, limits=RingLimits(most_periods=240, window=40))
        goes_to = held if factor < 1.0 else next(iter(found.cycles[2:]), None)
        if goes_to is not None:
            assert motion.settled
            assert motion.amplitude_m == pytest.approx(goes_to.amplitude_m, rel=2e-3)
        else:
            assert not motion.settled
            assert motion.amplitude_m > 1.5 * found.cycles[1].amplitude_m
