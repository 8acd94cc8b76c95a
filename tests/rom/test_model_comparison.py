"""Errors of reduced models as they are reported, against direct solutions with the full model's dynamic stiffness."""

from dataclasses import replace

import numpy as np
import pytest
from rom_meshes import NODAL, box_sector
from rom_reference import lowest_hz, spring_stiffness
from scipy.linalg import eigh
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from rom import Material, ReductionOptions, RomParameterError, assemble, reduce_sector
from rom.reduction.mode_selection import reduce_to_tolerance
from rom.reduction.model_comparison import LinearOperation, linear_errors, linear_responses
from rom.reduction.reference_model import full_reference, static_error

STEEL = Material(young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0)
RANGE = (800.0, 9000.0)
DIRECTION = np.array([0.6, 0.8, 0.0])


@pytest.fixture(scope="module")
def sector():
    return box_sector((2, 2, 6))


@pytest.fixture(scope="module")
def full(sector):
    return assemble(sector, STEEL)


def operation_of(sector, frequency=RANGE, **damping):
    n_c = len(sector.right.nodes)
    springs = np.linspace(1.0, 2.0, n_c) * 1e7
    phase = 2 * np.pi * 7 / sector.n_blades
    return LinearOperation(frequency, phase, springs, 0.8 * springs, **(damping or {"rayleigh": (20.0, 2e-7)}))


@pytest.fixture(scope="module")
def operation(sector):
    return operation_of(sector)


@pytest.fixture(scope="module")
def reference(full, sector):
    return full_reference(full, sector, RANGE[1], replace(NODAL, excitation_direction=DIRECTION))


def directly(full, sector, operation, like, damping_matrix=None):
    """Relative contact receptance and tip motion (tip, x, y, z), each frequency factorised by itself."""
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    normal, tangential = operation.contact_conditions()[like.condition]
    stiffness, mass = full.stiffness.astype(complex), full.mass
    if damping_matrix is None:
        a, b = operation.rayleigh
        damping_matrix = a * mass + b * full.stiffness
    for node in range(len(normal)):  # one node at a time: each has springs of its own
        alone = replace(
            sector,
            right=replace(sector.right, **_only(sector.right, node)),
            left=replace(sector.left, **_only(sector.left, node)),
        )
        stiffness = stiffness + spring_stiffness(full, alone, operation.phase, normal[node], tangential[node])
    forces = np.zeros((full.n_dofs, 3 * len(normal) + 1), dtype=complex)
    for node, (right, left) in enumerate(zip(sector.right.nodes, sector.left.nodes, strict=True)):
        for row in range(3):
            column = 3 * node + row
            forces[3 * full.vertex_node[right] + np.arange(3), column] = sector.right.frame[node][row]
            turned = -np.exp(-1j * operation.phase) * sector.left.frame[node][row]
            forces[3 * full.vertex_node[left] + np.arange(3), column] = turned
    tip = 3 * full.vertex_node[sector.node_sets["tip"][0]] + np.arange(3)
    forces[tip, -1] = DIRECTION
    contact, output = [], []
    for hertz in like.sample_hz:
        omega = 2 * np.pi * hertz
        dynamic = stiffness + 1j * omega * damping_matrix - omega**2 * mass
        motion = np.zeros_like(forces)
        motion[free] = splu(dynamic[free][:, free].tocsc()).solve(forces[free])
        contact.append(forces[:, :-1].conj().T @ motion[:, :-1])
        output.append([DIRECTION @ motion[tip, -1], *motion[tip, -1]])
    return np.array(contact), np.array(output)


def _only(face, node):
    pick = slice(node, node + 1)
    return {
        "nodes": face.nodes[pick],
        "position": face.position[pick],
        "frame": face.frame[pick],
        "area": face.area[pick],
    }


def test_the_reference_has_the_frequencies_of_the_full_model(full, sector, reference):
    springs = 2e7 * np.ones(len(sector.right.nodes))
    operation = replace(operation_of(sector), normal=springs, tangential=0.7 * springs)
    for response in linear_responses(reference.model, operation):
        normal, tangential = (values[0] for values in operation.contact_conditions()[response.condition])
        stiffness = full.stiffness + spring_stiffness(full, sector, operation.phase, normal, tangential)
        last = response.first_mode - 1 + len(response.natural_hz)
        exact = lowest_hz(stiffness, full.mass, last + 1, full.fixed)
        np.testing.assert_allclose(response.natural_hz, exact[response.first_mode - 1 : last], rtol=1e-9)
        inside = (response.natural_hz >= RANGE[0]) & (response.natural_hz <= RANGE[1])
        assert inside[:-1].all()
        assert not inside[-1]
        assert np.isin(response.natural_hz[inside], response.sample_hz).all()


@pytest.mark.parametrize("modes", [4, 12])
def test_reported_errors_are_those_against_a_direct_solution(full, sector, operation, reference, modes):
    model = reduce_sector(
        full, sector, ReductionOptions(modes=modes), replace(NODAL, excitation_direction=DIRECTION)
    ).model
    exact = linear_responses(reference.model, operation)
    found = linear_responses(model, operation, exact)
    for mine, theirs, error in zip(found, exact, linear_errors(found, exact, RANGE), strict=True):
        contact, output = directly(full, sector, operation, theirs)
        np.testing.assert_allclose(theirs.contact, contact, rtol=0, atol=1e-7 * np.abs(contact).max())
        np.testing.assert_allclose(theirs.output, output, rtol=0, atol=1e-7 * np.abs(output).max())
        difference = np.linalg.norm(mine.contact - contact, 2, axis=(1, 2)) / np.linalg.norm(contact, 2, axis=(1, 2))
        assert error.contact == pytest.approx(difference.max(), rel=1e-3)
        difference = np.linalg.norm(mine.output - output, axis=1) / np.linalg.norm(output, axis=1)
        assert error.output == pytest.approx(difference.max(), rel=1e-3)
        assert error.contact > 1e-4  # there is something to report


def test_modal_damping_of_the_reference_is_that_of_the_full_model(full, sector, reference):
    operation = operation_of(sector, damping_ratio=0.01)
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    mass = full.mass[free][:, free].toarray()
    squared, shapes = eigh(full.stiffness[free][:, free].toarray(), mass)
    damping = np.zeros((full.n_dofs, full.n_dofs))
    weighted = mass @ shapes
    damping[np.ix_(free, free)] = (weighted * (0.02 * np.sqrt(squared))) @ weighted.T
    response = linear_responses(reference.model, operation)[-1]
    response = replace(response, sample_hz=response.sample_hz[::3])
    contact, output = directly(full, sector, operation, response, csr_matrix(damping))
    found = linear_responses(reference.model, operation, [response] * 3)[-1]
    np.testing.assert_allclose(found.contact, contact, rtol=0, atol=1e-5 * np.abs(contact).max())
    np.testing.assert_allclose(found.output, output, rtol=0, atol=1e-5 * np.abs(output).max())


def test_static_error_is_round_off_and_sees_a_wrong_stiffness(full, sector, reference):
    model = reduce_sector(full, sector, ReductionOptions(modes=4), NODAL).model
    assert static_error(model, reference.flexibility) < 1e-9
    softer = replace(model, stiffness=0.999 * model.stiffness)
    assert static_error(softer, reference.flexibility) == pytest.approx(1e-3, rel=0.01)


def test_contact_conditions_without_springs_are_left_out(sector):
    operation = operation_of(sector)
    none = np.zeros_like(operation.normal)
    assert list(replace(operation, tangential=none).contact_conditions()) == ["free", "sliding"]
    assert list(replace(operation, normal=none).contact_conditions()) == ["free", "stuck"]
    assert list(replace(operation, normal=none, tangential=none).contact_conditions()) == ["free"]


@pytest.mark.parametrize("tolerance", [3e-2, 1e-2, 1e-3])
def test_modes_by_tolerance_are_enough_and_not_too_many(full, sector, operation, reference, tolerance):
    made = reduce_to_tolerance(full, sector, tolerance, [operation], replace(NODAL, excitation_direction=DIRECTION))
    exact = linear_responses(reference.model, operation)

    def true_error(model):
        return max(e.worst for e in linear_errors(linear_responses(model, operation, exact), exact, RANGE))

    assert made.model.size == 6 * len(sector.right.nodes) + 3 + made.modes
    assert true_error(made.model) <= tolerance
    assert true_error(made.model) == pytest.approx(made.error, rel=0.02)
    same = reduce_sector(
        full, sector, ReductionOptions(modes=made.modes), replace(NODAL, excitation_direction=DIRECTION)
    ).model
    np.testing.assert_allclose(same.mass, made.model.mass, atol=1e-7 * np.abs(same.mass).max())
    fewer = reduce_sector(
        full, sector, ReductionOptions(modes=made.modes - 1), replace(NODAL, excitation_direction=DIRECTION)
    ).model
    assert true_error(fewer) > tolerance


def test_modes_by_tolerance_reach_beyond_a_high_range(full, sector):
    """More modes in the range than the first guess: the estimate must not be taken from too few."""
    high = (10_000.0, 90_000.0)
    operation = operation_of(sector, high)
    made = reduce_to_tolerance(full, sector, 1e-2, [operation], replace(NODAL, excitation_direction=DIRECTION))
    reference = full_reference(full, sector, high[1], replace(NODAL, excitation_direction=DIRECTION))
    exact = linear_responses(reference.model, operation)
    assert len(exact[0].natural_hz) > 30
    found = linear_responses(made.model, operation, exact)
    assert max(e.worst for e in linear_errors(found, exact, high)) <= 1.02e-2


def test_several_operations_are_all_satisfied(full, sector, operation):
    easy = replace(operation, frequency_hz=(100.0, 200.0))
    modes = [
        reduce_to_tolerance(full, sector, 1e-3, each, NODAL).modes
        for each in ([easy], [operation], [easy, operation])
    ]
    assert modes[0] < modes[1] == modes[2]


@pytest.mark.parametrize("tolerance", [0.0, 1.0, -1.0, float("nan")])
def test_bad_tolerances_are_refused(full, sector, operation, tolerance):
    with pytest.raises(RomParameterError, match=r"rom\.tolerance"):
        reduce_to_tolerance(full, sector, tolerance, [operation], NODAL)


def test_a_tolerance_out_of_reach_is_said():
    sector = box_sector((2, 1, 3))
    with pytest.raises(RomParameterError, match="leave an error of"):
        reduce_to_tolerance(assemble(sector, STEEL, "hex8"), sector, 1e-15, [operation_of(sector)], NODAL)
