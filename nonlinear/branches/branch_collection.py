"""The branches of one problem: known ones, and those that solutions on none of them lead to.

A solution lies on a known branch, or a new branch is continued from it. Solutions come from branches with fewer
harmonics (`lift_branch`) and from branches of another problem (`branch_starts`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from nonlinear.branches.branch import Branch, join, with_special_points, with_stability
from nonlinear.branches.growth_along_branch import marked_where_all_grow
from nonlinear.contact.fourier import ComplexArray, to_real
from nonlinear.contact.parameters import Array, ContactParameters
from nonlinear.continuation.arclength_continuation import Continuation, Progress
from nonlinear.continuation.corrector import NormalPlane, correct
from nonlinear.continuation.response_quantities import output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.options import Excitation
from nonlinear.response_curve import TerminationReason, at_range_end

MAX_CHORDS = 2.0  # distance from the chord of two points, in its lengths, that a solution between them may have
MIN_DISTANCE = 0.1  # added to that, relative to the vibration
BEYOND_CHORD = 0.05  # part of a chord by which the plane through a solution may miss it
SAME_SOLUTION = 1e-6  # relative distance of two solutions that count as one
MOST_CROSSINGS = 3  # chords, the nearest first, from which a known solution is sought
MOST_BRANCHES = 12  # detached branches of a curve; what is found beyond them is said, not traced
MOST_POINTS = 250  # of a detached branch in each direction, or as many as the known branches have
SAMPLED_POINTS = 5  # of a new branch, evenly along it, that are looked for on the known ones
COMMON_POINTS = 2  # of these; one may be a branch point, at which two branches cross
EVENLY = 8  # points of a branch evenly along it, beside its top, ends and folds
EVENLY_FROM_ONE = 16  # the same where there is one harmonic only, far from more: few of its points lead anywhere
CLOSE = 0.01  # distance from a known branch, relative to the vibration, within which a point is not lifted


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
    height += (branch.omega - point.omega) * (normal[1] / metric.parameter**2)
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
        if solved is not None and plane.distance(solved.unknown, solved.parameter) <= SAME_SOLUTION:
            return True
    return False


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
                marked = marked_where_all_grow(self.continuation.stability, branch.points)
                branch = with_stability(self.continuation, branch._replace(points=marked))
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
    start = continuation.solver.point(start.unknown, start.omega, start.tangent, start.iterations)
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


@dataclass(frozen=True)
class Lifting:
    """How solutions with few harmonics get more."""

    balances: TruncatedBalances  # the balances by number of harmonics
    # numbers of harmonics, ascending, up to the first one that changes the amplitude by no more than `tolerance`
    numbers: tuple[int, ...]
    tolerance: float = 0.0  # relative change of the amplitude; 0: always up to the last number

    def lift(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
        """The solution with as many harmonics as it needs; None where Newton's method finds none."""
        output = continuation.options.output
        amplitude = output_amplitude(point, output)
        lifted: SolutionPoint | None = None
        few = point.balance.n_harmonics
        more = [n for n in self.numbers if n > few] if self.tolerance > 0.0 else []
        for number in more or self.numbers[-1:]:
            balance = self.balances.balance(number)
            found = point if number == few else with_balance(continuation, point, balance)
            if found is None:
                continue
            before, amplitude, lifted, point = amplitude, output_amplitude(found, output), found, found
            if abs(amplitude - before) <= self.tolerance * amplitude:
                break
        return lifted


def with_balance(continuation: Continuation, point: SolutionPoint, balance: HarmonicBalance) -> SolutionPoint | None:
    """The solution of a balance nearest to a point: in the plane normal to its tangent, else at its frequency."""
    solver = continuation.with_balance(balance).solver
    found = solver.refit(point)
    if found is not None:
        return found
    start = point.with_balance(balance)
    return solver.solution_at(start.omega, start.unknown, start.tangent)


def lift_branch(collection: BranchCollection, lifting: Lifting, points: list[SolutionPoint], origin: str) -> None:
    """Add to a collection what the points of a branch with few harmonics lead to."""
    for point in representative_points(points, collection.continuation.options.output):
        if collection.continuation.budget.is_spent:
            return
        if collection.is_known(point, CLOSE):
            continue
        lifted = lifting.lift(collection.continuation, point)
        if lifted is not None:
            collection.offer(lifted, origin)


def representative_points(points: list[SolutionPoint], output: str) -> Iterator[SolutionPoint]:
    """Points that stand for a branch: its top first, its ends, its folds, and some evenly along it."""
    evenly = EVENLY if points[0].balance.n_harmonics > 1 else EVENLY_FROM_ONE
    amplitude = np.array([output_amplitude(point, output) for point in points])
    omega, arc = np.array([point.omega for point in points]), np.array([point.arc for point in points])
    return (points[place] for place in representative_indices(amplitude, omega, arc, evenly))


def representative_indices(
    amplitude: Sequence[float] | Array,
    omega: Sequence[float] | Array,
    arc: Sequence[float] | Array,
    evenly: int = EVENLY,
) -> list[int]:
    """Indices of points that stand for a branch, see `representative_points`.

    Shapes: `amplitude` (P,), `omega` (P,), `arc` (P,).
    """
    heights, arcs = np.asarray(amplitude), np.asarray(arc)
    last = len(heights) - 1
    if last < 0:
        return []
    steps = np.diff(np.asarray(omega))
    folds = [index + 1 for index, (one, other) in enumerate(pairwise(steps)) if one * other < 0.0]
    spread = np.searchsorted(arcs, np.linspace(arcs[0], arcs[-1], evenly + 2)[1:-1])
    places = [int(np.argmax(heights)), 0, last, *folds, *(min(int(place), last) for place in spread)]
    return list(dict.fromkeys(places))


@dataclass(frozen=True)
class BranchStart:
    """A solution of a problem, as a start for another problem."""

    frequency_hz: float
    displacement: Array  # (2H+1, n_c, 3) real Fourier coefficients of the relative displacement, m
    contact: ContactParameters  # contact of the problem that it solves
    force: float  # excitation amplitude of that problem, N
    label: str  # name of that problem, such as "contact.interference = -60 um"
    branch: int = 0  # number of the branch that it is taken from


class SolvedBranch(Protocol):
    """What is needed of a branch: a `ResponseCurve`, or arrays read from a file."""

    @property
    def frequency_hz(self) -> Array:
        """Frequency, Hz, (P,)."""
        ...

    @property
    def amplitude_m(self) -> Array:
        """Amplitude of the output, m, (P,)."""
        ...

    @property
    def arc(self) -> Array:
        """Arc length, (P,)."""
        ...

    @property
    def relative_displacement(self) -> ComplexArray:
        """Fourier coefficients d^(h), m, (P, H+1, n_c, 3)."""
        ...


class SolvedCurve(SolvedBranch, Protocol):
    """A branch with its detached branches."""

    @property
    def detached(self) -> Sequence[SolvedBranch]:
        """The detached branches."""
        ...


def branch_starts(
    curve: SolvedCurve, contact: ContactParameters, excitation: Excitation, label: str
) -> list[BranchStart]:
    """Starts from every branch of a curve: its top, its ends, its folds, and some points evenly along it."""
    starts = []
    for number, branch in enumerate((*curve.detached, curve)):
        frequency = np.asarray(branch.frequency_hz)
        for index in representative_indices(branch.amplitude_m, frequency, branch.arc):
            displacement = to_real(branch.relative_displacement[index])
            starts.append(
                BranchStart(float(frequency[index]), displacement, contact, excitation.force, label, number)
            )
    return starts
