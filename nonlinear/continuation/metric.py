"""Lengths along a curve: how displacement and frequency count in a step."""

import math
from dataclasses import dataclass

from nonlinear.contact.parameters import Array

Tangent = tuple[Array, float]  # dx/ds (n,), dw/ds


@dataclass(frozen=True)
class Metric:
    """Scales of an arc length: of the displacement (m) and of the frequency (rad/s)."""

    length: float
    omega: float

    def norm(self, displacement: Array, omega: float) -> float:
        """Length of a step."""
        return math.hypot(math.sqrt(displacement @ displacement) / self.length, omega / self.omega)

    def product(self, one: Tangent, other: Tangent) -> float:
        """Scalar product of two steps."""
        return float(one[0] @ other[0] / self.length**2 + one[1] * other[1] / self.omega**2)

    def unit(self, tangent: Tangent) -> Tangent:
        """The same direction with length 1."""
        norm = self.norm(*tangent)
        return tangent[0] / norm, tangent[1] / norm
