"""Stiffness and mass against exact properties of the continuum and against scikit-fem's own forms."""

from dataclasses import replace

import numpy as np
import pytest
from rom_meshes import annulus, box, box_sector, distorted_box, mesh_of
from scipy.sparse.linalg import spsolve

from rom import Material, RomParameterError, assemble
from rom.finite_elements.assembly import elastic_matrices, stress_at_quadrature
from rom.finite_elements.discretisation import ELEMENTS, discretise
from rom.finite_elements.loads import strain_row

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)


def rigid_motions(positions):
    """Six rigid-body motions (3n, 6): three shifts, three small turns."""
    shifts = [np.tile(axis, (len(positions), 1)) for axis in np.eye(3)]
    turns = [np.cross(axis, positions) for axis in np.eye(3)]
    return np.stack([motion.ravel() for motion in shifts + turns], axis=1)


@pytest.mark.parametrize("element", ELEMENTS)
def test_free_body_has_six_zero_modes_and_no_more(element):
    points, hexahedra = distorted_box((2, 2, 2), (1.0, 0.7, 0.5))
    mesh = discretise(mesh_of(points, hexahedra), element)
    stiffness, _ = elastic_matrices(mesh, STEEL)
    eigenvalues = np.linalg.eigvalsh(stiffness.toarray())
    assert np.max(np.abs(eigenvalues[:6])) < 1e-12 * eigenvalues[-1]
    assert eigenvalues[6] > 1e-5 * eigenvalues[-1]
    rigid = rigid_motions(mesh.positions)
    assert np.max(np.abs(stiffness @ rigid)) < 1e-12 * np.max(np.abs(stiffness.diagonal()))


@pytest.mark.parametrize("element", ELEMENTS)
def test_mass_properties_of_a_brick(element):
    lengths, centre = np.array([0.4, 0.3, 0.2]), np.array([1.0, -2.0, 0.5])
    points, hexahedra = box((3, 2, 2), lengths, centre - lengths / 2)
    mesh = discretise(mesh_of(points, hexahedra), element)
    _, mass = elastic_matrices(mesh, STEEL)
    rigid = rigid_motions(mesh.positions - centre)
    body = STEEL.density * lengths.prod()
    squared = lengths**2
    inertia = body / 12 * (squared.sum() - squared)
    expected = np.diag(np.concatenate([np.full(3, body), inertia]))
    np.testing.assert_allclose(rigid.T @ (mass @ rigid), expected, atol=1e-11 * body)


def test_volume_of_a_polygonal_ring():
    sides, inner, outer, thickness = 12, 0.1, 0.2, 0.01
    points, hexahedra = annulus((2, sides, 1), inner, outer, thickness)
    mesh = discretise(mesh_of(points, hexahedra), "hex20")
    _, mass = elastic_matrices(mesh, STEEL)
    area = 0.5 * sides * np.sin(2 * np.pi / sides) * (outer**2 - inner**2)
    assert mass.sum() / 3 == pytest.approx(STEEL.density * area * thickness, rel=1e-12)


@pytest.mark.parametrize("element", ELEMENTS)
def test_patch_test_constant_strain_is_exact_in_distorted_elements(element):
    points, hexahedra = distorted_box((3, 3, 3), (1.0, 1.2, 0.9), amount=0.25)
    mesh = discretise(mesh_of(points, hexahedra), element)
    stiffness, _ = elastic_matrices(mesh, STEEL)
    slope = 1e-3 * np.random.default_rng(3).standard_normal((3, 3))
    exact = (mesh.positions @ slope.T).ravel()
    sides = (np.abs(mesh.positions) < 1e-9) | (np.abs(mesh.positions - [1.0, 1.2, 0.9]) < 1e-9)
    held = np.repeat(sides.any(axis=1), 3)
    assert (~held).sum() >= 3 * 8
    solution = exact.copy()
    solution[~held] = spsolve(stiffness[~held][:, ~held].tocsc(), -stiffness[~held][:, held] @ exact[held])
    np.testing.assert_allclose(solution, exact, atol=1e-12)
    strain = (slope + slope.T) / 2
    lame, shear = STEEL.lame
    stress = 2 * shear * strain + lame * np.trace(strain) * np.eye(3)
    (found,) = stress_at_quadrature(mesh, STEEL, solution)
    np.testing.assert_allclose(found, np.broadcast_to(stress, found.shape), rtol=0, atol=1e-9 * np.abs(stress).max())


def test_same_matrices_as_the_forms_of_scikit_fem():
    from skfem import Basis, ElementHexS2, ElementVector, MeshHex1, asm
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    points, hexahedra = distorted_box((3, 2, 2), (1.0, 0.5, 0.7))
    mesh = discretise(mesh_of(points, hexahedra), "hex20")
    stiffness, _ = elastic_matrices(mesh, STEEL)
    corners = mesh.blocks[0].nodes[:, :8]
    basis = Basis(
        MeshHex1(mesh.positions[: len(points)].T, corners.T.astype(np.int32)),
        ElementVector(ElementHexS2()),
        intorder=5,
    )
    reference = asm(linear_elasticity(*lame_parameters(STEEL.young_modulus, STEEL.poisson_ratio)), basis)
    dofs = np.empty((*mesh.blocks[0].nodes.shape, 3), dtype=int)
    for node in range(20):
        for axis in range(3):
            dofs[:, node, axis] = basis.dofs.element_dofs[3 * node + axis]
    renumber = np.empty(3 * mesh.n_nodes, dtype=int)
    renumber[3 * mesh.blocks[0].nodes[..., None] + np.arange(3)] = dofs
    difference = abs(stiffness - reference[renumber][:, renumber]).max()
    assert difference < 1e-12 * abs(stiffness).max()  # sums over elements in another order


def test_matrices_are_exactly_symmetric_and_share_no_element_order():
    points, hexahedra = distorted_box((3, 3, 4), (1.0, 1.0, 1.0))
    stiffness, mass = elastic_matrices(discretise(mesh_of(points, hexahedra), "hex20"), STEEL)
    assert abs(stiffness - stiffness.T).max() == 0.0
    assert abs(mass - mass.T).max() == 0.0
    shuffled = np.random.default_rng(0).permutation(len(hexahedra))
    mesh = discretise(mesh_of(points, hexahedra[shuffled]), "hex8")
    first, _ = elastic_matrices(discretise(mesh_of(points, hexahedra), "hex8"), STEEL)
    second, _ = elastic_matrices(mesh, STEEL)
    assert abs(first - second).max() < 1e-12 * abs(first).max()


def test_matrices_without_their_clamped_dofs_are_of_a_body_that_is_held():
    """As those that another program writes of its active dofs alone; without any clamped node it floats."""
    full = assemble(box_sector((3, 3, 4)), STEEL, "hex8")
    free = replace(full, fixed=np.zeros(0, dtype=np.int64))
    assert [len(nodes) for nodes in free.floating] == [len(full.positions)]
    kept = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    held = replace(
        free,
        positions=full.positions[kept[::3] // 3],
        stiffness=full.stiffness[kept][:, kept],
        mass=full.mass[kept][:, kept],
    )
    assert held.floating == ()


def test_clamped_nodes_are_all_nodes_of_the_root_surface():
    sector = box_sector()
    for element, per_face in (("hex8", 25), ("hex20", 65), ("hex27", 81)):
        full = assemble(sector, STEEL, element)
        root = np.flatnonzero(np.abs(full.positions[:, 2] - 0.3) < 1e-9)
        assert len(root) == per_face
        np.testing.assert_array_equal(np.unique(full.fixed // 3), root)
        np.testing.assert_array_equal(full.positions[full.vertex_node], sector.points)


@pytest.mark.parametrize(
    ("arguments", "parameter"),
    [
        ((0.0, 0.3, 7800.0), "young_modulus"),
        ((float("nan"), 0.3, 7800.0), "young_modulus"),
        ((2e11, 0.5, 7800.0), "poisson_ratio"),
        ((2e11, -1.0, 7800.0), "poisson_ratio"),
        ((2e11, 0.3, -1.0), "density"),
        ((2e11, 0.3, float("inf")), "density"),
        ((2e11, 0.3, "steel"), "density"),
    ],
)
def test_bad_material_is_refused_in_one_line(arguments, parameter):
    with pytest.raises(RomParameterError) as caught:
        Material(*arguments)
    assert caught.value.parameter == parameter
    assert parameter in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unknown_element_and_bad_meshes_are_refused_in_one_line():
    points, hexahedra = box((1, 1, 1), (1.0, 1.0, 1.0))
    with pytest.raises(RomParameterError, match=r"mesh.element = 'hex21': must be one of hex20, hex8, hex27"):
        discretise(mesh_of(points, hexahedra), "hex21")
    with pytest.raises(RomParameterError, match="turned inside out"):
        elastic_matrices(discretise(mesh_of(points, hexahedra[:, [4, 5, 6, 7, 0, 1, 2, 3]]), "hex20"), STEEL)
    with pytest.raises(RomParameterError, match="belongs to no element"):
        discretise(mesh_of(np.vstack([points, [[5.0, 5.0, 5.0]]]), hexahedra), "hex20")


def test_a_strain_gauge_reads_the_strain_of_a_uniform_stretch_along_its_direction():
    sector = box_sector((2, 2, 2))
    full = assemble(sector, STEEL, element="hex8")
    stretched = (full.positions * [-0.3e-3, -0.3e-3, 1e-3]).ravel()
    for direction, strain in ([0.0, 0.0, 2.0], 1e-3), ([1.0, 0.0, 0.0], -0.3e-3), ([1.0, 0.0, 1.0], 0.35e-3):
        row = strain_row(full, sector, at=sector.points.mean(axis=0).tolist(), direction=direction)
        assert row @ stretched == pytest.approx(strain, abs=1e-12)
