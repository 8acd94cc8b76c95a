"""The basis of the condensed factors of the compiled corrector: how many motions of the contact face, if any."""

import math

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.corrector_state import FORCES, MOTIONS, PAIRS, Condensation
from nonlinear.harmonic_balance.residual import HarmonicBalance

LARGEST_SHARE = 0.4  # of motions in the relative displacements
TYPICAL = 0.3  # contraction of the refinement, relative to what is left of G k where this is small
LARGEST_CONTRACTION = 0.2  # beyond, condensed factors are not tried
# errors of the solutions of a point, relative; number of these solutions
SOLVED, SOLUTIONS = 1e-5, 4
PROBES = 3
OLD = 1e-2  # contraction with factors of another iterate
PRODUCTS = 2.0  # work of a product with the Jacobian relative to that of as many multiplications in factors


def condensation(balance: HarmonicBalance, stiffness: float, omega_range: tuple[float, float]) -> Condensation:
    """The motions with the least estimated work, with the scratch of the kernels; none where dense factors take less.

    `stiffness`: the largest one of a contact node, N/m. What is chosen depends on the problem alone, not on what was
    solved before.
    """
    receptance, modes, values = balance.receptance, np.zeros((3 * balance.n_contacts, 0)), np.zeros(0)
    if not receptance.large:
        modes, values = receptance.common_interface_modes(*omega_range)
    return _with_scratch(balance, modes[:, : motion_count(balance, values * stiffness)])


def motion_count(balance: HarmonicBalance, left: Array) -> int:
    """The number of motions with the least estimated work; 0 where dense factors take less.

    `left` (3 n_c,): bounds of G k in each motion; empty: unknown, as of faces with many nodes.
    """
    rows, face, modes = 2 * balance.n_harmonics + 1, 3 * balance.n_contacts, balance.receptance.relative.shape[2]
    product = PRODUCTS * (8.0 * (balance.n_harmonics + 1) * face * modes + PAIRS / 3.0 * face * rows * rows)
    n, receptance = balance.size, 4.0 * balance.n_harmonics * modes
    dense = n**3 / 3.0 + 3.0 * n * n + receptance * face**2
    least, best = dense + _solutions(n * n, product, OLD), 0
    for count in range(1, min(int(LARGEST_SHARE * face) + 1, left.size)):
        largest = float(left[count:].max())
        contraction = TYPICAL * largest / (1.0 + largest)
        size = rows * count
        factors = size**3 / 3.0 + (2.0 * count + PAIRS / 3.0 * face) * size * size + receptance * count**2
        solution = size * size + PAIRS / 3.0 * face * rows * rows + 2.0 * face * size
        work = factors + _solutions(solution, product, contraction)
        if contraction < LARGEST_CONTRACTION and work < least:
            least, best = work, count
    return best


def _solutions(solution: float, product: float, contraction: float) -> float:
    """Estimate of the multiplications for the solutions of a point by iterative refinement."""
    refinements = max(1.0, math.log(SOLVED) / math.log(max(contraction, SOLVED)) - 1.0)
    return SOLUTIONS * (solution + refinements * (solution + product))


def _with_scratch(balance: HarmonicBalance, motions: Array) -> Condensation:
    """What the kernels need of the motions Q, (3 n_c, r)."""
    rows, nodes, (face, r) = 2 * balance.n_harmonics + 1, balance.n_contacts, motions.shape
    by_node = motions.reshape(nodes, 3, r)
    products = by_node[:, FORCES, :, None] * by_node[:, MOTIONS, None, :]
    relative = np.ascontiguousarray(motions.T @ balance.receptance.relative)
    size = rows * r
    return Condensation(
        motions=np.ascontiguousarray(motions),
        transposed=np.ascontiguousarray(motions.T),
        products=np.ascontiguousarray(products.reshape(nodes * PAIRS, r * r).T),
        relative=relative,
        adjoint=np.ascontiguousarray(balance.receptance.adjoint @ motions),
        static=np.ascontiguousarray(motions.T @ balance.receptance.static_matrix @ motions),
        weighted=np.empty(relative.shape[1:], complex),
        receptance=np.empty((r, r), complex),
        flexibility=np.empty((balance.n_harmonics, 2 * r, 2 * r)),
        stiffness=np.empty((nodes * PAIRS, rows * rows)),
        coupling=np.empty((r * r, rows * rows)),
        projected=np.empty((size, size)),
        moved=np.empty((size, size)),
        force=np.empty((rows, face)),
        reduced=np.empty((rows, r)),
        probes=np.random.default_rng(0).standard_normal((PROBES, rows * face + 1)),
    )
