"""A limit on the points that an estimate may solve for, so that its cost stays a fixed part of that of the curve."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint

OVERHEAD = 4  # time of a point is proportional to (H + 4)^2, measured with 9 contact nodes and H = 1 to 9


@dataclass
class WorkLimit:
    """Counts solved points; one with more harmonics than the curve has counts as several points of the curve."""

    n_harmonics: int  # number of harmonics of the curve
    left: float  # points that may still be solved for

    @property
    def exhausted(self) -> bool:
        """Whether the limit is reached."""
        return self.left <= 0.0

    def spend(self, n_harmonics: int, points: int = 1) -> None:
        """Count points with so many harmonics."""
        self.left -= points * ((n_harmonics + OVERHEAD) / (self.n_harmonics + OVERHEAD)) ** 2

    def branch(
        self, continuation: Continuation, start: SolutionPoint, most: int | None = None
    ) -> Iterator[SolutionPoint]:
        """Points of the branch from `start` on, at most `most`, and none beyond the limit."""
        for point in islice(continuation.continue_branch(start), most):
            if point.linear is None:
                self.spend(point.balance.n_harmonics)
            yield point
            if self.exhausted:
                return
