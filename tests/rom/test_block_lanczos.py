"""Block Lanczos against closed forms and dense eigenvalues, where blocks and bases meet their limits too."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_matrix, diags, identity, kron

from rom.linear_algebra.block_lanczos import lowest_eigenpairs
from rom.linear_algebra.factorisation import factorise
from rom.reduction.fixed_interface_modes import lowest_modes


def string(n: int) -> csr_matrix:
    """Stiffness of n unit masses in a row between two walls, springs of 1 between neighbours."""
    return diags([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1]).tocsr()


def string_squared(n: int, count: int) -> np.ndarray:
    """Its eigenvalues in closed form, 4 sin^2(k pi / (2 (n + 1)))."""
    return 4 * np.sin(np.arange(1, count + 1) * np.pi / (2 * (n + 1))) ** 2


def solved(stiffness: csr_matrix, mass: csr_matrix, width: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest pairs from a random start of so many vectors."""
    factor = factorise(stiffness)
    start = np.random.default_rng(2).standard_normal((width, stiffness.shape[0]))
    return lowest_eigenpairs(lambda rows: factor.solve(rows.T).T, mass, start, count, 1e-9)


@pytest.mark.parametrize("width", [1, 2, 5, 8])
@pytest.mark.parametrize("count", [1, 7, 30])
def test_a_string_of_masses(width, count):
    n = 400
    squared, shapes = solved(string(n), identity(n).tocsr(), width, count)
    np.testing.assert_allclose(squared, string_squared(n, count), rtol=1e-11)
    places = np.arange(1, n + 1)
    exact = np.sqrt(2 / (n + 1)) * np.sin(np.pi * np.outer(np.arange(1, count + 1), places) / (n + 1))
    np.testing.assert_allclose(np.abs(np.sum(shapes * exact, axis=1)), 1.0, atol=1e-12)
    np.testing.assert_allclose(shapes @ shapes.T, np.eye(count), atol=1e-11)  # sums over all dofs


@pytest.mark.parametrize("width", [3, 4, 8])
def test_eigenvalues_that_appear_several_times(width):
    """Three strings that know nothing of each other: every eigenvalue three times, as the block is wide enough."""
    n, count = 60, 14
    squared, shapes = solved(kron(identity(3), string(n)).tocsr(), identity(3 * n).tocsr(), width, count)
    np.testing.assert_allclose(squared, np.repeat(string_squared(n, 5), 3)[:count], rtol=1e-11)
    np.testing.assert_allclose(shapes @ shapes.T, np.eye(count), atol=1e-12)


def test_a_hermitian_ring_of_masses():
    """Complex: a ring of unit cells at a phase, with couplings turned in the complex plane; dense eigenvalues."""
    n, count, rng = 120, 12, np.random.default_rng(5)
    turned = diags([-np.exp(0.7j) * np.ones(n - 1), [-np.exp(0.4j)]], [1, -(n - 1)])
    stiffness = (turned + turned.conj().T + diags(2.1 + rng.random(n))).tocsr()
    coupling = 0.2j * diags([np.ones(n - 1)], [1])
    mass = (coupling + coupling.conj().T + diags(1.0 + rng.random(n))).tocsr()
    factor = factorise(stiffness)
    start = rng.standard_normal((4, n)) + 1j * rng.standard_normal((4, n))
    squared, shapes = lowest_eigenpairs(lambda rows: factor.solve(rows.T).T, mass, start, count, 1e-9)
    np.testing.assert_allclose(
        squared, eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)[:count], rtol=1e-10
    )
    np.testing.assert_allclose(shapes.conj() @ (mass @ shapes.T), np.eye(count), atol=1e-10)
    np.testing.assert_allclose(stiffness @ shapes.T, (mass @ shapes.T) * squared, atol=1e-7)


@pytest.mark.parametrize("width", [1, 2])
def test_a_block_narrower_than_an_eigenvalue_is_often(width):
    """Of copies beyond its width some may be missing, by round-off or not; nothing is there that should not be."""
    n, count = 60, 14
    squared, shapes = solved(kron(identity(3), string(n)).tocsr(), identity(3 * n).tocsr(), width, count)
    exact = string_squared(n, n)
    which = np.argmin(np.abs(exact - squared[:, None]), axis=1)
    np.testing.assert_allclose(squared, exact[which], rtol=1e-11)
    times = np.bincount(which)
    assert np.all(times[:-1] >= width)  # the last one may be cut
    assert np.all(times <= 3)
    np.testing.assert_allclose(shapes @ shapes.T, np.eye(count), atol=1e-12)


@pytest.mark.parametrize("width", [1, 4])
def test_nothing_but_one_eigenvalue(width):
    """Every block is an invariant subspace at once."""
    n = 9
    squared, shapes = solved(2 * identity(n).tocsr(), identity(n).tocsr(), width, 5)
    np.testing.assert_allclose(squared, 2.0, rtol=1e-11)
    np.testing.assert_allclose(shapes @ shapes.T, np.eye(5), atol=1e-11)  # sums over all dofs


@pytest.mark.parametrize("width", [1, 3, 8])
@pytest.mark.parametrize("count", [1, 11, 12])
def test_up_to_the_whole_spectrum_with_any_mass(width, count):
    rng = np.random.default_rng(7)
    a, b = rng.standard_normal((2, 12, 12))
    stiffness, mass = a @ a.T + 0.1 * np.eye(12), b @ b.T + np.eye(12)
    squared, shapes = solved(csr_matrix(stiffness), csr_matrix(mass), width, count)
    np.testing.assert_allclose(squared, eigh(stiffness, mass, eigvals_only=True)[:count], rtol=1e-10)
    np.testing.assert_allclose(shapes @ mass @ shapes.T, np.eye(count), atol=1e-11)
    np.testing.assert_allclose(shapes @ stiffness, squared[:, None] * (shapes @ mass), atol=1e-8)


def test_a_wide_range_of_stiffness_and_mass():
    """Units of metres and newtons: frequencies over nine decades, masses of a millionth."""
    n = 300
    stiffness = 1e9 * string(n) + diags(np.geomspace(1e2, 1e8, n)).tocsr()
    mass = diags(1e-6 * np.geomspace(1.0, 1e3, n)).tocsr()
    squared, _ = solved(stiffness.tocsr(), mass.tocsr(), 4, 20)
    np.testing.assert_allclose(squared, eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)[:20], rtol=1e-9)


def test_the_same_modes_whoever_factorised():
    n = 500
    stiffness, mass = string(n), identity(n).tocsr()
    first, second = (lowest_modes(mass, factorise(stiffness, name), 12) for name in ("auto", "superlu"))
    np.testing.assert_allclose(first.omega, second.omega, rtol=1e-11)
    np.testing.assert_allclose(first.shapes, second.shapes, atol=1e-8)


def test_the_same_bits_again():
    stiffness, mass = string(200), identity(200).tocsr()
    first, second = (lowest_modes(mass, factorise(stiffness), 9) for _ in range(2))
    np.testing.assert_array_equal(first.omega, second.omega)
    np.testing.assert_array_equal(first.shapes, second.shapes)
