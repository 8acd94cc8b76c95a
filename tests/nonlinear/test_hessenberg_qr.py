"""Eigenvalues of many small matrices, beside their definition: A - lambda is singular to round-off of the entries."""

import numpy as np
import pytest

from nonlinear.stability import hessenberg_qr
from nonlinear.stability.general_eigenvalues import general_eigenvalues
from nonlinear.stability.hessenberg_qr import MOST_ROWS, qr_eigenvalues
from nonlinear.stability.modal_condensation import Matrix
from rom.linear_algebra.threads import one_blas_thread

ROUND_OFF = 20.0 * np.finfo(float).eps  # times the number of rows and the norm


def random(count: int, n: int) -> Matrix:
    rng = np.random.default_rng(n)
    return rng.standard_normal((count, n, n)) + 1j * rng.standard_normal((count, n, n))


def similar(values: Matrix) -> Matrix:
    """A full matrix with the eigenvalues of a given one."""
    basis = random(1, len(values))[0]
    return np.asarray(basis @ values @ np.linalg.inv(basis))


def scaled(matrix: Matrix, decades: float) -> Matrix:
    """D A D^-1, the diagonal of D over so many decades."""
    scale = np.logspace(0.0, decades, len(matrix))
    return np.asarray(scale[:, None] * matrix / scale)


CASES = {
    "triangular": np.triu(random(1, 9)[0]),
    "Hessenberg": np.triu(random(1, 9)[0], -1),
    "blocks": np.kron(np.eye(3), random(1, 3)[0]),
    "identity": np.eye(5),
    "zero": np.zeros((4, 4)),
    "one row": np.array([[2.0 - 3.0j]]),
    "Jordan block": np.eye(6, k=1) + 0.5j * np.eye(6),
    "Jordan block, transposed": np.eye(6, k=-1),
    "Jordan block in a full matrix": similar(np.eye(6, k=1) - np.eye(6)),
    "repeated": similar(np.diag([1.0, 1.0, 1.0, 2.0j, 2.0j, 3.0])),
    "cyclic permutation": np.roll(np.eye(8), 1, axis=0),  # a QR step with its own shift changes nothing
    "graded": random(1, 10)[0] * np.logspace(0.0, -14.0, 10)[:, None],
    "badly scaled": scaled(random(1, 8)[0], 9.0),
    "rank one": np.outer(random(1, 7)[0, 0], random(1, 7)[0, 1]),
    "tiny": 1e-200 * random(1, 6)[0],
    "huge": 1e200 * random(1, 6)[0],
}


def assert_eigenvalues(matrix: Matrix, values: Matrix) -> None:
    """Each is one of a matrix nearby, and together they have its trace and that of its square."""
    norm = np.abs(matrix).sum() or 1.0
    unit, relative = matrix / norm, values / norm
    tolerance = ROUND_OFF * len(matrix)
    for value in relative:
        assert np.linalg.svd(unit - value * np.eye(len(unit)), compute_uv=False)[-1] < tolerance
    assert abs(relative.sum() - np.trace(unit)) < tolerance
    assert abs(np.sum(relative**2) - np.trace(unit @ unit)) < tolerance


@pytest.mark.parametrize("name", CASES)
def test_special_matrices(name: str) -> None:
    matrix = np.asarray(CASES[name], dtype=complex)
    assert_eigenvalues(matrix, qr_eigenvalues(matrix))


@pytest.mark.parametrize("n", [2, 3, 5, 12, 25, 60, MOST_ROWS + 1])
def test_many_at_once(n: int) -> None:
    matrices = random(7, n)
    values = qr_eigenvalues(matrices)
    for matrix, found in zip(matrices, values, strict=True):
        assert_eigenvalues(matrix, found)
        exact = np.linalg.eigvals(matrix)
        distance = np.abs(found[:, None] - exact).min(axis=0)
        assert distance.max() < 1e-10 * np.abs(exact).max()
    assert np.array_equal(qr_eigenvalues(matrices[2]), values[2])  # whatever stands beside it


@pytest.mark.parametrize("shape", [(0, 0), (3, 0, 0), (0, 4, 4)])
def test_nothing_to_solve(shape: tuple[int, ...]) -> None:
    assert qr_eigenvalues(np.zeros(shape, dtype=complex)).shape == shape[:-1]


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_not_finite_is_refused_as_lapack_does(wrong: float) -> None:
    matrices = random(3, 4)
    matrices[1, 2, 3] = wrong
    with pytest.raises(np.linalg.LinAlgError):
        qr_eigenvalues(matrices)


def test_lapack_solves_what_does_not_converge(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = hessenberg_qr._all_eigenvalues
    matrices = random(4, 6)

    def stuck(every: Matrix, values: Matrix, converged: Matrix) -> None:
        compiled(every, values, converged)
        converged[2], values[2] = False, np.nan

    monkeypatch.setattr(hessenberg_qr, "_all_eigenvalues", stuck)
    for matrix, found in zip(matrices, qr_eigenvalues(matrices), strict=True):
        assert_eigenvalues(matrix, found)


@pytest.mark.parametrize("imaginary", [0.0, 1.0])
def test_eigenvalues_of_large_matrices_are_those_of_numpy(imaginary):
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(2, 200, 200)) + (1j * rng.normal(size=(2, 200, 200)) if imaginary else 0.0)
    with one_blas_thread():
        found, expected = (np.sort_complex(each) for each in (general_eigenvalues(matrix), np.linalg.eigvals(matrix)))
    assert np.allclose(found, expected, atol=1e-9)
    with pytest.raises(np.linalg.LinAlgError):
        general_eigenvalues(np.full((300, 300), np.nan))
