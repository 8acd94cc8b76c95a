"""Contact dofs that are a mortar projection: polynomials, rigid motions, energy, and springs spread over the face."""

from dataclasses import replace

import numpy as np
import pytest
from rom_meshes import box_sector, patch_block
from rom_reference import lowest_hz, spread_springs

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import BoundaryChoice, Material, RomParameterError, assemble, natural_frequencies
from rom.finite_elements.discretisation import discretise
from rom.reduction.contact_dofs import averaged_dofs, contact_nodes
from rom.reduction.mortar_dofs import contact_grid, gauss_points
from rom.reduction.reference_model import full_reference

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)
BLADE = BladeParameters(72, 0.3, 0.08, chord=0.036, thickness=0.009, tip_thickness=0.006, twist=25.0, section="lens")
SHROUD = ShroudParameters(angle=180.0, thickness=0.005, axial_width=0.040, contact_length=0.012)
FACE = 12e-3 * 5e-3  # m^2
PUNCH = 1.0e9  # N/m, whole face
GAUSS = np.sqrt(3.0 / 5.0)


def sector_at(angle):
    return build_sector(BLADE, replace(SHROUD, angle=angle), MeshParameters(size=0.018, grading=1.0))


@pytest.mark.parametrize("element", ["hex8", "hex20", "hex27"])
@pytest.mark.parametrize(("divisions", "grid"), [((6, 2, 6), (3, 3)), ((12, 1, 4), (2, 1)), ((2, 1, 2), (1, 1))])
def test_projected_polynomials_have_their_values_at_the_gauss_points(element, divisions, grid):
    lengths = (0.012, 0.01, 0.009)
    sector = patch_block(divisions, lengths, grid)
    dofs = averaged_dofs(sector, element, "mortar")
    assert contact_grid(sector.right.position, sector.right.frame) == grid
    nodes = discretise(sector, element)
    x, _, z = (nodes.positions - [0.0, 0.0, 0.3]).T
    point = {1: [0.0], 2: [-np.sqrt(1 / 3), np.sqrt(1 / 3)], 3: [-GAUSS, 0.0, GAUSS]}
    weight = {1: [2.0], 2: [1.0, 1.0], 3: [5 / 9, 8 / 9, 5 / 9]}
    at_x = np.tile(point[grid[0]], grid[1]) * lengths[0] / 2
    at_z = np.repeat(point[grid[1]], grid[0]) * lengths[2] / 2 + lengths[2] / 2
    share = np.outer(weight[grid[1]], weight[grid[0]]).ravel() / 4.0
    np.testing.assert_allclose(
        dofs.area, share * dofs.area.sum(), rtol=1e-4
    )  # the radius bends slightly over the block
    assert dofs.area.sum() == pytest.approx(sector.right.area.sum(), rel=1e-12)
    np.testing.assert_allclose(dofs.position[:, 0], at_x, atol=1e-8)
    for side in (0, 1):
        rows = dofs.weights[side * len(share) : (side + 1) * len(share)]
        np.testing.assert_allclose(rows @ np.ones(len(x)), 1.0, atol=1e-12)
        exact = [(x, at_x), (z, at_z), (x * z, at_x * at_z)]
        known = exact if min(grid) > 1 else exact[:1] if grid[0] > 1 else []
        if element != "hex8" and min(grid) > 2:  # hex8 is linear between the corners
            known = [*known, (x**2, at_x**2), (z**2, at_z**2), (x**2 * z, at_x**2 * at_z)]
        for values, expected in known:
            np.testing.assert_allclose(rows @ values, expected, atol=2e-4 * np.abs(values).max())


def test_the_contact_grid_has_its_gauss_points_where_the_area_is():
    x = np.linspace(-1.0, 1.0, 4001)
    for count in (1, 2, 3, 7, 15):
        legendre = np.polynomial.legendre.leggauss(count)[0]
        np.testing.assert_allclose(gauss_points(x, np.ones_like(x), count), legendre, atol=2e-3)
    # with the weight 1 + x: zeros of the Jacobi polynomials P^(0, 1), 3 x - 1 and 5 x^2 - 2 x - 1
    fine, weight = np.polynomial.legendre.leggauss(9)
    assert gauss_points(fine, weight * (1.0 + fine), 1) == pytest.approx([1 / 3])
    found = gauss_points(fine, weight * (1.0 + fine), 2)
    np.testing.assert_allclose(5 * found**2 - 2 * found - 1, 0.0, atol=1e-12)


@pytest.mark.parametrize("angle", [70.0, 90.0, 120.0, 180.0])
def test_left_is_right_turned_back_and_rigid_motions_are_exact(angle):
    sector = sector_at(angle)
    dofs = averaged_dofs(sector, "hex20", "mortar")
    half = dofs.count
    pitch = 2 * np.pi / sector.n_blades
    forward = np.array([[1, 0, 0], [0, np.cos(pitch), np.sin(pitch)], [0, -np.sin(pitch), np.cos(pitch)]])
    positions = dofs.weights @ discretise(sector, "hex20").positions
    np.testing.assert_allclose(positions[half:], positions[:half] @ forward, atol=1e-12)
    assert np.linalg.norm(positions[:half] - sector.right.position, axis=1).max() < 1e-3  # in the order of the mesh
    np.testing.assert_allclose(dofs.frames[half:], dofs.frames[:half] @ forward, atol=1e-9)
    # the axes at a point: t1 and n in the tangent plane of the cylinder about x, t2 along its radius
    at = np.arctan2(positions[:half, 1], positions[:half, 2])
    radial = np.stack([0 * at, np.sin(at), np.cos(at)], axis=1)
    np.testing.assert_allclose(dofs.frames[:half, 1], radial, atol=1e-7)
    np.testing.assert_allclose(
        dofs.frames @ dofs.frames.transpose(0, 2, 1), np.tile(np.eye(3), (2 * half, 1, 1)), atol=1e-12
    )
    assert dofs.area.sum() == pytest.approx(FACE)
    np.testing.assert_allclose(dofs.area / FACE, np.outer([5, 8, 5], [5, 8, 5]).ravel() / 324.0, rtol=6e-3)
    np.testing.assert_allclose(contact_nodes(sector, "mortar").area, dofs.area, rtol=1e-12)


def test_springs_have_the_rotational_stiffness_of_the_face():
    """Rigid rotations by 1 rad about t1 and t2 at the centre: of kn it takes b^2 / 12 and l^2 / 12."""
    sector = sector_at(180.0)
    positions = discretise(sector, "hex20").positions
    centre, frame = sector.right.position.mean(axis=0), sector.right.frame[4]
    for kind, share in (("mortar", 1.0), ("patch", 8.0 / 9.0)):
        dofs = averaged_dofs(sector, "hex20", kind)
        for axis, moment in ((0, 5e-3**2 / 12), (1, 12e-3**2 / 12)):
            turned = np.cross(frame[axis], positions - centre)
            normal = (dofs.motion @ turned.ravel())[2 : 3 * dofs.count : 3]
            assert np.sum(dofs.area / FACE * normal**2) == pytest.approx(share * moment, rel=1e-6), (kind, axis)


@pytest.mark.parametrize(("angle", "engine_order", "stiffness"), [(180.0, 36, PUNCH), (70.0, 10, 1e8)])
def test_three_by_three_is_as_good_as_springs_spread_over_the_face(angle, engine_order, stiffness):
    """With the stiffness of a punch, and with less; nine patches are far off at the same stiffness."""
    sector = sector_at(angle)
    full = assemble(sector, STEEL)
    phase = 2 * np.pi * engine_order / sector.n_blades
    springs = spread_springs(full, sector, phase, stiffness, 0.8 * stiffness)
    if engine_order == 36:
        springs = springs.real
    exact = lowest_hz(full.stiffness + springs, full.mass, 4, full.fixed)

    def error(model):
        share = stiffness * model.contact_area / model.contact_area.sum()
        found = natural_frequencies(model, phase, normal=share, tangential=0.8 * share, count=4)
        return np.abs(found / exact - 1.0).max()

    reference = full_reference(full, sector, 6000.0, with_face=True)
    assert error(reference.face) < 2e-5
    assert error(reference.model) < (5e-3 if stiffness == PUNCH else 2e-4)
    patches = full_reference(full, sector, 6000.0, BoundaryChoice(contact_dofs="patch")).model
    assert error(patches) > 3.0 * error(reference.model)


def test_a_face_of_two_parts_and_a_mesh_without_faces_are_refused():
    block = patch_block((6, 1, 6))
    level = np.round((block.points[:, 2] - 0.3) / 0.002).astype(int)
    x = block.points[:, 0]
    fork = {
        name: nodes[(level[nodes] < 3) | (x[nodes] > 3e-3) | (np.abs(x[nodes] + 3e-3) < 2e-3)]
        for name, nodes in block.node_sets.items()
        if name.startswith("face")
    }
    cases = [
        (replace(block, node_sets={**block.node_sets, **fork}), "lines along t1 cross once"),
        (box_sector(divisions=(2, 2, 4)), 'node set "face_right"'),
    ]
    for sector, reason in cases:
        with pytest.raises(RomParameterError, match=reason) as caught:
            averaged_dofs(sector, "hex8", "mortar")
        assert (caught.value.table, caught.value.parameter) == ("rom", "contact_dofs")
        assert "\n" not in str(caught.value)
