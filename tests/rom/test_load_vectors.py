"""Loads and outputs as vectors: the reduced model against the full one, static response and receptance."""

from dataclasses import replace

import numpy as np
import pytest
from rom_meshes import NODAL, box_sector, patch_block
from scipy.sparse.linalg import spsolve

from rom import (
    BoundaryChoice,
    LoadVectors,
    Material,
    ReducedModelError,
    ReductionOptions,
    RomParameterError,
    assemble,
    modal_model,
    natural_frequencies,
    read_reduced_model,
    reduce_sector,
    write_reduced_model,
)
from rom.finite_elements.loads import nearest_vertices, nodal_force
from rom.reduction.modal_forces import with_modal_forces
from rom.reduction.mode_selection import reduce_to_tolerance, reduction_errors
from rom.reduction.model_comparison import LinearOperation
from rom.reduction.reference_model import full_reference

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)


@pytest.fixture(scope="module")
def sector():
    return box_sector((3, 2, 6))


@pytest.fixture(scope="module")
def full(sector):
    return assemble(sector, STEEL)


def vectors(full):
    """Two excitations, a static force and two outputs, none of them at a boundary dof."""
    rng = np.random.default_rng(5)
    nodes, _ = nearest_vertices(full, [[-0.015, 0.01, 0.35], [0.015, -0.01, 0.35], [0.0, 0.01, 0.383]])
    wave = nodal_force(full, nodes, rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3)))
    second = nodal_force(full, nodes[1:], [0.0, 1.0, 0.0])
    static = nodal_force(full, nodes, [1.0, 0.0, 0.5])
    outputs = {
        "mid": nodal_force(full, nodes[:1], [0.0, 1.0, 0.0]),
        "stretch": nodal_force(full, nodes[:2], [[0.0, 0.0, 40.0], [0.0, 0.0, -40.0]]),
    }
    return LoadVectors({1: wave, 2: second}, static, outputs)


def solved(full, force, omega=0.0, zeta=0.0):
    """Displacements (N,) of the full model, the root clamped: plain SciPy."""
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    dynamic = full.stiffness[free][:, free] * (1.0 + 2j * zeta) - omega**2 * full.mass[free][:, free]
    motion = np.zeros(full.n_dofs, dtype=complex)
    motion[free] = spsolve(dynamic.tocsc().astype(complex), force[free])
    return motion


@pytest.mark.parametrize("modes", [0, 6])
def test_static_response_is_that_of_the_full_model(full, sector, modes):
    """Of every output to every force: with the attachment modes it does not depend on the modes kept."""
    loads = vectors(full)
    boundary = BoundaryChoice(contact_dofs="nodal", loads=vectors)
    model = reduce_sector(full, sector, ReductionOptions(modes=modes), boundary).model
    plain = reduce_sector(full, sector, ReductionOptions(modes=modes), NODAL).model
    assert model.size == plain.size + np.linalg.matrix_rank(loads.columns())
    forces = {
        "excitation": (model.force_excitation, loads.excitation[1]),
        "second": (model.force_harmonics[2], loads.excitation[2]),
        "static": (model.force_static, loads.static),
    }
    tip = 3 * full.vertex_node[sector.node_sets["tip"][0]] + 1
    rows = {**loads.outputs, "tip": np.eye(1, full.n_dofs, tip)[0]}
    for reduced, force in forces.values():
        motion = solved(full, force)
        q = np.linalg.solve(model.stiffness.astype(complex), reduced)
        for name, row in rows.items():
            assert model.outputs[name] @ q == pytest.approx(row @ motion, rel=1e-8), name
    # the mesh displacements too
    np.testing.assert_allclose(
        model.basis @ np.linalg.solve(model.stiffness, model.force_static),
        solved(full, loads.static).real,
        atol=1e-9 * np.abs(solved(full, loads.static)).max(),
    )


def test_averaged_contact_dofs_carry_the_same_loads():
    """With mortar dofs the mesh displacements are u = T z: forces become T^T f."""
    sector = patch_block()
    full = assemble(sector, STEEL, element="hex8")
    rng = np.random.default_rng(2)
    force = np.zeros(full.n_dofs)
    force[rng.integers(0, full.n_dofs, 200)] = rng.normal(size=200)  # on the contact faces too
    row = rng.normal(size=full.n_dofs)
    boundary = BoundaryChoice(loads=lambda full: LoadVectors({1: force}, None, {"row": row}))
    model = reduce_sector(full, sector, ReductionOptions(modes=3), boundary).model
    motion = solved(full, force).real
    clamped = row.copy()
    clamped[full.fixed] = 0.0
    found = model.outputs["row"] @ np.linalg.solve(model.stiffness, model.force_excitation)
    assert found == pytest.approx(clamped @ motion, rel=1e-7)


def test_receptance_converges_to_that_of_the_full_model(full, sector):
    """A force and an output on the interior below the third mode; without the attachment modes it is far off."""
    loads = vectors(full)
    boundary = BoundaryChoice(contact_dofs="nodal", loads=vectors)
    hertz = 2.3 * natural_frequencies(reduce_sector(full, sector, ReductionOptions(modes=2), NODAL).model, 0.0)[0]
    omega, errors = 2.0 * np.pi * hertz, {}
    exact = loads.outputs["stretch"] @ solved(full, loads.excitation[1], omega)
    for modes in (2, 8, 20):
        model = reduce_sector(full, sector, ReductionOptions(modes=modes), boundary).model
        q = np.linalg.solve(model.stiffness - omega**2 * model.mass, model.force_excitation)
        errors[modes] = abs(model.outputs["stretch"] @ q / exact - 1.0)
    assert errors[2] < 3e-2
    assert errors[20] < errors[8] < errors[2]
    assert errors[20] < 2e-4, errors


def test_without_load_vectors_the_model_is_as_before(full, sector):
    plain = reduce_sector(full, sector, ReductionOptions(modes=5), NODAL, augment=True)
    assert not plain.model.force_harmonics
    assert plain.model.force_static is None
    empty = BoundaryChoice(contact_dofs="nodal", loads=lambda full: LoadVectors())
    same = reduce_sector(full, sector, ReductionOptions(modes=5), empty, augment=True)
    for one, other in ((plain.model, same.model), (plain.augmented, same.augmented)):
        np.testing.assert_array_equal(one.mass, other.mass)
        np.testing.assert_array_equal(one.stiffness, other.stiffness)


def test_truncation_errors_are_those_against_the_full_model(full, sector):
    """The augmented model holds the loads as well: it agrees with the reference, and auto chooses by it."""
    boundary = BoundaryChoice(contact_dofs="nodal", loads=vectors)
    made = reduce_sector(full, sector, ReductionOptions(modes=12), boundary, augment=True)
    springs = np.full(made.model.n_contacts, 1e6)
    operation = LinearOperation((200.0, 3000.0), 0.3, springs, springs, damping_ratio=0.01)
    errors = reduction_errors(made.model, made.augmented, made.highest_mode_hz, operation)
    reference = full_reference(full, sector, 3000.0, boundary).model
    against = reduction_errors(made.model, reference, made.highest_mode_hz, operation)
    for found, exact in zip(errors, against, strict=True):
        assert found.output == pytest.approx(exact.output, rel=0.05, abs=1e-9)
    auto = reduce_to_tolerance(full, sector, 1e-3, [operation], boundary)
    assert auto.error <= 1e-3
    chosen = reduction_errors(auto.model, reference, 1e9, operation)
    assert max(error.worst for error in chosen) <= 1e-3


def test_a_modal_force_excites_one_mode(full, sector):
    model = reduce_sector(full, sector, ReductionOptions(modes=5), NODAL).model
    excited = with_modal_forces(model, {2: 3.0, 4: 1.0 - 2.0j})
    force = modal_model(excited, damping_ratio=0.01).force
    assert np.abs(force[[1, 3]]) == pytest.approx([3.0, np.sqrt(5.0)], rel=1e-9)
    assert np.abs(np.delete(force, [1, 3])).max() < 1e-9
    modal = modal_model(excited, damping_ratio=0.01)
    largest = max((row[1] for row in modal.outputs.values()), key=abs)
    assert (largest * force[1]).real > 0.0  # what moves most moves with the force
    second = with_modal_forces(excited, {1: 2.0}, harmonic=2)
    assert np.abs(modal_model(second, damping_ratio=0.01).harmonic_forces[2][0]) == pytest.approx(2.0, rel=1e-9)
    both = with_modal_forces(excited, {2: -3.0}, added=True)
    assert np.abs(modal_model(both, damping_ratio=0.01).force[1]) < 1e-9
    with pytest.raises(ReducedModelError, match=r"^mode 0: not a mode of the model, allowed: 1 to "):
        with_modal_forces(model, {0: 1.0})


def test_forces_by_harmonic_in_the_file(full, sector, tmp_path):
    boundary = BoundaryChoice(contact_dofs="nodal", loads=vectors)
    model = reduce_sector(full, sector, ReductionOptions(modes=3), boundary).model
    write_reduced_model(tmp_path / "rom.h5", model)
    read = read_reduced_model(tmp_path / "rom.h5")
    np.testing.assert_array_equal(read.force_excitation, model.force_excitation)
    assert list(read.force_harmonics) == [2]
    np.testing.assert_array_equal(read.force_harmonics[2], model.force_harmonics[2])
    np.testing.assert_array_equal(read.force_static, model.force_static)
    for h in (1, 32):
        with pytest.raises(ReducedModelError, match=r"^force/excitation_h: harmonics "):
            replace(model, force_harmonics={h: model.force_harmonics[2]})


@pytest.mark.parametrize("name", ["force/excitation_x", "force/excitation_"])
def test_a_file_with_a_force_of_no_harmonic_is_refused(full, sector, tmp_path, name):
    import h5py

    model = reduce_sector(full, sector, ReductionOptions(modes=0), NODAL).model
    write_reduced_model(tmp_path / "rom.h5", model)
    with h5py.File(tmp_path / "rom.h5", "a") as file:
        file[name] = model.force_excitation
    with pytest.raises(ReducedModelError, match=f"{name}: allowed: force/excitation_2 and higher whole numbers"):
        read_reduced_model(tmp_path / "rom.h5")


@pytest.mark.parametrize("wrong", [np.ones(7), np.nan])
def test_vectors_that_do_not_fit_are_refused(full, sector, wrong):
    def loads(full):
        return LoadVectors({1: wrong if np.ndim(wrong) else np.full(full.n_dofs, wrong)})

    boundary = BoundaryChoice(contact_dofs="nodal", loads=loads)
    with pytest.raises(RomParameterError, match=r"force/excitation = .* must be \d+ finite numbers, one a dof"):
        reduce_sector(full, sector, ReductionOptions(modes=0), boundary)
    with pytest.raises(RomParameterError, match="must be nodes 0 to"):
        nodal_force(full, [-1], [0.0, 1.0, 0.0])
