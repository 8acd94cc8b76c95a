"""The modes of a reduced system, K phi = w^2 M phi, and its vectors in them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.cyclic_symmetry import in_wave, sparse_wave
from rom.cyclic.modal_damping import ModalDamping
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.reduced_model import Array, ReducedModel
from rom.errors import ReducedModelError

HIGHEST_SQUARED = 1e60  # (rad/s)^2: its square must not overflow
RIGID = 1e-14  # of the largest w^2: a smaller one is that of a rigid motion
RIGID_IN_WAVE = 1e-11  # the same in a wave: coordinates of cut faces leave more round-off


def projected_modes(
    model: ReducedModel, damping: ModalDamping, static: Array, wave: NDArray[Any] | None = None
) -> ModalModel:
    """All modes of a reduced model.

    Shapes: `static` (n,), `wave` (n, k).
    """
    squared, shapes = _modes(model, wave)
    frequency = np.sqrt(squared)
    adjoint = shapes.conj().T
    return ModalModel(
        angular_frequency=frequency,
        damping=damping.coefficients(frequency),
        right=model.contact_right @ shapes,
        left=None if model.contact_left is None else model.contact_left @ shapes,
        force=adjoint @ model.force_excitation,
        static_force=adjoint @ static,
        outputs={name: vector @ shapes for name, vector in model.outputs.items()},
        shapes=shapes,
        position=model.contact_position,
        area=model.contact_area,
        n_blades=model.n_blades,
        harmonic_forces={h: adjoint @ vector for h, vector in model.force_harmonics.items()},
    )


def _modes(model: ReducedModel, wave: NDArray[Any] | None) -> tuple[Array, NDArray[Any]]:
    """Eigenvalues w^2 (k,) and mass-normalised modes (n, k)."""
    from scipy.linalg import LinAlgError, eigh

    # Symmetrised: matrices from elsewhere are symmetric only to their own round-off.
    mass: NDArray[Any] = (model.mass + model.mass.T) / 2
    stiffness: NDArray[Any] = (model.stiffness + model.stiffness.T) / 2
    if wave is not None:
        mass, stiffness = in_wave(mass, wave), in_wave(stiffness, wave)
    try:
        squared, shapes = eigh(stiffness, mass)
    except LinAlgError:
        raise ReducedModelError("mass: not positive definite, allowed: positive definite") from None
    floor = -RIGID_IN_WAVE if wave is not None else RIGID
    if squared[0] <= floor * squared[-1]:
        raise ReducedModelError(
            f"stiffness: smallest w^2 is {squared[0]:.3g} (largest {squared[-1]:.3g}), allowed: positive definite; "
            "a structure that floats freely has no static response"
        )
    if squared[-1] > HIGHEST_SQUARED:
        raise ReducedModelError(
            f"mass: too small for its stiffness: the largest w^2 is {squared[-1]:.3g} (rad/s)^2, "
            f"allowed: {HIGHEST_SQUARED:g} at most"
        )
    if wave is None:
        return squared, shapes
    rigid = squared <= RIGID_IN_WAVE * squared[-1]
    return np.where(rigid, 0.0, squared), sparse_wave(wave) @ shapes
