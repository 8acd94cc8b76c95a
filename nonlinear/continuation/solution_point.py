"""One solved point of a response curve, and the scales in which lengths along the curve are measured.

Lengths are relative to the present vibration and to a part of the frequency range. So a step means the same at the
top of a resonance and far below it, and force and interference scaled together give the same steps.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.parameters import Array, ContactForces
from nonlinear.harmonic_balance.initial_solution import pad_or_truncate
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.stability.floquet import grows
from nonlinear.stability.ring_stability import PatternExponent

Tangent = tuple[Array, float]  # dx/ds (n,), dp/ds


@dataclass(frozen=True)
class Metric:
    """Norm and scalar product of steps (dx, dp): ds^2 = (dx . dx) / length^2 + dp^2 / parameter^2."""

    length: float  # scale of the displacement, m
    parameter: float  # scale of the parameter p: of the frequency, rad/s

    def norm(self, displacement: Array, parameter: float) -> float:
        """Length of the step (displacement (n,), parameter)."""
        return math.hypot(math.sqrt(displacement @ displacement) / self.length, parameter / self.parameter)

    def product(self, one: Tangent, other: Tangent) -> float:
        """Scalar product of two steps."""
        # products, not powers: these are not rounded alike when force and interference are scaled together
        squares = self.length * self.length, self.parameter * self.parameter
        return float(one[0] @ other[0] / squares[0] + one[1] * other[1] / squares[1])

    def unit(self, tangent: Tangent) -> Tangent:
        """The same direction with length 1."""
        norm = self.norm(*tangent)
        return tangent[0] / norm, tangent[1] / norm


SAME_RATE = 1e-9  # difference of growth rates, in units of omega, that is round-off


@dataclass(frozen=True)
class LinearState:
    """State of all contacts on a linear segment: `pressed` (n_c,) together all the time, or open all the time."""

    pressed: NDArray[np.bool_]


@dataclass(frozen=True)
class SolutionPoint:
    """One solution (x, p) of the balance, and how it was found."""

    balance: HarmonicBalance  # the equations
    unknown: Array  # (n,), x, m
    parameter: float  # p, in most balances the frequency, rad/s
    tangent: Tangent  # (dx/ds, dp/ds), of unit length in `metric`, towards growing `arc`
    metric: Metric  # scales of displacement and parameter at the point
    contact: ContactForces  # contact forces
    # sign of det dR/dx, a test function of folds and branch points. It is -1 where an odd number of real Floquet
    # exponents is positive
    jacobian_sign: int
    # sign of det [dR/dx, dR/dp; tangent], a test function of branch points. It is the same all along a curve,
    # folds and kinks included, and changes at a branch point
    bordered_sign: int
    iterations: int  # Newton iterations
    arc: float  # arc length from the start of the curve
    step: float  # arc length proposed for the next step
    dA_ds: float = float("nan")  # derivative of the amplitude of the output with respect to the arc length, m
    linear: LinearState | None = None  # state of the contacts, if the point was solved as a linear problem
    # (k,), Floquet exponents of perturbations with the symmetry of the wave, 1/s, the least stable first; NaN where
    # the work was spent before
    exponents: ComplexArray | None = None
    # the least stable exponent of the other nodal diameters; None: not known, or there are no others; NaN: undecided
    pattern: PatternExponent | None = None

    @property
    def omega(self) -> float:
        """Excitation frequency, rad/s."""
        fixed = self.balance.parameter.omega
        return self.parameter if fixed is None else fixed

    def state_differs(self, other: "SolutionPoint") -> bool:
        """Whether a node slips or opens here but not at an `other` point, or the other way round."""
        return not np.array_equal(self.contact.state, other.contact.state)

    @property
    def unstable(self) -> int:
        """Number of exponents of the wave that grow."""
        return 0 if self.exponents is None else int(np.count_nonzero(grows(self.exponents, self.omega)))

    @property
    def undecided(self) -> bool:
        """Whether no perturbation is known to grow, and the work that was left did not suffice to look at all."""
        own, other = self.exponents, self.pattern
        missing = (own is not None and np.isnan(own[:1]).any()) or (other is not None and np.isnan(other.exponent))
        return bool(missing) and not self.unstable and not (other is not None and other.grows(self.omega))

    @property
    def worst(self) -> PatternExponent | None:
        """The least stable known exponent over all nodal diameters; None where none is known, or it is undecided."""
        own = self.exponents
        if self.undecided:
            return None
        if own is None or own.size == 0:
            return self.pattern
        wave = PatternExponent(complex(own[0]), 0)
        leads = self.pattern is not None and self.pattern.exponent.real > own[0].real + SAME_RATE * self.omega
        return self.pattern if leads else wave

    @property
    def growth_rate(self) -> float:
        """Largest real part of the known exponents, 1/s; NaN where none is known."""
        return float("nan") if self.worst is None else float(self.worst.exponent.real)

    @property
    def growth_nodal_diameter(self) -> int:
        """Nodal diameter of the perturbation with this real part, beside that of the wave; -1 where not known."""
        return -1 if self.worst is None else self.worst.nodal_diameter

    @property
    def stable_wave(self) -> bool:
        """Whether det dR/dx is positive and no known exponent of the wave grows; not where it is undecided."""
        return self.jacobian_sign > 0 and self.unstable == 0 and not self.undecided

    @property
    def stable(self) -> bool:
        """Whether that holds for every known nodal diameter."""
        return self.stable_wave and (self.pattern is None or not self.pattern.grows(self.omega))

    @property
    def displacement(self) -> Array:
        """Real Fourier coefficients of d, (2H+1, n_c, 3)."""
        return self.balance.displacement(self.unknown)

    def changed(self, **values: Any) -> "SolutionPoint":
        """The point with other values of some attributes: as `dataclasses.replace`, which takes 25 us, not 1.

        The class has no cached properties, which would be copied too.
        """
        point = object.__new__(SolutionPoint)
        point.__dict__.update(self.__dict__, **values)
        return point

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
