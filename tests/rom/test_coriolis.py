"""Coriolis forces in the reduced model and the change of its natural frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from rom_meshes import box_sector, patch_block, turned_back
from scipy.linalg import eigvals

from rom import (
    BoundaryChoice,
    Material,
    ReducedModel,
    ReducedModelError,
    ReductionOptions,
    assemble,
    inter_blade_phase,
    natural_frequencies,
    reduce_sector,
)
from rom.cyclic.contact_springs import contact_springs
from rom.cyclic.cyclic_symmetry import relative_contact_motion
from rom.cyclic.natural_frequencies import gyroscopic_frequencies
from rom.finite_elements.rotation import stiffen_by_rotation
from rom.reduction.model_comparison import LinearOperation, coriolis_error

STEEL = Material(2.1e11, 0.3, 7800.0)
RPM = 30.0 / np.pi
POINT_MASS = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.0, -2.0, 0.0]])  # 1 kg at 1 rad/s


def reduced(sector, speed_rpm, contact_dofs="nodal"):
    """The full and the reduced model at speed; the loaded node is not the tip."""
    full = assemble(sector, STEEL)
    at_speed = stiffen_by_rotation(full, sector, STEEL, speed_rpm)
    boundary = BoundaryChoice((0.0, 1.0, 0.0), sector.points.max(axis=0), contact_dofs)
    return full, reduce_sector(at_speed, sector, ReductionOptions(modes=6), boundary).model


@pytest.mark.parametrize("contact_dofs", ["nodal", "patch"])
def test_reduced_matrix_is_the_projection_of_the_coriolis_forces(contact_dofs):
    full, model = reduced(patch_block(), 3000.0, contact_dofs)
    # The ring turns towards +y, about -x: see the test of the rigid ring.
    velocity = model.basis.reshape(-1, 3, model.size)
    acceleration = 2.0 * np.cross([-1.0, 0.0, 0.0], velocity, axisb=1, axisc=1)
    exact = model.basis.T @ (full.mass @ acceleration.reshape(model.basis.shape))
    np.testing.assert_allclose(model.coriolis, exact, atol=1e-10 * np.abs(exact).max())
    np.testing.assert_array_equal(model.coriolis, -model.coriolis.T)
    assert reduced(patch_block(), 0.0, contact_dofs)[1].coriolis is None


def test_foucault_pendulum():
    """A point mass on equal springs in the plane of rotation: w_0 + W and w_0 - W as seen from the rotating frame."""
    still, turning = 50.0, 3.0
    stiffness = np.diag([1e4, still**2 - turning**2, still**2 - turning**2])  # spin softening
    model = ReducedModel(
        mass=np.eye(3),
        stiffness=stiffness,
        contact_right=np.zeros((3, 3)),
        contact_position=np.zeros((1, 3)),
        force_excitation=np.ones(3),
        outputs={"tip": np.ones(3)},
        coriolis=POINT_MASS,
        speed_rpm=turning * RPM,
    )
    found = 2 * np.pi * gyroscopic_frequencies(model, 0.0)
    np.testing.assert_allclose(found, [still - turning, still + turning, 100.0], rtol=1e-12)
    operation = LinearOperation((7.0, 9.0), 0.0, np.zeros(1), np.zeros(1), damping_ratio=0.01)
    exact = (still + turning) / np.sqrt(still**2 - turning**2) - 1.0
    assert coriolis_error(model, operation) == pytest.approx(exact, rel=1e-10)
    # Where the range holds no frequency the first one above it counts, here that of the axial motion.
    assert coriolis_error(model, replace(operation, frequency_hz=(10.0, 12.0))) == pytest.approx(0.0, abs=1e-12)
    assert coriolis_error(replace(model, coriolis=None), operation) is None
    assert coriolis_error(replace(model, speed_rpm=None), operation) is None
    assert coriolis_error(replace(model, coriolis=None, speed_rpm=0.0), operation) == 0.0
    with pytest.raises(ReducedModelError, match="coriolis: missing"):
        gyroscopic_frequencies(replace(model, coriolis=None), 0.0)
    with pytest.raises(ReducedModelError, match="coriolis: not skew-symmetric"):
        replace(model, coriolis=np.abs(POINT_MASS))


@pytest.mark.parametrize(("engine_order", "sense"), [(1, 1.0), (11, -1.0)])
def test_whirl_of_a_rigid_ring_on_isotropic_springs(engine_order, sense):
    """In the inertial frame a turning ring on springs vibrates at w_0. Its blades see w_0 + W in the wave that runs
    with the engine orders, from whirl against the rotation, and w_0 - W in the wave that runs the other way."""
    blades, still, turning = 12, 50.0, 3.0
    frame = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    model = ReducedModel(
        mass=np.eye(3),
        stiffness=np.diag([1e8, still**2 - turning**2, still**2 - turning**2]),
        contact_right=frame,
        contact_left=turned_back(frame, blades),
        contact_position=np.zeros((1, 3)),
        force_excitation=np.ones(3),
        outputs={"tip": np.ones(3)},
        coriolis=POINT_MASS,
        n_blades=blades,
        speed_rpm=turning * RPM,
    )
    rigid = {"normal": 1e9, "tangential": 1e9}  # N/m between the blades
    phase = inter_blade_phase(engine_order, blades)
    found = 2 * np.pi * gyroscopic_frequencies(model, phase, **rigid)[0]
    assert found == pytest.approx(still + sense * turning, rel=1e-5)


def test_frequencies_of_a_travelling_wave_against_the_quadratic_eigenproblem():
    model = reduced(box_sector(divisions=(2, 2, 4)), 30_000.0)[1]
    phase, springs = 1.1, {"normal": 3e6, "tangential": 1e6}
    motion = relative_contact_motion(model.contact_right, model.contact_left, phase)
    diagonal = contact_springs(model.n_contacts, 3e6, 1e6).ravel()
    stiffness = model.stiffness + motion.conj().T @ (diagonal[:, None] * motion)
    # lambda^2 M + lambda W G + K with lambda = i w
    n, inverse = model.size, np.linalg.inv(model.mass)
    companion = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-inverse @ stiffness, -inverse @ model.coriolis * 30_000.0 / RPM],
        ]
    )
    every = eigvals(companion)
    assert np.abs(every.real).max() < 1e-6 * np.abs(every).max()
    exact = np.sort(every.imag[every.imag > 0.0])[:10] / (2 * np.pi)
    found = gyroscopic_frequencies(model, phase, **springs)
    np.testing.assert_allclose(found, exact, rtol=1e-7)
    # Opposite travelling waves have different frequencies, but for those of the Coriolis forces alone.
    back = gyroscopic_frequencies(model, -phase, **springs)
    assert np.abs(back / found - 1.0).max() > 1e-4
    assert np.abs(found / natural_frequencies(model, phase, **springs) - 1.0).max() > 1e-3
