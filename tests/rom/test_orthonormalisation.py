"""Orthonormal combinations by the Gram matrix, with vectors that depend on each other."""

import numpy as np
import pytest

from rom.linear_algebra.block_lanczos import orthonormal_combinations, svqb


@pytest.fixture
def vectors():
    """Five vectors of lengths from 1e-6 to 1e6, as columns; the last one is the sum of the first two."""
    columns = np.random.default_rng(0).normal(size=(12, 4)) * np.geomspace(1e-6, 1e6, 4)
    return np.column_stack([columns, columns[:, 0] + columns[:, 1]])


def test_combinations_are_orthonormal_and_span_the_vectors(vectors):
    gram = vectors.T @ vectors
    combinations, components = svqb(gram, np.sqrt(np.diag(gram)), 1e-11)
    basis = vectors @ combinations
    assert basis.shape == (12, 4)
    np.testing.assert_allclose(basis.T @ basis, np.eye(4), atol=1e-8)
    lengths = np.linalg.norm(vectors, axis=0)
    np.testing.assert_allclose(basis @ components / lengths, vectors / lengths, atol=1e-5)
    assert svqb(gram, lengths, 1e-11, 2)[0].shape == (5, 2)
    assert svqb(gram, lengths, 1e-11, 0)[0].shape == (5, 0)


def test_a_vector_of_which_only_round_off_is_left_is_left_out(vectors):
    gram = vectors[:, :4].T @ vectors[:, :4]
    before = np.diag(gram).copy()
    before[2] *= 1e15  # its length was 3e7 times as large before others were taken out of it
    combinations = orthonormal_combinations(gram, before)
    assert combinations.shape == (4, 3)
    np.testing.assert_array_equal(combinations[2], 0.0)  # left out: never computed
    np.testing.assert_allclose(combinations.T @ gram @ combinations, np.eye(3), atol=1e-8)
    assert orthonormal_combinations(np.zeros((2, 2))).shape == (2, 0)
