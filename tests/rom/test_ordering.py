"""Order of the unknowns: a permutation, node by node, that makes little of the factor."""

import importlib.util

import numpy as np
import pytest
from rom_meshes import box_sector
from scipy.sparse import csr_matrix, diags, identity, kron

import rom.linear_algebra.factorisation
from rom import Material, assemble
from rom.linear_algebra.factorisation import factorise, nested_dissection

pytestmark = pytest.mark.skipif(importlib.util.find_spec("pymetis") is None, reason="the extra cholmod is absent")


@pytest.fixture(autouse=True)
def every_size(monkeypatch):
    """Order small matrices too."""
    monkeypatch.setattr(rom.linear_algebra.factorisation, "DISSECT_FROM", 0)


def lattice(n: int) -> csr_matrix:
    """Stiffness of n^3 nodes with 3 unknowns each, tied to their six neighbours; unknowns of a node to each other."""
    line = diags([-np.ones(n - 1), 2.1 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1])
    one = identity(n)
    nodes = kron(kron(line, one), one) + kron(kron(one, line), one) + kron(kron(one, one), line)
    return kron(nodes, np.full((3, 3), 0.2) + np.eye(3)).tocsr()


def fill(matrix: csr_matrix, order: np.ndarray) -> int:
    """Entries of the Cholesky factor, by eliminating one node after another in sets of neighbours."""
    nodes = order[::3] // 3
    graph = matrix[::3, ::3].tolil().rows
    place = np.argsort(nodes)
    later = [set(place[list(graph[node])]) for node in nodes]
    count = 0
    for k, neighbours in enumerate(later):
        neighbours = {j for j in neighbours if j > k}
        count += 3 * (3 * len(neighbours) + 2)
        if neighbours:
            later[min(neighbours)] |= neighbours
    return count


def test_a_permutation_that_keeps_the_unknowns_of_a_node_together():
    matrix = lattice(5)
    order = nested_dissection(matrix)
    np.testing.assert_array_equal(np.sort(order), np.arange(matrix.shape[0]))
    np.testing.assert_array_equal(order.reshape(-1, 3) % 3, np.tile([0, 1, 2], (len(order) // 3, 1)))
    np.testing.assert_array_equal(order, nested_dissection(matrix))  # the same each time


def test_less_in_the_factor_than_row_by_row():
    """n^3 nodes row by row: a band of n^2, n^5 entries a node pair; nested dissection: some n^4."""
    ratios = []
    for n in (6, 12):
        matrix = lattice(n)
        ratios.append(fill(matrix, nested_dissection(matrix)) / fill(matrix, np.arange(matrix.shape[0])))
    assert ratios[1] < 0.6
    assert ratios[1] < 0.8 * ratios[0]


def test_none_for_unknowns_that_are_not_three_to_a_node(monkeypatch):
    assert nested_dissection(diags(np.ones(7)).tocsr()) is None
    monkeypatch.setattr(rom.linear_algebra.factorisation, "DISSECT_FROM", 10)
    assert nested_dissection(diags(np.ones(9)).tocsr()) is None


def test_none_without_the_package(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert nested_dissection(lattice(3)) is None


def test_the_same_solutions_in_either_order(monkeypatch):
    full = assemble(box_sector(), Material(2.1e11, 0.3, 7800.0))
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    matrix = full.stiffness[free][:, free]
    rhs = np.random.default_rng(4).standard_normal((len(free), 3))
    dissected = factorise(matrix).solve(rhs)
    monkeypatch.setattr(rom.linear_algebra.factorisation, "DISSECT_FROM", 10**9)
    plain = factorise(matrix).solve(rhs)
    assert np.max(np.abs(dissected - plain)) < 1e-9 * np.max(np.abs(plain))
    np.testing.assert_allclose(matrix @ dissected, rhs, atol=1e-9)
