"""Compiled kernels of the contact: stick intervals, the linearised friction cone, Jacobians in modal coordinates."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.numba_cache import compiled, inner
from nonlinear.contact.parameters import STICK, Array
from nonlinear.contact.return_map import Integers, jenkins_return_map

Matrix = NDArray[Any]
SMALL = 1e-3  # rate times length below which a series takes the place of the quotient
ROUND_OFF = complex(np.finfo(float).eps)


@compiled
def stick_integrals(turns: Matrix, length: Array, sigma: complex, value: Matrix, derivative: Matrix) -> None:
    """Write the integrals of e^(rate t) and of t e^(rate t), rate = i h - sigma, over t = 0 .. length.

    `turns`: e^(i h length), h = -H .. H, (M, 2H+1), as `value` and `derivative`.
    """
    count, size = turns.shape
    for m in range(count):
        extent, decay = length[m], np.exp(-sigma * length[m])
        for k in range(size):
            rate = complex(0.0, k - size // 2) - sigma
            z, end = rate * extent, turns[m, k] * decay
            if abs(z) < SMALL:
                value[m, k] = extent * (1.0 + z / 2.0 + z**2 / 6.0 + z**3 / 24.0)
                derivative[m, k] = extent**2 * (0.5 + z / 3.0 + z**2 / 8.0 + z**3 / 30.0)
            else:
                value[m, k] = (end - 1.0) / rate
                derivative[m, k] = (extent * end - value[m, k]) / rate


@compiled
def cone_periodic_response(
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


@compiled
def stick_intervals(
    motion: Array,
    limit: Array,
    stiffness: Array,
    slides: NDArray[np.bool_],
    found: tuple[Integers, Integers, Integers],
) -> None:
    """Write the steady cycles of two sliders a node, and the stick intervals in which an earlier sample has set them.

    Given: `motion` (n_c, 3, n), slip limits (n_c, n) and kt (n_c,); `slides` (n_c,): nodes that are looked at.
    Found, (n_c, 2, n) each: state and sign of the slip as of `jenkins_return_map`, and for each sample the number of
    samples of stick whose slider it has set; the last must be zero before.
    """
    state, sign, count = found
    samples = motion.shape[2]
    source = np.empty(samples, np.int64)
    for node in range(motion.shape[0]):
        if not slides[node]:
            continue
        for a in range(2):
            jenkins_return_map(motion[node, a], limit[node], stiffness[node], state[node, a], source, sign[node, a])
            for k in range(samples):
                if state[node, a, k] == STICK and source[k] >= 0:
                    count[node, a, source[k]] += 1


@compiled
def relative_motion_parts(faces: Array, ahead: Matrix, first: int, parts: Matrix) -> None:
    """Write B^H K B = parts 0 + cos(kappa) parts 1 + sin(kappa) parts 2, (3, S, q, S, q), in harmonics from `first`.

    B = R - e^(i (h psi + kappa)) L of the modes of the faces, R and L. `faces` (2, q, 2, q, 2H+1, 2H+1): the Jacobian
    of real coefficients in these modes, R^T K R, R^T K L, L^T K R, L^T K L. `ahead`: e^(i h psi), (2H+1,).
    """
    q, size = faces.shape[1], faces.shape[4]
    values = np.empty((2, 2, size, size), np.complex128)
    for i in range(q):
        for j in range(q):
            for a in range(2):
                for b in range(2):
                    _in_harmonics(faces[a, i, b, j], values[a, b])
            for h in range(first, size):
                for g in range(first, size):
                    one = -values[0, 1, h, g] * ahead[g]
                    other = -values[1, 0, h, g] * ahead[h].conjugate()
                    both = values[1, 1, h, g] * ahead[g] * ahead[h].conjugate()
                    parts[0, h - first, i, g - first, j] = values[0, 0, h, g] + both
                    parts[1, h - first, i, g - first, j] = one + other
                    parts[2, h - first, i, g - first, j] = 1j * (one - other)


@compiled
def all_in_harmonics(values: Array, result: Matrix) -> None:
    """Write matrices (k, 2H+1, 2H+1) of real coefficients as those of the amplitudes of the harmonics."""
    for k in range(len(values)):
        _in_harmonics(values[k], result[k])


@inner
def _in_harmonics(values: Array, result: Matrix) -> None:
    """A matrix of real coefficients as that of the amplitudes of the harmonics 0, 1, -1, 2, -2, ..., (2H+1, 2H+1)."""
    size = values.shape[0]
    result[0, 0] = values[0, 0]
    for h in range(1, size, 2):
        row = complex(values[0, h], -values[0, h + 1])
        column = complex(0.5 * values[h, 0], 0.5 * values[h + 1, 0])
        result[0, h], result[0, h + 1] = row, row.conjugate()
        result[h, 0], result[h + 1, 0] = column, column.conjugate()
        for g in range(1, size, 2):
            cc, cs, sc, ss = values[h, g], values[h, g + 1], values[h + 1, g], values[h + 1, g + 1]
            same, opposite = complex(0.5 * (cc + ss), 0.5 * (sc - cs)), complex(0.5 * (cc - ss), 0.5 * (sc + cs))
            result[h, g], result[h + 1, g + 1] = same, same.conjugate()
            result[h, g + 1], result[h + 1, g] = opposite, opposite.conjugate()
