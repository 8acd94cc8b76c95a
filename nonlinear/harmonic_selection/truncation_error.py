"""Truncation error of a solved curve: its points are solved again with more harmonics.

References
----------
P. J. Roache, "Perspective: a method for uniform reporting of grid refinement studies", J. Fluids Eng. 116(3), 1994,
pp. 405-413.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, pairwise

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.response_quantities import amplitude_derivative, output_amplitude
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import solve_at
from nonlinear.harmonic_balance.truncated_balances import TruncatedBalances

SAFETY_FACTOR = 1.25  # of solutions on three grids (Roache 1994)
SAMPLED_POINTS = 6  # along a curve, beside its peaks, where `along_curve` estimates the error
PROBE_STEPS = (1, 2, 4, 8, 16, 32, 64)  # steps from a lost peak, on each side, after which the curve is sought again
MAX_ITERATIONS = 20
FIRST_STEP = 0.05  # arc length of the first step towards a peak that moved
MAX_STEPS_TO_PEAK = 10
MAX_STEPS_TO_LOST_PEAK = 30
NEGLIGIBLE_RISE = 0.02  # part of the change of the amplitude that the way to the peak may add unseen
LINEAR_CHANGE = 1e-12  # relative change of a response that is linear


def reference_harmonics(n_harmonics: int) -> int:
    """Number of harmonics of the reference for H harmonics: 2 H + 3, at most H + 8 to limit the cost."""
    return min(2 * n_harmonics + 3, n_harmonics + 8)


@dataclass(frozen=True)
class TruncationErrorEstimator:
    """Estimates the error of the amplitude by neglected harmonics at the points of a curve.

    Attributes
    ----------
    continuation : Continuation
        The continuation of the curve.
    balances : TruncatedBalances
        The balances with other numbers of harmonics.
    """

    continuation: Continuation
    balances: TruncatedBalances

    def at_peak(self, points: list[SolutionPoint], peak_indices: list[int]) -> float:
        """Relative truncation error of the highest amplitude; NaN without points, inf where the peak is lost.

        The peak is continued to H + 2 harmonics, to H' = `reference_harmonics` of H, and to `reference_harmonics` of
        H'. With the relative changes d1, d2, d3 of the amplitude from each to the next, the estimate is

            1.25 (d1 + d2 + 2 d3).

        Changes are summed, since amplitudes that alternate are farther from their limit than the last change. The
        last one counts twice, as if each later change were half of the one before. 1.25 is the safety factor of
        Roache (1994). Where the peak is lost, the highest amplitude with more harmonics on both sides of it takes its
        place.

        Parameters
        ----------
        points : list of SolutionPoint
            The curve.
        peak_indices : list of int
            Indices of its peaks.
        """
        if not points:
            return float("nan")
        index = max((*peak_indices, 0, len(points) - 1), key=lambda place: self._amplitude(points[place]))
        amplitude = self._amplitude(points[index])
        if amplitude == 0.0:
            return 0.0
        wider = list(self._amplitudes_with_more_harmonics(points[index], index in peak_indices))
        changes = [abs(before / after - 1.0) for before, after in pairwise((amplitude, *wider))]
        return SAFETY_FACTOR * (sum(changes) + changes[-1]) if changes else float("inf")

    def along_curve(self, points: list[SolutionPoint], peak_indices: list[int]) -> float:
        """Largest change of the amplitude with more harmonics, relative to the highest amplitude.

        It is evaluated at the peaks and at some other points; NaN without points, inf where one is lost.
        """
        if not points:
            return float("nan")
        amplitudes = [self._amplitude(point) for point in points]
        if max(amplitudes) == 0.0:
            return 0.0
        spread = np.unique(np.linspace(0, len(points) - 1, SAMPLED_POINTS).astype(int)).tolist()
        sampled = sorted({*peak_indices, *spread, int(np.argmax(amplitudes))})
        changes = [abs(self._reference_amplitude(points[index]) - amplitudes[index]) for index in sampled]
        return max(changes) / max(amplitudes)

    def _amplitude(self, point: SolutionPoint) -> float:
        return output_amplitude(point, self.continuation.options.output)

    def _with_harmonics(self, n_harmonics: int) -> Continuation:
        """The continuation with a fixed number of harmonics, without exponents."""
        continuation = self.continuation.with_balance(self.balances.balance(n_harmonics))
        return replace(continuation, adapt=None, stability=None)

    def _reference_amplitude(self, point: SolutionPoint) -> float:
        """Amplitude with more harmonics, in the plane normal to the curve through the point; inf if not found."""
        found = self._with_harmonics(reference_harmonics(point.balance.n_harmonics)).solver.refit(point)
        return float("inf") if found is None else self._amplitude(found)

    def _amplitudes_with_more_harmonics(self, point: SolutionPoint, is_peak: bool) -> Iterator[float]:
        """Amplitudes of the point with more and more harmonics; numbers with which it is not found are left out.

        A peak may move; an end of the range stays at its frequency. The last and most expensive number of harmonics
        is needed only if the smaller ones changed the amplitude.
        """
        amplitude = self._amplitude(point)
        n_harmonics = point.balance.n_harmonics
        reference = reference_harmonics(n_harmonics)
        changed = False
        for n_more in (n_harmonics + 2, reference, reference_harmonics(reference)):
            if n_more > reference and not changed:
                return
            wider = self._with_harmonics(n_more)
            found = wider.solver.refit(point) if is_peak else _at_same_frequency(wider, point)
            if found is None:
                reached = self._from_both_sides(wider, point) if is_peak else None
            else:
                reached = self._climb(wider, found, amplitude) if is_peak else (found, self._amplitude(found))
            if reached is not None:
                point, wider_amplitude = reached
                changed = changed or abs(wider_amplitude - amplitude) > LINEAR_CHANGE * amplitude
                yield wider_amplitude

    def _from_both_sides(self, wider: Continuation, lost: SolutionPoint) -> tuple[SolutionPoint, float] | None:
        """The highest point that the curve with more harmonics reaches from both sides of a lost peak.

        On each side the curve with few harmonics is followed down from the peak until a point of it is found with
        more harmonics; from there the curve with more harmonics is followed back.
        """
        narrow = self._with_harmonics(lost.balance.n_harmonics)
        peak = narrow.solver.refit(lost)
        reached: list[SolutionPoint] = []
        for start in () if peak is None else (peak, peak.reversed()):
            down = islice(narrow.continue_branch(replace(start, step=FIRST_STEP)), PROBE_STEPS[-1] + 1)
            refits = (wider.solver.refit(point) for count, point in enumerate(down) if count in PROBE_STEPS)
            found = next((point for point in refits if point is not None), None)
            if found is not None:
                back = wider.continue_branch(replace(found.reversed(), step=FIRST_STEP))
                reached += islice(back, MAX_STEPS_TO_LOST_PEAK)
        top = max(reached, key=self._amplitude, default=None)
        return None if top is None else (top, self._amplitude(top))

    def _climb(
        self, wider: Continuation, start: SolutionPoint, narrow_amplitude: float
    ) -> tuple[SolutionPoint, float]:
        """The peak near `start` and its amplitude; the last point of the climb where no peak is reached.

        `start` itself, if the way to the peak adds little to the change from the amplitude with fewer harmonics.
        """
        output = wider.options.output
        amplitude, dA_ds = self._amplitude(start), amplitude_derivative(start, output)
        if dA_ds * dA_ds <= NEGLIGIBLE_RISE * amplitude * abs(amplitude - narrow_amplitude):
            return start, amplitude
        if dA_ds < 0.0:
            start = start.reversed()
        before: SolutionPoint | None = None
        for point in islice(wider.continue_branch(replace(start, step=FIRST_STEP)), MAX_STEPS_TO_PEAK):
            if before is not None and point.dA_ds <= 0.0:
                return before, _cubic_maximum(before, point, self._amplitude(before), self._amplitude(point))
            before = point
        last = before or start
        return last, self._amplitude(last)


def _at_same_frequency(continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
    """The solution at the frequency of a point with another number of harmonics, by damped Newton steps."""
    start = point.with_balance(continuation.balance)
    solved = solve_at(continuation.balance, start.omega, start.unknown, continuation.options, MAX_ITERATIONS)
    if not solved.converged:
        return None
    return continuation.solver.point(
        solved.solution, start.omega, start.tangent, solved.iterations, start.arc, start.step
    )


def _cubic_maximum(before: SolutionPoint, after: SolutionPoint, first: float, last: float) -> float:
    """Largest value between two points of the cubic with their amplitudes `first` and `last` and their dA/ds."""
    length = after.arc - before.arc
    s = np.linspace(0.0, 1.0, 129)
    first_derivative, last_derivative = length * before.dA_ds, length * after.dA_ds
    cubic = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * first + s**2 * (3.0 - 2.0 * s) * last
    cubic += s * (1.0 - s) ** 2 * first_derivative - s**2 * (1.0 - s) * last_derivative
    return float(cubic.max())
