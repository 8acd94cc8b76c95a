"""Shakedown state of a slider in the contact plane that it reaches in the limit only: the corner of two circles.

Shakedown: after a transient the slider rests, |u - w| <= r all the time, and the contact sticks throughout.

References
----------
A. Klarbring, M. Ciavarella, J. R. Barber, Shakedown in elastic contact problems with Coulomb friction, International
Journal of Solids and Structures 44 (2007) 8355-8365.
"""

import numpy as np

from nonlinear.contact.fourier import basis_at
from nonlinear.contact.parameters import Array

GRID = 64  # instants a harmonic among which the farthest motions are sought
MOST_STEPS = 20
ON_CIRCLE = 1e-13  # |u - w| - r, relative to the largest r, that is nothing
APART = 1e-6  # sine of the angle between two directions below which they are one


def shakedown_corner(curves: Array, position: Array, dr_dn: float) -> tuple[Array, Array] | None:
    """Slider position (2,) from which |u - w| = r at two instants and less at all others; None if none is found.

    `curves` (3, 2H+1): coefficients of u1, u2 and r. A slider outside of the shakedown region |u - w| <= r is drawn
    in at one instant and at another, again and again; where their circles meet at a sharp corner, it takes any number
    of periods to get there. With e_i the direction of u - w at these instants, Newton's method from `position` is
    e_i . dw = |u - w| - r; the derivatives by the coefficients of u1, u2 and u_n, (2, 3 (2H+1)), obey
    e_i . dw = e_i . du - dr_dn du_n, as the instants are those of the largest |u - w| - r.
    """
    n_harmonics = (curves.shape[1] - 1) // 2
    w, pair = position.copy(), _two_farthest(curves, position)
    if pair is None:
        return None
    for _ in range(MOST_STEPS):
        pair = _nearest_maxima(curves, w, pair, np.pi / (GRID * n_harmonics))
        basis = basis_at(pair, n_harmonics)
        deflection = basis @ curves[:2].T - w
        far = np.linalg.norm(deflection, axis=1)
        directions, excess = deflection / far[:, None], far - basis @ curves[2]
        if abs(np.linalg.det(directions)) < APART:
            return None
        if np.abs(excess).max() <= ON_CIRCLE:
            break
        w = w + np.linalg.solve(directions, excess)
    every = _excess(curves, w, np.linspace(0.0, 2.0 * np.pi, 4 * GRID * n_harmonics))[0]
    if np.abs(excess).max() > ON_CIRCLE or every.max() > 10.0 * ON_CIRCLE:
        return None
    moved = np.concatenate([directions[:, :, None] * basis[:, None], -dr_dn * basis[:, None]], axis=1)
    return w, np.linalg.solve(directions, moved.reshape(2, -1))


def _two_farthest(curves: Array, w: Array) -> Array | None:
    """The instants (rad) of the two largest maxima of |u - w| - r in different directions, to the grid."""
    n_harmonics = (curves.shape[1] - 1) // 2
    grid = 2.0 * np.pi / (GRID * n_harmonics) * np.arange(GRID * n_harmonics)
    values = _excess(curves, w, grid)[0]
    peaks = np.flatnonzero((values >= np.roll(values, 1)) & (values > np.roll(values, -1)))
    peaks = peaks[np.argsort(-values[peaks])]
    deflection = basis_at(grid[peaks], n_harmonics) @ curves[:2].T - w
    across = deflection[0, 0] * deflection[:, 1] - deflection[0, 1] * deflection[:, 0]
    others = np.flatnonzero(
        np.abs(across) > APART * np.linalg.norm(deflection, axis=1) * np.linalg.norm(deflection[0])
    )
    return grid[peaks[[0, others[0]]]] if others.size else None


def _nearest_maxima(curves: Array, w: Array, angles: Array, width: float) -> Array:
    """The maxima of |u - w| - r next to the angles, by Newton's method."""
    for _ in range(3):
        _, first, second = _excess(curves, w, angles)
        steps = np.divide(-first, second, out=np.zeros_like(first), where=second < 0.0)
        angles = angles + np.clip(steps, -width, width)
    return angles


def _excess(curves: Array, w: Array, angles: Array) -> tuple[Array, Array, Array]:
    """|u - w| - r and its first two derivatives."""
    n_harmonics = (curves.shape[1] - 1) // 2
    x, y, r = (basis_at(angles, n_harmonics) @ curves.T).T
    x1, y1, r1 = (basis_at(angles, n_harmonics, 1) @ curves.T).T
    x2, y2, r2 = (basis_at(angles, n_harmonics, 2) @ curves.T).T
    x, y = x - w[0], y - w[1]
    far = np.hypot(x, y)
    rate = (x * x1 + y * y1) / far
    return far - r, rate - r1, (x1 * x1 + y1 * y1 + x * x2 + y * y2 - rate * rate) / far - r2
