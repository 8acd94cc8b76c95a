"""Large displacements: internal forces, tangent, equilibrium in rotation and what the reduced model keeps of it."""

import numpy as np
import pytest
from rom_meshes import box, distorted_box, mesh_of, patch_block, sector_of
from rom_reference import lowest_hz
from scipy.integrate import solve_bvp

from rom import BoundaryChoice, Material, ReductionOptions, assemble, reduce_sector
from rom.finite_elements.assembly import ElasticBody
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.rotation import (
    RotatingBody,
    centrifugal_displacement,
    static_equilibrium,
    stiffen_by_rotation,
)
from rom.linear_algebra.factorisation import factorise

STEEL = Material(2.1e11, 0.3, 7800.0)
RPM = 30.0 / np.pi
FAST = 20_000.0  # rev/min; the strains of the thin blade reach 1 %


def turn_about(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew


def twisted_blade(divisions=(2, 1, 6), lengths=(0.03, 0.003, 0.15), twist=40.0, hub=0.3):
    """A thin plate along z whose sections turn by `twist` degrees from the clamped root to the tip."""
    points, hexahedra = box(divisions, lengths, (-lengths[0] / 2, -lengths[1] / 2, hub))
    angle = np.radians(twist) * (points[:, 2] - hub) / lengths[2]
    x, y = points[:, 0].copy(), points[:, 1].copy()
    points[:, 0], points[:, 1] = x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)
    root = np.flatnonzero(points[:, 2] < hub + 1e-9)
    top = np.flatnonzero(points[:, 2] > hub + lengths[2] - 1e-9)
    return sector_of(points, hexahedra, root, int(top[0]), top[-1:], top[1:2], turn_about([1.0, 2.0, 3.0], 0.7), 40)


def rotating_body(sector, full):
    mesh = discretise(sector, full.element)
    return RotatingBody.of(ElasticBody.of(mesh, STEEL), full)


@pytest.fixture(scope="module")
def blade():
    sector = twisted_blade()
    return sector, assemble(sector, STEEL)


@pytest.mark.parametrize("element", ["hex20", "hex27", "hex8"])
def test_tangent_is_the_derivative_of_the_internal_forces(element):
    mesh = discretise(mesh_of(*distorted_box((2, 2, 2), (0.1, 0.08, 0.12))), element)
    body, rng = ElasticBody.of(mesh, STEEL), np.random.default_rng(3)
    # Displacements of a third of an element and strains of order 1: every term of the tangent counts.
    displacement, direction = rng.normal(scale=0.01, size=(2, 3 * mesh.n_nodes))
    tangent, step = body.tangent(displacement), 1e-4
    ahead, behind = (body.internal_force(displacement + s * direction)[0] for s in (step, -step))
    derivative = (ahead - behind) / (2.0 * step)
    np.testing.assert_allclose(tangent @ direction, derivative, atol=1e-7 * np.abs(derivative).max())
    assert abs(tangent - tangent.T).max() == 0.0
    # Without displacement it is the stiffness of linear elasticity, assembled apart.
    at_rest, linear = body.tangent(np.zeros(3 * mesh.n_nodes)), assemble_free(mesh)
    assert abs(at_rest - linear).max() < 1e-12 * abs(linear).max()


def assemble_free(mesh):
    from rom.finite_elements.assembly import elastic_matrices

    return elastic_matrices(mesh, STEEL)[0]


def test_a_rigid_motion_costs_nothing_and_turns_the_stiffness():
    mesh = discretise(mesh_of(*distorted_box((2, 2, 2), (0.1, 0.08, 0.12))), "hex20")
    body, turn = ElasticBody.of(mesh, STEEL), turn_about([1.0, -2.0, 0.5], 2.0)
    moved = (mesh.positions @ turn.T - mesh.positions + [0.3, 0.1, -0.2]).ravel()
    force, strain = body.internal_force(moved)
    scale = abs(assemble_free(mesh)).max() * 0.1
    assert strain < 1e-12  # of terms of size 1
    assert np.abs(force).max() < 1e-12 * scale
    some = np.random.default_rng(4).normal(size=(mesh.n_nodes, 3))
    turned = body.tangent(moved) @ (some @ turn.T).ravel()
    np.testing.assert_allclose(
        turned.reshape(-1, 3) @ turn, (assemble_free(mesh) @ some.ravel()).reshape(-1, 3), atol=1e-10 * scale / 0.1
    )


def test_stretched_bar_against_its_boundary_value_problem():
    """Radial bar at large strain: (E l (l^2 - 1) / 2)' + rho W^2 (r + u) = 0 with the stretch l = 1 + u'."""
    material = Material(2.1e11, 0.0, 7800.0)
    hub, length, square = 0.3, 0.2, 0.25 * 2.1e11 / 7800.0 / 0.5**2
    points, hexahedra = box((1, 1, 8), (1e-4, 1e-4, length), (-5e-5, -5e-5, hub))
    root, top = (np.flatnonzero(points[:, 2] == z) for z in (points[:, 2].min(), points[:, 2].max()))
    sector = sector_of(points, hexahedra, root, int(top[0]), top[1:2], top[2:3], np.eye(3), 30)
    full = assemble(sector, material)
    mesh = discretise(sector, "hex20")
    displacement = static_equilibrium(RotatingBody.of(ElasticBody.of(mesh, material), full), square)

    def slope(r, state):
        """State: displacement u and stretch l."""
        u, stretch = state
        return np.stack([stretch - 1.0, -2.0 * 7800.0 * square / 2.1e11 * (r + u) / (3.0 * stretch**2 - 1.0)])

    places = np.linspace(hub, hub + length, 50)
    guess = np.stack([np.zeros(50), np.ones(50)])
    exact = solve_bvp(slope, lambda left, right: [left[0], right[1] - 1.0], places, guess, tol=1e-10)
    along = full.positions[:, 2]
    np.testing.assert_allclose(displacement[2::3], exact.sol(along)[0], atol=2e-5 * exact.y[0].max())
    assert exact.y[1].max() > 1.05  # a linear bar would be off by far more
    linear = square * 7800.0 / 2.1e11 * ((hub + length) ** 2 / 2 * length - ((hub + length) ** 3 - hub**3) / 6)
    assert abs(linear / exact.y[0, -1] - 1.0) > 0.01


def test_newton_converges_quadratically_to_the_equilibrium_found(blade):
    sector, full = blade
    rotating, squared = rotating_body(sector, full), (9000.0 / RPM) ** 2
    displacement = squared * centrifugal_displacement(full)
    found = static_equilibrium(rotating, squared)
    errors = []
    for _ in range(6):
        force, _ = rotating.unbalance(displacement, squared)
        errors.append(np.abs(displacement - found).max() / np.abs(found).max())
        displacement[rotating.free] += factorise(rotating.projected(rotating.stiffness(displacement, squared))).solve(
            force
        )
    errors = np.array(errors)
    assert errors[0] > 0.01  # the linear solution is far away
    assert np.abs(displacement - found).max() < 1e-11 * np.abs(found).max()
    fast = np.flatnonzero((errors[:-1] < 1e-2) & (errors[:-1] > 1e-6))
    assert len(fast) >= 1
    assert np.all(errors[fast + 1] < 100.0 * errors[fast] ** 2)


def test_a_load_too_large_for_one_step_is_applied_in_parts(blade, monkeypatch):
    sector, full = blade
    rotating, squared = rotating_body(sector, full), (FAST / RPM) ** 2
    found = static_equilibrium(rotating, squared)
    force, strain = rotating.unbalance(found, squared)
    assert np.abs(force).max() < 1e-8 * squared * np.abs(full.centrifugal).max()
    assert strain < 0.1
    monkeypatch.setattr("rom.finite_elements.rotation._SMALLEST_PART", 0.9)
    assert static_equilibrium(rotating, squared) is None


def test_linear_equilibrium_approaches_the_nonlinear_one_with_the_fourth_power_of_speed():
    sector = twisted_blade(lengths=(0.03, 0.01, 0.15))
    full = assemble(sector, STEEL)

    def squared_frequencies(speed, equilibrium):
        at_speed = stiffen_by_rotation(full, sector, STEEL, speed, equilibrium)
        return lowest_hz(at_speed.stiffness, full.mass, 4, full.fixed) ** 2

    low, high = (
        squared_frequencies(speed, "linear") - squared_frequencies(speed, "nonlinear") for speed in (1200.0, 2400.0)
    )
    np.testing.assert_allclose(high / low, 16.0, rtol=0.01)


def test_linear_equilibrium_has_the_linear_displacement(blade):
    sector, full = blade
    at_speed = stiffen_by_rotation(full, sector, STEEL, 6000.0, "linear")
    exact = centrifugal_displacement(full)
    np.testing.assert_allclose(centrifugal_displacement(at_speed), exact, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize("contact_dofs", ["nodal", "patch"])
def test_reduced_statics_give_the_contact_displacement_of_the_equilibrium(contact_dofs):
    sector = patch_block()
    full = assemble(sector, STEEL)
    at_speed = stiffen_by_rotation(full, sector, STEEL, 60_000.0)
    squared = (60_000.0 / RPM) ** 2
    exact = static_equilibrium(rotating_body(sector, full), squared)
    np.testing.assert_allclose(centrifugal_displacement(at_speed) * squared, exact, atol=1e-9 * np.abs(exact).max())
    linear = centrifugal_displacement(full) * squared
    assert np.abs(linear - exact).max() > 1e-3 * np.abs(exact).max()
    boundary = BoundaryChoice((0.0, 1.0, 0.0), [0.0, 0.005, 0.312], contact_dofs)
    model = reduce_sector(at_speed, sector, ReductionOptions(modes=3), boundary).model
    coordinates = squared * np.linalg.solve(model.stiffness, model.force_centrifugal)
    nodal = exact.reshape(-1, 3)
    tip = nodal[full.vertex_node[sector.node_sets["tip"][0]]]
    found = [coordinates @ model.outputs[f"tip_{axis}"] for axis in "xyz"]
    np.testing.assert_allclose(found, tip, atol=1e-9 * np.abs(tip).max())
    if contact_dofs == "nodal":
        nodes = full.vertex_node[sector.right.nodes]
        right = np.einsum("kij,kj->ki", sector.right.frame, nodal[nodes]).ravel()
        np.testing.assert_allclose(model.contact_right @ coordinates, right, atol=1e-9 * np.abs(right).max())
    else:  # patches of equal size: the mean of their averages is that of the face
        face = mean_over_side(sector, full, nodal)
        found = (model.contact_right @ coordinates).reshape(-1, 3).mean(axis=0)
        np.testing.assert_allclose(found, sector.right.frame[0] @ face, atol=1e-9 * np.abs(face).max())


def mean_over_side(sector, full, nodal):
    """Mean displacement of the +y side of the block: of its serendipity faces, one integral a shape function."""
    mesh = discretise(sector, "hex20")
    side = mesh.positions[:, 1].max()
    weights = np.zeros(mesh.n_nodes)
    for nodes in mesh.blocks[0].nodes:
        on_side = nodes[np.abs(mesh.positions[nodes, 1] - side) < 1e-12]
        if len(on_side) == 8:
            place = mesh.positions[on_side]
            middle = (place.min(axis=0) + place.max(axis=0)) / 2
            half_way = np.sum(np.abs(place - middle)[:, [0, 2]] < 1e-12, axis=1) == 1
            weights[on_side] += np.where(half_way, 1.0 / 3.0, -1.0 / 12.0)  # integrals over the 8-node square
    return weights @ nodal / weights.sum()
