"""One solved point of a response curve."""

from dataclasses import dataclass

from nonlinear.arclength import Tangent
from nonlinear.contact import Array, ContactForces


@dataclass(frozen=True)
class CurvePoint:
    """One solved point: unknown x (n,), w (rad/s), unit tangent (dx/ds, dw/ds) of growing arc, and how it was found.

    `determinant_sign` is that of det dR/dx: -1 where an odd number of real Floquet exponents is positive.
    `orientation` is the sign of det [dR/dx, dR/dw; tangent], the same along a curve, kinks included. `step` is the
    arc length proposed for the next step.
    """

    unknown: Array
    frequency: float
    tangent: Tangent
    contact: ContactForces
    determinant_sign: int
    orientation: int
    iterations: int
    arc: float
    step: float
