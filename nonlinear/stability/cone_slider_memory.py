"""Slider memory under the friction cone: the contact Jacobian of a perturbation that grows as e^(lambda t)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.numba_cache import compiled
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactParameters
from nonlinear.stability.block_matrices import Matrix

REPEAT_TOLERANCE = 1e-12  # of the largest motion: a cycle that comes back this near is the steady one
ROUND_OFF = complex(np.finfo(float).eps)


@dataclass(frozen=True)
class ConeSliderMemory:
    """The sliders of M nodes over N instants of a cycle, linearised.

    Under the perturbation e^(sigma theta) p(theta) of a contact motion, sigma = lambda / omega, its slider moves by
    e^(sigma theta) dw(theta),

        dw_k = e^(-sigma 2 pi / N) Phi_k dw_(k-1) + Gamma_k p_k,

    Phi = 1 in stick, 0 in lift-off and ratio (1 - e e^T) in slip along e, ratio = mu N / kt over the length of the
    trial deflection: the direction of slip forgets slowly.
    """

    node: NDArray[np.int64]  # (M,), the nodes
    transition: Array  # (M, N, 2, 2), phi
    input_matrix: Array  # (M, N, 2, 3), gamma
    stiffness: Array  # (M,), kt, N/m
    table: Array  # (N, 2H+1), basis functions at the instants

    def jacobian(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """The contact Jacobian at `sigma` beyond that at 0.

        Shapes: returns `change, derivative` (M, 2, 3, 2H+1, 2H+1).
        """
        value, derivative = self._coefficients(sigma)
        change = value - self._periodic
        return (change, derivative) if isinstance(sigma, complex) else (change.real, derivative.real)

    @cached_property
    def _periodic(self) -> Matrix:
        """The coefficients at sigma = 0."""
        return self._coefficients(0.0)[0]

    def _coefficients(self, sigma: complex) -> tuple[Matrix, Matrix]:
        """Fourier coefficients of kt dw for unit coefficients of p, and their derivative, (M, 2, 3, 2H+1, 2H+1)."""
        count, (n, size) = self.node.size, self.table.shape
        step = 2.0 * np.pi / n
        decay = complex(np.exp(-sigma * step))
        weights = (self.table * np.append(1.0, np.full(size - 1, 2.0)) / n).T
        result = np.empty((count, size, 12 * size), dtype=complex)
        response = np.empty((n, 12 * size), dtype=complex)
        for k in range(count):
            _periodic_response(self.transition[k], self.input_matrix[k], self.table, decay, step, response)
            result[k] = (self.stiffness[k] * weights @ response.view(float)).view(complex)
        both = result.reshape(count, size, 2, 2, 3, size).transpose(2, 0, 3, 4, 1, 5)
        return both[0], both[1]


@compiled
def _periodic_response(
    transition: Array, gamma: Array, table: Array, decay: complex, step: float, response: Matrix
) -> None:
    """Write the N-periodic dw and its derivative in sigma to `response`, (N, 2 * 6 (2H+1)).

    dw_k = decay Phi_k dw_(k-1) + Gamma_k p_k, (2, 3, 2H+1) for the unit coefficients p of the three directions; Phi,
    Gamma: `transition` (N, 2, 2) and `gamma` (N, 2, 3); decay: e^(-sigma step). The derivative follows the same rule
    with -step decay Phi_k dw_(k-1) in place of Gamma_k p_k. First period: dw from 0, and the monodromy matrix M; the
    periodic dw follows. Second period: its derivative from 0, and the periodic one follows. Third period: both.
    A slider that slips or opens at some instant forgets at least one direction: M has rank 1 at most, and

        (1 - M)^-1 s = s + M s / (1 - tr M).

    Where tr M = 1, the slider by itself has this exponent: dw has a pole, which is missed by round-off.
    """
    n, size = table.shape
    columns = 3 * size
    state = np.zeros((2, 2, columns), dtype=np.complex128)  # dw and its derivative
    monodromy = np.zeros((2, 2), dtype=np.complex128)
    monodromy[0, 0] = monodromy[1, 1] = 1.0
    for period in range(3):
        for k in range(n):
            a, b = decay * transition[k, 0, 0], decay * transition[k, 0, 1]
            c, d = decay * transition[k, 1, 0], decay * transition[k, 1, 1]
            if period == 0:
                for j in range(2):
                    x, y = monodromy[0, j], monodromy[1, j]
                    monodromy[0, j], monodromy[1, j] = a * x + b * y, c * x + d * y
            _advance((a, b, c, d), gamma[k], table[k], step, period > 0, state)
            if period == 2:
                response[k] = state.reshape(4 * columns)
        if period < 2:  # (1 - M)^-1 times what starting from 0 ended with
            rest = 1.0 - (monodromy[0, 0] + monodromy[1, 1])
            if rest == 0.0:
                rest = ROUND_OFF
            for column in range(columns):
                x, y = state[period, 0, column], state[period, 1, column]
                state[period, 0, column] = x + (monodromy[0, 0] * x + monodromy[0, 1] * y) / rest
                state[period, 1, column] = y + (monodromy[1, 0] * x + monodromy[1, 1] * y) / rest


@compiled
def _advance(
    phi: tuple[complex, complex, complex, complex],
    gamma: Array,
    basis: Array,
    step: float,
    derivative: bool,
    state: Matrix,
) -> None:
    """Advance dw and, if asked for, its `derivative` in sigma by one instant: `state` (2, 2, 3 (2H+1)), in place."""
    a, b, c, d = phi
    size = basis.size
    for direction in range(3):
        first, second = gamma[0, direction], gamma[1, direction]
        for j in range(size):
            column = direction * size + j
            x, y = state[0, 0, column], state[0, 1, column]
            if derivative:
                u, v = state[1, 0, column] - step * x, state[1, 1, column] - step * y
                state[1, 0, column], state[1, 1, column] = a * u + b * v, c * u + d * v
            state[0, 0, column] = a * x + b * y + first * basis[j]
            state[0, 1, column] = c * x + d * y + second * basis[j]


def cone_slider_memory(
    parameters: ContactParameters, table: Array, motion: Array, speed: Array
) -> ConeSliderMemory | None:
    """Slider memory under a periodic motion; None if each of the sliders sticks or is open throughout.

    Shapes: `table` (N, 2H+1), `motion` (n_c, 3, N), `speed` (n_c, 3, N).
    """
    from nonlinear.contact.return_map import MAX_PERIODS, cone_return_map

    p, n = parameters, table.shape[0]
    load = p.normal_load(motion[:, 2].T).T
    found = []
    for k in np.flatnonzero(p.can_stick & np.any(load > 0.0, axis=1)):
        limit, kt = p.friction[k] * load[k], float(p.tangential_stiffness[k])
        plane, traction = np.ascontiguousarray(motion[k, :2].T), np.empty((n, 2))
        state = np.empty(n, dtype=np.int64)
        cone_return_map(plane, limit, kt, MAX_PERIODS, REPEAT_TOLERANCE * float(np.abs(plane).max()), state, traction)
        if np.all(state == STICK):
            continue
        limit_dn = p.friction[k] * p.normal_stiffness[k] / kt
        found.append((k, *_linearised(plane, speed[k], limit / kt, limit_dn, state, traction / kt)))
    if not found:
        return None
    node, transition, gamma = zip(*found, strict=True)
    index = np.array(node, dtype=np.int64)
    return ConeSliderMemory(index, np.array(transition), np.array(gamma), p.tangential_stiffness[index], table)


def _linearised(
    plane: Array, speed: Array, limit: Array, limit_dn: float, state: NDArray[np.int64], deflection: Array
) -> tuple[Array, Array]:
    """Phi (N, 2, 2) and Gamma (N, 2, 3) of one slider.

    Where contact begins, the slider starts from dw = du - u' dd_n / d_n'.
    Shapes: `plane` (N, 2), `speed` (3, N), `limit` (N,), `state` (N,), `deflection` (N, 2).
    """
    n = len(plane)
    before = np.roll(plane - deflection, 1, axis=0)
    trial = plane - before
    length = np.linalg.norm(trial, axis=1)
    along = trial / np.where(length > 0.0, length, 1.0)[:, None]
    ratio = np.divide(limit, length, out=np.zeros(n), where=length > 0.0)
    across = np.eye(2) - along[:, :, None] * along[:, None, :]
    slips, sticks = (state == SLIP)[:, None, None], (state == STICK)[:, None, None]
    transition = np.where(slips, ratio[:, None, None] * across, np.where(sticks, np.eye(2), 0.0))
    gamma = np.zeros((n, 2, 3))
    gamma[:, :, :2] = np.eye(2) - transition
    gamma[:, :, 2] = np.where(slips[:, 0], -limit_dn * along, 0.0)
    touches = (state != LIFT_OFF) & (np.roll(state, 1) == LIFT_OFF)
    closing = speed[2, touches]
    start = np.zeros((closing.size, 2, 3))
    start[:, :, :2] = np.eye(2)
    start[:, :, 2] = -(speed[:2, touches] / np.where(closing == 0.0, np.inf, closing)).T
    gamma[touches] += transition[touches] @ start
    transition[touches] = 0.0
    return transition, gamma
