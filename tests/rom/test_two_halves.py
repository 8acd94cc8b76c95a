"""A factor in two halves against the matrix it was made from, and the cut itself."""

import importlib.util
import threading

import numpy as np
import pytest
from rom_meshes import box_sector
from scipy.sparse import block_diag, csr_matrix, diags, identity, kron

import rom.linear_algebra.factorisation
from rom import FactorisationError, Material, assemble
from rom.linear_algebra.blas_kernels import holds_locks
from rom.linear_algebra.cholmod import CholmodFactor, bears_threads
from rom.linear_algebra.factorisation import TwoHalves, analyse, bisection, factorise
from rom.linear_algebra.threads import SHARED_FROM, at_once, beside

pytestmark = pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in ("pymetis", "cvxopt")),
    reason="the extra cholmod is absent",
)


@pytest.fixture(autouse=True)
def every_size(monkeypatch):
    """Cut small matrices too."""
    for module in (rom.linear_algebra.factorisation, rom.linear_algebra.factorisation):
        monkeypatch.setattr(module, "BISECT_FROM", 0)


def beam(length: int, width: int) -> csr_matrix:
    """Stiffness of length x width^2 nodes with three unknowns each, tied to their neighbours."""
    lines = [diags([-np.ones(n - 1), 2.1 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1]) for n in (length, width)]
    one, other = identity(length), identity(width)
    nodes = kron(kron(lines[0], other), other) + kron(one, kron(lines[1], other) + kron(other, lines[1]))
    return kron(nodes, np.full((3, 3), 0.2) + np.eye(3)).tocsr()


@pytest.fixture(scope="module")
def held():
    """Stiffness of a clamped blade and right-hand sides, more than CHOLMOD takes at once."""
    full = assemble(box_sector(), Material(2.1e11, 0.3, 7800.0))
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    return full.stiffness[free][:, free], np.random.default_rng(5).standard_normal((19, len(free)))


def test_the_halves_are_not_coupled_and_the_separator_is_a_section():
    matrix = beam(30, 4)
    cut = bisection(matrix)
    first, second = cut.halves
    np.testing.assert_array_equal(np.sort(np.concatenate([first, second, cut.separator])), np.arange(matrix.shape[0]))
    assert matrix[first][:, second].nnz == 0
    assert len(cut.separator) <= 2 * 3 * 4**2
    assert min(len(first), len(second)) > 0.3 * matrix.shape[0]


def test_solves_what_the_matrix_says(held):
    matrix, rows = held
    whole = TwoHalves(matrix, bisection(matrix))
    assert whole.factorise()
    for some in (rows, rows[:1]):
        np.testing.assert_allclose(matrix @ whole.solve(some).T, some.T, atol=1e-9)
    exact = np.linalg.solve(matrix.toarray(), rows.T).T
    assert np.max(np.abs(whole.solve(rows) - exact)) < 1e-9 * np.max(np.abs(exact))


def test_two_threads_may_solve_with_one_factor(held):
    """Each with a workspace of its own; the same bits as one after the other."""
    assert bears_threads()
    matrix, rows = held
    factor = CholmodFactor(matrix)
    assert factor.factorise()
    alone = [factor.solve(rows), factor.solve(-2.0 * rows[::-1])]
    for _ in range(20):
        together = at_once(factor.solve, [rows, -2.0 * rows[::-1]])
        assert all(np.array_equal(one, other) for one, other in zip(alone, together, strict=True))


@pytest.mark.parametrize("size", [SHARED_FROM - 1, SHARED_FROM])
def test_work_beside_other_work(size):
    """In two threads where it is small; what one raises comes out."""
    threads = beside(size, threading.get_ident, threading.get_ident)
    assert (len(set(threads)) == 2) == (size < SHARED_FROM)
    assert len(set(beside(size, threading.get_ident, threading.get_ident, threads=False))) == 1
    for work in ((lambda: 1 / 0, int), (int, lambda: 1 / 0)):
        with pytest.raises(ZeroDivisionError):
            beside(size, *work)


def test_the_same_bits_on_one_core(held, monkeypatch):
    matrix, rows = held
    found = []
    for way in (at_once, lambda work, parts: [work(part) for part in parts]):
        monkeypatch.setattr(rom.linear_algebra.factorisation, "at_once", way)
        whole = TwoHalves(matrix, bisection(matrix))
        assert whole.factorise()
        found += [whole.solve(rows) for _ in range(10)]
    assert all(np.array_equal(found[0], other) for other in found)


def test_other_matrices_of_the_pattern_and_indefinite_ones():
    matrix = beam(20, 3)
    rhs = np.random.default_rng(2).standard_normal((matrix.shape[0], 2))
    analysis, cut = analyse(matrix), bisection(matrix)
    assert isinstance(analysis._analysed, TwoHalves)
    for place in (cut.halves[1][5], cut.separator[0]):
        other = matrix.copy()
        other[place, place] = -5.0
        analysis.load(other)
        with pytest.raises(FactorisationError, match="not positive definite"):
            analysis.factor()
    for factor in (2.0, 1.0):
        analysis.load(factor * matrix)
        np.testing.assert_allclose(matrix @ analysis.factor().solve(rhs), rhs / factor, atol=1e-11)
    with pytest.raises(ValueError, match="were analysed"):
        analysis.load(identity(matrix.shape[0]).tocsr())


def test_a_matrix_that_cannot_be_cut_is_factorised_whole():
    """Pieces that have nothing to do with each other."""
    for matrix in (block_diag([beam(4, 2)] * 5).tocsr(), identity(9).tocsr()):
        rhs = np.arange(matrix.shape[0], dtype=float)
        np.testing.assert_allclose(matrix @ factorise(matrix).solve(rhs), rhs, atol=1e-11)


def test_threads_only_beside_a_blas_with_locks(tmp_path, monkeypatch):
    assert bears_threads()
    for content, expected in ((b"dgemm_ pthread_mutex_lock", True), (b"dgemm_", False), (b"", False)):
        (tmp_path / "library").write_bytes(content)
        assert holds_locks(tmp_path / "library") == expected
    assert not holds_locks(tmp_path / "none")
    matrix = beam(20, 3)
    monkeypatch.setattr(rom.linear_algebra.factorisation, "bears_threads", lambda: False)
    assert not isinstance(analyse(matrix)._analysed, TwoHalves)
