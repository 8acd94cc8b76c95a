"""The modes of a ring: of a blade alone, the same in every wave, or of a sector of a bladed disk."""

import numpy as np
from numpy.typing import ArrayLike

from rom.cyclic.modal_damping import ModalDamping
from rom.cyclic.modal_model import ModalModel
from rom.cyclic.projected_modes import projected_modes
from rom.cyclic.reduced_model import Array, ReducedModel
from rom.cyclic.sector_modes import SectorModes
from rom.errors import ReducedModelError
from rom.units import angular_speed

RingModes = ModalModel | SectorModes


def modal_model(
    model: ReducedModel,
    *,
    damping_ratio: ArrayLike | None = None,
    rayleigh: tuple[float, float] | None = None,
    speed_rpm: float | None = None,
) -> RingModes:
    """Solve K phi = w^2 M phi of the reduced system for all its modes.

    Those of a sector with cut faces are solved wave by wave, when they are asked for.

    Parameters
    ----------
    model : ReducedModel
        The reduced model.
    damping_ratio : float or sequence of float, optional
        zeta, one number for all modes or one for each of the first modes; the last one holds for the modes above.
    rayleigh : (float, float), optional
        (a, b) of C = a M + b K, 2 zeta_m w_m = a + b w_m^2. Give this or `damping_ratio`.
    speed_rpm : float, optional
        Rotational speed of the centrifugal force, rev/min. By default the speed that the model was stiffened for,
        0 where the model does not say.

    Returns
    -------
    ModalModel or SectorModes
        The modes of a blade alone, or those of a sector with cut faces.

    Raises
    ------
    ReducedModelError
        The mass or the stiffness is not positive definite (a rigid-body mode of a blade has no static response);
        damping is given twice, not at all, or negative; the model was stiffened for another speed than `speed_rpm`,
        or has no centrifugal force; the number of sectors is missing, or a static force pushes a disk that floats.

    Examples
    --------
    >>> from rom import ReducedModel, modal_model
    >>> along_n, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> model = ReducedModel(np.eye(1), 1e6 * np.eye(1), along_n, np.zeros((1, 3)), one, {"tip": one})
    >>> print(modal_model(model, damping_ratio=0.01).damping.round(6))  # 2 zeta w, w = 1000 rad/s
    [20.]
    """
    damping, static = ModalDamping(damping_ratio, rayleigh), _static_force(model, speed_rpm)
    if model.has_disk:
        return SectorModes(model, damping, static)
    return projected_modes(model, damping, static)


def _static_force(model: ReducedModel, speed_rpm: float | None) -> Array:
    """Static force (n,) of harmonic 0: centrifugal force at the speed, and any other."""
    stiffened = model.speed_rpm
    speed = (stiffened or 0.0) if speed_rpm is None else speed_rpm
    if stiffened is not None and speed != stiffened:
        raise ReducedModelError(
            f"load.speed_rpm = {speed:g}: the model was stiffened for {stiffened:g} rev/min, allowed: that speed"
        )
    static = np.zeros(model.size)
    if model.force_static is not None:
        static = static + model.force_static
    if speed != 0.0:
        if model.force_centrifugal is None:
            raise ReducedModelError("force/centrifugal: missing, but load.speed_rpm is not 0")
        static = static + model.force_centrifugal * angular_speed(speed) ** 2
    return static
