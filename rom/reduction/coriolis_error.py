"""What leaving out the Coriolis forces costs: the change of the natural frequencies."""

from __future__ import annotations

import numpy as np

from rom.cyclic.natural_frequencies import frequencies_without_and_with_coriolis
from rom.cyclic.reduced_model import ReducedModel
from rom.reduction.model_comparison import LinearOperation


def coriolis_error(model: ReducedModel, operation: LinearOperation) -> float | None:
    """Largest relative change of a natural frequency in the range by the Coriolis forces, in any contact condition.

    Parameters
    ----------
    model : ReducedModel
        The model at its speed.
    operation : LinearOperation
        Range, phase and springs.

    Returns
    -------
    float or None
        The change, that of the first frequency above the range where the range holds none, 0 at rest; None where the
        model does not say its speed or has no Coriolis matrix.

    Raises
    ------
    ReducedModelError
        The mass is not positive definite.

    Examples
    --------
    Equal springs in a frame that turns with W = 0.1 w_0: (1 + 0.1^2)^(1/2) + 0.1 - 1

    >>> from rom import LinearOperation, ReducedModel, coriolis_error
    >>> g, one, none = np.array([[0.0, -2.0], [2.0, 0.0]]), np.ones(2), np.zeros(1)
    >>> turning = {"coriolis": g, "speed_rpm": 3000.0 / np.pi}  # W = 100 rad/s
    >>> model = ReducedModel(np.eye(2), 1e6 * np.eye(2), np.eye(3, 2), np.zeros((1, 3)), one, {"tip": one}, **turning)
    >>> round(coriolis_error(model, LinearOperation((100.0, 200.0), 0.0, none, none)), 6)
    0.104988
    """
    if model.speed_rpm == 0.0:
        return 0.0
    if model.speed_rpm is None or model.coriolis is None:
        return None
    low, high = operation.frequency_hz
    inside: list[float] = []
    above: list[float] = []
    for normal, tangential in operation.contact_conditions().values():
        without, found = frequencies_without_and_with_coriolis(model, operation.phase, (normal, tangential))
        change = np.abs(found / without - 1.0)
        first, last = np.searchsorted(without, low), np.searchsorted(without, high, side="right")
        inside.extend(change[first:last])
        above.extend(change[last : last + 1])
    return float(max(inside or above, default=0.0))
