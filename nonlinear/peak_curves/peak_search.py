"""Responses solved at single values of a parameter, and the peaks that are followed from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from nonlinear.branches.records import Peak, at_range_end
from nonlinear.contact.fourier import to_real
from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.options import NO_PEAK, TRUNCATION_TOLERATED, SolverOptions
from nonlinear.peak_curves.optimum_result import SolvedResponse
from nonlinear.peak_curves.parameter_family import ParameterFamily, Problem
from nonlinear.peak_curves.peak_branch import PeakPiece, follow_peak
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.response_curve import ResponseCurve
from nonlinear.response_solver import forced_response
from nonlinear.worst_motion.candidates import highest_persistent, without_doubtful

SAME = 1e-3  # relative difference of the amplitudes of two peaks that count as one
SAME_FREQUENCY = 3e-2
LOW = 0.3  # of the highest solution of a response: lower peaks of it are not followed
SAME_SHARE = 1e-9  # difference of two shares that count as one

Solve = Callable[[Sequence[Problem]], Sequence[ResponseCurve]]


def solve_in_turn(problems: Sequence[Problem]) -> list[ResponseCurve]:
    """The responses of some problems, one after the other, in this process."""
    return [forced_response(*problem) for problem in problems]


class ResponseAt(NamedTuple):
    """A response solved at a share of the range."""

    share: float  # share of the range
    curve: ResponseCurve  # the response, with detached branches and worst motion
    solved: SolvedResponse  # its summary


@dataclass
class PeakSearch:
    """Solved responses and followed peaks, as they are added."""

    family: ParameterFamily  # problems and range
    progress: Callable[[str], None]  # called with a line on what is done
    solver: Solve = solve_in_turn  # solves the responses of some problems
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
        """Responses at some shares; their high peaks that are not known are followed."""
        new = [s for s in shares if all(abs(s - known) > SAME_SHARE for known in self.shares)]
        for share in new:
            self.progress(f"response at {self.family.name} = {self.family.value(share):.6g} ({reason})")
        curves = self.solver([self.family.at(share) for share in new])
        found = [
            ResponseAt(share, curve, solved_response(self.family.value(share), curve, reason, self.family.problem[3]))
            for share, curve in zip(new, curves, strict=True)
        ]
        self.responses = sorted([*self.responses, *found], key=lambda each: each.share)
        for response in found:
            self._follow_all(response)
        return found

    def _follow_all(self, response: ResponseAt) -> None:
        continuation = self.follower.continuation(response.share)
        for number, branch in enumerate((response.curve, *response.curve.detached)):
            origin = origin_of(response.curve, number)
            for peak in branch.peaks:
                height = peak_height(branch, peak, continuation.options)
                high = height >= LOW * response.solved.highest_peak_m
                if peak.located and high and not self._known(response.share, height, peak.frequency_hz):
                    point = stored_point(continuation, branch, peak.index)
                    start = self.follower.peak_near(response.share, point)
                    if start is not None and start.is_maximum and not self._is_followed(start):
                        self.progress(f"peak {start.amplitude:.4g} m followed over {self.family.name}")
                        self.pieces += follow_peak(self.follower, start, origin)

    def _is_followed(self, start: PeakPoint) -> bool:
        """Whether a peak of the first harmonic is known: `_known` was asked with that of the displacement."""
        first = self.family.problem[3].objective == "harmonic_1"
        return first and self._known(start.share, start.amplitude, start.frequency_hz)

    def _known(self, share: float, amplitude: float, frequency_hz: float) -> bool:
        for piece in self.pieces:
            if piece.holds(share):
                near = float(np.interp(share, piece.share, piece.frequency_hz))
                same = abs(float(piece.amplitude_at(np.array([share]))[0]) / amplitude - 1.0) < SAME
                if same and abs(near / frequency_hz - 1.0) < SAME_FREQUENCY:
                    return True
        return False


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
    unresolved = "" if worst.at_end and not at_end else worst.unresolved
    found = replace(worst, amplitude_m=height, frequency_hz=at, branch=place[0], index=place[1], at_end=at_end)
    return replace(changed, worst=replace(found, unresolved=unresolved))


def solved_response(value: float, curve: ResponseCurve, reason: str, options: SolverOptions) -> SolvedResponse:
    """Summary of a response.

    Parameters
    ----------
    value : float
        The parameter, SI units.
    curve : ResponseCurve
        The response.
    reason : str
        Why it was solved.
    options : SolverOptions
        Its options, with the objective.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> from dataclasses import replace
    >>> from nonlinear import solved_response
    >>> first = solved_response(0.0, curve, "", replace(options, objective="harmonic_1"))
    >>> bool(first.amplitude_m <= curve.peak.amplitude_m)
    True
    """
    curve = _of_first_harmonic(curve, options)
    worst = curve.worst
    nan = float("nan")
    branches = (curve, *curve.detached)
    highest = max((float(np.max(branch.amplitude_m, initial=0.0)) for branch in branches), default=nan)
    if worst is None:
        worst_of = nan, nan, "periodic", "", curve.termination.message
    else:
        origin = origin_of(curve, worst.branch)
        worst_of = worst.amplitude_m, worst.frequency_hz, worst.motion, origin, worst.unresolved
    amplitude, frequency_hz, motion, origin, unresolved = worst_of
    bound = max(np.nan_to_num(amplitude), highest) if unresolved or not np.isfinite(amplitude) else amplitude
    holder = branches[worst.branch] if worst is not None and worst.branch >= 0 else curve
    return SolvedResponse(
        value,
        amplitude,
        frequency_hz,
        float(bound) if curve.points else nan,
        "quasi-periodic" if motion == "quasi-periodic" else "periodic",
        origin,
        highest,
        len(branches),
        holder.truncation_error,
        max(branch.harmonics for branch in branches),
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
    return continuation.solver.point(unknown, omega, (0.0 * unknown, 1.0), 0, 0.0, continuation.options.step)
