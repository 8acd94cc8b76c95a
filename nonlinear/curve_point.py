"""One solved point of a response curve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.arclength import Tangent
from nonlinear.balance import HarmonicBalance
from nonlinear.contact import Array, ContactForces


@dataclass(frozen=True)
class LinearState:
    """Which contacts are pressed together all the time, (n_c,), the others being open all the time."""

    pressed: NDArray[np.bool_]


@dataclass(frozen=True)
class CurvePoint:
    """One solved point of `balance`: unknown x (n,), w (rad/s), unit tangent (dx/ds, dw/ds), and how it was found.

    The tangent points to growing `arc`. `determinant_sign` is that of det dR/dx: -1 where an odd number of real
    Floquet exponents is positive. `orientation` is the sign of det [dR/dx, dR/dw; tangent], the same along a curve,
    kinks included. `step` is the arc length proposed for the next step, `amplitude_slope` the derivative of the
    output's amplitude in the arc, `linear` the state of its contacts if it was solved as a linear problem.
    """

    balance: HarmonicBalance
    unknown: Array
    frequency: float
    tangent: Tangent
    contact: ContactForces
    determinant_sign: int
    orientation: int
    iterations: int
    arc: float
    step: float
    amplitude_slope: float = float("nan")
    linear: LinearState | None = None

    @property
    def displacement(self) -> Array:
        """Real Fourier coefficients of d, (2H+1, n_c, 3)."""
        return self.balance.displacement(self.unknown)
