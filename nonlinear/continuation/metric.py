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
    """Norm and scalar product of steps (dx, domega): ds^2 = (dx . dx) / length^2 + domega^2 / omega^2.

    Attributes
    ----------
    length : float
        Scale of the displacement, m.
    omega : float
        Scale of the frequency, rad/s.
    """

    length: float
    omega: float

    def norm(self, displacement: Array, omega: float) -> float:
        """Length of the step (displacement (n,), omega)."""
        return math.hypot(math.sqrt(displacement @ displacement) / self.length, omega / self.omega)

    def product(self, one: Tangent, other: Tangent) -> float:
        """Scalar product of two steps."""
        return float(one[0] @ other[0] / self.length**2 + one[1] * other[1] / self.omega**2)

    def unit(self, tangent: Tangent) -> Tangent:
        """The same direction with length 1."""
        norm = self.norm(*tangent)
        return tangent[0] / norm, tangent[1] / norm
