"""Arc length along a curve: the scales of displacement and frequency.

Lengths are relative to the present vibration and to a part of the frequency range. So a step means the same at the
top of a resonance and far below it, and force and interference scaled together give the same steps.
"""

import math
from dataclasses import dataclass

from nonlinear.contact.parameters import Array

Tangent = tuple[Array, float]  # dx/ds (n,), domega/ds


@dataclass(frozen=True)
class Metric:
    """Norm and scalar product of steps (dx, domega): ds^2 = (dx . dx) / length^2 + domega^2 / omega^2."""

    length: float  # scale of the displacement, m
    omega: float  # scale of the frequency, rad/s

    def norm(self, displacement: Array, omega: float) -> float:
        """Length of the step (displacement (n,), omega)."""
        return math.hypot(math.sqrt(displacement @ displacement) / self.length, omega / self.omega)

    def product(self, one: Tangent, other: Tangent) -> float:
        """Scalar product of two steps."""
        # products, not powers: these are not rounded alike when force and interference are scaled together
        squares = self.length * self.length, self.omega * self.omega
        return float(one[0] @ other[0] / squares[0] + one[1] * other[1] / squares[1])

    def unit(self, tangent: Tangent) -> Tangent:
        """The same direction with length 1."""
        norm = self.norm(*tangent)
        return tangent[0] / norm, tangent[1] / norm
