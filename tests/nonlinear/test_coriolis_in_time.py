"""Time integration with Coriolis forces: physical matrices, poles, harmonic balance, energy, a closed form."""

from dataclasses import replace

import numpy as np
import pytest
from lumped_disk import sector_places, whole_ring
from ring_energy import energy_balance
from scipy.linalg import expm
from test_floating_bodies import OMEGA, sector
from turning import circling, turning

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.harmonic_balance.initial_solution import periodic_start
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_receptance import ring_in_time
from nonlinear.nonlinear_modes.ring_in_flow import ring_in_flow
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.time_integration.ring import RetainedModes, Ring, RingState
from nonlinear.time_integration.ring_integrator import RingIntegrator
from nonlinear.time_integration.ring_motion import RingLimits, integrate_ring
from rom import InfluenceCoefficients, modal_model
from rom.cyclic.natural_frequencies import aeroelastic_modes

N = 6
RAYLEIGH = (0.02, 0.02)
FLOW = InfluenceCoefficients(2, np.array([-1, 0, 1]), np.array([0.02 - 0.01j, -0.01 - 0.02j, -0.03 + 0.02j]))
OPEN = ContactParameters.shared(2, normal_stiffness=0.0, tangential_stiffness=0.0, friction=0.0)
RUBBING = ContactParameters.shared(2, normal_stiffness=6.0, tangential_stiffness=4.2, friction=0.4, interference=0.3)
EVERY = 1e6  # retention of all modes


def ring_of(model, contact=RUBBING, order=1, force=1.0, flow=(), coriolis=True):
    modal = modal_model(model, rayleigh=RAYLEIGH, influence=flow, coriolis=coriolis)
    return Ring(modal, contact, Excitation(order, force))


def random_state(integrator, size=1.0):
    rng, nodes = np.random.default_rng(3), integrator.ring.contact.n_contacts
    shape = integrator.n_blades, integrator.structure.angular_frequency.shape[-1]
    coordinates, rates = size * rng.normal(size=(2, *shape))
    none = np.zeros((len(rates), nodes, 3))
    return RingState(coordinates / 7.0, rates, none[:, :, :2], none)


class WholeRing:
    """Matrices of all coordinates of a ring of q sectors, and these from modal coordinates."""

    def __init__(self, ring, model, q):
        self.ring, self.q, self.places = ring, q, sector_places(model, q) if model.has_disk else None
        self.mass, self.stiffness, skew = map(self.assembled, (model.mass, model.stiffness, model.coriolis))
        speed = model.speed_rpm * np.pi / 30.0
        self.damping = RAYLEIGH[0] * self.mass + RAYLEIGH[1] * self.stiffness + speed * skew
        static = np.tile(model.force_static, (q, 1))
        force = static.ravel() if self.places is None else np.einsum("jn,jna->a", static, self.places)
        self.static = np.linalg.solve(self.stiffness, force)

    def assembled(self, matrix):
        if self.places is None:
            return np.kron(np.eye(self.q), matrix)
        return np.einsum("jna,nk,jkb->ab", self.places, matrix, self.places)

    def physical(self, coordinates):
        total, waves = 0.0, np.fft.fft(coordinates, axis=0) / self.q
        for wave, row in enumerate(waves):
            modes = self.ring.modal.at_phase(2.0 * np.pi * wave / self.q).shapes
            turns = np.exp(2j * np.pi * wave * np.arange(self.q) / self.q)
            total = total + turns[:, None] * (modes @ row[: modes.shape[1]])
        if self.places is None:
            return total.real.ravel()
        return np.einsum("jn,jna->a", total.real, self.places) / self.places.sum(axis=(0, 1))

    def after(self, start, time):
        inverse, size = np.linalg.inv(self.mass), len(self.mass)
        below = np.hstack([-inverse @ self.stiffness, -inverse @ self.damping])
        generator = np.vstack([np.eye(size, 2 * size, size), below])
        rest = np.concatenate([self.static, np.zeros(size)])
        both = np.concatenate([self.physical(start.coordinates), self.physical(start.rates)])
        return expm(generator * time) @ (both - rest) + rest


@pytest.mark.parametrize(("disk", "q"), [(False, 1), (False, 2), (False, 5), (True, 1), (True, 2), (True, 6)])
def test_vibration_without_contact_is_exact(disk, q):
    """All coordinates of the ring in physical matrices, from any state."""
    model = turning(q, disk)
    ring = ring_of(model, OPEN, force=0.0)
    integrator, whole = RingIntegrator.of(ring, 0.7, nodal_diameter=1, retention=EVERY), WholeRing(ring, model, q)
    start = random_state(integrator)
    final, expected = integrator.march(start, 2).final, whole.after(start, 2 * integrator.period)
    found = np.concatenate([whole.physical(final.coordinates), whole.physical(final.rates)])
    assert integrator.n_blades == q
    assert found == pytest.approx(expected, abs=2e-10 * np.abs(expected).max())  # rounding of the natural frequencies
    again = integrator.march(final, 1).final
    once = integrator.march(start, 3).final
    assert once.coordinates == pytest.approx(again.coordinates, abs=1e-12 * np.abs(expected).max())
    without = replace(ring, modal=ring.modal.without_coriolis)
    other = RingIntegrator.of(without, 0.7, nodal_diameter=1, retention=EVERY).march(start, 2).final
    assert np.abs(whole.physical(other.coordinates) - whole.physical(final.coordinates)).max() > 0.01


@pytest.mark.parametrize("flow", [[], [FLOW]], ids=["no_flow", "flow"])
@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_waves_move_as_their_poles(disk, flow):
    """Forward and backward waves of all nodal diameters, with modes that are not integrated."""
    ring = ring_of(turning(N, disk), OPEN, force=0.0, flow=flow)
    integrator = RingIntegrator.of(ring, 0.5, nodal_diameter=1)
    assert not integrator.structure.retained.all()
    rest, time = integrator.at_rest(), 3 * integrator.period
    static, _ = integrator.contact_free(0.0)
    for n in range(-2, 4):
        found, turns = ring.modal.at(n).turning, np.exp(2j * np.pi * n / N * np.arange(N))
        for place in np.argsort(np.abs(found.poles))[:4]:
            pole, shape = found.poles[place], np.zeros(rest.coordinates.shape[1], complex)
            shape[: len(found.shapes)] = found.shapes[:, place]
            moved = np.outer(turns, shape)
            start = replace(rest, coordinates=static + moved.real, rates=(pole * moved).real)
            final = integrator.march(start, 3).final
            expected = (np.exp(pole * time) * moved).real
            assert final.coordinates - static == pytest.approx(expected, abs=1e-9 * np.abs(shape).max())
            assert final.rates == pytest.approx(
                (pole * np.exp(pole * time) * moved).real, abs=1e-8 * np.abs(shape).max()
            )


@pytest.mark.parametrize("disk", [False, True], ids=["blade", "disk"])
def test_at_rest_coriolis_forces_change_nothing(disk):
    outputs = []
    for coriolis in (True, False):
        integrator = RingIntegrator.of(ring_of(turning(N, disk, 0.0), coriolis=coriolis), 0.9)
        outputs.append(integrator.march(integrator.at_rest(), 5).output_m)
    assert outputs[0] == pytest.approx(outputs[1], abs=1e-8 * np.abs(outputs[1]).max())


def assembled(model, contact, order):
    """A ring of six of twelve sectors as one structure, and the contact of all its pairs."""
    places = sector_places(model, N)
    whole = replace(
        whole_ring(model, N, order),
        coriolis=np.einsum("jna,nk,jkb->ab", places, model.coriolis, places),
        speed_rpm=model.speed_rpm,
        force_centrifugal=np.zeros(places.shape[2]),
    )
    fields = "normal_stiffness", "tangential_stiffness", "friction", "interference", "preload"
    every = {name: np.tile(getattr(contact, name), N) for name in fields}
    return whole, ContactParameters(**every, law=contact.law)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_the_ring_is_one_structure_in_contact_with_itself(law):
    """Slip and separation on six of twelve sectors: the same steps on the assembled ring, whose one wave is real."""
    model, contact, periods = turning(12, disk=True), replace(RUBBING, law=law), 3
    integrator = RingIntegrator.of(ring_of(model, contact, order=2), 0.9, retention=8.0)
    record = integrator.march(integrator.at_rest(), periods)
    whole = replace(ring_of(*assembled(model, contact, 2)), output="tip3")
    alone = RingIntegrator(whole, 0.9, 1, integrator.steps, RetainedModes(whole, integrator.modes.highest))
    expected = alone.march(alone.at_rest(), periods)
    assert record.output_m[:, :, 3] == pytest.approx(expected.output_m[:, :, 0], abs=1e-8)
    assert record.final.slider.ravel() == pytest.approx(expected.final.slider.ravel(), abs=1e-8)
    assert np.abs(record.final.slider).max() > 0.01


def balanced(ring, omega, harmonics):
    """The displacement of the wave by harmonic balance."""
    options = SolverOptions((0.1, 0.8), harmonics=harmonics)
    balance = build_harmonic_balance(ring.modal, ring.contact, ring.excitation, options)
    start = periodic_start(balance, omega, np.zeros((ring.modal.n_contacts, 3)), options, ring.contact)
    assert start.converged
    return balance.displacement(start.solution)


@pytest.mark.parametrize(("disk", "speed", "flow"), [(False, 0.3, []), (True, 0.08, []), (True, 0.3, [FLOW])])
def test_the_wave_of_the_harmonic_balance_is_that_of_the_ring(disk, speed, flow):
    """With the default number of modes too: what Coriolis forces do to the others is not left out (that is 3 %)."""
    distances = []
    modal = modal_model(turning(N, disk, speed), damping_ratio=0.02, influence=flow, coriolis=True)
    ring = Ring(modal, RUBBING, Excitation(1, 1.0))
    for harmonics, retention in ((7, 60.0), (31, 60.0), (31, 20.0)):
        displacement = balanced(ring, 0.8, harmonics)
        integrator = RingIntegrator.of(ring, 0.8, retention=retention)
        record = integrator.march(integrator.on_wave(displacement), 4)
        wave = integrator.wave_output(displacement)
        distances.append(np.abs(record.output_m[-1] - wave).max() / np.abs(wave).max())
    assert not integrator.structure.retained.all()
    assert np.abs(record.final.slider).max() > 0.1
    assert distances[0] > 1e-3
    assert distances[1] < 5e-4
    assert distances[2] < 1e-3


@pytest.mark.parametrize("q", [2, 5])
def test_blades_alone_are_joined_sectors(q):
    """Slip and separation: with a flow that does nothing poles of waves are integrated, not those of blades."""
    still, outputs = replace(FLOW, coefficient=np.zeros(3, complex)), []
    for flow in ([], [still]):
        ring = ring_of(turning(q, speed=0.3), flow=flow)
        integrator = RingIntegrator.of(ring, 0.9, nodal_diameter=1)
        outputs.append(integrator.march(integrator.at_rest(), 5))
    assert outputs[1].output_m == pytest.approx(outputs[0].output_m, abs=1e-8)
    assert outputs[1].final.coordinates == pytest.approx(outputs[0].final.coordinates, abs=1e-8)
    assert outputs[1].final.rates == pytest.approx(outputs[0].final.rates, abs=1e-8)
    assert np.abs(outputs[0].final.slider).max() > 0.01


def test_blades_that_differ_are_refused():
    ring = ring_of(turning(2))
    apart = ring_in_time(ring.modal, ring.contact, ring.excitation, Mistuning.of(2, friction=[0.1, -0.1]))
    with pytest.raises(ValueError, match="blades that differ, allowed: on a rigid disk"):
        RingIntegrator.of(apart, 0.9)


@pytest.mark.parametrize("law", ["two_sliders", "cone"])
def test_coriolis_forces_do_no_work(law):
    """Energy is balanced to second order, from rest, with slip and separation."""
    ring, errors = ring_of(turning(3, disk=True, speed=0.3), replace(RUBBING, law=law)), []
    for finer in (1, 2):
        integrator = RingIntegrator.of(ring, 0.9, finer=finer, retention=EVERY)
        errors.append(energy_balance(integrator, integrator.march(integrator.at_rest(), 3).final).error)
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 3.5


@pytest.mark.parametrize(("sense", "omega"), [(1.0, 0.6), (-1.0, 0.9), (-1.0, 1.4)])
def test_a_mass_that_circles_in_a_turning_frame_under_friction(sense, omega):
    """kt = 1, mu N = 0.5, slip all the time: D z + T = F with abs(T) = mu N, D = 1 - (w + W)^2 + i c w.

    z = (mu N / kt -+ i r) e^(i a) where the slider moves on a circle of the radius r, T = mu N e^(i a) along its
    velocity; w + W for a force that turns with the frame, w - W against it.
    """
    speed, limit, force = 0.3, 0.5, 1.2
    contact = ContactParameters.shared(
        1, normal_stiffness=0.0, tangential_stiffness=1.0, friction=0.5, preload=1.0, law="cone"
    )
    modal = modal_model(circling(speed, -sense), damping_ratio=0.01, coriolis=True)
    assert modal.damping[0] == pytest.approx(modal.damping[1])
    ring = Ring(modal, contact, Excitation(0, force))
    dynamic = 1.0 - (omega + sense * speed) ** 2 + 1j * modal.damping[0] * sense * omega
    # abs(D (limit - i sense r) + limit)^2 = force^2
    first, second = (dynamic + 1.0) * limit, -1j * sense * dynamic
    quadratic = [abs(second) ** 2, 2.0 * (first * second.conjugate()).real, abs(first) ** 2 - force**2]
    radius = float(np.roots(quadratic).real.max())
    assert radius > 0.1
    amplitude = np.hypot(limit, radius)
    displacement = balanced(ring, omega, 1)
    size = np.abs(displacement[1] - 1j * displacement[2])[0, :2]
    assert size == pytest.approx(amplitude, rel=1e-9)
    errors = []
    for finer in (1, 2):
        integrator = RingIntegrator.of(ring, omega, finer=finer)
        states, _ = integrator.history(integrator.march(integrator.on_wave(displacement), 40).final)
        height = np.array([np.hypot(*state.coordinates[0]) for state in states])
        drag = np.array([np.hypot(*state.force[0, 0, :2]) for state in states])
        assert drag == pytest.approx(limit, rel=1e-6)
        errors.append(np.abs(height / amplitude - 1.0).max())
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 3.5


def test_a_body_that_contacts_alone_hold_stays_on_the_wave():
    """A blade and its damper, whose rigid motions are softly held."""
    model, contact, excitation = sector("two_sliders")
    skew, root = np.random.default_rng(3).normal(size=(model.size, model.size)), np.sqrt(np.diag(model.mass))
    still = np.zeros(model.size)
    model = replace(model, coriolis=(skew - skew.T) * np.outer(root, root), force_centrifugal=still, speed_rpm=0.8)
    ring = Ring(modal_model(model, damping_ratio=0.02, coriolis=True), contact, excitation)
    displacement = balanced(ring, OMEGA, 11)
    integrator = RingIntegrator.of(ring, OMEGA, retention=200.0)
    start, wave = integrator.on_wave(displacement), integrator.wave_output(displacement)
    record = integrator.march(start, 20)
    assert record.output_m[-1] == pytest.approx(wave, abs=5e-3 * np.abs(wave).max())
    size = np.abs(start.coordinates[:, :2]).max()
    assert record.final.coordinates[:, :2] == pytest.approx(start.coordinates[:, :2], abs=1e-2 * size)


def test_small_motions_of_a_ring_in_a_flow_grow_as_their_poles():
    """Stuck contacts; frequencies and growth rates of forward and backward waves."""
    model, flow = turning(N), replace(FLOW, mode=1, coefficient=np.array([-0.03, -0.02j, 0.03]))
    modal = modal_model(model, damping_ratio=0.0, influence=[flow], coriolis=True)
    found = ring_in_flow(modal, RUBBING, SolverOptions((0.05, 0.5), harmonics=1), 40, disturbance=0.01)
    period = 2.0 * np.pi / found.omega
    springs = {"normal": RUBBING.normal_stiffness, "tangential": RUBBING.tangential_stiffness}
    for place, n in enumerate(found.nodal_diameter):
        values = aeroelastic_modes(model, modal, int(n), count=2, **springs)
        pole = values[np.argmin(np.abs(values))]
        rate = np.polyfit(found.periods * period, np.log(found.amplitude_m[:, place]), 1)[0]
        assert rate == pytest.approx(pole.real, rel=0.01, abs=2e-5)
        if n not in (0, 3):  # these are half of larger motions
            assert 2.0 * np.pi * found.frequency_hz[place] == pytest.approx(pole.imag, rel=1e-3)


@pytest.mark.long
def test_the_worst_motion_is_that_of_the_assembled_ring():
    """No solution of the curve is stable near its top; the ring as one structure, from rest, goes as high."""
    contact = replace(RUBBING, interference=np.zeros(2))
    model, options = turning(N, True, 0.05), SolverOptions((0.105, 0.115), harmonics=3, detached=False)
    curve = forced_response(
        modal_model(model, damping_ratio=0.01, coriolis=True), contact, Excitation(2, 1.0), options
    )
    assert curve.worst.motion in {"quasi-periodic", "irregular"}
    assert curve.worst.ring_blades == N
    whole, every = assembled(model, contact, 2)
    modal, omega = modal_model(whole, damping_ratio=0.01, coriolis=True), 2.0 * np.pi * curve.worst.frequency_hz
    limits, amplitudes = RingLimits(most_periods=500, window=100), []
    for name in whole.outputs:
        ring = Ring(modal, every, Excitation(1, 1.0), name)
        amplitudes.append(integrate_ring(ring, omega, None, limits=limits).amplitude_m)
    assert curve.worst.amplitude_m == pytest.approx(max(amplitudes), rel=0.05)
    assert curve.worst.amplitude_m > 1.2 * curve.amplitude_m.max()
