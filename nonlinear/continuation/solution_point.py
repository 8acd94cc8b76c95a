"""One solved point of a response curve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.harmonic_balance.residual import HarmonicBalance


@dataclass(frozen=True)
class LinearState:
    """Which contacts are pressed together all the time, (n_c,), the others being open all the time."""

    pressed: NDArray[np.bool_]


@dataclass(frozen=True)
class SolutionPoint:
    """One solved point of `balance`: unknown x (n,), w (rad/s), unit tangent (dx/ds, dw/ds), and how it was found.

    The tangent points to growing `arc`; its length is 1 in `metric`, the scales at the point. `determinant_sign` is
    that of det dR/dx: -1 where an odd number of real Floquet exponents is positive. `orientation` is the sign of
    det [dR/dx, dR/dw; tangent], the same along a curve, kinks included. `step` is the arc length proposed for the
    next step, `amplitude_slope` the derivative of the output's amplitude in the arc. `linear`: the state of the
    contacts if the point was solved as a linear problem. `exponents`: the Floquet exponents (1/s), the least stable
    first.
    """

    balance: HarmonicBalance
    unknown: Array
    omega: float
    tangent: Tangent
    metric: Metric
    contact: ContactForces
    determinant_sign: int
    orientation: int
    iterations: int
    arc: float
    step: float
    amplitude_slope: float = float("nan")
    linear: LinearState | None = None
    exponents: ComplexArray | None = None

    @property
    def unstable(self) -> int:
        """Number of exponents with a positive real part."""
        return 0 if self.exponents is None else int(np.count_nonzero(self.exponents.real > 0.0))

    @property
    def growth_rate(self) -> float:
        """Largest real part of the exponents, 1/s; NaN where they are not known."""
        if self.exponents is None or self.exponents.size == 0:
            return float("nan")
        return float(self.exponents[0].real)

    @property
    def stable(self) -> bool:
        """Whether no exponent grows, as far as they are known; that the number of real ones is even, in any case."""
        return self.determinant_sign > 0 and self.unstable == 0

    @property
    def displacement(self) -> Array:
        """Real Fourier coefficients of d, (2H+1, n_c, 3)."""
        return self.balance.displacement(self.unknown)
