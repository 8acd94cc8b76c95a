"""The reduced model against the full one: frequencies, statics, convergence, and the order of its coordinates."""

import weakref
from dataclasses import replace

import numpy as np
import pytest
from rom_meshes import NODAL, annulus, box_sector, ring_sector
from rom_reference import lowest_hz, spring_stiffness
from scipy.linalg import eigh, null_space
from scipy.sparse.linalg import spsolve

import rom.reduction.craig_bampton
from geometry import ElementBlock
from rom import (
    BoundaryChoice,
    FactorisationError,
    Material,
    ReducedModelError,
    ReductionOptions,
    RomParameterError,
    assemble,
    natural_frequencies,
    reduce_sector,
)
from rom.cyclic.natural_frequencies import mode_shapes
from rom.cyclic.reduced_model import expand_to_mesh

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
SPRINGS = {"free": (0.0, 0.0), "sliding": (2e7, 0.0), "stuck": (2e7, 1.5e7)}


@pytest.fixture(scope="module")
def sector():
    return box_sector()


@pytest.fixture(scope="module")
def full(sector):
    return assemble(sector, STEEL)


@pytest.fixture(scope="module")
def model(full, sector):
    return reduce_sector(full, sector, ReductionOptions(modes=20), NODAL).model


def test_coordinates_are_right_left_tip_and_modes(model, full, sector):
    n_c = model.n_contacts
    assert n_c == len(sector.right.nodes)
    assert model.size == 6 * n_c + 3 + 20
    np.testing.assert_array_equal(model.contact_right, np.eye(model.size)[: 3 * n_c])
    np.testing.assert_array_equal(model.contact_left, np.eye(model.size)[3 * n_c : 6 * n_c])
    np.testing.assert_array_equal(model.outputs["tip_z"], np.eye(model.size)[6 * n_c + 2])
    np.testing.assert_array_equal(model.outputs["tip"], model.outputs["tip_y"])
    np.testing.assert_array_equal(model.force_excitation, model.outputs["tip"])
    assert model.n_blades == sector.n_blades
    # Seen from the mesh: the basis moves each contact node along its own frame.
    right = full.vertex_node[sector.right.nodes]
    moved = expand_to_mesh(model, np.eye(model.size)[: 3 * n_c])[:, right]
    expected = np.zeros((3 * n_c, n_c, 3))
    for node in range(n_c):
        expected[3 * node : 3 * node + 3, node] = sector.right.frame[node]
    np.testing.assert_allclose(moved, expected, atol=1e-13)  # of unit vectors


def test_reduced_matrices_are_those_of_the_basis(model, full):
    basis = model.basis
    for reduced, matrix in ((model.stiffness, full.stiffness), (model.mass, full.mass)):
        np.testing.assert_array_equal(reduced, reduced.T)
        projected = basis.T @ (matrix @ basis)
        assert np.max(np.abs(projected - reduced)) < 1e-9 * np.max(np.abs(projected))
    np.testing.assert_allclose(model.force_centrifugal, basis.T @ full.centrifugal, rtol=1e-9, atol=1e-12)
    assert not np.any(basis[full.fixed])


@pytest.mark.parametrize("contact", SPRINGS)
def test_natural_frequencies_agree_with_the_full_model(full, sector, contact):
    normal, tangential = SPRINGS[contact]
    phase = 2 * np.pi * 7 / sector.n_blades
    stiffness = full.stiffness + spring_stiffness(full, sector, phase, normal, tangential)
    exact = lowest_hz(stiffness, full.mass, 8, full.fixed)
    errors = []
    for modes in (10, 20, 40, 80):
        reduced = reduce_sector(full, sector, ReductionOptions(modes=modes, store_basis=False), NODAL).model
        found = natural_frequencies(reduced, phase, normal=normal, tangential=tangential, count=8)
        errors.append(found / exact - 1)
    worst = np.max(errors, axis=1)
    # Rayleigh-Ritz in nested spaces: from above, never worse with more modes, and soon good.
    assert np.min(errors) > -1e-9
    assert np.all(np.diff(errors, axis=0) < 1e-9)
    assert np.all(worst[:-1] > 5 * worst[1:])
    assert np.all(worst < [3e-2, 2e-3, 3e-4, 5e-5])


def test_static_responses_at_the_boundary_dofs_are_exact(model, full, sector):
    rng = np.random.default_rng(2)
    boundary = full.vertex_node[np.concatenate([sector.right.nodes, sector.left.nodes, sector.node_sets["tip"]])]
    frames = [*sector.right.frame, *sector.left.frame, np.eye(3)]
    contact_load = rng.standard_normal(3 * len(boundary))
    load = 50.0 * full.centrifugal
    for node, frame, part in zip(boundary, frames, contact_load.reshape(-1, 3), strict=True):
        load[3 * node : 3 * node + 3] += frame.T @ part
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    exact = np.zeros(full.n_dofs)
    exact[free] = spsolve(full.stiffness[free][:, free].tocsc(), load[free])
    exact_boundary = [frame @ exact[3 * node : 3 * node + 3] for node, frame in zip(boundary, frames, strict=True)]
    reduced_load = 50.0 * model.force_centrifugal
    reduced_load[: 3 * len(boundary)] += contact_load
    found = np.linalg.solve(model.stiffness, reduced_load)[: 3 * len(boundary)]
    assert np.max(np.abs(found - np.concatenate(exact_boundary))) < 1e-10 * np.max(np.abs(found))


def test_loads_at_the_boundary_dofs_alone_are_exact_on_the_whole_mesh(model, full):
    coordinates = np.linalg.solve(model.stiffness, model.force_excitation)
    displacement = expand_to_mesh(model, coordinates).ravel()
    residual = full.stiffness @ displacement
    tip = int(np.argmin(np.sum((full.positions - [0.0, 0.0, 0.4]) ** 2, axis=1)))
    residual[3 * tip + 1] -= 1.0
    residual[full.fixed] = 0.0
    assert np.max(np.abs(residual)) < 1e-9


@pytest.mark.parametrize("contact", SPRINGS)
def test_forward_and_backward_waves_have_the_same_frequencies(model, contact):
    normal, tangential = SPRINGS[contact]
    for phase in (0.3, 2.0, np.pi):
        waves = [natural_frequencies(model, sign * phase, normal=normal, tangential=tangential) for sign in (1, -1)]
        np.testing.assert_allclose(waves[0], waves[1], rtol=1e-9)
        turned = natural_frequencies(model, phase + 2 * np.pi, normal=normal, tangential=tangential)
        np.testing.assert_allclose(turned, waves[0], rtol=1e-9)


def test_free_frequencies_do_not_depend_on_the_phase(model):
    # the springs are 0 at any phase; round-off of eigenvalues goes with the largest of them
    np.testing.assert_allclose(natural_frequencies(model, 0.0), natural_frequencies(model, 2.2), rtol=1e-9)


def test_very_stiff_springs_in_phase_are_a_constraint(model):
    found = natural_frequencies(model, 0.0, normal=1e14, tangential=1e14, count=6)
    together = null_space(model.contact_right - model.contact_left)
    squared = eigh(together.T @ model.stiffness @ together, together.T @ model.mass @ together, eigvals_only=True)
    np.testing.assert_allclose(found, np.sqrt(squared[:6]) / (2 * np.pi), rtol=1e-4)


@pytest.mark.parametrize("diameter", [0, 1, 3, 5])
def test_sectors_stuck_together_are_the_whole_ring(diameter):
    """Travelling-wave convention, frames and phase at once: hex8, so that every node of a face is in contact."""
    sizes, thickness = (0.1, 0.2), 0.03
    sector = ring_sector((3, 2, 1), *sizes, thickness, 10)
    model = reduce_sector(assemble(sector, STEEL, "hex8"), sector, ReductionOptions(modes=30), NODAL).model
    phase = 2 * np.pi * diameter / 10
    found = natural_frequencies(model, phase, normal=1e14, tangential=1e14, count=3)
    points, hexahedra = annulus((3, 20, 1), *sizes, thickness)
    ring = box_sector()
    bore = np.flatnonzero(np.hypot(points[:, 1], points[:, 2]) < sizes[0] + 1e-9)
    whole = assemble(
        type(ring)(points, (ElementBlock("hex8", hexahedra),), {"root": bore}, ring.right, ring.left, ring.n_blades),
        STEEL,
        "hex8",
    )
    all_hz = lowest_hz(whole.stiffness, whole.mass, 40, whole.fixed)
    for value in found:
        gap = np.sort(np.abs(all_hz / value - 1))
        assert gap[0] < 2e-4
        # Diameters other than 0 and half the number of sectors come as pairs of waves, forward and backward.
        if diameter in (1, 3):
            assert gap[1] < 2e-4


def test_shapes_on_the_mesh_are_mass_normalised_modes(model, full, sector):
    phase = 1.1
    hz, shapes = mode_shapes(model, phase, normal=2e7, tangential=1.5e7, count=4)
    np.testing.assert_array_equal(hz, natural_frequencies(model, phase, normal=2e7, tangential=1.5e7, count=4))
    assert shapes.shape == (4, len(full.positions), 3)
    flat = shapes.reshape(4, -1)
    np.testing.assert_allclose(flat.conj() @ (full.mass @ flat.T), np.eye(4), atol=1e-9)
    stiffness = full.stiffness + spring_stiffness(full, sector, phase, 2e7, 1.5e7)
    quotient = np.real(np.sum(flat.conj() * (stiffness @ flat.T).T, axis=1))
    np.testing.assert_allclose(quotient, (2 * np.pi * hz) ** 2, rtol=1e-7)


def test_modes_up_to_a_frequency_limit(full, sector):
    hz = reduced_interface_hz(reduce_sector(full, sector, ReductionOptions(modes=60), NODAL).model)
    for wanted in (3, 27):
        limit = (hz[wanted - 1] + hz[wanted]) / 2
        model = reduce_sector(full, sector, ReductionOptions(modes=None, frequency_limit=limit), NODAL).model
        np.testing.assert_allclose(reduced_interface_hz(model), hz[:wanted], rtol=1e-9)
    none = reduce_sector(full, sector, ReductionOptions(frequency_limit=1.0), NODAL).model
    assert (
        none.size
        == reduce_sector(full, sector, ReductionOptions(modes=0), NODAL).model.size
        == 6 * none.n_contacts + 3
    )


def reduced_interface_hz(model):
    boundary = 6 * model.n_contacts + 3
    np.testing.assert_array_equal(model.mass[boundary:, boundary:], np.eye(model.size - boundary))
    return np.sqrt(np.diag(model.stiffness)[boundary:]) / (2 * np.pi)


def test_backends_and_repeated_runs_give_the_same_model(full, sector):
    pytest.importorskip("cvxopt")
    options = [ReductionOptions(modes=12, backend=backend) for backend in ("cholmod", "superlu", "cholmod")]
    first, other, again = (reduce_sector(full, sector, option, NODAL).model for option in options)
    assert "cholmod" in first.producer
    assert "superlu" in other.producer
    for name in ("mass", "stiffness", "basis", "force_centrifugal"):
        value = getattr(first, name)
        np.testing.assert_array_equal(value, getattr(again, name))
        assert np.max(np.abs(value - getattr(other, name))) < 1e-8 * np.max(np.abs(value))
    for normal, tangential in SPRINGS.values():
        pair = [natural_frequencies(m, 0.7, normal=normal, tangential=tangential) for m in (first, other)]
        np.testing.assert_allclose(pair[0], pair[1], rtol=1e-10)


def test_excitation_elsewhere_adds_and_observes_that_node(full, sector):
    place, direction = [0.015, 0.01, 0.35], [3.0, 0.0, 4.0]
    model = reduce_sector(full, sector, ReductionOptions(), BoundaryChoice(direction, place, "nodal")).model
    boundary = 6 * model.n_contacts
    expected = np.zeros(model.size)
    expected[boundary + 3 : boundary + 6] = [0.6, 0.0, 0.8]
    np.testing.assert_allclose(model.force_excitation, expected, atol=1e-13)  # of unit vectors
    np.testing.assert_array_equal(model.outputs["tip"], model.force_excitation)
    node = int(np.argmin(np.sum((full.positions - place) ** 2, axis=1)))
    found = expand_to_mesh(model, np.eye(model.size)[boundary + 3 : boundary + 6])[:, node]
    np.testing.assert_array_equal(found, np.eye(3))


def test_excitation_at_a_contact_node_uses_its_frame(full, sector):
    position = sector.right.position[4]
    model = reduce_sector(full, sector, ReductionOptions(modes=3), BoundaryChoice((1, 0, 0), position, "nodal")).model
    assert model.size == 6 * model.n_contacts + 3 + 3
    expected = np.zeros(model.size)
    expected[12:15] = sector.right.frame[4] @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(model.force_excitation, expected, atol=1e-13)  # of unit vectors


@pytest.mark.parametrize(
    ("keywords", "parameter"),
    [
        ({"excitation_direction": (0, 0, 0)}, "direction"),
        ({"excitation_direction": (0, 1)}, "direction"),
        ({"excitation_direction": (0, float("nan"), 1)}, "direction"),
        ({"excitation_at": "root"}, "at"),
        ({"excitation_at": (0.0, 1.0)}, "at"),
        ({"excitation_at": (0.0, 0.0, 0.3)}, "at"),
    ],
)
def test_bad_excitation_is_refused_in_one_line(full, sector, keywords, parameter):
    with pytest.raises(RomParameterError) as caught:
        reduce_sector(full, sector, ReductionOptions(), replace(NODAL, **keywords))
    assert (caught.value.table, caught.value.parameter) == ("excitation", parameter)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("keywords", "parameter"),
    [
        ({"modes": None}, "modes"),
        ({"modes": -1}, "modes"),
        ({"modes": 2.5}, "modes"),
        ({"modes": "many"}, "modes"),
        ({"modes": True}, "modes"),
        ({"frequency_limit": "high"}, "frequency_limit"),
        ({"frequency_limit": 0.0}, "frequency_limit"),
        ({"frequency_limit": float("nan")}, "frequency_limit"),
    ],
)
def test_bad_options_are_refused(keywords, parameter):
    with pytest.raises(RomParameterError) as caught:
        ReductionOptions(**keywords)
    assert caught.value.parameter == parameter


def test_model_without_basis_does_not_expand(full, sector):
    model = reduce_sector(full, sector, ReductionOptions(modes=2, store_basis=False), NODAL).model
    assert model.basis is None
    with pytest.raises(ReducedModelError, match="basis: missing"):
        mode_shapes(model, 0.0)


def test_structure_that_is_not_held_is_refused(full, sector):
    from dataclasses import replace

    drifting = replace(full, fixed=np.zeros(0, dtype=int), stiffness=0.0 * full.stiffness)
    with pytest.raises(FactorisationError):
        reduce_sector(drifting, sector, ReductionOptions(modes=2), NODAL)


def test_asking_for_more_modes_than_there_are_gives_all_of_them():
    sector = box_sector(divisions=(2, 1, 3), lengths=(0.02, 0.02, 0.03))
    full = assemble(sector, STEEL, "hex8")
    model = reduce_sector(full, sector, ReductionOptions(modes=500), NODAL).model
    interior = full.n_dofs - len(full.fixed) - 6 * model.n_contacts - 3
    assert model.size - 6 * model.n_contacts - 3 == interior


def test_a_full_model_that_is_made_on_the_way_does_not_stay(full, sector, model, monkeypatch):
    """Beside the factor of a large mesh there is no room for it."""
    seen, alive = [], []

    def make():
        made = assemble(sector, STEEL)
        seen.append(weakref.ref(made))
        return made

    def watched(*arguments):
        alive.append(seen[0]() is not None)
        return modes(*arguments)

    modes = rom.reduction.craig_bampton.lowest_modes
    monkeypatch.setattr(rom.reduction.craig_bampton, "lowest_modes", watched)
    made = reduce_sector(make, sector, ReductionOptions(modes=20), NODAL)
    assert alive == [False]
    assert made.dofs == full.n_dofs
    for name in ("mass", "stiffness", "basis", "force_centrifugal"):
        np.testing.assert_array_equal(getattr(made.model, name), getattr(model, name))
