"""Contact dofs that are averages over patches: the averages themselves, statics, modes, symmetry, mesh size."""

from dataclasses import replace

import numpy as np
import pytest
from rom_meshes import NODAL, box_sector, patch_block
from rom_reference import lowest_hz
from scipy.sparse import csr_matrix, identity, kron
from scipy.sparse.linalg import spsolve

from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
from rom import (
    BoundaryChoice,
    Material,
    ReductionOptions,
    RomParameterError,
    assemble,
    natural_frequencies,
    reduce_sector,
)
from rom.cyclic.reduced_model import expand_to_mesh
from rom.finite_elements.discretisation import discretise
from rom.reduction.contact_dofs import patch_averages
from rom.reduction.mode_selection import reduce_to_tolerance
from rom.reduction.model_comparison import LinearOperation, linear_errors, linear_responses
from rom.reduction.reference_model import full_reference, static_error

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
MODES = ReductionOptions(modes=12)
PATCH = BoundaryChoice(contact_dofs="patch")
BLADE = BladeParameters(n_blades=72, hub_radius=0.3, length=0.1, chord=0.03, thickness=0.008, twist=20.0)
SHROUD = ShroudParameters(angle=70.0, thickness=0.006, axial_width=0.036, contact_length=0.01)


def averages_of(sector, element="hex20"):
    return patch_averages(discretise(sector, element), sector)


def vector_averages(sector, element="hex20"):
    """Displacement averages in the contact frames, (6 n_c, 3n)."""
    frames = np.concatenate([sector.right.frame, sector.left.frame])
    size = len(frames)
    rotation = csr_matrix((3 * size, 3 * size)).tolil()
    for k, frame in enumerate(frames):
        rotation[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = frame
    return (rotation @ kron(averages_of(sector, element), identity(3))).tocsr()


@pytest.fixture(scope="module")
def sector():
    return build_sector(BLADE, SHROUD, MeshParameters(size=0.006))


@pytest.fixture(scope="module")
def full(sector):
    return assemble(sector, STEEL)


@pytest.fixture(scope="module")
def model(full, sector):
    return reduce_sector(full, sector, MODES, PATCH).model


@pytest.mark.parametrize("element", ["hex8", "hex20", "hex27"])
@pytest.mark.parametrize(("divisions", "grid"), [((6, 2, 6), (3, 3)), ((12, 1, 4), (2, 1)), ((2, 1, 2), (1, 1))])
def test_averages_of_polynomials_are_those_of_the_rectangles(element, divisions, grid):
    lengths = (0.012, 0.01, 0.009)
    sector = patch_block(divisions, lengths, grid)
    nodes = discretise(sector, element)
    weights = patch_averages(nodes, sector)
    x, _, z = (nodes.positions - [0.0, 0.0, 0.3]).T
    a, b = lengths[0] / grid[0] / 2, lengths[2] / grid[1] / 2
    for side, face in enumerate((sector.right, sector.left)):
        rows = weights[side * len(face.nodes) : (side + 1) * len(face.nodes)]
        cx, cz = face.position[:, 0], face.position[:, 2] - 0.3
        exact = [(1.0 + 0.0 * x, 1.0 + 0.0 * cx), (x, cx), (z, cz), (x * z, cx * cz)]
        if element != "hex8":  # these are linear between the corners
            exact += [(x**2, cx**2 + a**2 / 3), (z**2, cz**2 + b**2 / 3)]
        for values, average in exact:
            np.testing.assert_allclose(rows @ values, average, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("angle", [70.0, 90.0, 120.0, 180.0])
@pytest.mark.parametrize("size", [0.006, 0.0026])
def test_patches_of_the_shroud_are_equal_parts_of_its_faces(angle, size):
    sector = build_sector(BLADE, replace(SHROUD, angle=angle), MeshParameters(size=size, contact_grid=(3, 2)))
    nodes = discretise(sector, "hex20")
    weights = patch_averages(nodes, sector)
    np.testing.assert_allclose(np.asarray(weights.sum(axis=1)).ravel(), 1.0, atol=1e-13)
    half = len(sector.right.nodes)
    face = {side: getattr(sector, side).position for side in ("right", "left")}
    centroid = weights @ nodes.positions
    # Equal parts are centred on their nodes but for the curvature and the wedge shape of the face.
    np.testing.assert_allclose(centroid[:half], face["right"], atol=3e-5)
    np.testing.assert_allclose(centroid[half:], face["left"], atol=3e-5)
    # Left is right turned back by one pitch, patch by patch.
    pitch = 2 * np.pi / sector.n_blades
    back = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    np.testing.assert_allclose(centroid[half:], centroid[:half] @ back.T, atol=1e-12)


def test_rigid_motions_and_the_forces_of_patches(sector, full):
    weights = averages_of(sector)
    centroid = weights @ full.positions
    rng = np.random.default_rng(3)
    shift, turn = rng.standard_normal((2, 3))
    rigid = shift + np.cross(turn, full.positions)
    np.testing.assert_allclose(weights @ rigid, shift + np.cross(turn, centroid), atol=1e-13)
    force = rng.standard_normal((weights.shape[0], 3))
    nodal = weights.T @ force
    np.testing.assert_allclose(nodal.sum(axis=0), force.sum(axis=0), atol=1e-12)
    for k, part in enumerate(force):  # one patch alone: no moment about its centroid
        spread = weights[k].toarray().ravel()[:, None] * part
        np.testing.assert_allclose(np.cross(full.positions - centroid[k], spread).sum(axis=0), 0.0, atol=1e-12)


def test_contact_rows_are_the_averages_of_the_basis(model, full, sector):
    rows = vector_averages(sector) @ model.basis
    np.testing.assert_allclose(rows, np.vstack([model.contact_right, model.contact_left]), atol=1e-10)
    np.testing.assert_array_equal(model.contact_right, np.eye(model.size)[: 3 * model.n_contacts])
    assert not np.any(model.basis[full.fixed])
    assert "patch contact dofs" in model.producer
    for reduced, matrix in ((model.stiffness, full.stiffness), (model.mass, full.mass)):
        projected = model.basis.T @ (matrix @ model.basis)
        assert np.max(np.abs(projected - reduced)) < 1e-9 * np.max(np.abs(projected))
    np.testing.assert_allclose(
        model.force_centrifugal,
        model.basis.T @ full.centrifugal,
        rtol=1e-9,
        atol=1e-12 * np.abs(full.centrifugal).sum(),
    )


def test_statics_are_those_of_the_full_model_under_tractions(model, full, sector):
    averages = vector_averages(sector)
    force = np.random.default_rng(5).standard_normal(averages.shape[0])
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    moved = np.zeros(full.n_dofs)
    moved[free] = spsolve(full.stiffness[free][:, free].tocsc(), (averages.T @ force)[free])
    load = np.vstack([model.contact_right, model.contact_left]).T @ force
    coordinates = np.linalg.solve(model.stiffness, load)
    exact = averages @ moved
    found = coordinates[: len(force)]
    assert np.max(np.abs(found - exact)) < 1e-9 * np.max(np.abs(exact))
    whole = expand_to_mesh(model, coordinates).ravel()  # on the whole mesh too
    assert np.max(np.abs(whole - moved)) < 1e-9 * np.max(np.abs(moved))


def test_frequencies_converge_to_those_of_the_full_model(full, sector):
    normal, tangential = 2e6, 1.5e6
    phase = 2 * np.pi * 24 / sector.n_blades
    averages, half = vector_averages(sector), 3 * len(sector.right.nodes)
    motion = averages[:half] - np.exp(1j * phase) * averages[half:]
    springs = np.tile([tangential, tangential, normal], half // 3)
    stiffness = full.stiffness + motion.conj().T @ (csr_matrix(np.diag(springs)) @ motion)
    exact = lowest_hz(stiffness, full.mass, 6, full.fixed)
    errors = []
    for modes in (10, 20, 40):
        reduced = reduce_sector(full, sector, ReductionOptions(modes=modes, store_basis=False), PATCH).model
        found = natural_frequencies(reduced, phase, normal=normal, tangential=tangential, count=6)
        errors.append(found / exact - 1)
    worst = np.max(errors, axis=1)
    assert np.min(errors) > -1e-8
    assert np.all(np.diff(errors, axis=0) < 1e-8)
    assert np.all(worst[:-1] > 2 * worst[1:])
    assert worst[-1] < 4e-4


def test_a_half_turn_exchanges_the_faces(model, sector):
    """The mesh is its own image under a half turn about the stacking axis; so must be the contact dofs."""
    n_c = model.n_contacts
    contact = np.vstack([model.contact_right, model.contact_left])
    flexibility = (contact @ np.linalg.solve(model.stiffness, contact.T)).reshape(2, n_c, 3, 2, n_c, 3)
    turned = sector.left.position * [-1.0, -1.0, 1.0]
    image = np.argmin(np.linalg.norm(sector.right.position[:, None] - turned, axis=-1), axis=0)
    # In the images of the frames t1 and n are reversed, t2 is not.
    sign = np.array([-1.0, 1.0, -1.0])
    frames = sector.left.frame * [-1.0, -1.0, 1.0] * sign[:, None]
    np.testing.assert_allclose(frames, sector.right.frame[image], atol=1e-12)
    left = flexibility[1, :, :, 1] * sign[:, None, None] * sign
    right = flexibility[0][image][:, :, 0][:, :, image]
    assert np.max(np.abs(left - right)) < 1e-9 * np.max(np.abs(right))


def test_reference_and_automatic_choice_hold_for_patches(full, sector):
    n_c = len(sector.right.nodes)
    operation = LinearOperation((400.0, 3000.0), np.pi, np.full(n_c, 2e5), np.full(n_c, 1.5e5), damping_ratio=0.003)
    reference = full_reference(full, sector, 3000.0, PATCH)
    made = reduce_to_tolerance(full, sector, 1e-2, [operation], PATCH, store_basis=False)
    assert static_error(made.model, reference.flexibility) < 1e-9
    exact = linear_responses(reference.model, operation)
    errors = linear_errors(linear_responses(made.model, operation, exact), exact, operation.frequency_hz)
    true = max(error.worst for error in errors)
    assert true <= 1e-2
    assert made.error == pytest.approx(true, rel=2e-2)
    nodal = full_reference(full, sector, 3000.0, NODAL)
    assert static_error(made.model, nodal.flexibility) > 1e-4


@pytest.mark.parametrize("element", ["hex8", "hex20"])
def test_a_loaded_contact_node_stays_a_node(element):
    sector = patch_block()
    full = assemble(sector, STEEL, element)
    at = sector.right.position[4]
    model = reduce_sector(full, sector, MODES, replace(PATCH, excitation_at=at)).model
    assert model.size == 6 * model.n_contacts + 6 + 12
    coordinates = np.random.default_rng(1).standard_normal(model.size)
    node = full.vertex_node[sector.right.nodes[4]]
    assert model.outputs["tip"] @ coordinates == pytest.approx(expand_to_mesh(model, coordinates)[node, 1], rel=1e-10)
    averages = vector_averages(sector, element) @ expand_to_mesh(model, coordinates).ravel()
    np.testing.assert_allclose(averages, coordinates[: len(averages)], atol=1e-9)
    # Which nodes give way to the averages does not matter: the natural frequencies are those without this load
    # but for the modes left out.
    free = lowest_hz(full.stiffness, full.mass, 3, full.fixed)
    np.testing.assert_allclose(natural_frequencies(model, 0.0, count=3), free, rtol=2e-3)


def test_compliance_of_a_patch_converges_where_that_of_a_node_grows():
    found = {"nodal": [], "patch": []}
    for n in (2, 4, 8):
        sector = patch_block((n, n, n), (0.01, 0.01, 0.01), grid=(1, 1))
        full = assemble(sector, STEEL)
        for dofs, values in found.items():
            model = reduce_sector(
                full, sector, ReductionOptions(modes=0, store_basis=False), BoundaryChoice(contact_dofs=dofs)
            ).model
            right = model.contact_right
            values.append(np.diag(right @ np.linalg.solve(model.stiffness, right.T)))
    nodal, patch = np.diff(found["nodal"], axis=0), np.diff(found["patch"], axis=0)
    assert np.all(nodal[1] > 1.5 * nodal[0])  # a point force: like 1 / h
    assert np.all(np.abs(patch[1]) < 0.5 * np.abs(patch[0]))
    assert np.all(np.abs(patch[1]) < 0.02 * np.array(found["patch"][-1]))


def test_what_cannot_be_had_is_refused_in_one_line():
    sector = box_sector(divisions=(2, 2, 4))
    full = assemble(sector, STEEL, "hex8")
    block = patch_block((2, 1, 2), grid=(1, 1))
    doubled = {
        side: replace(
            face,
            nodes=np.repeat(face.nodes, 2),
            position=np.repeat(face.position, 2, axis=0) + shift,
            frame=np.repeat(face.frame, 2, axis=0),
            area=np.repeat(face.area, 2),
        )
        for side, face in (("right", block.right), ("left", block.left))
        for shift in ([[0, 0, 0], [0, 0.1, 0]],)
    }
    far = replace(block, **doubled)
    with pytest.raises(RomParameterError) as bad:
        BoundaryChoice(contact_dofs="lumped")
    with pytest.raises(RomParameterError) as no_face:
        reduce_sector(full, sector, MODES, PATCH)
    with pytest.raises(RomParameterError) as no_patch:
        reduce_sector(assemble(block, STEEL, "hex8"), far, MODES, PATCH)
    for caught in (bad, no_face, no_patch):
        assert (caught.value.table, caught.value.parameter) == ("rom", "contact_dofs")
        assert "\n" not in str(caught.value)
