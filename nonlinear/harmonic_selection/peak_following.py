"""A peak of a response curve followed to more harmonics, at a cost that stays a fixed part of that of the curve."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import amplitude_derivative, output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances

OVERHEAD = 4  # time of a point is proportional to (H + 4)^2, measured with 9 contact nodes and H = 1 to 9
PROBE_STEPS = (1, 2, 4, 8, 16, 32, 64)  # steps from a lost peak, on each side, after which the curve is sought again
MAX_ITERATIONS = 20
FIRST_STEP = 0.05  # arc length of the first step towards a peak that moved
MAX_STEPS_TO_PEAK = 10
MAX_STEPS_TO_LOST_PEAK = 30
NEGLIGIBLE_RISE = 0.02  # part of the change of the amplitude that the way to the peak may add unseen
LINEAR_CHANGE = 1e-12  # relative change of a response that is linear
REFIT_POINTS = 2  # points of a curve that a refit counts for: it starts farther from the solution than a step


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


def reference_harmonics(n_harmonics: int) -> int:
    """Number of harmonics of the reference for H harmonics: 2 H + 3, at most H + 8 to limit the cost."""
    return min(2 * n_harmonics + 3, n_harmonics + 8)


@dataclass(frozen=True)
class FollowedPeak:
    """A peak with more harmonics."""

    point: SolutionPoint  # solution at the peak, or the last one before it
    amplitude: float  # amplitude of the peak, m
    # whether it was found in the normal plane of the peak with fewer harmonics; else only the highest point that the
    # curve reaches nearby is known
    refitted: bool = True


@dataclass(frozen=True)
class PeakFollower:
    """Follows the highest point of a curve to more and more harmonics."""

    continuation: Continuation  # the continuation of the curve
    balances: TruncatedBalances  # the balances with other numbers of harmonics
    work: WorkLimit  # limits the points that are solved for

    def with_harmonics(self, n_harmonics: int) -> Continuation:
        """The continuation with a fixed number of harmonics, without exponents."""
        continuation = self.continuation.with_balance(self.balances.balance(n_harmonics))
        return replace(continuation, adapt=None, stability=None)

    def amplitude(self, point: SolutionPoint) -> float:
        """Amplitude of the output at a point, m."""
        return output_amplitude(point, self.continuation.options.output)

    def refit(self, wider: Continuation, point: SolutionPoint) -> SolutionPoint | None:
        """The point with more harmonics in its normal plane; None if it is not found."""
        self.work.spend(wider.balance.n_harmonics, REFIT_POINTS)
        return wider.solver.refit(point)

    def follow(self, point: SolutionPoint, is_peak: bool) -> Iterator[FollowedPeak]:
        """The point with more and more harmonics; numbers with which it is not found are left out.

        A peak may move; an end of the range stays at its frequency. The last and most expensive number of harmonics
        is needed only if the smaller ones changed the amplitude.
        """
        amplitude = self.amplitude(point)
        n_harmonics = point.balance.n_harmonics
        reference = reference_harmonics(n_harmonics)
        changed = False
        for n_more in (n_harmonics + 2, reference, reference_harmonics(reference)):
            if self.work.exhausted or (n_more > reference and not changed):
                return
            wider = self.with_harmonics(n_more)
            if not is_peak:
                found = self._at_same_frequency(wider, point)
            else:
                found = self._moved_peak(wider, point, amplitude, n_more <= reference)
            if found is not None:
                point = found.point
                changed = changed or abs(found.amplitude - amplitude) > LINEAR_CHANGE * amplitude
                yield found

    def _moved_peak(
        self, wider: Continuation, point: SolutionPoint, amplitude: float, search: bool
    ) -> FollowedPeak | None:
        """The peak with the harmonics of `wider`, searched for on both sides where it is not found in its plane."""
        found = self.refit(wider, point)
        if found is not None:
            return self._climb(wider, found, amplitude)
        return self._from_both_sides(wider, point) if search else None

    def _from_both_sides(self, wider: Continuation, lost: SolutionPoint) -> FollowedPeak | None:
        """The highest point that the curve with more harmonics reaches from both sides of a lost peak.

        On each side the curve with few harmonics is followed down from the peak until a point of it is found with
        more harmonics; from there the curve with more harmonics is followed back.
        """
        narrow = self.with_harmonics(lost.balance.n_harmonics)
        peak = self.refit(narrow, lost)
        reached: list[SolutionPoint] = []
        for start in () if peak is None else (peak, peak.reversed()):
            down = self.work.branch(narrow, replace(start, step=FIRST_STEP), PROBE_STEPS[-1] + 1)
            refits = (self.refit(wider, point) for count, point in enumerate(down) if count in PROBE_STEPS)
            found = next((point for point in refits if point is not None), None)
            if found is not None:
                back = replace(found.reversed(), step=FIRST_STEP)
                reached += self.work.branch(wider, back, MAX_STEPS_TO_LOST_PEAK)
        top = max(reached, key=self.amplitude, default=None)
        return None if top is None else FollowedPeak(top, self.amplitude(top), refitted=False)

    def _climb(self, wider: Continuation, start: SolutionPoint, narrow_amplitude: float) -> FollowedPeak:
        """The peak near `start`; the last point of the climb where no peak is reached.

        `start` itself, if the way to the peak adds little to the change from the amplitude with fewer harmonics.
        """
        output = wider.options.output
        amplitude, dA_ds = self.amplitude(start), amplitude_derivative(start, output)
        if dA_ds * dA_ds <= NEGLIGIBLE_RISE * amplitude * abs(amplitude - narrow_amplitude):
            return FollowedPeak(start, amplitude)
        if dA_ds < 0.0:
            start = start.reversed()
        before: SolutionPoint | None = None
        for point in self.work.branch(wider, replace(start, step=FIRST_STEP), MAX_STEPS_TO_PEAK):
            if before is not None and point.dA_ds <= 0.0:
                return FollowedPeak(before, self._cubic_maximum(before, point))
            before = point
        last = before or start
        return FollowedPeak(last, self.amplitude(last))

    def _at_same_frequency(self, wider: Continuation, point: SolutionPoint) -> FollowedPeak | None:
        """The solution at the frequency of a point with another number of harmonics, by damped Newton steps."""
        start = point.with_balance(wider.balance)
        found = wider.solver.solution_at(
            start.omega, start.unknown, start.tangent, MAX_ITERATIONS, start.arc, start.step
        )
        return None if found is None else FollowedPeak(found, self.amplitude(found))

    def _cubic_maximum(self, before: SolutionPoint, after: SolutionPoint) -> float:
        """Largest value between two points of the cubic with their amplitudes and their dA/ds."""
        first, last = self.amplitude(before), self.amplitude(after)
        length = after.arc - before.arc
        s = np.linspace(0.0, 1.0, 129)
        first_derivative, last_derivative = length * before.dA_ds, length * after.dA_ds
        cubic = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * first + s**2 * (3.0 - 2.0 * s) * last
        cubic += s * (1.0 - s) ** 2 * first_derivative - s**2 * (1.0 - s) * last_derivative
        return float(cubic.max())
