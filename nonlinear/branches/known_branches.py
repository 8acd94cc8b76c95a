"""Solutions of known branches as arrays: whether another solution lies on one of them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.corrector import NormalPlane, correct
from nonlinear.continuation.solution_point import SolutionPoint

MAX_CHORDS = 2.0  # distance from the chord of two points, in its lengths, that a solution between them may have
MIN_DISTANCE = 0.1  # added to that, relative to the vibration
BEYOND_CHORD = 0.05  # part of a chord by which the plane through a solution may miss it
SAME_SOLUTION = 1e-6  # relative distance of two solutions that count as one
MOST_CROSSINGS = 3  # chords, the nearest first, from which a known solution is sought


@dataclass(frozen=True)
class KnownBranch:
    """The P solutions of a branch, in their order."""

    omega: Array  # (P,), frequency, rad/s
    unknown: Array  # (P, n), x, m; zero in harmonics that a point does not have

    @classmethod
    def of(cls, points: list[SolutionPoint]) -> "KnownBranch":
        """The solutions of solved points."""
        unknown = np.zeros((len(points), max(point.unknown.size for point in points)))
        for row, point in zip(unknown, points, strict=True):
            row[: point.unknown.size] = point.unknown
        return cls(np.array([point.omega for point in points]), unknown)

    @cached_property
    def _resized(self) -> dict[int, Array]:
        return {}

    def unknowns(self, size: int) -> Array:
        """The solutions with n = `size` unknowns: zeros added, or the highest harmonics cut off, (P, n)."""
        if size not in self._resized:
            missing = max(size - self.unknown.shape[1], 0)
            self._resized[size] = np.pad(self.unknown[:, :size], ((0, 0), (0, missing)))
        return self._resized[size]


def lies_on(continuation: Continuation, branch: KnownBranch, point: SolutionPoint, tolerance: float = 0.0) -> bool:
    """Whether a solution lies on a known branch, which may have other numbers of harmonics.

    Where the branch crosses the plane through the solution, normal to its tangent, the branch is solved for in that
    plane. So folds make no difference.
    """
    metric = continuation.solver.metric(point.unknown)
    normal = metric.unit(point.tangent)
    unknown = branch.unknowns(point.unknown.size)
    height = (unknown - point.unknown) @ (normal[0] / metric.length**2)
    height += (branch.omega - point.omega) * (normal[1] / metric.omega**2)
    rise = np.diff(height)
    with np.errstate(all="ignore"):
        fraction = -height[:-1] / rise
    crossings = np.flatnonzero((fraction >= -BEYOND_CHORD) & (fraction <= 1.0 + BEYOND_CHORD))
    candidates = []
    for index in crossings:
        dx, domega = unknown[index + 1] - unknown[index], branch.omega[index + 1] - branch.omega[index]
        offset = (
            unknown[index] + fraction[index] * dx - point.unknown,
            float(branch.omega[index] + fraction[index] * domega - point.omega),
        )
        distance = metric.norm(*offset)
        if distance <= max(tolerance, SAME_SOLUTION):
            return True
        if distance <= MAX_CHORDS * metric.norm(dx, domega) + MIN_DISTANCE:
            candidates.append((distance, offset))
    for distance, offset in sorted(candidates, key=lambda item: item[0])[:MOST_CROSSINGS]:
        plane = NormalPlane(point.unknown, point.omega, normal, metric, 2.0 * distance)
        solved = correct(continuation.balance, continuation.options, plane, offset)
        if solved is not None and plane.distance(solved.unknown, solved.omega) <= SAME_SOLUTION:
            return True
    return False
