"""Forced response of a bladed disk: one sector and its waves against the whole ring without cyclic symmetry."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from nonlinear import ContactParameters, Excitation, SolverOptions, forced_response, nonlinear_mode
from nonlinear.contact.fourier import to_real
from nonlinear.peak_curves.peak_sensitivity import peak_sensitivity
from nonlinear.response_solver import build_harmonic_balance
from nonlinear.stability.floquet import FloquetAnalysis
from rom import (
    ReducedModel,
    ReducedModelError,
    WaveSuperelement,
    linear_response,
    modal_model,
    model_of_waves,
    natural_frequencies,
    read_reduced_model,
    write_reduced_model,
)

SECTORS, ENGINE_ORDER = 6, 2
PHASE = 2.0 * np.pi * ENGINE_ORDER / SECTORS


def spring(rng, stiffness):
    """A definite stiffness (3, 3) of no symmetry: waves towards +y and -y differ."""
    vectors = rng.normal(size=(3, 3))
    return stiffness * (vectors @ vectors.T + np.eye(3))


@cache
def sector(grounded=True):
    """Two rim masses, left and right, and a blade mass between them with two contact nodes; dofs in this order."""
    rng = np.random.default_rng(1)
    blade = np.hstack([-0.5 * np.eye(3), -0.5 * np.eye(3), np.eye(3)])
    disk = np.hstack([np.eye(3), -np.eye(3), np.zeros((3, 3))])
    stiffness = disk.T @ spring(rng, 3e5) @ disk
    ground = spring(rng, 1e5) / 2.0
    stiffness += blade.T @ spring(rng, 1e5) @ blade
    if grounded:
        stiffness += np.kron(np.diag([1.0, 1.0, 0.0]), ground)
    right, left = np.zeros((2, 6, 9))
    right[:3, 6:], left[:3, 6:] = np.eye(3), np.eye(3) + 0.1 * rng.normal(size=(3, 3))
    right[3:, 6:], left[3:, 6:] = (np.eye(3) + 0.2 * rng.normal(size=(3, 3)) for _ in range(2))
    if not grounded:
        left = right.copy()
    force, tip = np.eye(9)[6], np.eye(9)[7] + 0.5 * np.eye(9)[6]
    rows = {"cyclic_right": np.eye(9)[3:6], "cyclic_left": np.eye(9)[:3]}
    mass, place = np.diag([1.0] * 6 + [0.5] * 3), np.zeros((2, 3))
    return ReducedModel(mass, stiffness, right, place, force, {"tip": tip}, left, n_blades=SECTORS, **rows)


def ring(model):
    """The same ring in one piece, a structure of 36 dofs that touches itself at 12 nodes."""
    places = np.zeros((SECTORS, 9, 6 * SECTORS))
    for j in range(SECTORS):
        following = 6 * ((j + 1) % SECTORS)
        places[j, :3, 6 * j : 6 * j + 3] = places[j, 3:6, following : following + 3] = np.eye(3)
        places[j, 6:, 6 * j + 3 : 6 * j + 6] = np.eye(3)
    mass, stiffness = (sum(p.T @ matrix @ p for p in places) for matrix in (model.mass, model.stiffness))
    right = np.vstack([model.contact_right @ p for p in places])
    left = np.vstack([model.contact_left @ p for p in np.roll(places, -1, axis=0)])
    force = sum(p.T @ model.force_excitation * np.exp(1j * PHASE * j) for j, p in enumerate(places))
    tip = {"tip": model.outputs["tip"] @ places[0]}
    return ReducedModel(mass, stiffness, right, np.zeros((2 * SECTORS, 3)), force, tip, left)


def contact(nodes, law="two_sliders"):
    values = {"normal_stiffness": 2e5 * nodes, "tangential_stiffness": 1.5e5 * nodes, "friction": 0.3}
    return ContactParameters.shared(nodes, interference=-0.5e-3, law=law, **values)


def options(harmonics, stability="ring"):
    return SolverOptions(
        (60.0, 110.0),
        harmonics=harmonics,
        stability=stability,
        detached=False,
        truncation=False,
        search="off",
    )


def test_linear_response_of_a_wave_is_that_of_the_ring():
    """Also of waves with more than N_b / 2 nodal diameters, which run backwards."""
    model, frequency = sector(), np.linspace(40.0, 140.0, 11)
    springs = {"normal": 1e5, "tangential": 5e4, "force": 1.0}
    whole = linear_response(modal_model(ring(model), damping_ratio=0.01), frequency, phase=0.0, **springs)
    modes = modal_model(model, damping_ratio=0.01)
    for engine_order in (ENGINE_ORDER, ENGINE_ORDER + SECTORS):
        found = linear_response(modes, frequency, phase=modes.phase(engine_order), **springs)
        np.testing.assert_allclose(found, whole, rtol=1e-11)
    backward = linear_response(modes, frequency, phase=modes.phase(SECTORS - ENGINE_ORDER), **springs)
    assert np.abs(backward / whole - 1.0).max() > 0.1  # a slanted blade


@pytest.mark.parametrize(("harmonics", "law"), [(1, "two_sliders"), pytest.param(2, "cone", marks=pytest.mark.long)])
def test_solutions_and_their_stability_are_those_of_the_ring(harmonics, law):
    """Every solution with friction and lift-off solves the whole ring; it is stable where that of the ring is."""
    model = sector()
    modes, whole = modal_model(model, damping_ratio=0.01), modal_model(ring(model), damping_ratio=0.01)
    curve = forced_response(modes, contact(2, law), Excitation(ENGINE_ORDER, 40.0), options(harmonics))
    assert curve.termination.kind == "complete"
    assert curve.separating.max() == 2
    assert 0 < np.count_nonzero(~curve.stable) < curve.points / 2
    every = contact(2 * SECTORS, law)
    balance = build_harmonic_balance(whole, every, Excitation(0, 40.0), options(harmonics))
    analysis = FloquetAnalysis.of(balance.receptance, every)
    turns = np.exp(1j * np.outer(np.arange(harmonics + 1), PHASE * np.arange(SECTORS)))
    for place in range(0, curve.points, 4 if harmonics == 1 else 12):
        motion = curve.relative_displacement[place]
        on_ring = (turns[:, :, None, None] * motion[:, None]).reshape(harmonics + 1, -1)
        displacement = to_real(on_ring).reshape(2 * harmonics + 1, -1, 3)
        omega = 2.0 * np.pi * curve.frequency_hz[place]
        solved = balance.evaluate(balance.unknown(displacement), omega)
        assert np.abs(solved.residual).max() < 1e-11 * np.abs(displacement).max()
        leading = analysis.exponents(displacement, solved.contact.jacobian, omega)[0].real
        assert bool(leading <= 1e-6 * omega) == curve.stable[place]
        if abs(leading) > 1e-3 * omega and curve.growth_rate[place] > 0.0:
            assert curve.growth_rate[place] == pytest.approx(leading, rel=0.1)


def test_derivatives_of_a_peak_by_friction_and_damping_are_differences():
    modes, wave = modal_model(sector(), damping_ratio=0.01), Excitation(ENGINE_ORDER, 40.0)

    def solved(friction=0.3, damping=1.0):
        parameters = replace(contact(2), friction=np.full(2, friction))
        problem = modes.with_damping_times(damping), parameters, wave, options(1, "wave")
        return problem, forced_response(*problem)

    problem, curve = solved()
    found = peak_sensitivity(problem, curve, curve.peak.index, ["friction", "damping"])
    assert found is not None
    for name, by in (("friction", {"friction": 0.3}), ("damping", {"damping": 1.0})):
        heights = [solved(**{name: by[name] * (1.0 + step)})[1].peak.amplitude_m for step in (-1e-4, 1e-4)]
        rate = (heights[1] - heights[0]) / (2e-4 * by[name])
        assert found.amplitude[name] == pytest.approx(rate, rel=1e-4)


def test_a_free_disk_moves_but_has_no_static_response():
    """Rigid motions have w = 0; a dynamic force moves the disk, a static one along them is refused."""
    model = sector(grounded=False)
    modes = modal_model(model, damping_ratio=0.01)
    still = modes.at(0)
    assert np.count_nonzero(still.angular_frequency == 0.0) == 3
    np.testing.assert_allclose(still.angular_frequency[3:] / (2 * np.pi), natural_frequencies(model, 0.0)[3:])
    wave = Excitation(SECTORS, 40.0)  # nodal diameter 0
    curve = forced_response(modes, contact(2), wave, options(1, "wave"))
    assert curve.termination.kind == "complete"
    slow, mass = linear_response(modes, [1.0], phase=0.0, force=1.0), 2.5  # kg of a sector; the tip sees half of x
    assert abs(slow[0]) == pytest.approx(0.5 / (mass * (2.0 * np.pi) ** 2), rel=1e-3)
    pushed = ReducedModel(**{**vars(model), "force_static": np.ones(9)})
    with pytest.raises(ReducedModelError, match="force/static: pushes the disk"):
        modal_model(pushed, damping_ratio=0.01)


def test_points_without_a_pole_near_the_axis_have_no_exponents_of_a_wave():
    """Lightly damped, far below the natural frequencies of a nodal diameter: no pole of it is retained."""
    springs = {"normal_stiffness": 1e5, "tangential_stiffness": 5e4, "friction": 0.4, "interference": 1e-4}
    modes, every = modal_model(sector(), damping_ratio=0.003), ContactParameters.shared(2, **springs)
    wide = replace(options(1), frequency_hz=(20.0, 90.0))
    curve = forced_response(modes, every, Excitation(1, 20.0), wide)
    assert curve.termination.kind == "complete"
    assert curve.stable.all()


def test_a_nonlinear_mode_begins_at_the_linear_mode_of_its_wave():
    model = sector()
    modes = modal_model(model, damping_ratio=0.01)
    mode = nonlinear_mode(modes, contact(2), ENGINE_ORDER, (1e-6, 1e-3), options(3), number=1)
    assert mode.frequency_hz[0] == pytest.approx(natural_frequencies(model, PHASE)[0], rel=1e-9)


def superelements(model):
    """The waves of a sector as other programs give them, each in complex coordinates of its own."""
    found, rng = {}, np.random.default_rng(3)
    for n in range(SECTORS // 2 + 1):
        wave = model.wave(2.0 * np.pi * n / SECTORS)
        real = 2 * n % SECTORS == 0
        mixed = rng.normal(size=(2, wave.shape[1], wave.shape[1]))
        own = wave.real @ mixed[0] if real else wave @ (mixed[0] + 1j * mixed[1])
        adjoint = own.conj().T
        found[n] = WaveSuperelement(
            adjoint @ model.mass @ own,
            adjoint @ model.stiffness @ own,
            model.contact_right @ own,
            model.contact_left @ own,
            adjoint @ model.force_excitation,
            {"tip": model.outputs["tip"] @ own},
        )
    return found


def test_one_superelement_for_each_nodal_diameter_is_the_sector(tmp_path):
    """Also from a file; what is missing is said."""
    model, waves = sector(), superelements(sector())
    write_reduced_model(tmp_path / "rom.h5", model_of_waves(waves, SECTORS, np.zeros((2, 3))))
    read = read_reduced_model(tmp_path / "rom.h5")
    problem = contact(2), Excitation(ENGINE_ORDER, 40.0), options(1)
    of_sector, of_waves = (forced_response(modal_model(m, damping_ratio=0.01), *problem) for m in (model, read))
    np.testing.assert_allclose(of_waves.amplitude_m, of_sector.amplitude_m, rtol=1e-9)
    clear = ~(np.abs(of_sector.growth_rate) < 1e-7)  # at a point on the limit of stability round-off decides
    np.testing.assert_array_equal(of_waves.stable[clear], of_sector.stable[clear])
    fewer = model_of_waves({n: waves[n] for n in (0, 2)}, SECTORS, np.zeros((2, 3)))
    np.testing.assert_allclose(natural_frequencies(fewer, -PHASE), natural_frequencies(model, PHASE), rtol=1e-10)
    with pytest.raises(ReducedModelError, match=r"nodal_diameter/1: missing, and needed here; the model holds 0, 2"):
        forced_response(modal_model(fewer, damping_ratio=0.01), *problem)
    wrong = {
        "nodal_diameter/0: missing": {2: waves[2]},
        "nodal_diameter/4: allowed: 0 to 3 with 6 blades": {**waves, 4: waves[2]},
        "nodal_diameter/3/mass: complex": {**waves, 3: waves[2]},
        "nodal_diameter/1/stiffness: not Hermitian": {
            **waves,
            1: replace(waves[1], stiffness=1j * waves[1].stiffness),
        },
        "nodal_diameter/1/contact/right: shape": {**waves, 1: replace(waves[1], contact_right=np.ones((6, 2)))},
    }
    for message, given in wrong.items():
        with pytest.raises(ReducedModelError, match=message):
            model_of_waves(given, SECTORS, np.zeros((2, 3)))
