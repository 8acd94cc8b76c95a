"""The two factorisations against each other and against what they were made from."""

import importlib.util

import numpy as np
import pytest
from rom_meshes import box_sector
from scipy.sparse import csr_matrix, diags

import rom.factorisation
from rom import FactorisationError, Material, assemble, factorise

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


@needs_cholmod
def test_backends_agree_to_round_off(held):
    matrix, rhs = held
    first, second = (factorise(matrix, backend).solve(rhs) for backend in ("cholmod", "superlu"))
    assert np.max(np.abs(first - second)) < 1e-10 * np.max(np.abs(first))


@needs_cholmod
def test_where_the_dense_door_of_cholmod_is_shut(held, monkeypatch):
    matrix, rhs = held
    expected = factorise(matrix, "cholmod").solve(rhs)
    monkeypatch.setattr(rom.factorisation, "dense_solver", lambda *_: None)
    factor = factorise(matrix, "cholmod")
    for columns in (rhs, rhs[:, 0]):
        found = factor.solve(columns)
        assert found.shape == columns.shape
        assert np.max(np.abs(found.T - expected.T[: len(np.atleast_2d(columns.T))])) < 1e-12 * np.max(
            np.abs(expected)
        )


@needs_cholmod
def test_the_dense_door_opens_to_factors_only():
    from cvxopt import cholmod

    from rom.cholmod_dense import dense_solver

    assert dense_solver(cholmod.__file__, object()) is None
    assert dense_solver(__file__, object()) is None


@needs_cholmod
def test_cholmod_is_taken_where_it_is_installed():
    assert factorise(diags([1.0, 2.0, 3.0]).tocsr()).backend == "cholmod"


def test_superlu_is_taken_where_cholmod_is_not_installed(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
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
