"""Complex modes of waves with the flow around the blades, Coriolis forces and damping: linear flutter."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rom.cyclic.cyclic_symmetry import inter_blade_phase
from rom.cyclic.natural_frequencies import natural_modes
from rom.cyclic.pole_modes import coriolis_forces
from rom.cyclic.reduced_model import ComplexArray, ReducedModel
from rom.cyclic.sector_modes import RingModes

SHAPES = 30  # modes with contact springs between which these forces act, or twice as many as asked for


def aeroelastic_modes(
    model: ReducedModel,
    modal: RingModes,
    nodal_diameter: int,
    *,
    normal: ArrayLike = 0.0,
    tangential: ArrayLike = 0.0,
    count: int = 10,
) -> ComplexArray:
    """Eigenvalues of a wave with its aerodynamic, damping and Coriolis forces, as far as these are known.

    `nodal_diameter`: n of any sign, the phase angle is 2 pi n / N_b: a wave n > 0 runs against +y, as that of an
    engine order; `normal`, `tangential` (n_c,): contact springs kn, kt of the nodes, N/m. Returns (count,): lambda,
    rad/s, of motions exp(lambda t), by ascending frequency Im lambda > 0; Re lambda > 0: flutter.
    """
    phase = inter_blade_phase(nodal_diameter, model.n_blades)
    free, springs = modal.at_phase(phase), {"normal": normal, "tangential": tangential}
    hertz, shapes = natural_modes(model, phase, count=min(max(SHAPES, 2 * count), model.size), **springs)
    # modal coordinates with free contacts, of the modes with contact springs
    share = free.shapes.conj().T @ (model.mass @ shapes)
    stiffness = np.diag((2.0 * np.pi * hertz) ** 2).astype(complex)
    damping = share.conj().T @ (free.total_damping[:, None] * share)
    if free.flow is not None:
        stiffness += share.conj().T @ (free.flow[0][:, None] * share)
    if model.has_coriolis:
        damping = damping + coriolis_forces(model, shapes)
    zero = np.zeros_like(stiffness)
    values = np.linalg.eigvals(np.block([[zero, np.eye(len(zero))], [-stiffness, -damping]]))
    values = values[values.imag > 0.0]
    return values[np.argsort(values.imag)][:count]
