"""A matrix alike on x, y and z against the matrix written out, in one thread and in two."""

import numpy as np
import pytest
from scipy.sparse import identity, kron, random_array

import rom.linear_algebra.threads
from rom.linear_algebra.block_lanczos import IsotropicMatrix, lowest_eigenpairs


@pytest.fixture(params=[10**9, 0], ids=["one thread", "two threads"], autouse=True)
def threads(request, monkeypatch):
    monkeypatch.setattr(rom.linear_algebra.threads, "SHARED_FROM", request.param)


@pytest.mark.parametrize("shape", [(9, 9), (9, 4), (1, 5)])
def test_products_are_those_of_the_matrix_written_out(shape):
    rng = np.random.default_rng(1)
    pairs = random_array(shape, density=0.4, rng=rng, format="csr")
    matrix, written_out = IsotropicMatrix(pairs), kron(pairs, identity(3)).tocsr()
    assert matrix.shape == written_out.shape
    for columns in (0, 1, 4):
        x = rng.standard_normal((written_out.shape[1], columns))
        np.testing.assert_allclose(matrix @ x, written_out @ x, atol=1e-12)  # sums of 9 terms
        np.testing.assert_allclose(matrix @ np.asfortranarray(x), written_out @ x, atol=1e-12)  # sums of 9 terms
    vector = rng.standard_normal(written_out.shape[1])
    np.testing.assert_allclose(matrix @ vector, written_out @ vector, atol=1e-12)  # sums of 9 terms
    assert (IsotropicMatrix.of(written_out).pairs != pairs).nnz == 0


def test_modes_with_it_are_those_of_the_dense_matrices():
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((30, 30)), rng.standard_normal((10, 10))
    stiffness, pairs = a @ a.T + np.eye(30), b @ b.T + np.eye(10)
    mass = IsotropicMatrix.of(kron(pairs, identity(3)).tocsr())
    inverse = np.linalg.inv(stiffness)
    squared, shapes = lowest_eigenpairs(lambda rows: rows @ inverse, mass, rng.standard_normal((4, 30)), 8, 1e-9)
    np.testing.assert_allclose(shapes @ stiffness, squared[:, None] * (mass @ shapes.T).T, atol=1e-9)
    np.testing.assert_allclose(shapes @ (mass @ shapes.T), np.eye(8), atol=1e-12)
