"""The branches of one problem: known ones, and those that solutions on none of them lead to."""

from dataclasses import dataclass, field, replace

import numpy as np

from nonlinear.branches.branch import Branch, join, with_special_points, with_stability
from nonlinear.branches.known_branches import KnownBranch, lies_on
from nonlinear.branches.peaks import at_range_end
from nonlinear.branches.termination import TerminationReason
from nonlinear.continuation.arclength_continuation import Continuation, Progress
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint

MOST_BRANCHES = 12  # detached branches of a curve; what is found beyond them is said, not traced
MOST_POINTS = 250  # of a detached branch in each direction, or as many as the known branches have
SAMPLED_POINTS = 5  # of a new branch, evenly along it, that are looked for on the known ones
COMMON_POINTS = 2  # of these; one may be a branch point, at which two branches cross


@dataclass(frozen=True)
class FoundBranch:
    """A detached branch."""

    branch: Branch  # its points
    origin: str  # how it was found, in a short sentence
    height: float  # its highest amplitude, m


@dataclass
class BranchCollection:
    """Branches with one number of harmonics, each listed once."""

    continuation: Continuation  # its balance has the number of harmonics of the new branches
    # branches that are not listed again: the main branch, and detached branches known before
    known: list[KnownBranch]
    found: list[FoundBranch] = field(default_factory=list)  # the new ones
    progress: Progress | None = None  # called with the frequency (Hz) and the number of points at each new point
    # whether peaks, folds and stability of new branches are asked for; not where they only lead to others
    final: bool = True
    # number of solutions on no known branch that were not followed, as there were too many branches
    left_out: int = 0

    def is_known(self, point: SolutionPoint, tolerance: float = 0.0) -> bool:
        """Whether a solution lies on one of the branches."""
        current = self.continuation.with_balance(point.balance)
        return any(lies_on(current, branch, point, tolerance) for branch in self.known)

    def offer(self, point: SolutionPoint, origin: str) -> bool:
        """Continue the branch through a solution with the harmonics of this collection, if it is new."""
        if self.is_known(point):
            return False
        if len(self.found) >= MOST_BRANCHES:
            self.left_out += 1
            return False
        points, closed = _both_ways(self._tracing, point, self.progress)
        overlap = self._overlapping(points)
        output = self.continuation.options.output
        height = max(output_amplitude(item, output) for item in points)
        if any(place < 0 or self.found[place].height >= height for place in overlap):
            return False
        self._drop(overlap)  # lower parts of the same branch, which was not traced to its end
        self.known.append(KnownBranch.of(points))
        termination = _termination(self.continuation, points, closed)
        branch = Branch(points, [], [], termination)
        if self.final:
            branch = with_special_points(replace(self.continuation, stability=None), points, termination)
            if self.continuation.stability is not None:
                branch = with_stability(self.continuation, branch)
        height = max(output_amplitude(item, output) for item in branch.points)
        self.found.append(FoundBranch(branch, origin, height))
        return True

    def _drop(self, places: list[int]) -> None:
        """Take branches out of those found, by their places among them, and out of those known."""
        given = self._given
        for place in sorted(places, reverse=True):
            del self.found[place], self.known[given + place]

    @property
    def _given(self) -> int:
        """Number of branches that were known from the start."""
        return len(self.known) - len(self.found)

    @property
    def _tracing(self) -> Continuation:
        """The continuation of new branches: exponents follow later, and a limit keeps a wandering branch short."""
        most = max((branch.omega.size for branch in self.known), default=0)
        limit = min(max(most, MOST_POINTS), self.continuation.options.max_points)
        options = replace(self.continuation.options, max_points=limit)
        return replace(self.continuation, options=options, stability=None, adapt=None)

    def _overlapping(self, points: list[SolutionPoint]) -> list[int]:
        """Places among `found` of the branches on which several points of a branch lie: they are the same curve.

        A branch known from the start has a negative place.
        """
        places = np.unique(np.linspace(0, len(points) - 1, SAMPLED_POINTS + 2)[1:-1].astype(int))
        current, overlap = self.continuation.with_balance(points[0].balance), []
        for number, branch in enumerate(self.known):
            common = sum(lies_on(current, branch, points[place]) for place in places)
            if common >= min(COMMON_POINTS, places.size):
                overlap.append(number - self._given)
        return overlap


def _both_ways(
    continuation: Continuation, start: SolutionPoint, progress: Progress | None
) -> tuple[list[SolutionPoint], bool]:
    """Points of the branch through a solution, closed or from one end to the other, and whether it is closed.

    The tangent at the start is that at the very solution: beside a fold, the one of the last Newton step is not good
    enough to tell on which side of a peak the start lies.
    """
    continuation = continuation.with_balance(start.balance)
    start = continuation.solver.point(
        start.unknown, start.omega, start.tangent, start.iterations, 0.0, continuation.options.step
    )
    points = list(continuation.continue_branch(start, progress))
    if len(points) > 2 and points[-1].unknown is points[0].unknown:
        return points, True
    return join(list(continuation.continue_branch(start.reversed(), progress)), points), False


def _termination(continuation: Continuation, points: list[SolutionPoint], closed: bool) -> TerminationReason:
    """Why a detached branch ended."""
    limits = continuation.options.frequency_hz
    frequencies = [point.omega / (2.0 * np.pi) for point in points]
    ends = (frequencies[0], frequencies[-1])
    complete = closed or all(at_range_end(end, limits) for end in ends)
    shape = "closed" if closed else "open" if complete else "not traced to its end"
    span = f"{min(frequencies):.6g} to {max(frequencies):.6g} Hz in {len(points)} points"
    return TerminationReason(
        "complete" if complete else "step too small", ends[-1], f"detached branch, {shape}: {span}"
    )
