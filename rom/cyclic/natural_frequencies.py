"""Natural frequencies and mode shapes of the blade ring with its shroud contacts free, sliding or stuck."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.expansion import expand
from rom.cyclic.reduced_model import ReducedModel, ReducedModelError
from rom.linear_algebra.threads import one_blas_thread


def natural_frequencies(
    model: ReducedModel, phase: float, *, normal: ArrayLike = 0.0, tangential: ArrayLike = 0.0, count: int = 10
) -> NDArray[np.float64]:
    """The `count` lowest natural frequencies (count,) in Hz of a model at the inter-blade phase angle `phase` [rad].

    Linear contact springs, N/m for each contact node, (n_c,) or one number: normal = tangential = 0 is free,
    normal alone sliding without friction, both stuck. Eigenvalues of K + B^H diag(k) B, B = right -
    exp(i phase) left. Raises ReducedModelError when the mass is not positive definite.
    """
    squared, _ = _cyclic_modes(model, phase, normal, tangential, count)
    return np.sqrt(np.maximum(squared, 0.0)) / (2 * np.pi)


def mode_shapes(
    model: ReducedModel, phase: float, *, normal: ArrayLike = 0.0, tangential: ArrayLike = 0.0, count: int = 10
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """As `natural_frequencies`, with the mass-normalised shapes on the mesh: Hz (count,), shapes (count, n_nodes, 3).

    normal, tangential: contact springs, N/m, numbers or (n_c,). Blade j moves with shape * exp(i j phase), turned by
    j pitches. Raises ReducedModelError when the model holds no basis.
    """
    squared, vectors = _cyclic_modes(model, phase, normal, tangential, count)
    return np.sqrt(np.maximum(squared, 0.0)) / (2 * np.pi), expand(model, vectors.T)


def contact_motion(model: ReducedModel, phase: float) -> NDArray[np.complex128]:
    """B (3 n_c, n) of a model: relative contact displacement right - exp(i phase) left = B q in the contact frame.

    phase: inter-blade phase angle, rad.
    """
    right = model.contact_right.astype(complex)
    return right if model.contact_left is None else right - np.exp(1j * phase) * model.contact_left


@one_blas_thread()
def _cyclic_modes(
    model: ReducedModel, phase: float, normal: ArrayLike, tangential: ArrayLike, count: int
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Lowest eigenvalues (count,) [(rad/s)^2] and mass-normalised vectors (n, count) with linear contact springs."""
    from scipy.linalg import LinAlgError, eigh

    springs = np.empty((model.n_contacts, 3))
    springs[:, :2] = np.broadcast_to(np.asarray(tangential, dtype=float), model.n_contacts)[:, None]
    springs[:, 2] = np.asarray(normal, dtype=float)
    motion = contact_motion(model, phase)
    stiffness = model.stiffness + motion.conj().T @ (springs.ravel()[:, None] * motion)
    last = min(count, model.size) - 1
    try:
        return eigh(stiffness, model.mass, subset_by_index=(0, last))
    except LinAlgError:
        raise ReducedModelError("mass: not positive definite, allowed: positive definite") from None
