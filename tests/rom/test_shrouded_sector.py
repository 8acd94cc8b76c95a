"""The chain from the parametric sector to the reduced model, against the full model of the same sector."""

import numpy as np
import pytest
from rom_meshes import NODAL
from rom_reference import lowest_hz, spring_stiffness

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import Material, ReductionOptions, assemble, natural_frequencies, reduce_sector
from rom.finite_elements.rotation import centrifugal_displacement, stiffen_by_rotation

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
BLADE = BladeParameters(
    n_blades=72, hub_radius=0.3, length=0.1, chord=0.03, thickness=0.008, tip_thickness=0.006, twist=20.0
)


def shrouded(angle):
    shroud = ShroudParameters(angle=angle, thickness=0.006, axial_width=0.036, contact_length=0.01)
    return build_sector(BLADE, shroud, MeshParameters(size=0.009))


@pytest.fixture(scope="module")
def sector():
    return shrouded(70.0)


@pytest.fixture(scope="module")
def full(sector):
    return assemble(sector, STEEL)


@pytest.fixture(scope="module")
def nodal(full, sector):
    return reduce_sector(full, sector, ReductionOptions(modes=20, store_basis=False), NODAL).model


@pytest.mark.parametrize(("normal", "tangential", "engine_order"), [(1e6, 0.0, 36), (1e6, 7.5e5, 5)])
def test_reduced_and_full_frequencies(full, sector, nodal, normal, tangential, engine_order):
    phase = 2 * np.pi * engine_order / sector.n_blades
    stiffness = full.stiffness + spring_stiffness(full, sector, phase, normal, tangential)
    exact = lowest_hz(stiffness, full.mass, 6, full.fixed)
    found = natural_frequencies(nodal, phase, normal=normal, tangential=tangential, count=6)
    assert np.all(found / exact - 1 > -1e-7)
    np.testing.assert_allclose(found, exact, rtol=3e-3)
    assert found[0] == pytest.approx(exact[0], rel=2e-4)


def test_contact_stiffens_in_order_free_sliding_stuck(full, sector):
    model = reduce_sector(full, sector, ReductionOptions(store_basis=False)).model
    phase = 2 * np.pi * 24 / sector.n_blades
    free, sliding, stuck = (
        natural_frequencies(model, phase, normal=normal, tangential=tangential)
        for normal, tangential in ((0.0, 0.0), (1e6, 0.0), (1e6, 1e6))
    )
    assert np.all(free <= sliding * (1 + 1e-12))
    assert np.all(sliding <= stuck * (1 + 1e-12))
    assert stuck[0] > 1.2 * free[0]


def test_mirrored_shroud_angle_has_the_same_free_and_stuck_frequencies(full, sector):
    mirrored = build_sector(
        BladeParameters(**{**BLADE.__dict__, "twist": -BLADE.twist}),
        ShroudParameters(angle=110.0, thickness=0.006, axial_width=0.036, contact_length=0.01),
        MeshParameters(size=0.009),
    )
    models = [
        reduce_sector(part, blade, ReductionOptions(store_basis=False)).model
        for part, blade in ((full, sector), (assemble(mirrored, STEEL), mirrored))
    ]
    for normal, tangential in ((0.0, 0.0), (1e6, 7e5)):
        pair = [natural_frequencies(m, 1.0, normal=normal, tangential=tangential) for m in models]
        np.testing.assert_allclose(pair[0], pair[1], rtol=1e-7)


def test_rotation_untwists_the_blade_and_raises_its_frequencies(full, sector):
    still = centrifugal_displacement(full).reshape(-1, 3)
    tip = np.flatnonzero(full.positions[:, 2] > 0.3985)
    # Twist turns x towards y about +z; untwisting turns the tip the other way.
    arm = full.positions[tip, :2] - full.positions[tip, :2].mean(axis=0)
    turn = np.sum(arm[:, 0] * still[tip, 1] - arm[:, 1] * still[tip, 0]) / np.sum(arm**2)
    assert turn < 0.0
    assert np.mean(still[tip, 2]) > 0.0
    options = ReductionOptions(store_basis=False)
    models = [
        reduce_sector(stiffen_by_rotation(full, sector, STEEL, rpm), sector, options).model for rpm in (0.0, 8000.0)
    ]
    assert [model.speed_rpm for model in models] == [0.0, 8000.0]
    hz = [natural_frequencies(model, 0.0)[0] for model in models]
    assert hz[1] > hz[0]
    # The reduced centrifugal force moves the contact nodes as the full model does.
    rest = reduce_sector(full, sector, options, NODAL).model
    moved = rest.contact_right @ np.linalg.solve(rest.stiffness, rest.force_centrifugal)
    nodes = full.vertex_node[sector.right.nodes]
    exact = np.einsum("kij,kj->ki", sector.right.frame, still[nodes]).ravel()
    np.testing.assert_allclose(moved, exact, atol=1e-8 * np.max(np.abs(exact)))
