"""Sampled evaluation of the coupled law: one slider in the plane of the contact, friction cone (compiled)."""

import numpy as np

from nonlinear.contact.numba_cache import compiled
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array
from nonlinear.contact.return_map import ROUND_OFF, Integers, march_plane

MAX_TURNS = 200
REPEAT_TOLERANCE = 1e-13


@compiled
def evaluate_plane(
    displacement: Array,
    motion: Array,
    laws: tuple[Array, Array, Array, Array, Array],
    table: Array,
    force: Array,
    jacobian: Array,
    worst: Integers,
) -> None:
    """Add T1, T2 and their Jacobian to `force` and `jacobian`, and the worst states to `worst`.

    The slider is marched from w = 0 to its steady cycle; its derivative is marched along with it, so that the
    Jacobian is that of the computed force, memory of the start included.
    """
    normal_stiffness, tangential_stiffness, friction, interference, preload = laws
    n_samples, size = table.shape
    limit = np.empty(n_samples)
    plane = np.empty((n_samples, 2))
    state = np.empty(n_samples, dtype=np.int64)
    traction = np.empty((n_samples, 2))
    for node in range(force.shape[1]):
        offset = preload[node] + normal_stiffness[node] * interference[node]
        largest = 0.0
        for k in range(n_samples):
            load = offset + normal_stiffness[node] * motion[node, 2, k]
            limit[k] = friction[node] * max(load, 0.0)
            plane[k, 0], plane[k, 1] = motion[node, 0, k], motion[node, 1, k]
            largest = max(largest, abs(plane[k, 0]), abs(plane[k, 1]))
            worst[node] = max(worst[node], LIFT_OFF if load <= 0.0 else STICK)
        kt = tangential_stiffness[node]
        if kt == 0.0:
            continue
        turns = march_plane(plane, limit, kt, MAX_TURNS, REPEAT_TOLERANCE * largest, state, traction)
        slope = friction[node] * normal_stiffness[node]
        for k in range(n_samples):
            if state[k] == SLIP:
                worst[node] = max(worst[node], SLIP)
            for i in range(size):
                weight = (1.0 if i == 0 else 2.0) / n_samples
                for a in range(2):
                    force[i, node, a] -= weight * table[k, i] * traction[k, a]
        _march_derivative(plane, limit, kt, slope, turns, table, jacobian[node])


@compiled
def _march_derivative(
    motion: Array, limit: Array, kt: float, slope: float, turns: int, table: Array, jacobian: Array
) -> None:
    """March the slider again with its derivative in the coefficients of (u1, u2, v), and sum the last turn.

    `slope` is mu kn; `jacobian` (3, 3, 2H+1, 2H+1) of one node. At each sample dT = kt (A du - A dw) + B dv, with
    A = 1 in stick, ratio (1 - e e^T) in slip along e, 0 in lift-off, and dw follows from T = kt (u - w).
    """
    n_samples, size = table.shape
    x, y = 0.0, 0.0
    position = np.zeros((2, 3, size))  # d w / d (u1, u2, v)
    for turn in range(turns):
        last = turn == turns - 1
        for k in range(n_samples):
            tx, ty = kt * (motion[k, 0] - x), kt * (motion[k, 1] - y)
            magnitude = np.sqrt(tx * tx + ty * ty)
            stuck = limit[k] > 0.0 and magnitude <= limit[k] * (1.0 + ROUND_OFF)
            axx, axy, ayy, ex, ey = 1.0, 0.0, 1.0, 0.0, 0.0
            if limit[k] <= 0.0:
                axx, ayy = 0.0, 0.0
                x, y = motion[k, 0], motion[k, 1]
            elif not stuck:
                ex, ey = tx / magnitude, ty / magnitude
                ratio = limit[k] / magnitude
                axx, axy, ayy = ratio * ey * ey, -ratio * ex * ey, ratio * ex * ex
                x, y = motion[k, 0] - limit[k] * ex / kt, motion[k, 1] - limit[k] * ey / kt
            if stuck and not last:
                continue
            for b in range(3):
                for j in range(size):
                    du = table[k, j]
                    rx = (du if b == 0 else 0.0) - position[0, b, j]
                    ry = (du if b == 1 else 0.0) - position[1, b, j]
                    dtx = kt * (axx * rx + axy * ry) + (slope * ex * du if b == 2 else 0.0)
                    dty = kt * (axy * rx + ayy * ry) + (slope * ey * du if b == 2 else 0.0)
                    if not stuck:
                        position[0, b, j] = (du if b == 0 else 0.0) - dtx / kt
                        position[1, b, j] = (du if b == 1 else 0.0) - dty / kt
                    if last:
                        for i in range(size):
                            weight = -(1.0 if i == 0 else 2.0) / n_samples * table[k, i]
                            jacobian[0, b, i, j] += weight * dtx
                            jacobian[1, b, i, j] += weight * dty
