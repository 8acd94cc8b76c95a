"""One solved point of a response curve."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.continuation.metric import Metric, Tangent
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.harmonic_balance.truncated_balances import pad_or_truncate


@dataclass(frozen=True)
class LinearState:
    """State of all contacts on a linear segment: `pressed` (n_c,) together all the time, or open all the time."""

    pressed: NDArray[np.bool_]


@dataclass(frozen=True)
class SolutionPoint:
    """One solution (x, omega) of the balance, and how it was found.

    Attributes
    ----------
    balance : HarmonicBalance
        The equations.
    unknown : (n,) float
        x, m.
    omega : float
        Frequency, rad/s.
    tangent : Tangent
        (dx/ds, domega/ds), of unit length in `metric`, towards growing `arc`.
    metric : Metric
        Scales of displacement and frequency at the point.
    contact : ContactForces
        Contact forces.
    jacobian_sign : int
        Sign of det dR/dx, a test function of folds and branch points. It is -1 where an odd number of real Floquet
        exponents is positive.
    bordered_sign : int
        Sign of det [dR/dx, dR/domega; tangent], a test function of branch points. It is the same all along a curve,
        folds and kinks included, and changes at a branch point.
    iterations : int
        Newton iterations.
    arc : float
        Arc length from the start of the curve.
    step : float
        Arc length proposed for the next step.
    dA_ds : float
        Derivative of the amplitude of the output with respect to the arc length, m.
    linear : LinearState or None
        State of the contacts, if the point was solved as a linear problem.
    exponents : (k,) complex or None
        Floquet exponents, 1/s, the least stable first.
    """

    balance: HarmonicBalance
    unknown: Array
    omega: float
    tangent: Tangent
    metric: Metric
    contact: ContactForces
    jacobian_sign: int
    bordered_sign: int
    iterations: int
    arc: float
    step: float
    dA_ds: float = float("nan")
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
        """Whether det dR/dx is positive and no known exponent has a positive real part."""
        return self.jacobian_sign > 0 and self.unstable == 0

    @property
    def displacement(self) -> Array:
        """Real Fourier coefficients of d, (2H+1, n_c, 3)."""
        return self.balance.displacement(self.unknown)

    def reversed(self) -> "SolutionPoint":
        """The same point on the curve in the opposite direction; its `arc` is not changed."""
        return replace(
            self,
            tangent=(-self.tangent[0], -self.tangent[1]),
            bordered_sign=-self.bordered_sign,
            dA_ds=-self.dA_ds,
        )

    def with_balance(self, balance: HarmonicBalance) -> "SolutionPoint":
        """The point with the harmonics of `balance`, zeros added or the highest cut off. Nothing is solved."""
        tangent = pad_or_truncate(self.tangent[0], balance), self.tangent[1]
        return replace(self, balance=balance, unknown=pad_or_truncate(self.unknown, balance), tangent=tangent)
