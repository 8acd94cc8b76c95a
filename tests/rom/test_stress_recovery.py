"""Nodal stresses: patch test, beam closed forms, large displacements, and CalculiX on the same mesh."""

from dataclasses import replace
from types import SimpleNamespace

import calculix
import numpy as np
import pytest
from element_meshes import KINDS, arched, brick, mixed_brick, moved
from rom_meshes import NODAL, box_sector, distorted_box, mesh_of
from scipy.sparse.linalg import spsolve

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import BoundaryChoice, LoadVectors, Material, ReductionOptions, assemble, modal_model, reduce_sector
from rom.cyclic.receptance import RelativeReceptance
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.rotation import centrifugal_displacement, stiffen_by_rotation
from rom.reduction.modal_forces import with_modal_forces
from rom.stress.hot_spots import Surroundings, hot_spots, point_loads, singular_vertices
from rom.stress.mesh_motion import MeshMotion, SolvedPoint
from rom.stress.operating_stress import nodal_stress, operating_stress
from rom.stress.stress_recovery import StressRecovery, components, von_mises
from rom.units import angular_speed

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0)


def recovery(mesh, element="hex20", base=None, materials=STEEL):
    return StressRecovery.of(discretise(mesh, element), materials, base)


@pytest.mark.parametrize("element", ["hex8", "hex20", "hex27"])
def test_constant_strain_gives_constant_stress_in_distorted_elements(element):
    mesh = mesh_of(*distorted_box((3, 2, 3), (1.0, 0.7, 1.2)))
    nodes = discretise(mesh, element).positions
    gradient = 1e-4 * np.random.default_rng(0).normal(size=(3, 3))
    exact = components(STEEL.law.stress(0.5 * (gradient + gradient.T)))
    for phase in (1.0, 0.3 + 2.0j):
        found = recovery(mesh, element).increments((phase * nodes @ gradient.T)[None])[0]
        np.testing.assert_allclose(found.values, np.tile(phase * exact, (len(nodes), 1)), rtol=1e-9, atol=1e-6)
        assert found.spread.max() < 1e-6 * von_mises(exact)


@pytest.mark.parametrize("kind", [*KINDS, "mixed"])
def test_constant_strain_in_every_kind_of_element_with_curved_edges(kind):
    mesh = mixed_brick(arched) if kind == "mixed" else moved(brick(kind, (2, 2, 2)), 0.1)
    gradient = 1e-4 * np.random.default_rng(0).normal(size=(3, 3))
    exact = components(STEEL.law.stress(0.5 * (gradient + gradient.T)))
    found = recovery(mesh, None).increments((mesh.points @ gradient.T)[None])[0]
    np.testing.assert_allclose(found.values, np.tile(exact, (len(mesh.points), 1)), rtol=1e-8, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "rate"), [("hex8", 0.9), ("tet4", 0.4), ("hex20", 1.9), ("tet10", 1.4), ("wedge15", 1.4)]
)
def test_nodal_stresses_converge_at_the_rate_of_the_element(kind, rate):
    """Interpolated displacements of a smooth field: the stresses of the interpolant against the exact ones."""

    def field(x):
        return 1e-3 * np.column_stack(
            [np.sin(x[:, 1]) * x[:, 2], np.cos(x[:, 0] + x[:, 2]), np.exp(x[:, 0]) * x[:, 1]]
        )

    def exact(x):
        h, step = np.empty((len(x), 3, 3)), 1e-6
        for j in range(3):
            ahead, behind = x.copy(), x.copy()
            ahead[:, j] += step
            behind[:, j] -= step
            h[:, :, j] = (field(ahead) - field(behind)) / (2 * step)
        return components(STEEL.law.stress(0.5 * (h + h.swapaxes(1, 2))))

    errors = []
    for n in (3, 6):
        mesh = brick(kind, (n, n, n), bend=arched)
        found = recovery(mesh, None).increments(field(mesh.points)[None])[0]
        off = von_mises(found.values - exact(mesh.points))
        errors.append(np.sqrt(np.mean(off**2)))
    assert np.log2(errors[0] / errors[1]) > rate


def test_stresses_are_averaged_within_one_material_only():
    soft = Material(young_modulus=7e10, poisson_ratio=0.33, density=2700.0)
    mesh = mixed_brick(materials=("steel", "soft", "steel"))
    gradient = np.diag([1e-3, 0.0, 0.0])
    found = recovery(mesh, None, materials={"steel": STEEL, "soft": soft})
    stress = found.increments((mesh.points @ gradient.T)[None])[0].values
    assert found.names == ("steel", "soft")
    assert len(found.node) > len(mesh.points)  # two places at a node of the interface
    for number, material in enumerate((STEEL, soft)):
        exact = components(material.law.stress(gradient))
        np.testing.assert_allclose(
            stress[found.material == number],
            np.tile(exact, (np.sum(found.material == number), 1)),
            rtol=1e-8,
            atol=1e-3,
        )


@pytest.mark.parametrize("kind", [*KINDS, "mixed"])
def test_free_expansion_causes_no_stress_and_held_expansion_a_pressure(kind):
    warm = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0, expansion=12e-6)
    mesh = mixed_brick(arched) if kind == "mixed" else moved(brick(kind, (2, 2, 2)), 0.1)
    free, _ = nodal_stress(mesh, warm, 12e-6 * 80.0 * mesh.points, None, temperature=80.0)
    held, _ = nodal_stress(mesh, warm, 0.0 * mesh.points, None, temperature=80.0)
    pressure = 2.1e11 * 12e-6 * 80.0 / (1 - 2 * 0.3)
    np.testing.assert_allclose(held.values[:, :3], -pressure, rtol=1e-9)
    assert np.abs(free.values).max() < 1e-8 * pressure


def test_large_rotation_turns_the_stress_and_increments_are_its_derivative():
    mesh = mesh_of(*distorted_box((2, 2, 2), (1.0, 1.0, 1.0)))
    nodes = discretise(mesh, "hex20").positions
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1.0]])
    stretch = np.diag([1.003, 1.0, 0.999])
    base = nodes @ (turn @ stretch - np.eye(3)).T
    strain = 0.5 * (stretch @ stretch - np.eye(3))
    exact = turn @ (stretch @ STEEL.law.stress(strain) @ stretch / np.linalg.det(stretch)) @ turn.T
    found = recovery(mesh, base=base).static(base).values
    np.testing.assert_allclose(found, np.tile(components(exact), (len(nodes), 1)), rtol=1e-7, atol=1.0)
    step = 1e-6 * np.random.default_rng(1).normal(size=nodes.shape)
    ahead, behind = (recovery(mesh, base=at).static(at).values for at in (base + step, base - step))
    increment = recovery(mesh, base=base).increments(step[None])[0].values
    np.testing.assert_allclose(increment, (ahead - behind) / 2, atol=1e-6 * np.abs(increment).max())


def loaded_beam(force, divisions=(4, 4, 12), lengths=(0.02, 0.01, 0.12)):
    """A cantilever and its displacement under nodal forces (n, 3) = force(positions at the free end)."""
    sector = box_sector(divisions, lengths, hub_radius=0.0)
    full = assemble(sector, STEEL)
    nodes = full.positions
    end = np.flatnonzero(nodes[:, 2] > lengths[2] - 1e-9)
    load = np.zeros_like(nodes)
    load[end] = force(nodes[end])
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    moved = np.zeros(full.n_dofs)
    moved[free] = spsolve(full.stiffness[free][:, free].tocsc(), load.ravel()[free])
    stress, node = nodal_stress(sector, STEEL, moved)
    middle = np.abs(nodes[node][:, 2] - lengths[2] / 2) < 1e-9
    return nodes[node][middle], stress.values[middle], load, nodes


def test_bending_and_tension_of_a_beam():
    place, stress, load, _ = loaded_beam(lambda at: np.tile([0.0, 1.0, 0.0], (len(at), 1)))
    force, (width, height) = load[:, 1].sum(), (0.02, 0.01)
    bending = -force * 0.06 * place[:, 1] / (width * height**3 / 12)  # M y / I, the load towards +y
    np.testing.assert_allclose(stress[:, 2], bending, atol=2e-3 * np.abs(bending).max())
    place, stress, load, _ = loaded_beam(lambda at: np.tile([0.0, 0.0, 1.0], (len(at), 1)))
    np.testing.assert_allclose(stress[:, 2], load[:, 2].sum() / (width * height), rtol=2e-3)
    assert np.abs(stress[:, [0, 1, 3, 4, 5]]).max() < 2e-3 * stress[:, 2].max()


def test_torsion_of_a_square_bar():
    side, length = 0.01, 0.08
    place, stress, load, nodes = loaded_beam(
        lambda at: np.column_stack([-at[:, 1], at[:, 0], np.zeros(len(at))]), (6, 6, 12), (side, side, length)
    )
    torque = np.sum(nodes[:, 0] * load[:, 1] - nodes[:, 1] * load[:, 0])
    largest = torque / (0.208 * side**3)  # Saint-Venant, at the middle of the sides
    at = np.argmin(np.linalg.norm(place[:, :2] - (side / 2, 0.0), axis=1))
    assert np.hypot(stress[at, 4], stress[at, 5]) == pytest.approx(largest, rel=0.03)
    corner = np.argmin(np.linalg.norm(place[:, :2] - (side / 2, side / 2), axis=1))
    assert np.hypot(stress[corner, 4], stress[corner, 5]) < 0.15 * largest


@pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")
def test_centrifugal_stress_of_a_blade_is_that_of_calculix(tmp_path):
    sector = blade_sector(0.012)
    full = assemble(sector, STEEL)
    mesh = calculix.quadratic_mesh(sector)
    speed = angular_speed(6000.0)
    calculix.solve(tmp_path, calculix.static_deck(mesh, STEEL, calculix.Rotation(speed)))
    theirs = calculix.nodal_field(tmp_path / "blade.frd", "STRESS")[:, [0, 1, 2, 3, 4, 5]]
    moved = speed**2 * centrifugal_displacement(full)
    from scipy.spatial import cKDTree

    distance, ours = cKDTree(full.positions).query(mesh.points)
    assert distance.max() < 1e-9
    displaced = calculix.nodal_field(tmp_path / "blade.frd", "DISP")
    np.testing.assert_allclose(moved.reshape(-1, 3)[ours], displaced, atol=1e-5 * np.abs(moved).max())
    # CalculiX extrapolates by its 20 shape functions fitted to the 27 Gauss points: so do we for once
    found = recovery(sector)
    like_theirs = calculix.with_serendipity_extrapolation(found)
    exact = like_theirs.increments(moved[None])[0].values[ours]
    np.testing.assert_allclose(exact, theirs, atol=5e-5 * np.abs(theirs).max())
    # our extrapolation differs where the mesh is too coarse, as the spread between elements says
    projected = found.increments(moved[None])[0]
    regular = np.ones(len(full.positions), bool)
    singular = full.vertex_node[np.concatenate(list(singular_vertices(sector).values()))]
    for block in found.blocks:
        regular[block.nodes[np.isin(block.nodes, singular).any(axis=1)]] = False
    off = von_mises(projected.values[ours] - theirs)[regular[ours]]
    assert np.median(off) < 0.02 * von_mises(theirs)[regular[ours]].max()
    assert von_mises(projected.values)[regular].max() == pytest.approx(
        von_mises(theirs)[regular[ours]].max(), rel=0.05
    )


@pytest.mark.skipif(calculix.PROGRAM is None, reason="CalculiX is not installed: no ccx on PATH")
def test_stress_under_contact_forces_on_the_face_is_that_of_calculix(tmp_path):
    """Static part of a solved point: contact forces through the mortar, and the excitation's node, as *CLOAD."""
    sector = blade_sector(0.012)
    full, boundary = assemble(sector, STEEL), BoundaryChoice()
    model = reduce_sector(full, sector, ReductionOptions(modes=3), boundary).model
    modal = modal_model(model, damping_ratio=0.01)
    motion, point = MeshMotion(full, sector, (model, modal), boundary), point_of(model, 1)
    force = motion.forces(point)[0].real.reshape(-1, 3)
    from scipy.spatial import cKDTree

    mesh = calculix.quadratic_mesh(sector)
    _, ours = cKDTree(full.positions).query(mesh.points)
    calculix.solve(tmp_path, calculix.static_deck(mesh, STEEL, forces=force[ours]))
    theirs = calculix.nodal_field(tmp_path / "blade.frd", "STRESS")
    moved = motion.corrected(point)[0].real
    found = calculix.with_serendipity_extrapolation(recovery(sector)).static(moved).values[ours]
    np.testing.assert_allclose(found, theirs, atol=5e-5 * np.abs(theirs).max())


def blade_sector(size):
    blade = BladeParameters(n_blades=72, hub_radius=0.3, length=0.1, chord=0.03, thickness=0.008, twist=20.0)
    shroud = ShroudParameters(angle=70.0, thickness=0.006, axial_width=0.036, contact_length=0.01)
    return build_sector(blade, shroud, MeshParameters(size=size, contact_grid=(2, 2)))


def point_of(model, harmonics, hertz=900.0):
    """A point with contact forces at random, up to a number of harmonics."""
    random = np.random.default_rng(1)
    shape = (harmonics + 1, model.n_contacts, 3)
    force = random.normal(size=shape) + 1j * random.normal(size=shape)
    force[0] = force[0].real
    return SolvedPoint(2 * np.pi * hertz, 0.7, 5.0, force)


def reduced_of(full, sector, modes):
    model = reduce_sector(full, sector, ReductionOptions(modes=modes), NODAL).model
    return model, modal_model(model, rayleigh=(30.0, 2e-7))


def test_the_motion_of_the_mesh_is_that_of_a_direct_solution_of_the_full_model():
    sector = box_sector((3, 3, 4))
    full = assemble(sector, STEEL, element="hex8")
    model, modal = reduced_of(full, sector, 10)
    motion, point = MeshMotion(full, sector, (model, modal), NODAL), point_of(model, 2)
    # forces on the mesh, from the definition: right f, left -f exp(-i h psi), each in its frame
    count = model.n_contacts
    for h in point.harmonics:
        force = np.zeros((len(full.positions), 3), complex)
        turned = -point.contact_force[h] * np.exp(-1j * h * point.phase)
        for face, values in ((sector.right, point.contact_force[h]), (sector.left, turned)):
            for k in range(count):
                force[full.vertex_node[face.nodes[k]]] += values[k] @ face.frame[k]
        if h == 1:
            force[full.vertex_node[sector.node_sets["tip"][0]], 1] += point.force
        np.testing.assert_allclose(motion.forces(point)[h], force.ravel(), atol=1e-12)
    start = motion.corrected(point)
    found, residual = motion.solved(point, start)
    assert residual < 1e-9
    free = motion.free
    shapes = (model.basis @ modal.shapes)[free]
    mass, stiffness = full.mass[free][:, free].toarray(), full.stiffness[free][:, free].toarray()
    damping = mass @ shapes @ np.diag(modal.damping) @ shapes.T @ mass
    for h in point.harmonics:
        omega = h * point.omega
        exact = np.linalg.solve(stiffness - omega**2 * mass + 1j * omega * damping, motion.forces(point)[h][free])
        np.testing.assert_allclose(found[h][free], exact, atol=1e-8 * np.abs(exact).max())
        if h == 0:
            np.testing.assert_allclose(start[h][free], exact, atol=1e-10 * np.abs(exact).max())


def test_coriolis_forces_act_in_the_motion_of_the_mesh():
    """(K - x^2 M + i x (C + W G)) u = f with G u = M (2 w x u) of the mesh, and nearly so where it is corrected."""
    sector, speed = box_sector((3, 3, 4)), 20000.0
    full = stiffen_by_rotation(assemble(sector, STEEL, element="hex8"), sector, STEEL, speed)
    turn = np.kron(np.eye(len(full.positions)), 2.0 * np.array([[0, 0, 0], [0, 0, 1], [0, -1, 0]]))  # w = -e_x
    model = reduce_sector(full, sector, ReductionOptions(modes=20), NODAL).model
    modal = modal_model(model, rayleigh=(30.0, 2e-7), coriolis=True)
    lowest = float(modal.angular_frequency[0]) / (2.0 * np.pi)
    motion, point = MeshMotion(full, sector, (model, modal), NODAL), point_of(model, 2, 0.5 * lowest)
    start = motion.corrected(point)
    found, residual = motion.solved(point, start)
    assert residual < 1e-9
    free = motion.free
    shapes = (model.basis @ modal.shapes)[free]
    mass, stiffness = full.mass[free][:, free].toarray(), full.stiffness[free][:, free].toarray()
    damping = mass @ shapes @ np.diag(modal.damping) @ shapes.T @ mass
    turned = damping + speed * np.pi / 30.0 * mass @ turn[np.ix_(free, free)]
    for h in (1, 2):
        x, force = h * point.omega, motion.forces(point)[h][free]
        exact, without = (
            np.linalg.solve(stiffness - x**2 * mass + 1j * x * each, force) for each in (turned, damping)
        )
        np.testing.assert_allclose(found[h][free], exact, atol=1e-8 * np.abs(exact).max())
        assert np.abs(start[h][free] - exact).max() < 0.02 * np.abs(without - exact).max()


def test_forces_on_the_mesh_are_those_of_the_reduced_model():
    """Loads as vectors, several harmonics with factors, forces on modes: the projection on the modes is the same."""
    sector = box_sector((3, 3, 4))
    full = assemble(sector, STEEL, element="hex8")
    random = np.random.default_rng(3)
    first, third, static = (random.normal(size=full.n_dofs) for _ in range(3))
    for vector in (first, third, static):
        vector[full.fixed] = 0.0
    vectors = LoadVectors(excitation={1: first + 0.5j * third, 3: third}, static=static)
    given = {"loads": replace(NODAL, loads=lambda full: vectors), "node": NODAL}
    for name, boundary in given.items():
        model = reduce_sector(full, sector, ReductionOptions(modes=8), boundary).model
        for changed in (model, with_modal_forces(model, {1: 2.0, 3: 1.0j}, added=name == "loads")):
            modal = modal_model(changed, rayleigh=(30.0, 2e-7))
            point = replace(point_of(changed, 3), harmonic_factors=((2, 0.3j), (3, -0.7)))
            motion = MeshMotion(full, sector, (changed, modal), boundary)
            receptance = RelativeReceptance(modal, point.phase, point.harmonics, point.force, point.harmonic_factors)
            contact = (receptance.adjoint @ point.contact_force.reshape(4, -1, 1))[..., 0]
            exact = receptance.modal_force + contact
            found = motion.forces(point) @ (model.basis @ modal.shapes)
            np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())


def an_l(root=0.0):
    """An L of three kinds of elements and two materials, clamped below."""
    mesh = mixed_brick(materials=("steel", "soft", "steel"))
    sets = {"root": np.flatnonzero(mesh.points[:, 2] < root + 1e-9)}
    return SimpleNamespace(points=mesh.points, blocks=mesh.blocks, node_sets=sets)


def test_singular_places_of_an_l_are_its_inner_edge_its_clamp_and_its_interface():
    body = an_l()
    places = singular_vertices(body)
    x, y, z = body.points.T

    def near(a, b):
        return np.abs(a - b) < 1e-9

    vertices = np.unique(np.concatenate([b.nodes[:, : b.topology.corners].ravel() for b in body.blocks]))
    inner = np.intersect1d(np.flatnonzero(near(x, 1.0) & near(z, 1.0)), vertices)
    np.testing.assert_array_equal(places["re-entrant edge"], inner)
    rim = near(z, 0.0) & (near(x, 0.0) | near(x, 2.0) | near(y, 0.0) | near(y, 1.0))
    np.testing.assert_array_equal(places["clamped edge"], np.intersect1d(np.flatnonzero(rim), vertices))
    met = body.points[places["material interface"]]
    assert len(met) > 6
    assert np.all(near(met[:, 0], 1.0) | (near(met[:, 2], 1.0) & (met[:, 0] >= 1.0 - 1e-9)))
    assert len(places["contact edge"]) == 0


def test_a_pressure_is_no_point_force():
    body = an_l()
    top = np.flatnonzero(np.abs(body.points[:, 2] - 2.0) < 1e-9)
    alone = int(np.argmin(np.linalg.norm(body.points - (0.0, 0.0, 1.0), axis=1)))
    corners = np.intersect1d(top, body.blocks[2].nodes[:, :4])
    assert point_loads(body, corners).tolist() == []
    assert point_loads(body, np.append(corners, alone)).tolist() == [alone]
    assert point_loads(body, corners[:1]).tolist() == corners[:1].tolist()


def test_stress_converges_with_the_modes_and_faster_with_the_static_correction():
    sector = box_sector((3, 3, 6))
    full = assemble(sector, STEEL)
    expansion, correction = [], []
    for modes in (4, 16, 40):
        reduced = reduced_of(full, sector, modes)
        stress = operating_stress(full, sector, STEEL, reduced, NODAL, point_of(reduced[0], 1))
        expansion.append(stress.expansion_error)
        correction.append(stress.model_error)
        assert stress.residual < 1e-9
    assert correction[0] < 0.1 * expansion[0]
    assert correction[2] < 1e-2 * correction[0]
    assert expansion[2] < 0.2 * expansion[0]


@pytest.mark.parametrize("equilibrium", ["linear", "nonlinear"])
def test_static_stress_of_rotation_is_that_of_the_full_model(equilibrium):
    sector = box_sector((3, 3, 6))
    full = stiffen_by_rotation(assemble(sector, STEEL), sector, STEEL, 9000.0, equilibrium)
    reduced = reduced_of(full, sector, 4)
    point = point_of(reduced[0], 1)
    point.contact_force[0] = 0.0
    large = equilibrium == "nonlinear"
    stress = operating_stress(full, sector, STEEL, reduced, NODAL, point, large_displacements=large, check=False)
    moved = angular_speed(9000.0) ** 2 * centrifugal_displacement(full)
    found = recovery(sector, base=moved if large else None)
    exact = found.static(moved).values
    np.testing.assert_allclose(stress.harmonics[0], exact, atol=1e-8 * np.abs(exact).max())
    mid = np.abs(stress.positions[:, 2] - 0.35) < 1e-9  # rho W^2 (r_tip^2 - r^2) / 2 away from the ends
    axial = STEEL.density * angular_speed(9000.0) ** 2 * (0.4**2 - 0.35**2) / 2
    assert stress.harmonics[0, mid, 2].real.mean() == pytest.approx(axial, rel=3e-3)


def test_the_hot_spot_list_keeps_what_converges_apart_from_what_does_not():
    """An airfoil that meets its shroud in a sharp corner, bent by its own rotation, on finer and finer meshes."""
    singular, regular = [], []
    for size in (0.012, 0.006, 0.004):
        sector = blade_sector(size)
        full = assemble(sector, STEEL)
        moved = angular_speed(6000.0) ** 2 * centrifugal_displacement(full)
        found = recovery(sector)
        stress = von_mises(found.static(moved).values)
        places = {cause: full.vertex_node[nodes] for cause, nodes in singular_vertices(sector).items()}
        near = Surroundings.of(found, full.positions, places)
        top = hot_spots(stress, full.positions[found.node], near.size, near.regular, 3)
        assert len(top) == 3
        assert all(near.cause[top] < 0)
        assert stress[top[0]] == stress[near.regular].max()
        regular.append(stress[top[0]])
        singular.append(stress[~near.regular].max())
    assert singular[1] > 1.1 * singular[0]
    assert singular[2] > 1.1 * singular[1]
    assert 0.92 * regular[1] < regular[2] < 1.02 * regular[1]
