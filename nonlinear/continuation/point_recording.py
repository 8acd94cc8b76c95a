"""What is recorded of a solved point: derivative of the amplitude, Floquet exponents."""

from dataclasses import dataclass, replace

from nonlinear.continuation.point_stability import PointStability
from nonlinear.continuation.response_quantities import amplitude_derivative
from nonlinear.continuation.solution_point import SolutionPoint


@dataclass(frozen=True)
class PointRecorder:
    """Adds derived quantities to solved points."""

    output: str  # name of the output whose amplitude is recorded
    stability: PointStability | None = None  # computes Floquet exponents; None: they are not asked for

    def record(self, point: SolutionPoint, exponents: bool = False) -> SolutionPoint:
        """The point with dA/ds and, if asked for, its exponents. Its contact Jacobian is dropped, to save memory."""
        dA_ds = point.dA_ds if point.linear is not None else amplitude_derivative(point, self.output)
        found = self.stability.exponents(point) if self.stability is not None and exponents else None
        return point.changed(dA_ds=dA_ds, exponents=found, contact=point.contact.without_jacobian())

    def with_exponents(self, point: SolutionPoint) -> SolutionPoint:
        """A recorded point with its exponents, if they are asked for."""
        if self.stability is None or point.exponents is not None:
            return point
        contact = point.balance.element.evaluate(point.displacement)
        return replace(point, exponents=self.stability.exponents(replace(point, contact=contact)))
