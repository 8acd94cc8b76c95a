"""Data of the kernels that follow a slider under the friction cone: motion, slider positions, panel, iteration.

Lengths are relative to the largest elastic limit displacement r = mu N / kt of the node. A row of m = 3 (2H+1) + 3
numbers holds a value and its derivatives by the coefficients of u1, u2 and u_n and by the two components of the
slider position w at the beginning of the period.
"""

from typing import Any, NamedTuple

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.contact.radau import RadauTable

STICKING, STARTING, SLIPPING = 0, 1, 2  # STARTING: slip begins, the length of its first panel is not known
ITERATION = np.dtype(
    [
        ("angle", np.float64),  # reached in the present interval
        ("end", np.float64),  # of the interval: a contact interval or, without separation, a period
        ("state", np.int64),  # STICKING, STARTING or SLIPPING
        ("after_slip", np.bool_),  # the slider stands on its limit: the same instant is no new onset of slip
        ("length", np.float64),  # of the next panel
        ("graded_below", np.float64),  # length left in the interval below which a graded panel is tried
        ("approach", np.int64),  # panels tried so far that should end where slip ends
        ("phi", np.float64),  # direction of slip at `angle`, rad; NOWHERE: the slider position tells
        ("slip", np.float64),  # distance slipped in the interval
        ("separates", np.bool_),  # the contact opens in the period
        ("next_contact", np.int64),  # place of the next contact interval in `Workspace.contact_angles`
        ("accumulate", np.bool_),  # means over the interval are summed
        ("periods", np.int64),  # marched so far
        ("max_periods", np.int64),
        ("newton_start", np.bool_),  # the period started where Newton's method placed the slider
        ("change", np.float64),  # of the slider position over the last period
        ("off_path", np.bool_),  # Newton's method has moved the slider off its own path
        ("shakedown", np.bool_),  # the slider comes to rest: its own path is followed to the end
        ("converged", np.bool_),  # the next Newton step is negligible: this is the periodic orbit
    ],
    align=True,
)


class ConeSlider(NamedTuple):
    """A slider of one node; or of all nodes, with one more leading axis in each field."""

    dr_dn: Any  # float: derivative of r by u_n, mu kn / kt
    curves: Array  # (4, 4H+3): coefficients of u1, u2 (without their means), r and |u|^2 - r^2, then zeros
    w: Array  # (2, m): slider position now
    w_start: Array  # (2, m): at the beginning of the period
    w_path: Array  # (2, m): where the slider was moved off its own path
    deflection: Array  # (2, 2H+1, m): mean of (u - w) phi_i over the period (in stick without u)
    stick_moments: Array  # (2, 2H+1): means of cos(m theta), sin(m theta) over stick
    contact_moments: Array  # (2, 2H+1): the same over contact
    iteration: Any  # record of type `ITERATION`


class Panel(NamedTuple):
    """A piece of a slip interval with n collocation points."""

    radau: RadauTable
    angle: Array  # theta, (n,)
    rate: Array  # d theta / ds, (n,)
    motion: Array  # u1, u2 and r, (3, n)
    velocity: Array  # their derivatives by theta, (3, n)
    phi: Array  # direction of slip, (n,)
    e: Array  # (cos phi, sin phi), (2, n)
    f: Array  # (-sin phi, cos phi), (2, n)
    ratio: Array  # r / (d theta / ds), (n,)
    margin: Array  # rate of slip u' . e - r', (n,)
    basis: Array  # Fourier basis, then its derivatives, (n, 2 (2H+1))
    system: Array  # equations of collocation with right sides, (n, n + m)


class Workspace(NamedTuple):
    """Scratch arrays of the kernels."""

    panel: Panel
    polynomial: Array  # coefficients of a trigonometric polynomial, (4H+3,)
    mean: Array  # means of the basis functions over an interval, (2H+1,)
    contact_angles: Array  # roots of r, (4H+3,)


def workspace(radau: RadauTable, n_harmonics: int) -> Workspace:
    """Scratch arrays for `n_harmonics`."""
    n, size = radau.point.size, 2 * n_harmonics + 1
    panel = Panel(
        radau,
        angle=np.empty(n),
        rate=np.empty(n),
        motion=np.empty((3, n)),
        velocity=np.empty((3, n)),
        phi=np.empty(n),
        e=np.empty((2, n)),
        f=np.empty((2, n)),
        ratio=np.empty(n),
        margin=np.empty(n),
        basis=np.empty((n, 2 * size)),
        system=np.zeros((n, n + 3 * size + 3)),
    )
    return Workspace(panel, np.empty(2 * size + 1), np.empty(size), np.empty(2 * size + 1))


def cone_sliders(motion: Array, dr_dn: Array, curves: Array) -> ConeSlider:
    """Sliders of all nodes at w = 0; `motion` (n_c, 3, 2H+1): u1, u2 and r, `curves` as in `ConeSlider`."""
    n, _, size = motion.shape
    w = np.zeros((n, 2, 3 * size + 3))
    w[:, :, 0] = -motion[:, :2, 0]
    deflection = np.zeros((n, 2, size, 3 * size + 3))
    stick, contact = np.zeros((2, n, 2, size))
    return ConeSlider(dr_dn, curves, w, w.copy(), w.copy(), deflection, stick, contact, np.zeros(n, ITERATION))
