"""Bodies that contacts alone hold: a published wedge damper, closed forms, all blades in one structure, and time."""

import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from lumped import lumped_blade
from lumped_disk import sector_with_disk
from lumped_disk import whole_ring as ring_with_disk
from period_map import PeriodMap

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response
from nonlinear.contact.fourier import to_real
from nonlinear.harmonic_balance.initial_solution import periodic_start, static_displacement
from nonlinear.mistuned_ring.mistuning import Mistuning
from nonlinear.mistuned_ring.ring_receptance import ring_in_time
from nonlinear.mistuned_ring.ring_response import mistuned_response
from nonlinear.nonlinear_modes.extended_motion import linear_mode
from nonlinear.nonlinear_modes.resonance_motions import resonance_motions
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis
from nonlinear.stability.ring_stability import LinearisedContact, RingStability
from nonlinear.time_integration.ring import Ring
from nonlinear.time_integration.ring import whole_ring as ring_of_blades
from nonlinear.time_integration.ring_integrator import RingIntegrator
from rom import ContactInterface, ReducedModel, ReducedModelError, modal_model, natural_frequencies, with_interfaces
from rom.cyclic.natural_frequencies import coupled_frequencies
from rom.cyclic.receptance import RelativeReceptance
from rom.reduction.rigid_body import RigidBody, with_rigid_body

NOWHERE = np.zeros((1, 3))


def pair(stiffness, friction, nodes=2, tangential=1.0, law="two_sliders"):
    values = {"normal_stiffness": [stiffness] * nodes, "tangential_stiffness": [tangential * stiffness] * nodes}
    return ContactParameters.shared(nodes, **values, friction=friction, law=law)


@pytest.fixture(scope="module")
def modal():
    """The wedge damper of Balaji and Ferhatoglu (2025)."""
    stiffness, select = np.diag([1e5, 1e5, 1e5, 1e5, 0.0, 0.0]), np.eye(6)
    for first, k in ((0, 9e5), (2, 3e5), (4, 1e6)):
        stiffness[first : first + 2, first : first + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    force = -1j * np.array([0.0, -20.0, 5.0, 0.0, 0.0, 0.0])
    bare = ReducedModel(
        np.diag([10.0, 10.0, 10.0, 10.0, 0.1, 0.1]),
        stiffness,
        np.zeros((3, 6)),
        NOWHERE,
        force,
        {"tip": select[3]},
        force_static=240.0 * select[5],
    )
    c, s = np.cos(np.deg2rad(40.0)), np.sin(np.deg2rad(40.0))
    frames = ([[c, s], [-s, c]], [[c, -s], [s, c]])
    contacts = []
    for frame, (x, y) in zip(frames, ((0, 1), (2, 3)), strict=True):
        right, left = np.zeros((2, 3, 6))
        right[[0, 2]], left[[0, 2]] = frame @ select[[4, 5]], frame @ select[[x, y]]
        contacts.append(ContactInterface(right, NOWHERE, left, inside=True))
    model = with_interfaces(bare, *contacts)
    elastic = 2.0 * np.pi * natural_frequencies(model, 0.0)  # the rigid motion of the damper is left out
    return modal_model(model, damping_ratio=[1.0 / w if w < 1e3 else 0.0 for w in elastic])  # 2 zeta w = 20 / 10


def test_a_body_that_nothing_holds_has_a_rigid_motion_without_a_resonance(modal):
    contact, free = pair(3e5, 0.3), np.zeros(2)
    receptance = RelativeReceptance(modal, 0.0, (0, 1), 1.0)
    frequency, damping, _ = linear_mode(receptance, contact, free, 1)
    assert (frequency, damping) == (0.0, 0.0)
    balance = build_harmonic_balance(modal, contact, Excitation(0, 1.0), SolverOptions((10.0, 600.0)))
    apart = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]])
    assert all(omega > 0.0 for _, omega, _ in resonance_motions(balance, contact, apart, (1e-3, 600.0)))


def test_stuck_frequencies(modal):
    assert modal.floating == 1
    found = coupled_frequencies(modal, 0.0, normal=3e5, tangential=3e5) / (2.0 * np.pi)
    assert found == pytest.approx([15.87579, 31.83099, 49.42141, 74.07305, 390.82342, 811.64284], rel=1e-6)


# Balaji and Ferhatoglu (2025): the residual traction of the first contact decides on the peak
@pytest.mark.parametrize(("start", "peak", "at"), [(-1, 4.48698e-4, 49.418), (1, 3.371e-4, 49.424)])
def test_peaks_between_which_the_start_of_a_slider_decides(modal, start, peak, at):
    contact, excitation = pair(3e5, 0.9), Excitation(0, 1.0)
    options = SolverOptions((48.0, 51.0), harmonics=5, search="off", stability="folds", detached=False)
    for _ in range(60):  # the first slider starts at T = m mu N
        balance = build_harmonic_balance(modal, contact, excitation, options)
        still = static_displacement(balance.receptance, contact, options)
        origin = still[:, :2].copy()
        origin[0, 0] -= start * 0.9 * contact.normal_load(still[:, 2])[0] / 3e5
        contact = replace(contact, slider_origin=origin)
    curve = forced_response(modal, contact, excitation, options)
    first = np.abs(curve.harmonic_m[:, 0])
    assert first.max() == pytest.approx(peak, rel=2e-4)
    assert curve.frequency_hz[first.argmax()] == pytest.approx(at, abs=0.01)


@pytest.mark.parametrize("form", ["wedge", "cylinder"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("stiffness", [1e5, 1e9])
def test_normal_forces_of_a_damper_between_two_planes(form, friction, stiffness):
    """A pull W between planes at the angle b: both contacts slide outward, W = 2 N (cos b + mu sin b)."""
    angle, pull, along = np.deg2rad(35.0), 100.0, np.array([-0.01, 0.0, 0.01])
    one = np.ones(1)
    blade = ReducedModel(
        np.eye(1), 1e6 * np.eye(1), np.zeros((3, 1)), NOWHERE, one, {"tip": one}, force_static=np.zeros(1)
    )
    model = with_rigid_body(blade, RigidBody(0.01, np.zeros(3), np.full(3, 1e-7)))
    heights = [-0.002, 0.002] if form == "wedge" else [0.0]
    contacts = []
    for side in (1.0, -1.0):
        normal = np.array([0.0, side * np.sin(angle), np.cos(angle)])
        upward = np.array([0.0, -side * np.cos(angle), np.sin(angle)])
        frame = np.stack([[1.0, 0.0, 0.0], upward, normal])
        points = np.array([0.005 * normal + h * upward + [x, 0.0, 0.0] for h in heights for x in along])
        rows = np.zeros((3 * len(points), model.size))
        rows[:, 1:] = RigidBody(0.01, np.zeros(3), np.full(3, 1e-7)).rows(points, np.tile(frame, (len(points), 1, 1)))
        contacts.append(ContactInterface(rows, points))
    model = replace(with_interfaces(model, *contacts), force_static=pull * np.eye(model.size)[3])
    modal = modal_model(model, damping_ratio=0.01)
    assert modal.floating == 6
    nodes = model.n_contacts
    contact = pair(2.0 * stiffness / nodes, friction, nodes)
    options = SolverOptions((10.0, 20.0))
    balance = build_harmonic_balance(modal, contact, Excitation(0, 1.0), options)
    load = contact.normal_load(static_displacement(balance.receptance, contact, options)[:, 2])
    expected = pull / (2.0 * (np.cos(angle) + friction * np.sin(angle)))
    assert [load[: nodes // 2].sum(), load[nodes // 2 :].sum()] == pytest.approx([expected] * 2, rel=1e-5)


DEVIATIONS = {"friction": 0.1, "interference": 0.01}  # their sizes
N, OMEGA = 6, 1.79  # rad/s, below the resonance
SMALL = lumped_blade(N)


def sector(law, bare=SMALL, mass=0.05):
    """A blade with a damper of two coordinates between its right face and the left face of the next one.

    The damper's coordinates stand before those of the cut faces of a disk.
    """
    at = bare.size if bare.cyclic_right is None else bare.size - 6
    damper = np.zeros((3, bare.size + 2))
    damper[[1, 2], [at, at + 1]] = 1.0

    def wider(rows):
        return None if rows is None else np.insert(rows, [at, at], 0.0, axis=-1)

    def larger(matrix):
        return None if matrix is None else wider(wider(matrix).T).T

    rows = ("contact_right", "contact_left", "force_excitation", "cyclic_right", "cyclic_left")
    blade = replace(
        bare,
        mass=larger(bare.mass) + mass * damper.T @ damper,
        stiffness=larger(bare.stiffness),
        blade_stiffness=larger(bare.blade_stiffness),
        force_static=wider(np.zeros(bare.size) if bare is SMALL else bare.force_static) + damper[2],
        outputs={name: wider(row) for name, row in bare.outputs.items()},
        **{name: wider(getattr(bare, name)) for name in rows},
    )
    c, s = np.cos(np.deg2rad(40.0)), np.sin(np.deg2rad(40.0))
    own, next_one = (np.array([[1.0, 0.0, 0.0], [0.0, c, k * s], [0.0, -k * s, c]]) for k in (1.0, -1.0))
    right = ContactInterface(own @ damper, NOWHERE, own @ wider(bare.contact_right[:3]), inside=True)
    left = ContactInterface(next_one @ damper, NOWHERE, next_one @ wider(bare.contact_left[:3]))
    return with_interfaces(blade, right, left), pair(5.0, 0.3, tangential=0.7, law=law), Excitation(1, 0.2)


@pytest.mark.parametrize("wave", [0, 1, 3])
@pytest.mark.parametrize("mass", [1e-9, 1e9])
def test_a_stuck_damper_of_no_mass_is_a_spring_and_of_large_mass_the_ground(wave, mass):
    """Half the stiffness from face to face along its two coordinates, the whole one to the ground along the third."""
    stuck, phase = 4.0, 2.0 * np.pi * wave / N
    found = natural_frequencies(sector("two_sliders", mass=mass)[0], phase, normal=stuck, tangential=stuck)
    right, left = SMALL.contact_right[:3], SMALL.contact_left[:3]
    across = right - np.exp(1j * phase) * left
    apart = np.diag([1.0, 0.0, 0.0] if mass < 1.0 else [1.0, 1.0, 1.0])
    added = stuck * (right.T @ apart @ right + left.T @ apart @ left)
    added = added + stuck / 2.0 * across.conj().T @ (np.eye(3) - apart) @ across
    squared = scipy.linalg.eigh(SMALL.stiffness + added, SMALL.mass, eigvals_only=True)
    expected = np.sqrt(squared) / (2.0 * np.pi)
    elastic = found[(found > 1e-3) & (found < 1e3)]
    assert elastic == pytest.approx(expected[: elastic.size], rel=1e-6)
    assert elastic.size >= 10


def whole_ring(model, contact):
    """All blades and dampers as one structure: each pair of nodes is one against the ground."""
    n = model.n_blades
    every, wave = np.eye(n), np.exp(2j * np.pi * np.arange(n) / n)
    rows = [
        np.kron(every[j], model.contact_right) - np.kron(every[(j + 1) % n], model.contact_left) for j in range(n)
    ]
    ring = ReducedModel(
        np.kron(every, model.mass),
        np.kron(every, model.stiffness),
        np.concatenate(rows),
        np.zeros((2 * n, 3)),
        np.kron(wave, model.force_excitation),
        {"tip": np.kron(every[0], model.outputs["tip"])},
        force_static=np.tile(model.force_static, n),
    )
    return ring, ContactParameters.joined(*[contact] * n)


def solved(model, contact, excitation, harmonics, coriolis=False):
    modal = modal_model(model, damping_ratio=0.02, coriolis=coriolis)
    options = SolverOptions((0.1, 0.4), harmonics=harmonics)
    balance = build_harmonic_balance(modal, contact, excitation, options)
    start = periodic_start(
        balance, OMEGA, static_displacement(balance.receptance, contact, options), options, contact
    )
    assert start.converged
    return balance, balance.displacement(start.solution)


@pytest.mark.parametrize(("law", "harmonics"), [("two_sliders", 3), ("cone", 1)])
def test_the_wave_is_that_of_all_blades_and_dampers(law, harmonics):
    model, contact, _ = sector(law, lumped_blade(3))
    excitation = Excitation(1, 0.6)
    balance, own = solved(model, contact, excitation, harmonics)
    ring, every = whole_ring(model, contact)
    whole, found = solved(ring, every, excitation, harmonics)
    assert balance.forces_of(own).state.max() == 1  # slip
    assert (balance.receptance.floating, whole.receptance.floating) == (2, 2 * 3)
    assert found[:, :2] == pytest.approx(own, abs=1e-9)


def test_coriolis_forces_act_on_a_blade_and_its_damper():
    """The relative motion of harmonic 1 under its contact forces, from the matrices of the blade and its damper."""
    model, contact, excitation = sector("two_sliders")
    skew = np.random.default_rng(3).normal(size=(model.size, model.size))
    root, speed = np.sqrt(np.diag(model.mass)), 0.08
    model = replace(model, coriolis=(skew - skew.T) * np.outer(root, root), force_centrifugal=np.zeros(model.size))
    model = replace(model, speed_rpm=30.0 / np.pi * speed)
    balance, own = solved(model, contact, excitation, 3, coriolis=True)
    modal, phase = balance.receptance.modal, balance.receptance.phase
    inertia = model.mass @ modal.shapes
    damping = inertia @ np.diag(modal.damping) @ inertia.T + speed * model.coriolis
    dynamic = model.stiffness + 1j * OMEGA * damping - OMEGA**2 * model.mass
    relative = model.contact_right - np.exp(1j * phase) * model.contact_left
    force = balance.forces_of(own).force.reshape(7, -1)
    force = relative.conj().T @ (force[1] + 1j * force[2]) + excitation.force * model.force_excitation
    found = own.reshape(7, -1)
    expected = relative @ np.linalg.solve(dynamic, force)
    assert found[1] + 1j * found[2] == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


def test_the_ring_in_time_stays_on_the_wave_and_its_damper_where_it_is():
    model, contact, excitation = sector("two_sliders")
    balance, motion = solved(model, contact, excitation, 11)
    ring = Ring(modal_model(model, damping_ratio=0.02), contact, excitation)
    integrator = RingIntegrator.of(ring, OMEGA, retention=200.0)
    start, balanced = integrator.on_wave(motion), integrator.wave_output(motion)
    record = integrator.march(start, 20)
    assert record.output_m[-1] == pytest.approx(balanced, abs=5e-3 * np.abs(balanced).max())
    size = np.abs(start.coordinates[:, :2]).max()
    assert record.final.coordinates[:, :2] == pytest.approx(start.coordinates[:, :2], abs=1e-2 * size)
    jacobian = balance.element.evaluate(motion).jacobian
    exponents = FloquetAnalysis.of(balance.receptance, contact).exponents(motion, jacobian, OMEGA)
    assert exponents.real.max() < 1e-6 * OMEGA  # it does not leave the wave


def test_a_body_that_no_contact_spring_holds_is_refused():
    model, contact, excitation = sector("two_sliders")
    loose = replace(contact, normal_stiffness=np.zeros(2), tangential_stiffness=np.zeros(2))
    with pytest.raises(ValueError, match="contacts alone hold a body"):
        build_harmonic_balance(modal_model(model, damping_ratio=0.02), loose, excitation, SolverOptions((0.1, 0.4)))


@pytest.mark.parametrize("joined", [False, True])
def test_a_mistuned_ring_with_dampers_is_that_of_all_of_them_in_one_structure(joined):
    """Contacts, and clamped blades too, that differ: the motions of the ring solve the balance of one structure."""
    model, contact, excitation = sector("two_sliders", sector_with_disk(N) if joined else SMALL)
    modal = modal_model(model, damping_ratio=0.02)
    deviations = {name: size * np.random.default_rng(3).normal(size=N) for name, size in DEVIATIONS.items()}
    mistuning = Mistuning.of(N, frequency=0.0 if joined else deviations["friction"] / 10.0, **deviations)
    options = SolverOptions((0.22, 0.3), harmonics=1, search="off")
    response = mistuned_response(modal, contact, excitation, options, mistuning)
    assert response.complete
    if joined:
        whole, order = modal_model(ring_with_disk(model, N, 1), damping_ratio=0.02), 0
    else:
        whole, order = ring_of_blades(modal, excitation, 1.0 + mistuning.frequency), 1
    assert whole.floating == 2 * N
    balance = build_harmonic_balance(whole, mistuning.contact(contact), Excitation(order, excitation.force), options)
    turns = np.exp(1j * modal.phase(1) * np.multiply.outer(np.arange(2), np.arange(N)))
    for frequency, motion in list(zip(response.frequency_hz, response.relative_displacement, strict=True))[::5]:
        unknown = to_real((motion.reshape(2, N, -1) * turns[..., None]).reshape(2, -1)).ravel()
        residual = balance.evaluate(unknown, 2.0 * np.pi * frequency).residual
        assert balance.relative_error(residual, unknown) < 1e-6


def test_dampers_of_different_blades_stay_where_they_are_in_time():
    model, contact, excitation = sector("two_sliders")
    modal = modal_model(model, damping_ratio=0.02)
    mistuning = Mistuning.of(N, friction=0.1 * np.random.default_rng(3).normal(size=N))
    options = SolverOptions((0.25, 0.2502), harmonics=5, search="off")
    response = mistuned_response(modal, contact, excitation, options, mistuning)
    motion = to_real(response.relative_displacement[0].reshape(6, -1)).reshape(11, -1, 3)
    ring = ring_in_time(modal, contact, excitation, mistuning)
    integrator = RingIntegrator.of(ring, 2.0 * np.pi * response.frequency_hz[0], retention=200.0)
    start = integrator.on_wave(motion)
    final = integrator.march(start, 3).final
    size = np.abs(start.coordinates[:, :2]).max()
    assert final.coordinates[:, :2] == pytest.approx(start.coordinates[:, :2], abs=1e-2 * size)


def test_growth_by_the_fast_vibration_of_dampers_on_their_contacts():
    """Seven times the excitation frequency: the least stable exponent of all waves against the ring in time."""
    model, contact, excitation = sector("two_sliders")
    balance, motion = solved(model, contact, excitation, 11)
    analysis = FloquetAnalysis.of(balance.receptance, contact)
    point = LinearisedContact(motion, balance.element.evaluate(motion).jacobian, OMEGA)
    leading = RingStability(analysis, N).leading(point)
    own = FloquetAnalysis.of(balance.receptance, contact, kappa=2.0 * np.pi * leading.nodal_diameter / N)
    assert np.abs(own.exponents(motion, point.jacobian, OMEGA) - leading.exponent).min() < 1e-3 * OMEGA
    ring = Ring(modal_model(model, damping_ratio=0.02), contact, excitation)
    integrator = RingIntegrator.of(ring, OMEGA, nodal_diameter=1, retention=200.0, finer=2.0)
    period = PeriodMap(integrator, integrator.on_wave(motion))
    marched = period.exponents(period.fixed_point(period.start)[1])
    assert leading.exponent.real > 0.01 * OMEGA
    assert np.abs(marched - leading.exponent).min() < 5e-3 * OMEGA
    assert leading.exponent.real == pytest.approx(marched[0].real, abs=2e-3 * OMEGA)


def test_a_body_without_stiffness_is_held_by_its_contact_alone():
    """A mass on an elastic slider: the describing function of a Jenkins element (Caughey) in each point."""
    rows = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    model = ReducedModel.from_matrices(np.eye(2), np.zeros((2, 2)), rows, [1.0, 0.0], contact_position=NOWHERE)
    kt, limit, damping, force = 3.0, 0.5, 0.05, 0.1
    contact = ContactParameters.shared(1, normal_stiffness=4.0, tangential_stiffness=kt, friction=0.5, preload=1.0)
    body = modal_model(model, rayleigh=[damping, 0.0])
    curve = forced_response(body, contact, Excitation(0, force), SolverOptions((0.1, 0.5)))
    size, omega = curve.amplitude_m, 2.0 * np.pi * curve.frequency_hz
    angle = np.arccos(1.0 - 2.0 * np.minimum(limit / kt / size, 1.0))
    spring = kt / np.pi * (angle - 0.5 * np.sin(2.0 * angle))
    lost = np.maximum(4.0 * limit * (size - limit / kt), 0.0) / (np.pi * size**2)
    assert size.max() > 1.1 * limit / kt
    assert abs(spring - omega**2 + 1j * (damping * omega + lost)) * size == pytest.approx(force, rel=1e-6)


def test_massless_coordinates_are_told_the_mass_that_they_need():
    stiffness = np.array([[2.0, -1.0], [-1.0, 1.0]])
    rows = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 0.0]])
    given = {"load": [1.0, 0.0], "contact_position": NOWHERE}
    model = ReducedModel.from_matrices(np.diag([1.0, 0.0]), stiffness, rows, **given)
    with pytest.raises(ReducedModelError, match="1 coordinates have no mass: give them one of ") as raised:
        modal_model(model, damping_ratio=0.01)
    with pytest.raises(ReducedModelError, match=re.escape(str(raised.value))):
        natural_frequencies(model, 0.0)
    small = float(str(raised.value).partition("one of ")[2].partition(",")[0])
    held = ReducedModel.from_matrices(np.diag([1.0, small]), stiffness, rows, **given)
    assert natural_frequencies(held, 0.0)[0] == pytest.approx(1.0 / (2.0 * np.pi), rel=1e-6)  # k = 2 - 1


@pytest.mark.long
def test_bounds_over_residual_tractions_are_those_of_both_laws_in_one_direction(modal):
    """The damper moves along one tangential direction only: there a cone is a slider, and its body moves with it."""
    options = SolverOptions(
        (49.1, 49.9), residual_tractions="bounds", search="off", detached=False, truncation=False, stability="folds"
    )
    bounds = [
        forced_response(modal, pair(3e5, 0.9, law=law), Excitation(0, 1.0), options).residual_bounds
        for law in ("two_sliders", "cone")
    ]
    for name in ("lowest", "highest"):
        heights = [getattr(bound, name).amplitude_m for bound in bounds]
        assert heights[1] == pytest.approx(heights[0], rel=1e-4)
    for name in ("least_vibration", "most_vibration"):
        vibrations = [getattr(bound, name).vibration_m for bound in bounds]
        assert vibrations[1] == pytest.approx(vibrations[0], rel=1e-4)
