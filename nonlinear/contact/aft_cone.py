"""AFT for the friction cone: one slider in the contact plane, sampled, with its derivative (compiled)."""

import numpy as np

from nonlinear.contact.numba_cache import compiled, inner
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array
from nonlinear.contact.return_map import MAX_PERIODS, REPEAT_TOLERANCE, ROUND_OFF, Integers, cone_return_map

Law = tuple[Array, Array, Array, Array, Array]
Tangent = tuple[float, float, float, float, float]


@compiled
def evaluate_cone(motion: Array, law: Law, table: Array, force: Array, jacobian: Array, worst: Integers) -> None:
    """Add the coefficients of -T1, -T2 and their Jacobian, and the worst states.

    `motion` (n_c, 3, samples): u1, u2 and the unclipped load; `law`: kn, kt, mu and two more, (n_c,) each; `table`
    (samples, 2H+1): basis functions. The return map starts from w = 0 and goes on to the steady cycle; its derivative
    goes the same way, so that the Jacobian is that of the computed force, memory of the start included.
    """
    normal_stiffness, tangential_stiffness, friction, _, _ = law
    n_samples, size = table.shape
    limit = np.empty(n_samples)
    plane = np.empty((n_samples, 2))
    state = np.empty(n_samples, dtype=np.int64)
    traction = np.empty((n_samples, 2))
    for node in range(force.shape[1]):
        largest = 0.0
        for k in range(n_samples):
            load = motion[node, 2, k]
            limit[k] = friction[node] * max(load, 0.0)
            plane[k, 0], plane[k, 1] = motion[node, 0, k], motion[node, 1, k]
            largest = max(largest, abs(plane[k, 0]), abs(plane[k, 1]))
            worst[node] = max(worst[node], LIFT_OFF if load <= 0.0 else STICK)
        kt = tangential_stiffness[node]
        if kt == 0.0:
            continue
        periods = cone_return_map(plane, limit, kt, MAX_PERIODS, REPEAT_TOLERANCE * largest, state, traction)
        for k in range(n_samples):
            if state[k] == SLIP:
                worst[node] = max(worst[node], SLIP)
            for i in range(size):
                weight = (1.0 if i == 0 else 2.0) / n_samples
                force[i, node, 0] -= weight * table[k, i] * traction[k, 0]
                force[i, node, 1] -= weight * table[k, i] * traction[k, 1]
        mu_kn = friction[node] * normal_stiffness[node]
        _differentiate(plane, limit, kt, mu_kn, periods, table, jacobian[node])


@compiled
def _differentiate(
    motion: Array, limit: Array, kt: float, mu_kn: float, periods: int, table: Array, jacobian: Array
) -> None:
    """Repeat the return map with its derivative by the coefficients of (u1, u2, d_n); sum over the last period.

    `jacobian` (3, 3, 2H+1, 2H+1) of one node.
    """
    n_samples, size = table.shape
    x, y = 0.0, 0.0
    position = np.zeros((2, 3, size))  # d w / d (u1, u2, d_n)
    traction = np.zeros((2, 3, size))  # d T / d (u1, u2, d_n)
    for period in range(periods):
        for k in range(n_samples):
            tx, ty = kt * (motion[k, 0] - x), kt * (motion[k, 1] - y)
            magnitude = np.sqrt(tx * tx + ty * ty)
            sticks = limit[k] > 0.0 and magnitude <= limit[k] * (1.0 + ROUND_OFF)
            tangent = (1.0, 0.0, 1.0, 0.0, 0.0)
            if limit[k] <= 0.0:
                tangent = (0.0, 0.0, 0.0, 0.0, 0.0)
                x, y = motion[k, 0], motion[k, 1]
            elif not sticks:
                ex, ey, ratio = tx / magnitude, ty / magnitude, limit[k] / magnitude
                tangent = (ratio * ey * ey, -ratio * ex * ey, ratio * ex * ex, ex, ey)
                x, y = motion[k, 0] - limit[k] * ex / kt, motion[k, 1] - limit[k] * ey / kt
            if not sticks or period == periods - 1:
                _write_traction(tangent, kt, mu_kn, table[k], position, traction)
            if not sticks:
                _move(kt, table[k], traction, position)
            if period == periods - 1:
                _add_coefficients(table[k], n_samples, traction, jacobian)


@inner
def _write_traction(
    tangent: Tangent, kt: float, mu_kn: float, basis: Array, position: Array, traction: Array
) -> None:
    """Write dT = kt A (du - dw) + mu kn e dd_n for unit coefficients, (2, 3, 2H+1).

    `tangent`: A11, A12, A22 and e; A = 1 in stick, ratio (1 - e e^T) in slip along e, 0 in lift-off.
    """
    axx, axy, ayy, ex, ey = tangent
    for b in range(3):
        for j in range(basis.shape[0]):
            du = basis[j]
            rx = (du if b == 0 else 0.0) - position[0, b, j]
            ry = (du if b == 1 else 0.0) - position[1, b, j]
            traction[0, b, j] = kt * (axx * rx + axy * ry) + (mu_kn * ex * du if b == 2 else 0.0)
            traction[1, b, j] = kt * (axy * rx + ayy * ry) + (mu_kn * ey * du if b == 2 else 0.0)


@inner
def _move(kt: float, basis: Array, traction: Array, position: Array) -> None:
    """Write dw = du - dT / kt."""
    for b in range(3):
        for j in range(basis.shape[0]):
            position[0, b, j] = (basis[j] if b == 0 else 0.0) - traction[0, b, j] / kt
            position[1, b, j] = (basis[j] if b == 1 else 0.0) - traction[1, b, j] / kt


@inner
def _add_coefficients(basis: Array, n_samples: int, traction: Array, jacobian: Array) -> None:
    """Add what one sample contributes to the Fourier coefficients of -dT."""
    for a in range(2):
        for b in range(3):
            for i in range(basis.shape[0]):
                weight = -(1.0 if i == 0 else 2.0) / n_samples * basis[i]
                for j in range(basis.shape[0]):
                    jacobian[a, b, i, j] += weight * traction[a, b, j]
