"""Every kind of element: shape functions, rigid motions, patch test, rates of convergence, curved geometry."""

from dataclasses import replace

import numpy as np
import pytest
from element_meshes import KINDS, QUADRATIC, arched, brick, mixed_brick, moved, split_to_tetrahedra, wavy
from rom_meshes import box, mesh_of, mesh_of_blocks
from rom_reference import lowest_hz
from scipy.sparse.linalg import eigsh, spsolve

from geometry import BladeParameters, ElementBlock, MeshParameters, ShroudParameters, build_sector
from geometry.elements import ELEMENT_KINDS
from rom import Material, RomParameterError, assemble
from rom.finite_elements.assembly import elastic_matrices, stress_at_quadrature
from rom.finite_elements.discretisation import discretise, element_warnings
from rom.finite_elements.reference_element import reference_nodes, vtk_shape_functions
from rom.linear_algebra.factorisation import factorise
from rom.reduction.fixed_interface_modes import lowest_modes

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
# Points inside all reference cells.
INSIDE = np.random.default_rng(5).uniform(0.0, 1.0 / 3.0, (3, 12))


def rigid_motions(positions):
    """Six rigid-body motions (3n, 6): three shifts, three small turns."""
    shifts = [np.tile(axis, (len(positions), 1)) for axis in np.eye(3)]
    turns = [np.cross(axis, positions) for axis in np.eye(3)]
    return np.stack([motion.ravel() for motion in shifts + turns], axis=1)


def clamped_hz(full, count):
    """Lowest natural frequencies of a clamped full model, Hz."""
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    stiffness, mass = (matrix[free][:, free] for matrix in (full.stiffness, full.mass))
    return lowest_modes(mass, factorise(stiffness), count).omega / (2 * np.pi)


def sorted_meshes():
    """One bent mesh of each kind and a mixed one."""
    return [pytest.param(brick(kind, (2, 2, 2), bend=wavy), id=kind) for kind in KINDS] + [
        pytest.param(mixed_brick(arched), id="mixed")
    ]


@pytest.mark.parametrize("kind", KINDS)
def test_shape_functions_are_one_at_their_node_and_sum_to_one(kind):
    values, _ = vtk_shape_functions(kind, reference_nodes(kind).T)
    np.testing.assert_allclose(values, np.eye(len(values)), atol=1e-12)  # sums of up to 27 terms
    values, gradients = vtk_shape_functions(kind, INSIDE)
    np.testing.assert_allclose(values.sum(axis=1), 1.0, atol=1e-12)  # sums of up to 27 terms
    np.testing.assert_allclose(gradients.sum(axis=1), 0.0, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_shape_functions_are_complete(kind):
    degree = 2 if ELEMENT_KINDS[kind].quadratic else 1
    values, _ = vtk_shape_functions(kind, INSIDE)
    nodes = reference_nodes(kind).T
    for i, j, k in np.ndindex(3, 3, 3):
        if i + j + k <= degree:
            monomial = [x**i * y**j * z**k for x, y, z in (nodes, INSIDE)]
            np.testing.assert_allclose(values @ monomial[0], monomial[1], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_gradients_are_the_derivatives_of_the_values(kind):
    _, gradients = vtk_shape_functions(kind, INSIDE)
    step = 1e-6
    for axis in range(3):
        ahead, behind = INSIDE.copy(), INSIDE.copy()
        ahead[axis] += step
        behind[axis] -= step
        difference = (vtk_shape_functions(kind, ahead)[0] - vtk_shape_functions(kind, behind)[0]) / (2 * step)
        np.testing.assert_allclose(gradients[..., axis], difference, atol=1e-8)


@pytest.mark.parametrize("mesh", sorted_meshes())
def test_free_body_has_six_zero_modes_and_no_more(mesh):
    stiffness, mass = elastic_matrices(discretise(mesh), STEEL)
    assert abs(stiffness - stiffness.T).max() == 0.0
    rigid = rigid_motions(mesh.points)
    assert np.abs(stiffness @ rigid).max() < 1e-11 * np.abs(stiffness.diagonal()).max() * np.abs(rigid).max()
    lowest = lowest_hz(stiffness, mass, 8, shift=-1e6)
    assert lowest[5] < 1e-3 * lowest[6]


@pytest.mark.parametrize("kind", [*KINDS, "mixed"])
def test_patch_test_constant_strain_is_exact_in_distorted_elements(kind):
    mesh = moved(mixed_brick() if kind == "mixed" else brick(kind, (3, 3, 3)), 0.05)
    nodes = discretise(mesh)
    stiffness, _ = elastic_matrices(nodes, STEEL)
    slope = 1e-3 * np.random.default_rng(3).standard_normal((3, 3))
    exact = (mesh.points @ slope.T).ravel()
    faces = _outer_nodes(mesh)
    held = np.zeros(len(mesh.points), dtype=bool)
    held[faces] = True
    held = np.repeat(held, 3)
    assert (~held).sum() >= 3 * 8
    solution = exact.copy()
    solution[~held] = spsolve(stiffness[~held][:, ~held].tocsc(), -stiffness[~held][:, held] @ exact[held])
    np.testing.assert_allclose(solution, exact, atol=1e-12)
    strain = (slope + slope.T) / 2
    lame, shear = STEEL.lame
    stress = 2 * shear * strain + lame * np.trace(strain) * np.eye(3)
    for found in stress_at_quadrature(nodes, STEEL, solution):
        np.testing.assert_allclose(
            found, np.broadcast_to(stress, found.shape), rtol=0, atol=1e-8 * np.abs(stress).max()
        )


def _outer_nodes(mesh):
    """Nodes of the sides that one element only has."""
    sides = [
        block.nodes[:, list(block.topology.side_nodes(k))]
        for block in mesh.blocks
        for k in range(len(block.topology.sides))
    ]
    corners = {}
    for table in sides:
        count = table.shape[1] // 2 if mesh.blocks[0].topology.quadratic else table.shape[1]
        for row in table:
            corners.setdefault(frozenset(row[:count].tolist()), []).append(row)
    return np.unique(np.concatenate([rows[0] for rows in corners.values() if len(rows) == 1]))


@pytest.mark.parametrize("kind", KINDS)
def test_frequencies_converge_at_the_rate_of_the_element(kind):
    """A unit cube between smooth walls: u = (sin pi x cos pi y, -cos pi x sin pi y, 0), omega^2 = 2 pi^2 mu / rho."""
    exact = 2.0 * np.pi**2 * STEEL.lame[1] / STEEL.density
    quadratic = ELEMENT_KINDS[kind].quadratic
    errors = []
    for count in (2, 4) if quadratic else (4, 8):
        mesh = brick(kind, (count,) * 3, bend=wavy)
        stiffness, mass = elastic_matrices(discretise(mesh), STEEL)
        wall = (np.abs(mesh.points) < 1e-9) | (np.abs(mesh.points - 1.0) < 1e-9)
        free = np.flatnonzero(~wall.ravel())
        parts = (matrix[free][:, free].tocsc() for matrix in (stiffness, mass))
        squared = eigsh(next(parts), k=3, M=next(parts), sigma=0.0, which="LM", return_eigenvectors=False)
        errors.append(squared.mean() / exact - 1.0)
    assert errors[0] < (0.1 if quadratic else 0.4)
    rate = np.log2(errors[0] / errors[1])
    assert abs(rate - (4.0 if quadratic else 2.0)) < 0.6, errors


@pytest.mark.parametrize("kind", QUADRATIC)
def test_volume_of_a_curved_ring_converges_with_the_fourth_power(kind):
    errors = []
    for count in (2, 4):
        mesh = brick(kind, (2 * count, 1, count), (2.0, 1.0, 1.0), lambda p: _ring(p))
        _, mass = elastic_matrices(discretise(mesh), STEEL)
        exact = STEEL.density * 0.25 * np.pi * (2.0**2 - 1.0**2)
        errors.append(abs(mass.sum() / 3 / exact - 1.0))
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] > 12.0


def _ring(points):
    """A quarter of a ring about y, radii 1 and 2."""
    angle, radius = 0.25 * np.pi * points[:, 0], 1.0 + points[:, 2]
    return np.column_stack([radius * np.sin(angle), points[:, 1], radius * np.cos(angle)])


@pytest.mark.parametrize("kind", KINDS)
def test_elements_turned_inside_out_are_refused_by_kind_and_number(kind):
    mesh = brick(kind, (2, 1, 1))
    block = mesh.blocks[0]
    nodes = reference_nodes(kind)
    mirrored = np.abs(nodes[:, None] - nodes[None, :, [1, 0, 2]]).sum(axis=-1).argmin(axis=1)
    table = block.nodes.copy()
    table[1] = table[1, mirrored]
    with pytest.raises(RomParameterError, match=rf"mesh.{kind} = 1: this element is turned inside out") as caught:
        elastic_matrices(discretise(mesh_of(mesh.points, table, kind)), STEEL)
    assert "\n" not in str(caught.value)


def test_a_mid_side_node_beyond_its_corner_is_refused():
    mesh = brick("tet10", (1, 1, 1))
    corner, middle = mesh.blocks[0].nodes[2, [0, 4]]
    mesh.points[middle] += 1.5 * (mesh.points[corner] - mesh.points[middle])
    with pytest.raises(RomParameterError, match=r"mesh.tet10 = \d: this element is turned inside out"):
        elastic_matrices(discretise(mesh), STEEL)


@pytest.mark.parametrize("kind", KINDS)
def test_linear_tetrahedra_and_wedges_bend_too_stiffly_and_are_warned_of(kind):
    """A slender cantilever with two elements through its thickness against the beam: first bending."""
    mesh = brick(kind, (2, 2, 12), (0.02, 0.02, 0.3))
    held = np.flatnonzero(mesh.points[:, 2] < 1e-9)
    matrices = elastic_matrices(discretise(mesh), STEEL)
    beam = 1.8751041**2 / 0.3**2 * np.sqrt(2.1e11 * 0.02**2 / 12 / 7800.0) / (2 * np.pi)
    error = lowest_hz(*matrices, 1, (3 * held[:, None] + np.arange(3)).ravel())[0] / beam - 1.0
    assert (error > 0.2) == bool(element_warnings(mesh))
    assert all(kind in line for line in element_warnings(mesh))


def test_hanging_mid_side_nodes_are_warned_of():
    """Linear elements beside quadratic ones, and mid-side nodes that were not merged."""
    assert element_warnings(mixed_brick()) == ()
    mesh = brick("hex20", (2, 1, 1))
    block = mesh.blocks[0]
    half = mesh_of_blocks(
        mesh.points, replace(block, nodes=block.nodes[:1]), ElementBlock("hex8", block.nodes[1:, :8])
    )
    assert element_warnings(half)[-1].startswith("4 edges have a mid-side node in one element and none, or another")
    table = block.nodes.copy()
    common = np.intersect1d(table[0, 8:], table[1, 8:])
    copies = dict(zip(common.tolist(), range(len(mesh.points), len(mesh.points) + 4), strict=True))
    table[1] = [copies.get(node, node) for node in table[1].tolist()]
    apart = mesh_of_blocks(np.vstack([mesh.points, mesh.points[common]]), replace(block, nodes=table))
    assert element_warnings(apart)[0].startswith("4 edges")


def test_a_mesh_of_other_elements_cannot_be_promoted():
    with pytest.raises(RomParameterError, match="must be None, left out in a scene: the mesh has tet10 elements"):
        discretise(brick("tet10", (1, 1, 1)), "hex20")


def test_promoted_hexahedra_are_isoparametric_ones_with_straight_edges():
    points, hexahedra = box((3, 2, 4), (0.3, 0.2, 0.4))
    promoted = elastic_matrices(discretise(mesh_of(points, hexahedra), "hex20"), STEEL)
    own = elastic_matrices(discretise(brick("hex20", (3, 2, 4), (0.3, 0.2, 0.4))), STEEL)
    found, exact = (lowest_hz(*matrices, 12, shift=-1e6)[6:] for matrices in (own, promoted))
    np.testing.assert_allclose(found, exact, rtol=1e-9)


def test_two_materials_in_a_row_have_the_stiffness_of_springs_in_series():
    """A bar without Poisson's ratio: the ends move by F (l1 / E1 + l2 / E2) / A; the masses add up."""
    soft, hard = Material(1e10, 0.0, 2000.0), Material(4e10, 0.0, 5000.0)
    mesh = mixed_brick(materials=("soft", "hard", "hard"))
    stiffness, mass = elastic_matrices(discretise(mesh), {"soft": soft, "hard": hard})
    assert mass.sum() / 3 == pytest.approx(1.0 * 2000.0 + 2.0 * 5000.0, rel=1e-12)
    low = mesh.points[:, 2] < 1.0 + 1e-9
    keep = [k for k, block in enumerate(mesh.blocks) if block.kind != "tet10"]
    rows = np.full(len(mesh.points), -1)
    rows[np.unique(np.concatenate([mesh.blocks[k].nodes.ravel() for k in keep]))] = 1
    used = np.flatnonzero(rows > 0)
    assert np.all(low[used])
    rows[used] = np.arange(len(used))
    bar = type(mesh)(
        mesh.path,
        mesh.points[used],
        mesh.node_labels[used],
        tuple(
            type(mesh.blocks[k])(mesh.blocks[k].kind, rows[mesh.blocks[k].nodes], mesh.blocks[k].material)
            for k in keep
        ),
        (),
    )
    stiffness, _ = elastic_matrices(discretise(bar), {"soft": soft, "hard": hard})
    x = bar.points[:, 0]
    exact = np.where(x < 1.0, x / 1e10, 1.0 / 1e10 + (x - 1.0) / 4e10)  # under 1 N/m^2
    force = (stiffness @ np.column_stack([exact, 0 * x, 0 * x]).ravel()).reshape(-1, 3)
    inner = (x > 1e-9) & (x < 2.0 - 1e-9)
    assert np.abs(force[inner]).max() < 1e-12
    assert force[x > 2.0 - 1e-9].sum(axis=0) == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)


def test_a_material_that_is_not_given_is_named():
    mesh = mixed_brick(materials=("", "lining", ""))
    with pytest.raises(RomParameterError, match=r"materials.name = 'lining': must be given.*\(given: \"\"\)"):
        elastic_matrices(discretise(mesh), {"": STEEL})


def test_the_same_blade_in_tetrahedra_has_the_frequencies_within_the_error_of_the_mesh():
    blade = BladeParameters(n_blades=72, hub_radius=0.3, length=0.1, chord=0.03, thickness=0.008, twist=15.0)
    shroud = ShroudParameters(angle=70.0, thickness=0.006, axial_width=0.036, contact_length=0.01)
    sector = build_sector(blade, shroud, MeshParameters(size=0.01))
    points, blocks = split_to_tetrahedra(sector.points, sector.hexahedra)
    edges = np.array(ELEMENT_KINDS["tet10"].edges)
    root = np.isin(np.arange(len(points)), sector.node_sets["root"])
    ends, middle = blocks[0].nodes[:, edges], blocks[0].nodes[:, 4:]
    root[middle[root[ends].all(axis=-1)]] = True
    tetrahedra = type(sector)(
        points, tuple(blocks), {"root": np.flatnonzero(root)}, sector.right, sector.left, sector.n_blades
    )
    found, coarse, fine = (
        clamped_hz(full, 6)
        for full in (
            assemble(tetrahedra, STEEL, None),
            assemble(sector, STEEL, "hex20"),
            assemble(build_sector(blade, shroud, MeshParameters(size=0.006)), STEEL, "hex20"),
        )
    )
    error = np.abs(coarse / fine - 1.0).max()
    assert np.abs(found / fine - 1.0).max() < max(2.0 * error, 2e-3)
