"""Linear springs between facing contact nodes: the limits of the contact without friction, slip or separation.

Free contacts have no springs, sliding ones without friction the normal springs, stuck ones all springs.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg.lapack import dgetrf, dgetrs, zgetrf, zgetrs

MORE_VECTORS = 20  # of the subspace iteration, beyond twice the frequencies asked for
MOST_ITERATIONS = 40
CONVERGED = 1e-13  # relative change of a squared frequency


def contact_springs(n_contacts: int, normal: ArrayLike, tangential: ArrayLike) -> NDArray[np.float64]:
    """Spring stiffness of the contact nodes along t1, t2 and n: (kt, kt, kn), an array (n_c, 3) in N/m.

    `normal`, `tangential` (n_c,): stiffness kn and kt of each node, N/m.
    """
    springs = np.empty((n_contacts, 3))
    springs[:, :2] = np.broadcast_to(np.asarray(tangential, dtype=float), n_contacts)[:, None]
    springs[:, 2] = np.asarray(normal, dtype=float)
    return springs


def spring_stiffness(motion: NDArray[Any], springs: NDArray[np.float64]) -> NDArray[Any]:
    """Stiffness B^H diag(k) B of springs between contact nodes.

    `motion` (3 n_c, n): relative motion B of the nodes, real or complex; `springs` (n_c, 3): springs k along t1, t2
    and n, N/m. Returns (n, n): stiffness, N/m in the coordinates of `motion`.
    """
    return motion.conj().T @ (springs.reshape(-1, 1) * motion)


def supported_frequencies(
    frequency: NDArray[np.float64], motion: NDArray[Any], springs: NDArray[np.float64], highest: float
) -> NDArray[np.float64] | None:
    """Natural frequencies up to a limit with springs, by subspace iteration; None if it does not converge.

    With W = diag(w^2) of the modes without springs, (W + B^H k B)^-1 = W^-1 - W^-1 B^H s C^-1 s B W^-1, where
    s = k^(1/2) and C = I + s B W^-1 B^H s. The start are the modes with w up to the limit and more: springs only
    raise frequencies, hence no vector orthogonal to these belongs to a frequency below the limit. Their number is
    that of the modes below the limit less the negative eigenvalues of C with W - limit^2 in place of W.
    Shapes: `frequency` (m,), `motion` (3 n_c, m), `springs` (n_c, 3), returns (p,).
    """
    from scipy.linalg import cho_factor, cho_solve

    square = frequency**2
    scaled = np.sqrt(springs.reshape(-1, 1)) * motion

    def compliance(shift: float) -> NDArray[Any]:
        matrix = (scaled / (square - shift)) @ scaled.conj().T
        matrix.flat[:: len(matrix) + 1] += 1.0
        return matrix

    below = int(np.count_nonzero(square < highest**2))
    wanted = below - int(np.count_nonzero(np.linalg.eigvalsh(compliance(highest**2)) < 0.0))
    factor = cho_factor(compliance(0.0))

    def inverse(vectors: NDArray[Any]) -> NDArray[Any]:
        moved = vectors / square[:, None]
        return moved - (scaled.conj().T @ cho_solve(factor, scaled @ moved)) / square[:, None]

    basis = np.eye(frequency.size, 2 * below + MORE_VECTORS, dtype=motion.dtype)
    previous = np.zeros(wanted)
    for _ in range(MOST_ITERATIONS):
        image = inverse(basis)
        values, vectors = np.linalg.eigh(basis.conj().T @ image)
        found = np.maximum(values[::-1][:wanted], 0.0)
        if np.all(np.abs(found - previous) <= CONVERGED * found):
            return 1.0 / np.sqrt(found)
        previous = found
        basis = np.linalg.qr(image @ vectors[:, ::-1])[0]
    return None


class SpringSupportedMotion:
    """Relative displacement of contact nodes joined by linear springs: (I + G k) d = d_lin.

    d_lin is the relative displacement with free contacts. The springs exert the contact force f = -k d, hence
    d = d_lin + G f (Gulisano et al. 2011, eq. 6, with a linear contact force).

    `receptance` (3 n_c, 3 n_c): G k: the receptance G of the relative displacement times the springs k of its
    columns, real (static) or complex, C-contiguous; it is overwritten.
    """

    def __init__(self, receptance: NDArray[Any]) -> None:
        receptance.flat[:: len(receptance) + 1] += 1.0
        self._complex = receptance.dtype.kind == "c"
        if self._complex:  # solved at each frequency: without a copy LAPACK sees the transpose
            self._factors, self._pivots, _ = zgetrf(receptance.T, overwrite_a=1)
        else:
            self._factors, self._pivots, _ = dgetrf(receptance)

    def solve(self, linear: NDArray[Any]) -> NDArray[Any]:
        """Solution d of (I + G k) d = d_lin, of the shape of d_lin.

        `linear` (3 n_c, k): response d_lin without contact springs, m.
        """
        if self._complex:
            return zgetrs(self._factors, self._pivots, linear, trans=1)[0]
        return dgetrs(self._factors, self._pivots, linear)[0]
