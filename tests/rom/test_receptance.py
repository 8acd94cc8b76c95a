"""Modal model and receptance of the reduced system against direct solutions with the dynamic stiffness."""

from dataclasses import replace

import numpy as np
import pytest

from rom import ReducedModel, ReducedModelError, linear_response, modal_model
from rom.cyclic.receptance import RelativeReceptance


def random_model(seed=0, size=10, n_contacts=2, ground=False, complex_force=False):
    """Symmetric positive definite matrices without any structure."""
    rng = np.random.default_rng(seed)
    root, mass_root = rng.normal(size=(2, size, size))
    force = rng.normal(size=size) + (1j * rng.normal(size=size) if complex_force else 0.0)
    return ReducedModel(
        mass=mass_root @ mass_root.T + size * np.eye(size),
        stiffness=root @ root.T + size * np.eye(size),
        contact_right=rng.normal(size=(3 * n_contacts, size)),
        contact_left=None if ground else rng.normal(size=(3 * n_contacts, size)),
        contact_position=rng.normal(size=(n_contacts, 3)),
        force_excitation=force,
        outputs={"tip": rng.normal(size=size), "root": rng.normal(size=size)},
        force_centrifugal=rng.normal(size=size),
        force_static=rng.normal(size=size),
        n_blades=None if ground else 9,
        contact_frame=np.linalg.qr(rng.normal(size=(n_contacts, 3, 3)))[0],
    )


def dynamic_stiffness(model, omega, a, b):
    """K + i w (a M + b K) - w^2 M."""
    return model.stiffness * (1 + 1j * omega * b) + model.mass * (1j * omega * a - omega**2)


@pytest.mark.parametrize("ground", [False, True])
def test_receptance_is_the_inverse_dynamic_stiffness(ground):
    model = random_model(ground=ground, complex_force=True)
    modal = modal_model(model, rayleigh=(0.03, 0.02), speed_rpm=120.0)
    psi, omega, force = 0.7, 0.9, 2.5
    receptance = RelativeReceptance(modal, psi, (0, 1, 2, 3), force)
    matrix = receptance.matrix(omega)
    linear, _ = receptance.response(omega, np.zeros((4, 6), dtype=complex))
    contact_force = np.random.default_rng(1).normal(size=(4, 6)) + 0.0j
    coordinates, _ = receptance.modal_response(omega, contact_force)
    response, _ = receptance.response(omega, contact_force)
    rows = receptance.output_rows("root", omega)
    for h in range(4):
        relative = model.contact_right.astype(complex)
        if not ground:
            relative = relative - model.contact_left * np.exp(1j * h * psi)
        flexibility = np.linalg.inv(dynamic_stiffness(model, h * omega, 0.03, 0.02))
        external = np.zeros(model.size, dtype=complex)
        if h == 0:
            external += model.force_static + model.force_centrifugal * (2 * np.pi * 120.0 / 60.0) ** 2
        if h == 1:
            external += force * model.force_excitation
        assert matrix[h] == pytest.approx(relative @ flexibility @ relative.conj().T, rel=1e-9, abs=1e-12)
        assert linear[h] == pytest.approx(relative @ flexibility @ external, rel=1e-9, abs=1e-12)
        motion = flexibility @ (external + relative.conj().T @ contact_force[h])
        assert modal.shapes @ coordinates[h] == pytest.approx(motion, rel=1e-9, abs=1e-12)
        assert response[h] == pytest.approx(relative @ motion, rel=1e-9, abs=1e-12)
        assert rows[h] == pytest.approx(model.outputs["root"] @ flexibility @ relative.conj().T, rel=1e-9, abs=1e-12)


def test_derivatives_in_the_frequency():
    modal = modal_model(random_model(3), damping_ratio=0.02)
    receptance = RelativeReceptance(modal, 1.1, (0, 1, 5), 1.0)
    omega, step = 0.8, 1e-6
    force = np.ones((3, 6), dtype=complex)
    for evaluate in (receptance.response, receptance.modal_response):
        _, slope = evaluate(omega, force)
        difference = evaluate(omega + step, force)[0] - evaluate(omega - step, force)[0]
        assert slope == pytest.approx(difference / (2 * step), rel=1e-7, abs=1e-8)


def test_modes_are_mass_normalised_and_damping_is_as_asked():
    model = random_model(4)
    modal = modal_model(model, damping_ratio=[0.01, 0.03])
    assert modal.shapes.T @ model.mass @ modal.shapes == pytest.approx(np.eye(model.size), abs=1e-10)
    squared = modal.shapes.T @ model.stiffness @ modal.shapes
    assert squared == pytest.approx(np.diag(modal.angular_frequency**2), abs=1e-9)
    ratios = modal.damping / (2 * modal.angular_frequency)
    assert ratios == pytest.approx([0.01] + [0.03] * (model.size - 1))  # the last one holds for the modes above
    rayleigh = modal_model(model, rayleigh=(0.5, 0.25))
    assert rayleigh.damping == pytest.approx(0.5 + 0.25 * rayleigh.angular_frequency**2)


def test_a_model_stiffened_for_one_speed_has_the_centrifugal_force_of_that_speed_only():
    model = random_model(5)
    stiffened = replace(model, speed_rpm=120.0)
    asked = modal_model(stiffened, damping_ratio=0.01, speed_rpm=120.0)
    assert asked.static_force == pytest.approx(modal_model(model, damping_ratio=0.01, speed_rpm=120.0).static_force)
    assert asked.static_force == pytest.approx(modal_model(stiffened, damping_ratio=0.01).static_force)
    for speed in (0.0, 119.0):
        with pytest.raises(ReducedModelError, match=f"load.speed_rpm = {speed:g}: .* for 120 rev/min") as refused:
            modal_model(stiffened, damping_ratio=0.01, speed_rpm=speed)
        assert "\n" not in str(refused.value)
    with pytest.raises(ReducedModelError, match="for 0 rev/min"):
        modal_model(replace(model, speed_rpm=0.0), damping_ratio=0.01, speed_rpm=120.0)
    with pytest.raises(ReducedModelError, match="speed_rpm: nan, allowed: a finite number"):
        replace(model, speed_rpm=float("nan"))


def test_phase_is_aliased():
    modal = modal_model(random_model(), damping_ratio=0.0)
    assert modal.phase(2) == pytest.approx(4 * np.pi / 9)
    assert modal.phase(11) == modal.phase(2) == modal.phase(-7)
    assert modal_model(random_model(ground=True), damping_ratio=0.0).phase(5) == 0.0


def test_linear_springs_against_a_direct_solution():
    model = random_model(6)
    modal = modal_model(model, rayleigh=(0.02, 0.01))
    psi = 0.9
    relative = model.contact_right - model.contact_left * np.exp(1j * psi)
    springs = np.tile([3.0, 3.0, 7.0], 2)
    for hertz in (0.05, 0.1, 0.3):
        omega = 2 * np.pi * hertz
        system = dynamic_stiffness(model, omega, 0.02, 0.01) + relative.conj().T @ (springs[:, None] * relative)
        expected = model.outputs["tip"] @ np.linalg.solve(system, 4.0 * model.force_excitation)
        found = linear_response(modal, [hertz], phase=psi, force=4.0, normal=7.0, tangential=np.array([3.0, 3.0]))
        assert found[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "either"),
        ({"damping_ratio": 0.1, "rayleigh": (0.0, 0.0)}, "either"),
        ({"damping_ratio": -0.1}, "0 or more"),
        ({"damping_ratio": float("nan")}, "finite"),
        ({"damping_ratio": [0.1] * 11}, "at most one for each of the 10 modes"),
        ({"rayleigh": (-5.0, 0.0)}, "0 or more"),
    ],
)
def test_bad_damping_is_refused(keys, words):
    with pytest.raises(ReducedModelError, match=words):
        modal_model(random_model(), **keys)


def test_rigid_body_modes_are_refused():
    model = random_model()
    floating = model.stiffness - np.linalg.eigvalsh(model.stiffness)[0] * np.eye(model.size)
    arguments = {name: getattr(model, name) for name in ("mass", "contact_right", "contact_position")}
    broken = ReducedModel(
        stiffness=floating, force_excitation=model.force_excitation, outputs=model.outputs, **arguments
    )
    assert modal_model(broken, damping_ratio=0.01).floating == 1  # contacts hold it
    rigid = np.linalg.eigh(model.stiffness)[1][:, :1]
    unfelt = broken.contact_right @ (np.eye(model.size) - rigid @ rigid.T)
    with pytest.raises(ReducedModelError, match="floats freely"):
        modal_model(replace(broken, contact_right=unfelt), damping_ratio=0.01)


def test_speed_without_a_centrifugal_force_is_refused():
    model = random_model()
    arguments = {name: getattr(model, name) for name in ("mass", "stiffness", "contact_right", "contact_position")}
    bare = ReducedModel(force_excitation=model.force_excitation, outputs=model.outputs, **arguments)
    with pytest.raises(ReducedModelError, match="force/centrifugal: missing"):
        modal_model(bare, damping_ratio=0.01, speed_rpm=100.0)
