"""Time integration of sectors joined at a disk: the whole ring as one structure, matrix exponentials, energy."""

from dataclasses import replace

import numpy as np
import pytest
from lumped_disk import sector_places, sector_with_disk, whole_ring
from ring_energy import energy_balance
from scipy.linalg import expm

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_complex, to_real
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis, floquet_exponents
from nonlinear.time_integration.ring import RetainedModes, Ring, RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
from nonlinear.worst_motion.ring_integration import RingPatterns
from rom import modal_model
from rom.cyclic.contact_springs import contact_springs

RAYLEIGH = (0.02, 0.02)
OPEN = ContactParameters.shared(2, normal_stiffness=0.0, tangential_stiffness=0.0, friction=0.0)
RUBBING = ContactParameters.shared(
    2, normal_stiffness=6.0, tangential_stiffness=4.0, friction=0.4, interference=0.2, preload=0.1
)


def ring_of(sector, contact=RUBBING, engine_order=1, force=1.0):
    return Ring(modal_model(sector, rayleigh=RAYLEIGH), contact, Excitation(engine_order, force))


def of_all_pairs(contact, pairs):
    """Contact parameters of the nodes of all pairs of faces."""
    fields = "normal_stiffness", "tangential_stiffness", "friction", "interference", "preload"
    return ContactParameters(**{name: np.tile(getattr(contact, name), pairs) for name in fields}, law=contact.law)


def tip(blade):
    """Name of the output of a blade of the assembled ring."""
    return f"tip{blade}" if blade else "tip"


@pytest.mark.parametrize(
    ("law", "engine_order", "ground"),
    [
        ("two_sliders", 2, False),
        ("cone", 2, False),
        ("two_sliders", 2, True),
        ("two_sliders", 12, False),
        ("two_sliders", 6, False),
        ("two_sliders", 3, False),
    ],
)
def test_the_ring_is_one_structure_in_contact_with_itself(law, engine_order, ground):
    """Six of twelve sectors, complex modes, slip and separation: the same steps on the assembled ring.

    Against ground, too: the disk joins the sectors then. And one, two and four sectors.
    """
    sector, contact, periods = sector_with_disk(12), replace(RUBBING, law=law), 3
    if ground:
        sector = replace(sector, contact_left=None)
    ring = ring_of(sector, contact, engine_order=engine_order)
    integrator = RingIntegrator.of(ring, 0.9, retention=8.0)
    record, sectors = integrator.march(integrator.at_rest(), periods), 12 // engine_order
    assert integrator.n_blades == sectors
    assert not integrator.structure.retained.all()
    modal = modal_model(whole_ring(sector, sectors, engine_order), rayleigh=RAYLEIGH)
    for j in {0, 2 * sectors // 3}:
        whole = Ring(modal, of_all_pairs(contact, sectors), Excitation(1, 1.0), tip(j))
        retained = RetainedModes(whole, integrator.modes.highest)
        alone = RingIntegrator(whole, 0.9, 1, integrator.steps, retained)
        expected = alone.march(alone.at_rest(), periods)
        assert record.output_m[:, :, j] == pytest.approx(expected.output_m[:, :, 0], abs=1e-9)
    assert record.final.slider.ravel() == pytest.approx(expected.final.slider.ravel(), abs=1e-9)
    if engine_order == 2:
        assert np.any(np.abs(record.final.slider) > 0.01)
        assert np.any(record.final.force[:, :, 2] == contact.preload[0])


class AssembledRing:
    """Motion of all coordinates of a ring of sectors by the matrix exponential, with springs at the contacts."""

    def __init__(self, ring, n_sectors, springs):
        self.ring, sector = ring, ring.modal.model
        self.places = sector_places(sector, n_sectors)
        whole = whole_ring(sector, n_sectors, ring.excitation.engine_order)
        self.force = ring.excitation.force * whole.force_excitation
        relative = whole.contact_right
        self.relative, self.springs = relative, np.tile(springs.ravel(), n_sectors)
        self.mass, free = whole.mass, whole.stiffness
        self.static_force = whole.force_static
        self.damping = RAYLEIGH[0] * whole.mass + RAYLEIGH[1] * free
        self.stiffness = free + relative.T @ (self.springs[:, None] * relative)

    def physical(self, coordinates):
        """Displacements (N,) from coordinates (q, m), by the definition of the waves."""
        q, total = len(coordinates), 0.0
        waves = np.fft.fft(coordinates, axis=0) / q
        for wave, row in enumerate(waves):
            modes = self.ring.modal.at(wave * self.ring.modal.n_blades // q).shapes
            turns = np.exp(2j * np.pi * wave * np.arange(q) / q)
            total = total + turns[:, None] * (modes @ row[: modes.shape[1]])
        assert np.abs(total.imag).max() < 1e-12
        assert total.real[:, -3:] == pytest.approx(np.roll(total.real, -1, axis=0)[:, -6:-3], abs=1e-12)
        shared = self.places.sum(axis=(0, 1))
        return np.einsum("jn,jna->a", total.real, self.places) / shared

    def after(self, start, omega, time):
        """Displacements after a time from a state at t = 0."""
        operator = self.stiffness + 1j * omega * self.damping - omega**2 * self.mass
        forced = np.linalg.solve(operator, self.force)
        inverse = np.linalg.inv(self.mass)
        generator = np.block(
            [
                [np.zeros_like(self.mass), np.eye(len(self.mass))],
                [-inverse @ self.stiffness, -inverse @ self.damping],
            ]
        )
        static = np.linalg.solve(self.stiffness, self.static_force) if self.static_force.any() else 0.0
        particular = np.concatenate([forced.real + static, (1j * omega * forced).real])
        both = np.concatenate([self.physical(start.coordinates), self.physical(start.rates)])
        turned = (forced * np.exp(1j * omega * time)).real + static
        return (expm(generator * time) @ (both - particular))[: len(forced)] + turned


def random_state(integrator, size, seed=3):
    """Any state without contact forces."""
    rng, structure = np.random.default_rng(seed), integrator.structure
    shape = integrator.n_blades, structure.angular_frequency.shape[-1]
    nodes = integrator.n_blades, integrator.ring.contact.n_contacts
    rates = rng.normal(size=shape)
    return RingState(size * rng.normal(size=shape) / 7.0, size * rates, np.zeros((*nodes, 2)), np.zeros((*nodes, 3)))


@pytest.mark.parametrize("ground", [2.0, 0.0])
def test_vibration_without_contact_is_exact(ground):
    """A held disk and one that floats: its rigid motions drift and turn as they must."""
    ring, omega = ring_of(sector_with_disk(5, ground=ground), OPEN), 0.7
    integrator = RingIntegrator.of(ring, omega, retention=1e6)
    start = random_state(integrator, 1.0)
    final = integrator.march(start, 2).final
    assembled = AssembledRing(ring, 5, np.zeros(6))
    assert bool(ring.modal.at(0).angular_frequency[0] == 0.0) == (ground == 0.0)
    expected = assembled.after(start, omega, 2 * integrator.period)
    assert assembled.physical(final.coordinates) == pytest.approx(expected, abs=1e-9)


def test_stuck_contacts_are_springs_and_the_error_is_of_second_order():
    """A floating disk whose shrouds neither slip nor open."""
    contact = ContactParameters.shared(2, normal_stiffness=4.0, tangential_stiffness=3.0, friction=50.0, preload=30.0)
    ring, omega, errors = ring_of(sector_with_disk(6, ground=0.0), contact, engine_order=2), 1.0, []
    springs = contact_springs(2, contact.normal_stiffness, contact.tangential_stiffness)
    for finer in (1, 2):
        integrator = RingIntegrator.of(ring, omega, nodal_diameter=1, retention=1e6, finer=finer)
        start = random_state(integrator, 0.1)
        force = -springs.ravel() * integrator.structure.motion(start.coordinates)
        start = replace(start, force=force.reshape(6, 2, 3))
        assembled = AssembledRing(ring, 6, springs)
        moved = assembled.physical(start.coordinates)
        assert -assembled.springs * (assembled.relative @ moved) == pytest.approx(start.force.ravel(), abs=1e-12)
        final = integrator.march(start, 1).final
        expected = assembled.after(start, omega, integrator.period)
        errors.append(np.abs(assembled.physical(final.coordinates) - expected).max() / np.abs(expected).max())
    assert errors[0] < 2e-3
    assert errors[1] == pytest.approx(errors[0] / 4.0, rel=0.1)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_energy_is_balanced_to_second_order(law):
    ring, errors = ring_of(sector_with_disk(3), replace(RUBBING, law=law)), []
    for finer in (1, 2):
        integrator = RingIntegrator.of(ring, 0.9, finer=finer, retention=1e6)
        errors.append(energy_balance(integrator, integrator.march(integrator.at_rest(), 3).final).error)
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 3.5


def solution(ground, engine_order, omega, interference, harmonics=15):
    """Ring of six sectors, options and the displacement of the wave at omega, by harmonic balance."""
    modal = modal_model(sector_with_disk(6, ground=ground), damping_ratio=0.01)
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=interference
    )
    ring, options = (
        Ring(modal, contact, Excitation(engine_order, 1.0)),
        SolverOptions((0.1, 0.8), harmonics=harmonics),
    )
    balance = build_harmonic_balance(modal, contact, ring.excitation, options)
    start = periodic_start(balance, omega, np.zeros((2, 3)), options, contact)
    assert start.converged
    return ring, options, balance.displacement(start.solution)


def test_the_wave_of_the_harmonic_balance_is_that_of_the_ring():
    """Slip and separation, harmonics in all waves: more harmonics come nearer, down to the error of the step."""
    distances = []
    for harmonics in (7, 31):
        ring, _, displacement = solution(2.0, 1, 0.8, 0.3, harmonics)
        integrator = RingIntegrator.of(ring, 0.8, retention=60.0)
        record = integrator.march(integrator.on_wave(displacement), 4)
        wave = integrator.wave_output(displacement)
        distances.append(np.abs(record.output_m[-1] - wave).max() / np.abs(wave).max())
    assert integrator.n_blades == 6
    assert np.abs(record.final.slider).max() > 0.1
    assert distances[0] > 1e-3
    assert distances[1] < 2e-4


def test_a_floating_disk_keeps_a_stable_motion():
    ring, options, displacement = solution(0.0, 1, 0.8, 0.3)
    rate = RingPatterns(ring, options, 0.8, displacement).growth_rate(1)
    motion = integrate_ring(
        ring, 0.8, displacement, nodal_diameter=1, limits=RingLimits(most_periods=300, window=40, settling=60)
    )
    assert motion.stays
    assert motion.growth_rate == pytest.approx(rate, rel=0.1)
    assert rate < 0.0


def test_sectors_leave_a_wave_at_the_rate_of_the_pattern():
    """Two sectors carry the wave, six the one perturbation that grows, at the rate of Hill's method."""
    ring, options, displacement = solution(0.0, 3, 1.2, 0.15)
    rates = [RingPatterns(ring, options, 1.2, displacement).growth_rate(k) for k in range(4)]
    assert [rate > 0.0 for rate in rates] == [False, True, False, False]
    motion = integrate_ring(
        ring, 1.2, displacement, nodal_diameter=1, limits=RingLimits(most_periods=400, window=40, settling=60)
    )
    assert (ring.wave_blades, motion.n_blades) == (2, 6)
    assert not motion.stays
    assert motion.growth_rate == pytest.approx(rates[1], rel=0.05)
    assert abs(motion.amplitude_m / motion.started_m - 1.0) > 0.1


@pytest.mark.long
def test_the_worst_motion_is_that_of_the_assembled_ring():
    """No solution of the curve is stable near its top; the ring as one structure, from rest, goes as high."""
    sector = sector_with_disk(6)
    contact = ContactParameters.shared(2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4)
    options = SolverOptions((0.105, 0.115), harmonics=3, detached=False, truncation=False)
    curve = forced_response(modal_model(sector, damping_ratio=0.01), contact, Excitation(2, 1.0), options)
    assert curve.worst.motion in {"quasi-periodic", "irregular"}
    assert curve.worst.ring_blades == 6
    modal, omega = modal_model(whole_ring(sector, 6, 2), damping_ratio=0.01), 2.0 * np.pi * curve.worst.frequency_hz
    limits, amplitudes = RingLimits(most_periods=500, window=100), []
    for blade in range(3):
        whole = Ring(modal, of_all_pairs(contact, 6), Excitation(1, 1.0), tip(blade))
        amplitudes.append(integrate_ring(whole, omega, None, limits=limits).amplitude_m)
    assert curve.worst.amplitude_m == pytest.approx(max(amplitudes), rel=0.05)
    assert curve.worst.amplitude_m > 1.2 * curve.amplitude_m.max()


def test_patterns_of_contacts_against_ground_are_those_of_the_assembled_ring():
    """The disk couples the sectors: every nodal diameter has a growth rate of its own, the largest is the ring's."""
    sector, omega, engine_order = replace(sector_with_disk(5), contact_left=None), 0.9, 1
    contact = ContactParameters.shared(
        2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=0.1
    )
    ring = Ring(modal_model(sector, damping_ratio=0.01), contact, Excitation(engine_order, 1.0))
    options = SolverOptions((0.1, 0.8), harmonics=2)
    balance = build_harmonic_balance(ring.modal, contact, ring.excitation, options)
    start = periodic_start(balance, omega, np.zeros((2, 3)), options, contact)
    displacement = balance.displacement(start.solution)
    worst = RingPatterns(ring, options, omega, displacement).worst()
    modal, every = modal_model(whole_ring(sector, 5, engine_order), damping_ratio=0.01), of_all_pairs(contact, 5)
    whole = build_harmonic_balance(modal, every, Excitation(1, 1.0), options)
    turns = np.exp(2j * np.pi * engine_order / 5 * np.outer(np.arange(3), np.arange(5)))  # harmonic, sector
    motion = turns[:, :, None, None] * to_complex(displacement)[:, None]
    of_ring = to_real(motion).reshape(5, 10, 3)
    solved = whole.evaluate(whole.unknown(of_ring), omega)
    assert np.abs(solved.residual).max() < 1e-9
    analysis = FloquetAnalysis.of(whole.receptance, every)
    every_pole = replace(analysis.problem, retention_radius=np.inf)
    memory = analysis.sampler.memory(of_ring)
    exponents = floquet_exponents(every_pole, solved.contact.jacobian, omega, memory)
    assert worst.nodal_diameter == 1
    assert worst.exponent.real == pytest.approx(exponents[0].real, rel=1e-4)
    assert worst.exponent.real > 0.0
