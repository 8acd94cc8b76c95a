"""The two factorisations against each other and against what they were made from."""

import importlib.util
import sys

import numpy as np
import pytest
from rom_meshes import box_sector
from scipy.sparse import csr_matrix, diags, tril

import rom.linear_algebra.cholmod
import rom.linear_algebra.factorisation
from rom import FactorisationError, Material, assemble
from rom.linear_algebra.factorisation import analyse, factorise

needs_cholmod = pytest.mark.skipif(importlib.util.find_spec("cvxopt") is None, reason="the extra cholmod is absent")
BACKENDS = [pytest.param("cholmod", marks=needs_cholmod), "superlu"]


@pytest.fixture(scope="module")
def held():
    """Stiffness of a clamped blade and forty right-hand sides."""
    full = assemble(box_sector(), Material(2.1e11, 0.3, 7800.0))
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    return full.stiffness[free][:, free], np.random.default_rng(5).standard_normal((len(free), 40))


@pytest.mark.parametrize("backend", BACKENDS)
def test_solves_one_and_many_right_hand_sides(held, backend):
    matrix, rhs = held
    before = rhs.copy()
    factor = factorise(matrix, backend)
    assert factor.backend == backend
    many = factor.solve(rhs)
    assert many.shape == rhs.shape
    np.testing.assert_allclose(matrix @ many, rhs, atol=1e-9)
    assert np.max(np.abs(factor.solve(rhs[:, 3]) - many[:, 3])) < 1e-10 * np.max(np.abs(many[:, 3]))
    np.testing.assert_array_equal(rhs, before)
    more = factor.solve(np.tile(rhs, 7))  # so many that other numbers are taken at once
    np.testing.assert_allclose(more[:, -40:], many, atol=1e-10 * np.abs(many).max())


@needs_cholmod
def test_backends_agree_to_round_off(held):
    matrix, rhs = held
    first, second = (factorise(matrix, backend).solve(rhs) for backend in ("cholmod", "superlu"))
    assert np.max(np.abs(first - second)) < 1e-10 * np.max(np.abs(first))


@needs_cholmod
def test_the_matrix_may_go_before_the_factor_comes(held):
    matrix, rhs = held
    expected = factorise(matrix, "cholmod").solve(rhs)
    gone = matrix.copy()
    analysis = analyse(gone, "cholmod")
    gone.data[:], gone.indices[:] = 0.0, 0
    np.testing.assert_array_equal(analysis.factor().solve(rhs), expected)


@pytest.mark.parametrize("backend", BACKENDS)
def test_one_analysis_serves_matrices_of_one_pattern(held, backend):
    matrix, rhs = held
    other = matrix.copy()
    other.setdiag(2.0 * matrix.diagonal())
    analysis = analyse(matrix, backend)
    np.testing.assert_array_equal(analysis.factor().solve(rhs), factorise(matrix, backend).solve(rhs))
    for each in (other, matrix):
        analysis.load(each)
        np.testing.assert_allclose(analysis.factor().solve(rhs), factorise(each, backend).solve(rhs), rtol=1e-9)
    # After a matrix that is not positive definite the next one is factorised again.
    if backend == "cholmod":
        analysis.load(-matrix)
        with pytest.raises(FactorisationError):
            analysis.factor()
        analysis.load(matrix)
        np.testing.assert_allclose(analysis.factor().solve(rhs), factorise(matrix, backend).solve(rhs), rtol=1e-9)
        with pytest.raises(ValueError, match="were analysed"):
            analysis.load(diags(np.ones(matrix.shape[0])).tocsr())


@needs_cholmod
def test_entries_in_any_order_and_twice(held):
    """What SciPy calls not canonical: CHOLMOD itself would take it amiss."""
    matrix, rhs = held
    expected = factorise(matrix, "cholmod").solve(rhs)
    parts = matrix.tocoo()
    mixed = np.random.default_rng(3).permutation(2 * parts.nnz) % parts.nnz
    starts = np.concatenate([[0], np.cumsum(2 * np.diff(matrix.indptr))])
    by_row = mixed[np.argsort(parts.row[mixed], kind="stable")]
    doubled = csr_matrix((0.5 * parts.data[by_row], parts.col[by_row], starts), shape=matrix.shape)
    assert not doubled.has_canonical_format
    np.testing.assert_allclose(factorise(doubled, "cholmod").solve(rhs), expected, rtol=1e-8, atol=1e-20)
    assert doubled.nnz == 2 * matrix.nnz  # left as it was


@needs_cholmod
@pytest.mark.parametrize("slab", [1, 7, 1000])
def test_the_triangle_is_taken_slab_by_slab(held, monkeypatch, slab):
    matrix = held[0]
    monkeypatch.setattr(rom.linear_algebra.cholmod, "_SLAB", slab)
    _, (starts, indices, values) = rom.linear_algebra.cholmod._upper_triangle(matrix)
    count = starts[-1]
    found = csr_matrix((values[:count], indices[:count], starts), shape=matrix.shape)
    assert (found != tril(matrix)).nnz == 0  # by rows what the upper one is by columns


@needs_cholmod
def test_a_library_of_another_kind_is_left_alone(monkeypatch):
    from cvxopt import cholmod

    assert rom.linear_algebra.cholmod._opened(__file__) is None  # no library
    assert rom.linear_algebra.cholmod._opened(np._core._multiarray_umath.__file__) is None  # one without CHOLMOD
    assert rom.linear_algebra.cholmod._opened(cholmod.__file__) is not None
    monkeypatch.setattr(rom.linear_algebra.cholmod, "_VERSION", 5)
    assert rom.linear_algebra.cholmod._opened(cholmod.__file__) is None
    monkeypatch.setattr(rom.linear_algebra.cholmod, "_VERSION", 3)
    for expected in (rom.linear_algebra.cholmod._COMMON_DEFAULTS, rom.linear_algebra.cholmod._FACTOR_OF_TWO):
        for name in expected:
            with monkeypatch.context() as other:
                other.setitem(expected, name, -1)
                assert rom.linear_algebra.cholmod._opened(cholmod.__file__) is None
    monkeypatch.setattr(rom.linear_algebra.factorisation, "library", lambda: None)
    assert factorise(diags([1.0, 2.0, 4.0]).tocsr()).backend == "superlu"


@needs_cholmod
def test_cholmod_is_taken_where_it_is_installed():
    assert factorise(diags([1.0, 2.0, 3.0]).tocsr()).backend == "cholmod"


def test_superlu_is_taken_where_cholmod_is_not_installed(monkeypatch):
    monkeypatch.setitem(sys.modules, "cvxopt.cholmod", None)  # as if it could not be imported
    monkeypatch.setattr(rom.linear_algebra.factorisation, "library", rom.linear_algebra.cholmod.library.__wrapped__)
    factor = factorise(diags([1.0, 2.0, 4.0]).tocsr())
    assert factor.backend == "superlu"
    np.testing.assert_allclose(factor.solve(np.ones(3)), [1.0, 0.5, 0.25])
    with pytest.raises(ValueError, match="needs the package cvxopt"):
        factorise(diags([1.0, 2.0]).tocsr(), "cholmod")


@pytest.mark.parametrize("backend", BACKENDS)
def test_singular_matrix_is_refused_in_one_line(backend):
    with pytest.raises(FactorisationError, match="not positive definite") as caught:
        factorise(csr_matrix(np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])), backend)
    assert "\n" not in str(caught.value)


@needs_cholmod
def test_indefinite_matrix_is_refused_by_cholmod():
    with pytest.raises(FactorisationError, match="not positive definite"):
        factorise(diags([1.0, -2.0, 3.0]).tocsr(), "cholmod")


def test_unknown_backend_is_refused():
    with pytest.raises(ValueError, match="must be one of auto, cholmod, superlu"):
        factorise(diags([1.0, 2.0]).tocsr(), "pardiso")
