"""Lowest modes of the structure with every kept dof held."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import FactorisationError
from rom.factorisation import Factor

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_SEED = 20240607
_FIRST_GUESS = 20


def lowest_modes(
    stiffness: csr_matrix, mass: csr_matrix, factor: Factor, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The `count` lowest modes of K phi = w^2 M phi: w (m,) [rad/s] ascending, mass-normalised shapes (n, m).

    Shift-invert Lanczos (ARPACK) with the given factor of K as its solver. The start vector and the signs (largest entry positive)
    are fixed, so the same matrices give the same modes. Raises FactorisationError when an eigenvalue is not above 0.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh
    from threadpoolctl import threadpool_limits

    size = stiffness.shape[0]
    count = min(count, size - 1)
    if count < 1:
        return np.zeros(0), np.zeros((size, 0))
    inverse = LinearOperator((size, size), matvec=factor.solve, dtype=float)
    start = np.random.default_rng(_SEED).standard_normal(size)
    # ARPACK's vectors are too short to share out: with two BLAS threads it takes four times as long as with one.
    with threadpool_limits(1, user_api="blas"):
        squared, shapes = eigsh(stiffness, k=count, M=mass, sigma=0.0, which="LM", OPinv=inverse, v0=start)
    order = np.argsort(squared)
    squared, shapes = squared[order], shapes[:, order]
    if squared[0] <= 0.0:
        raise FactorisationError(
            f"the held structure has the eigenvalue {squared[0]:.3g} (rad/s)^2: not above 0, it is unstable or not held"
        )
    largest = np.argmax(np.abs(shapes), axis=0)
    return np.sqrt(squared), shapes * np.sign(shapes[largest, np.arange(shapes.shape[1])])


def modes_up_to(
    stiffness: csr_matrix, mass: csr_matrix, factor: Factor, frequency_limit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """All modes up to frequency_limit [Hz], as `lowest_modes`; asks for twice as many until one lies beyond."""
    limit, count = 2 * np.pi * frequency_limit, _FIRST_GUESS
    while True:
        angular, shapes = lowest_modes(stiffness, mass, factor, count)
        if len(angular) < count or angular[-1] > limit:
            within = angular <= limit
            return angular[within], shapes[:, within]
        count *= 2
