"""Responses solved at single values of a parameter, where they tell most, and the peaks followed from them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np

from nonlinear.contact.fourier import to_real
from nonlinear.contact.parameters import Array
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.options import NO_PEAK, TRUNCATION_TOLERATED, SolverOptions
from nonlinear.peak_curves.optimum_result import SolvedResponse
from nonlinear.peak_curves.parameter_family import ParameterFamily
from nonlinear.peak_curves.peak_branch import PeakPiece, follow_peak
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.peak_curves.worst_envelope import NARROW, EnvelopeOfPeaks, Gap, ResponseAt
from nonlinear.problem import Problem
from nonlinear.response_curve import Peak, ResponseCurve, at_range_end
from nonlinear.response_solver import forced_response
from nonlinear.worst_motion.candidates import highest_persistent, without_doubtful

SAME = 1e-3  # relative difference of the amplitudes of two peaks that count as one
SAME_FREQUENCY = 3e-2
LOW = 0.3  # of the highest solution of a response: lower peaks of it are not followed
SAME_SHARE = 1e-9  # difference of two shares that count as one

Found = TypeVar("Found")
Solve = Callable[[Sequence[Problem]], Sequence[ResponseCurve]]
MOST_RESPONSES = 40
FIRST_SHARES = (0.0, 0.5, 1.0)  # of the range
QUASI_RANDOM = 3  # shares without a reason: a branch may exist anywhere
BISECTIONS = 2  # of a part between two responses with different numbers of branches
EXTREMA = 3  # of the envelope, at most, at which responses are solved
ACCURATE = 0.01  # relative error of the envelope that is good enough
SHOWS, WIDE = 0.1, 0.04  # relative error and width, in shares, of a gap that is halved wherever it is
AT_ONCE = 4  # gaps that are halved in one round
APART = 0.01  # of the share, from a solved response, below which none is solved without a reason


def solve_in_turn(problems: Sequence[Problem]) -> list[ResponseCurve]:
    """The responses of some problems, one after the other, in this process."""
    return [forced_response(*problem) for problem in problems]


@dataclass
class PeakSearch:
    """Solved responses and followed peaks, as they are added."""

    family: ParameterFamily  # problems and range
    progress: Callable[[str], None]  # called with a line on what is done
    solver: Solve = solve_in_turn  # solves the responses of some problems
    most: int = MOST_RESPONSES  # of them
    follower: PeakContinuation = field(init=False)
    pieces: list[PeakPiece] = field(default_factory=list, init=False)
    responses: list[ResponseAt] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self.follower = PeakContinuation(self.family)

    @property
    def shares(self) -> list[float]:
        """Shares at which responses were solved, ascending."""
        return [response.share for response in self.responses]

    def solve(self, shares: Sequence[float], reason: str) -> list[ResponseAt]:
        """Responses at some shares, as far as the limit allows; their high peaks that are not known are followed."""
        new = [s for s in shares if all(abs(s - known) > SAME_SHARE for known in self.shares)]
        new = new[: max(self.most - len(self.responses), 0)]
        for share in new:
            self.progress(f"response at {listed(self.family.names, self.family.values(share))} ({reason})")
        curves = self.solver([self.family.at(share) for share in new])
        found = [
            ResponseAt(
                share, curve, solved_response(self.family.value(share), curve, reason, self.family.problem.options)
            )
            for share, curve in zip(new, curves, strict=True)
        ]
        self.responses = sorted([*self.responses, *found], key=lambda each: each.share)
        for response in found:
            self._follow_all(response)
        return found

    @property
    def envelope(self) -> EnvelopeOfPeaks:
        """The worst motion as known now."""
        return EnvelopeOfPeaks(tuple(self.pieces), tuple(self.responses))

    def explore(self) -> None:
        """Responses at both ends and in the middle; between differing ones; at extrema; without a reason."""
        self.solve(FIRST_SHARES, "first")
        for _ in range(BISECTIONS):
            self.solve(self._between_differing(), "between")
        self.solve(self._extrema(), "search")
        sequence = [float(place[0]) for place in quasi_random(1, 2 * QUASI_RANDOM)]
        self.solve([s for s in sequence if self._is_new(s)][:QUASI_RANDOM], "search")

    def refine(self, reserve: int) -> None:
        """Halve the gaps whose error matters until all are accurate, or all but `reserve` responses are spent."""
        while (left := self.most - len(self.responses) - reserve) > 0:
            gaps = open_gaps(self.envelope)
            if not gaps:
                return
            self.solve(
                [0.5 * (gap.before.share + gap.after.share) for gap in gaps[: min(AT_ONCE, left)]], "refinement"
            )

    def _between_differing(self) -> list[float]:
        """The middle between neighbouring responses with different numbers of branches."""
        return [
            0.5 * (before.share + after.share)
            for before, after in pairwise(self.responses)
            if before.solved.branches != after.solved.branches and after.share - before.share > APART
        ]

    def _extrema(self) -> list[float]:
        """The lowest and the highest local extrema of the envelope inside the range, that are no responses yet."""
        envelope = self.envelope
        shares, heights = envelope.shares, envelope.at(envelope.shares)
        if not np.isfinite(heights).any():
            return []
        inner = heights[1:-1]
        low = (inner <= heights[:-2]) & (inner < heights[2:])
        high = (inner >= heights[:-2]) & (inner > heights[2:]) & np.isfinite(inner)
        found = 1 + np.flatnonzero(low | high)
        places = sorted(found[np.isfinite(heights[found])].tolist(), key=lambda place: float(heights[place]))
        chosen = places[: EXTREMA - 1] + places[EXTREMA - 1 :][-1:]  # the lowest ones and the highest
        return [float(shares[place]) for place in chosen if self._is_new(shares[place])]

    def _is_new(self, share: float) -> bool:
        return all(abs(share - known) > APART for known in self.shares)

    def _follow_all(self, response: ResponseAt) -> None:
        def is_new(height: float, frequency_hz: float) -> bool:
            high = height >= LOW * response.solved.highest_peak_m
            return high and not self._known(response.share, height, frequency_hz)

        for origin, start in peaks_of(self.follower, response.share, response.curve, is_new):
            if not self._is_followed(start):
                self.progress(f"peak {start.amplitude:.4g} m followed over {self.family.name}")
                self.pieces += follow_peak(self.follower, start, origin)

    def _is_followed(self, start: PeakPoint) -> bool:
        """Whether a peak of the first harmonic is known: `_known` was asked with that of the displacement."""
        first = self.family.problem.options.objective == "harmonic_1"
        return first and self._known(start.share, start.amplitude, start.frequency_hz)

    def _known(self, share: float, amplitude: float, frequency_hz: float) -> bool:
        for piece in self.pieces:
            if piece.holds(share):
                near = float(np.interp(share, piece.share, piece.frequency_hz))
                same = abs(float(piece.amplitude_at(np.array([share]))[0]) / amplitude - 1.0) < SAME
                if same and abs(near / frequency_hz - 1.0) < SAME_FREQUENCY:
                    return True
        return False


def peaks_of(
    follower: PeakContinuation, share: float, curve: ResponseCurve, wanted: Callable[[float, float], bool]
) -> Iterator[tuple[str, PeakPoint]]:
    """Peaks of a response, solved for: branch and peak of those whose height (m) and frequency (Hz) are wanted."""
    continuation = follower.continuation(share)
    for number, branch in enumerate((curve, *curve.detached)):
        for peak in branch.peaks:
            height = peak_height(branch, peak, continuation.options)
            if peak.located and wanted(height, peak.frequency_hz):
                start = follower.peak_near(share, stored_point(continuation, branch, peak.index))
                if start is not None and start.is_maximum:
                    yield origin_of(curve, number), start


def quasi_random(n: int, count: int) -> list[Array]:
    """Places (n,) in the unit cube that fill it evenly: multiples of powers of the generalised golden ratio."""
    root = max(np.roots([1.0, *([0.0] * (n - 1)), -1.0, -1.0]).real)
    steps = root ** -np.arange(1.0, n + 1.0)
    return [np.asarray((0.5 + k * steps) % 1.0) for k in range(1, count + 1)]


def listed(names: Sequence[str], values: Sequence[float]) -> str:
    """Parameters with their values, in a line."""
    return ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, values, strict=True))


def most_harmonics(curve: ResponseCurve) -> int:
    """Largest number of harmonics on any branch."""
    return max(branch.harmonics for branch in (curve, *curve.detached))


def with_enough_harmonics(
    problem: Problem,
    first: Callable[[], int],
    search: Callable[[Problem], Found],
    asked: Callable[[Found], int],
    progress: Callable[[str], None],
) -> Found:
    """What a search finds with as many harmonics as are asked for at its result.

    Where the number is fixed it is that of the problem; with "auto" the `first` number is raised to what is asked.
    """
    if problem.options.harmonics != "auto":
        return search(problem)
    number = first()
    while True:
        found = search(problem.with_harmonics(number))
        needed = asked(found)
        if needed <= number:
            return found
        progress(f"{needed} harmonics are needed")
        number = needed


def peak_height(branch: ResponseCurve, peak: Peak, options: SolverOptions) -> float:
    """Height of a peak of a branch as the objective counts it, m."""
    return float(branch.harmonic_m[peak.index, 0]) if options.objective == "harmonic_1" else peak.amplitude_m


def ends_said(solved: Sequence[SolvedResponse]) -> list[str]:
    """That some worst motions lie at an end of the frequency range; nothing where none does."""
    count = sum(each.at_end for each in solved)
    if not count:
        return []
    return [f"at {count} of {len(solved)} values {NO_PEAK}: they are no candidates; widen response.frequency"]


def _of_first_harmonic(curve: ResponseCurve, options: SolverOptions) -> ResponseCurve:
    """The curve with the amplitude of harmonic 1 as that of its points, and with the worst motion by it.

    A motion that is not periodic keeps its largest displacement, which bounds its first harmonic.
    """
    if options.objective != "harmonic_1" or curve.worst is None:
        return curve
    first, *others = (replace(b, amplitude_m=b.harmonic_m[:, 0], detached=()) for b in (curve, *curve.detached))
    changed, worst = replace(first, detached=tuple(others)), curve.worst
    if worst.ring_blades:
        return replace(changed, worst=worst)
    branches, _ = without_doubtful((first, *others), max(options.harmonic_tolerance, TRUNCATION_TOLERATED))
    place = highest_persistent(branches)
    if place is None:
        return replace(changed, worst=worst)
    height, at = (float(getattr(branches[place[0]], name)[place[1]]) for name in ("amplitude_m", "frequency_hz"))
    at_end = at_range_end(at, options.frequency_hz)
    if worst.at_end and not at_end:  # what is said of the end comes first
        worst = replace(worst, unresolved=worst.unresolved.partition("; ")[2], open_kinds=worst.open_kinds[1:])
    worst = replace(worst, amplitude_m=height, frequency_hz=at, branch=place[0], index=place[1], at_end=at_end)
    return replace(changed, worst=worst)


def solved_response(value: float, curve: ResponseCurve, reason: str, options: SolverOptions) -> SolvedResponse:
    """Summary of a response."""
    curve = _of_first_harmonic(curve, options)
    worst = curve.worst
    nan = float("nan")
    branches = (curve, *curve.detached)
    highest = max((float(np.max(branch.amplitude_m, initial=0.0)) for branch in branches), default=nan)
    if worst is None:
        worst_of = nan, nan, "", curve.termination.message
    else:
        origin = origin_of(curve, worst.branch)
        worst_of = worst.amplitude_m, worst.frequency_hz, origin, worst.unresolved
    amplitude, frequency_hz, origin, unresolved = worst_of
    bound = max(np.nan_to_num(amplitude), highest) if unresolved or not np.isfinite(amplitude) else amplitude
    holder = branches[worst.branch] if worst is not None and worst.branch >= 0 else curve
    return SolvedResponse(
        value,
        amplitude,
        frequency_hz,
        float(bound) if curve.points else nan,
        "periodic" if worst is None else worst.motion,
        origin,
        highest,
        len(branches),
        holder.truncation_error,
        most_harmonics(curve),
        reason,
        unresolved,
        worst is not None and worst.at_end,
    )


def origin_of(curve: ResponseCurve, branch: int) -> str:
    """Name of a branch of a response: "main branch", how a detached one was found, or that it is none of them."""
    if branch < 0:
        return "time integration"
    return "main branch" if branch == 0 else curve.detached[branch - 1].origin


def stored_point(continuation: Continuation, branch: ResponseCurve, index: int) -> SolutionPoint:
    """A stored solution of a branch with the harmonics of a continuation."""
    rows = np.zeros((2 * continuation.balance.n_harmonics + 1, continuation.balance.n_contacts, 3))
    stored = to_real(branch.relative_displacement[index])
    count = min(len(rows), len(stored))
    rows[:count] = stored[:count].reshape(count, -1, 3)
    unknown, omega = continuation.balance.unknown(rows), 2.0 * np.pi * float(branch.frequency_hz[index])
    return continuation.solver.point(unknown, omega)


def open_gaps(envelope: EnvelopeOfPeaks) -> list[Gap]:
    """The gaps whose error matters to the optimum, or is large and would show in a figure, the worst first."""
    lowest = envelope.lowest_height
    weights = [
        (_weight(gap, error, lowest), error, gap) for gap, error in zip(envelope.gaps, envelope.errors, strict=True)
    ]
    found = [
        (weight, gap)
        for weight, error, gap in weights
        if (gap.width > NARROW and weight > ACCURATE) or (gap.width > WIDE and error > SHOWS and weight > 0.0)
    ]
    return [gap for _, gap in sorted(found, key=lambda item: -item[0])]


def _weight(gap: Gap, error: float, lowest: float) -> float:
    """The error of a gap that matters: less where the gap lies far above the lowest height of the envelope."""
    if gap.before.at_end and gap.after.at_end:  # between them the frequency range ends too early as well
        return 0.0
    height = min(gap.before.height, gap.after.height)
    above = lowest / height if np.isfinite(height) and height > 0.0 else 1.0
    return error * min(1.0, above) ** 2
