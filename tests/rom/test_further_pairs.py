"""Contact dofs of further pairs of faces: snubber and platform in the full and in the reduced model."""

import numpy as np
import pytest
from rom_reference import lowest_hz, spread_springs

from geometry import (
    BladeParameters,
    MeshParameters,
    PlatformParameters,
    ShroudParameters,
    SnubberParameters,
    build_sector,
)
from geometry.quality import hexahedron_scaled_jacobian
from rom import BoundaryChoice, Material, ReductionOptions, assemble, natural_frequencies, reduce_sector
from rom.reduction.reference_model import full_reference, static_error

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
BLADE = BladeParameters(24, 0.2, 0.08, 0.024, 0.006, 0.004, 15.0, "lens")
SHROUD = ShroudParameters(angle=150.0, thickness=0.005, axial_width=0.03, contact_length=0.008)
PLATFORM = PlatformParameters(radius=0.212, thickness=0.005)
GRID = (3, 2)


@pytest.fixture(scope="module")
def sector():
    snubber = SnubberParameters(radius=0.24, thickness=0.005, width=0.012, angle=150.0)
    return build_sector(BLADE, SHROUD, MeshParameters(0.009, GRID), snubber=snubber, platform=PLATFORM)


@pytest.fixture(scope="module")
def full(sector):
    return assemble(sector, STEEL, element="hex20")


def springs(model, of, stiffness):
    """Stiffness of the nodes with that of a whole face on one interface."""
    share = np.concatenate([np.full(count, float(name == of)) for name, count in model.interfaces.items()])
    share *= model.contact_area
    return stiffness * share / max(share.sum(), 1e-300)


def test_mass_and_rigid_motions_of_a_sector_with_wings(sector, full):
    positions = full.positions
    corners = sector.points[sector.hexahedra]
    assert hexahedron_scaled_jacobian(sector.points, sector.hexahedra).min() > 0.1
    point = np.polynomial.legendre.leggauss(2)[0]
    total = 0.0
    for a in point:
        for b in point:
            for c in point:
                signs = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]])
                signs = np.vstack([signs, signs * [1, 1, -1]])
                u, v, w = (1 + signs * [a, b, c]).T / 2
                slopes = np.stack([signs[:, 0] * v * w, signs[:, 1] * u * w, signs[:, 2] * u * v]) / 2
                total += np.linalg.det(np.einsum("kn,enj->ekj", slopes, corners)).sum()
    motions = [np.tile(axis, (len(positions), 1)) for axis in np.eye(3)]
    motions += [np.cross(axis, positions) for axis in np.eye(3)]
    x = motions[0].ravel()
    assert x @ (full.mass @ x) == pytest.approx(STEEL.density * total, rel=1e-9)
    scale = abs(full.stiffness.diagonal()).max()
    for motion in motions:
        assert np.abs(full.stiffness @ motion.ravel()).max() < 1e-12 * scale


@pytest.mark.parametrize("kind", ["mortar", "patch", "nodal"])
def test_reduced_model_has_the_interfaces_with_exact_statics(sector, full, kind):
    choice = BoundaryChoice(contact_dofs=kind)
    model = reduce_sector(full, sector, ReductionOptions(modes=6), choice).model
    nodes = GRID[0] * GRID[1]
    assert model.interfaces == {"shroud": nodes, "snubber": nodes, "platform": nodes}
    reference = full_reference(full, sector, 500.0, choice)
    assert static_error(model, reference.flexibility) < 1e-7
    for k, view in enumerate(sector.views.values()):
        rows = slice(k * nodes, (k + 1) * nodes)
        assert model.contact_area[rows].sum() == pytest.approx(view.right.area.sum())
        assert np.abs(model.contact_position[rows].mean(axis=0) - view.right.position.mean(axis=0)).max() < 1e-3


def test_stuck_snubber_against_springs_spread_over_its_face(sector, full):
    diameters, stiffness = 12, 1e8
    phase = 2 * np.pi * diameters / BLADE.n_blades
    model = reduce_sector(full, sector, ReductionOptions(modes=30)).model
    share = springs(model, "snubber", stiffness)
    found = natural_frequencies(model, phase, normal=share, tangential=0.8 * share, count=5)
    added = spread_springs(full, sector.seen_from("snubber"), phase, stiffness, 0.8 * stiffness)
    exact = lowest_hz(full.stiffness + added, full.mass, 5, fixed=full.fixed)
    free = natural_frequencies(model, phase, count=5)
    assert found == pytest.approx(exact, rel=1e-3)
    assert found[0] > 1.2 * free[0]


def test_one_flank_of_the_platform_is_the_mirror_image_of_the_other():
    """Without twist half a turn about the stacking axis takes one flank to the other, and their flexibility."""
    blade = BladeParameters(24, 0.2, 0.08, 0.024, 0.006)
    straight = ShroudParameters(angle=180.0, thickness=0.005, axial_width=0.03, contact_length=0.008)
    for flank_angle in (0.0, 45.0):
        platform = PlatformParameters(radius=0.212, thickness=0.005, flank_angle=flank_angle)
        sector = build_sector(blade, straight, MeshParameters(0.009, GRID), platform=platform)
        model = reduce_sector(assemble(sector, STEEL, element="hex20"), sector, ReductionOptions(modes=2)).model
        rows = slice(3 * GRID[0] * GRID[1], None)
        right, left = (each[rows] for each in (model.contact_right, model.contact_left))
        own = [each @ np.linalg.solve(model.stiffness, each.T) for each in (right, left)]
        # node (i, j) goes to (n - 1 - i, j), t1 changes its sign
        order = np.arange(GRID[0] * GRID[1]).reshape(GRID[1], GRID[0])[:, ::-1].ravel()
        change = np.kron(np.eye(len(order))[order], np.diag([-1.0, 1.0, 1.0]))
        assert change @ own[0] @ change.T == pytest.approx(own[1], rel=1e-6, abs=1e-6 * np.abs(own[0]).max())
