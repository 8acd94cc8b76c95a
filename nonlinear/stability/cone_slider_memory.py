"""Memory of sliders under the friction cone: what e^(lambda t) changes in the contact Jacobian."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.numba_cache import compiled
from nonlinear.contact.parameters import LIFT_OFF, SLIP, STICK, Array, ContactParameters
from nonlinear.stability.block_matrices import Matrix

MAX_TURNS = 200
REPEATED = 1e-12  # of the largest motion: a cycle that comes back this near is the steady one


@dataclass(frozen=True)
class ConeSliderMemory:
    """The sliders of M nodes over N instants of a cycle, linearised.

    Under the perturbation e^(lambda theta / w) p(theta) of a contact motion its slider moves by e^(...) y(theta),

        y_k = e^(-lambda step / w) P_k y_(k-1) + D_k p_k,

    P = 1 in stick, 0 in lift-off and ratio (1 - e e^T) in slip along e: the direction of slip forgets slowly.

    node : (M,). carried, driven : P (M, N, 2, 2) and D (M, N, 2, 3). stiffness : kt, (M,). table : the basis
    functions at the instants, (N, 2H+1).
    """

    node: NDArray[np.int64]
    carried: Array
    driven: Array
    stiffness: Array
    table: Array

    def jacobian(self, exponent: complex) -> tuple[Matrix, Matrix]:
        """The Jacobian at lambda = `exponent` w beyond that at 0, and its derivative in lambda / w.

        (M, 2, 3, 2H+1, 2H+1) as in `ContactForces`, rows t1 and t2 of the force; real for a real exponent.
        """
        value, slope = self._moments(exponent)
        beyond = value - self._at_rest
        return (beyond, slope) if isinstance(exponent, complex) else (beyond.real, slope.real)

    @cached_property
    def _at_rest(self) -> Matrix:
        return self._moments(0.0)[0]

    def _moments(self, exponent: complex) -> tuple[Matrix, Matrix]:
        """Fourier coefficients of kt y for unit coefficients of p, and their derivative, (M, 2, 3, 2H+1, 2H+1)."""
        count, (n, size) = self.node.size, self.table.shape
        step = 2.0 * np.pi / n
        factor = complex(np.exp(-exponent * step))
        weights = (self.table * np.append(1.0, np.full(size - 1, 2.0)) / n).T
        result = np.empty((count, size, 12 * size), dtype=complex)
        positions = np.empty((n, 12 * size), dtype=complex)
        for k in range(count):
            _periodic(self.carried[k], self.driven[k], self.table, factor, step, positions)
            result[k] = (self.stiffness[k] * weights @ positions.view(float)).view(complex)
        both = result.reshape(count, size, 2, 2, 3, size).transpose(2, 0, 3, 4, 1, 5)
        return both[0], both[1]


@compiled
def _periodic(carried: Array, driven: Array, table: Array, factor: complex, step: float, found: Matrix) -> None:
    """Write y, which repeats itself after N instants, and its derivative in lambda / w to `found`, (N, 2 * 6 (2H+1)).

    y_k = factor P_k y_(k-1) + D_k p_k, (2, 3, 2H+1) for the unit coefficients p of the three directions; P, D:
    `carried` (N, 2, 2) and `driven` (N, 2, 3); factor: e^(-lambda step / w). The derivative follows the same rule
    with -step factor P_k y_(k-1) in place of D_k p_k.
    """
    n, size = table.shape
    columns = 3 * size
    last = np.zeros((2, 2, columns), dtype=np.complex128)  # of y and of its derivative
    product = np.zeros((2, 2), dtype=np.complex128)
    product[0, 0] = product[1, 1] = 1.0
    for turn in range(3):
        for k in range(n):
            a, b = factor * carried[k, 0, 0], factor * carried[k, 0, 1]
            c, d = factor * carried[k, 1, 0], factor * carried[k, 1, 1]
            if turn == 0:
                for j in range(2):
                    x, y = product[0, j], product[1, j]
                    product[0, j], product[1, j] = a * x + b * y, c * x + d * y
            for direction in range(3):
                first, second = driven[k, 0, direction], driven[k, 1, direction]
                for j in range(size):
                    column = direction * size + j
                    x, y = last[0, 0, column], last[0, 1, column]
                    if turn > 0:
                        u, v = last[1, 0, column] - step * x, last[1, 1, column] - step * y
                        last[1, 0, column], last[1, 1, column] = a * u + b * v, c * u + d * v
                    last[0, 0, column] = a * x + b * y + first * table[k, j]
                    last[0, 1, column] = c * x + d * y + second * table[k, j]
                    if turn == 2:
                        found[k, column], found[k, columns + column] = last[0, 0, column], last[0, 1, column]
                        found[k, 2 * columns + column] = last[1, 0, column]
                        found[k, 3 * columns + column] = last[1, 1, column]
        if turn < 2:  # the beginning that comes back, (1 - product)^-1 times what began with 0 ended with
            determinant = (1.0 - product[0, 0]) * (1.0 - product[1, 1]) - product[0, 1] * product[1, 0]
            for column in range(columns):
                x, y = last[turn, 0, column], last[turn, 1, column]
                last[turn, 0, column] = ((1.0 - product[1, 1]) * x + product[0, 1] * y) / determinant
                last[turn, 1, column] = (product[1, 0] * x + (1.0 - product[0, 0]) * y) / determinant


def cone_slider_memory(
    parameters: ContactParameters, table: Array, motion: Array, speed: Array
) -> ConeSliderMemory | None:
    """Memory of the sliders under a periodic motion; None if each of them sticks or is open throughout.

    table (N, 2H+1): basis functions at equidistant instants; motion, speed (n_c, 3, N): displacement and its
    derivative in theta there.
    """
    from nonlinear.contact.return_map import cone_return_map

    p, n = parameters, table.shape[0]
    load = p.normal_load(motion[:, 2].T).T
    found = []
    for k in np.flatnonzero((p.tangential_stiffness > 0.0) & (p.friction > 0.0) & np.any(load > 0.0, axis=1)):
        limit, kt = p.friction[k] * load[k], float(p.tangential_stiffness[k])
        plane, traction = np.ascontiguousarray(motion[k, :2].T), np.empty((n, 2))
        state = np.empty(n, dtype=np.int64)
        cone_return_map(plane, limit, kt, MAX_TURNS, REPEATED * float(np.abs(plane).max()), state, traction)
        if np.all(state == STICK):
            continue
        slope = p.friction[k] * p.normal_stiffness[k] / kt
        found.append((k, *_linearised(plane, speed[k], limit / kt, slope, state, traction / kt)))
    if not found:
        return None
    node, carried, driven = zip(*found, strict=True)
    index = np.array(node, dtype=np.int64)
    return ConeSliderMemory(index, np.array(carried), np.array(driven), p.tangential_stiffness[index], table)


def _linearised(
    plane: Array, speed: Array, reach: Array, slope: float, state: NDArray[np.int64], stretch: Array
) -> tuple[Array, Array]:
    """P (N, 2, 2) and D (N, 2, 3) of one slider w = u - stretch, |stretch| = reach in slip; slope: d reach / d d_n.

    plane (N, 2): u; speed (3, N). Where contact begins, the slider starts from dw = du - u' dd_n / d_n'.
    """
    n = len(plane)
    before = np.roll(plane - stretch, 1, axis=0)
    trial = plane - before
    far = np.linalg.norm(trial, axis=1)
    along = trial / np.where(far > 0.0, far, 1.0)[:, None]
    ratio = np.divide(reach, far, out=np.zeros(n), where=far > 0.0)
    across = np.eye(2) - along[:, :, None] * along[:, None, :]
    slips, sticks = (state == SLIP)[:, None, None], (state == STICK)[:, None, None]
    carried = np.where(slips, ratio[:, None, None] * across, np.where(sticks, np.eye(2), 0.0))
    driven = np.zeros((n, 2, 3))
    driven[:, :, :2] = np.eye(2) - carried
    driven[:, :, 2] = np.where(slips[:, 0], -slope * along, 0.0)
    touches = (state != LIFT_OFF) & (np.roll(state, 1) == LIFT_OFF)
    closing = speed[2, touches]
    start = np.zeros((closing.size, 2, 3))
    start[:, :, :2] = np.eye(2)
    start[:, :, 2] = -(speed[:2, touches] / np.where(closing == 0.0, np.inf, closing)).T
    driven[touches] += carried[touches] @ start
    carried[touches] = 0.0
    return carried, driven
