"""Adaptive number of harmonics: the truncation error is estimated at every point of a branch."""

import math
from dataclasses import dataclass

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.corrector import BorderedSystem
from nonlinear.continuation.point_stability import PointStability
from nonlinear.continuation.response_quantities import (
    largest_amplitude,
    output_amplitude,
    output_harmonics,
    output_under_forces,
)
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.initial_solution import TruncatedBalances
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.harmonic_selection.peak_following import reference_harmonics
from nonlinear.options import MOST_UNKNOWNS
from nonlinear.stability.ring_stability import PatternExponent

HARMONIC_NUMBERS = (1, 3, 5, 7, 9, 11, 15, 21, 31)  # numbers of harmonics that are tried
MAX_CONTRACTION = 0.5  # of the residual of the added harmonics by one sweep; above, the sweep counts as divergent
NEGLIGIBLE = 0.02  # part of the tolerance below which the highest harmonics count as negligible
CLEARLY_BELOW = 0.2  # part of the tolerance below which an estimate is used for the next few points too
CONSECUTIVE_POINTS = 4  # so many with negligible harmonics before these are dropped; so many without a new estimate
TRIAL_INTERVAL, LONGEST_TRIAL_INTERVAL = 4, 16  # points between two trials with fewer harmonics
ENOUGH = 0.7  # part of the tolerance below which the error with fewer harmonics is small enough to drop the others
MOST_RAISES = 2  # next higher numbers of harmonics that are tried where a point needs more
LOOKED_AT_FROM = 7  # harmonics that do not suffice, from which on the stability of the motion is looked at
UNSTABLE_HARMONICS = 5  # most harmonics of such a motion: its height tells nothing
UNSTABLE_INTERVAL = 8  # points between two looks at such motions


def feasible_harmonic_numbers(n_contacts: int, least: int = 1) -> tuple[int, ...]:
    """The numbers of harmonics, `least` or more, that are tried with `n_contacts` contact nodes; the first always."""
    numbers = [n for n in HARMONIC_NUMBERS if n >= least]
    return tuple(n for n in numbers if n == numbers[0] or 3 * n_contacts * (2 * n + 1) <= MOST_UNKNOWNS)


@dataclass
class UnstableMotion:
    """Motions that the ring leaves, so that more harmonics tell nothing of what it does."""

    pattern: PatternExponent  # a perturbation that grows
    n_harmonics: int  # number of harmonics with which it was found
    points: int = UNSTABLE_INTERVAL  # number of points until the next look


@dataclass
class HarmonicSelection:
    """Raises and lowers the number of harmonics along a branch, to keep the truncation error below a tolerance.

    Where many harmonics do not suffice and the ring clearly leaves the motion, few are kept: the points get the
    exponent that grows as their `pattern`.
    """

    balances: TruncatedBalances  # the balances with other numbers of harmonics
    tolerance: float  # largest truncation error, relative to the highest amplitude so far
    stability: PointStability | None = None  # tells whether the ring leaves a motion; None: it is not looked at
    min_harmonics: int = 1  # smallest number of harmonics
    highest_amplitude: float = 0.0  # highest amplitude so far, m. It is kept from one branch to the next
    negligible_points: int = 0  # number of successive points, up to now, whose highest harmonics are negligible
    points_without_estimate: int = 0  # number of points that the last estimate still holds for
    points_to_trial: int = TRIAL_INTERVAL  # number of points until the next trial with fewer harmonics
    trial_interval: int = TRIAL_INTERVAL  # number of points between two trials. It doubles with each one that fails
    unstable: UnstableMotion | None = None  # what was found where the ring leaves the motions
    # number of points until the next look at motions that may be such; 0: nothing hints at them yet
    points_to_look: int = 0

    def __call__(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
        """The point with as many harmonics as it needs; None if it is not found with them."""
        self.highest_amplitude = max(self.highest_amplitude, self._amplitude(point))
        if point.arc == 0.0:  # of another branch
            self.unstable, self.points_to_look = None, 0
        if continuation.is_linear(point):
            self.negligible_points = self.points_without_estimate = 0
            self.unstable = None
            return self._with_harmonics(continuation, point, self.min_harmonics)
        if self.unstable is not None:
            point = self._still_unstable(continuation, point)
            if self.unstable is not None:
                return point
        if self._looked_at_now(point) and (growing := self._clearly_growing(point)):
            return self._with_few(continuation, point, growing)
        if self.points_without_estimate:
            self.points_without_estimate -= 1
            return point
        if not self._higher(point) and self.points_to_trial > 1:  # an estimate could not raise the number
            self.points_to_trial -= 1
            return self._lower_harmonics(continuation, point)
        while not (error := self.estimate(continuation, point)) <= self.tolerance:
            self.negligible_points = 0
            self.points_to_trial = self.trial_interval = TRIAL_INTERVAL
            if math.isnan(error):
                self.points_to_look = self.points_to_look or UNSTABLE_INTERVAL
            higher = self._higher(point)
            if not higher:
                break
            looked_at = point.balance.n_harmonics >= min(LOOKED_AT_FROM, higher[-1])
            growing = self._clearly_growing(point) if looked_at else None
            if growing is not None:
                return self._with_few(continuation, point, growing)
            raised = None if math.isnan(error) else self._raise_harmonics(continuation, point, higher)
            if raised is None:  # what is not found with more harmonics keeps those that it has
                return point
            point = raised
        self.points_without_estimate = CONSECUTIVE_POINTS if error < CLEARLY_BELOW * self.tolerance else 0
        return self._with_fewer(continuation, self._lower_harmonics(continuation, point), error)

    def _with_fewer(self, continuation: Continuation, point: SolutionPoint, error: float) -> SolutionPoint:
        """The point, with the lowest number of harmonics that trials, one after another, show to be enough."""
        self.points_to_trial -= 1
        if self.points_to_trial > 0 or not error < ENOUGH * self.tolerance:
            return point
        best, needed = point, 2 * self.trial_interval
        for fewer in reversed([n for n in HARMONIC_NUMBERS if self.min_harmonics <= n < point.balance.n_harmonics]):
            found = self._with_harmonics(continuation, point, fewer)
            if found is None or not (
                self._relative_change(self._amplitude(found), point) + error < ENOUGH * self.tolerance
            ):
                break
            best, needed = found, TRIAL_INTERVAL
        self.trial_interval = self.points_to_trial = min(needed, LONGEST_TRIAL_INTERVAL)
        return best

    def _clearly_growing(self, point: SolutionPoint, start: PatternExponent | None = None) -> PatternExponent | None:
        """A perturbation that grows so fast that the ring leaves the motion; None where none is known.

        `start`: the one that grew at the last look, which is followed first.
        """
        if self.stability is None:
            return None
        if not self.stability.has_patterns(point):
            own = self.stability.exponents(point)
            found = PatternExponent(complex(own[0]), 0) if own.size else None
        else:
            found = None if start is None else self.stability.follow_pattern(point, start)
            if found is None or not found.grows_clearly(point.omega):
                found = self.stability.worst_pattern(point, any_growing=True)
        return found if found is not None and found.grows_clearly(point.omega) else None

    def _still_unstable(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint:
        """A point beside motions that the ring leaves: marked as they are, unless a look tells that it does not."""
        assert self.unstable is not None
        self.unstable.points -= 1
        if self.unstable.points > 0:
            return self._marked(continuation, point)
        n_harmonics = self.unstable.n_harmonics
        wider = self._with_harmonics(continuation, point, n_harmonics) or point
        growing = self._clearly_growing(wider, self.unstable.pattern)
        if growing is None:
            self.unstable, self.points_without_estimate = None, 0
            return wider
        self.unstable = UnstableMotion(growing, n_harmonics)
        return self._marked(continuation, point)

    def _looked_at_now(self, point: SolutionPoint) -> bool:
        """Whether the stability of a point with many harmonics is looked at, beyond motions that the ring leaves."""
        if not self.points_to_look or point.balance.n_harmonics < LOOKED_AT_FROM:
            return False
        self.points_to_look -= 1
        if self.points_to_look:
            return False
        self.points_to_look = UNSTABLE_INTERVAL
        return True

    def _with_few(self, continuation: Continuation, point: SolutionPoint, growing: PatternExponent) -> SolutionPoint:
        """The first point that the ring leaves."""
        self.unstable, self.points_to_look = UnstableMotion(growing, point.balance.n_harmonics), UNSTABLE_INTERVAL
        return self._marked(continuation, point)

    def _marked(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint:
        """A point that the ring leaves, with the exponent that grows, and few harmonics if it is found with these."""
        assert self.unstable is not None
        few = max([n for n in HARMONIC_NUMBERS if n <= UNSTABLE_HARMONICS] + [self.min_harmonics])
        found = self._with_harmonics(continuation, point, few) if few < point.balance.n_harmonics else None
        return (found or point).changed(pattern=self.unstable.pattern)

    def estimate(self, continuation: Continuation, point: SolutionPoint) -> float:
        """Truncation error of the amplitude at a point, relative to the highest amplitude; NaN if it is unknown.

        One sweep of a block Gauss-Seidel iteration: the added harmonics of the displacement follow from the contact
        forces that the old ones cause, and the old ones are corrected by a Newton step normal to the curve. Where the
        iteration would diverge, the point is solved with the added harmonics instead.
        """
        n_old = point.unknown.size
        wider = self.balances.balance(reference_harmonics(point.balance.n_harmonics))
        x = point.with_balance(wider).unknown
        first = wider.evaluate(x, point.omega).residual[n_old:]
        x[n_old:] -= first
        second = wider.evaluate(x, point.omega)
        if np.linalg.norm(second.residual[n_old:]) > MAX_CONTRACTION * np.linalg.norm(first):
            return self._estimate_by_solution(continuation, point, wider)
        metric = continuation.solver.metric(point.unknown)
        linearised = point.balance.evaluate(point.unknown, point.omega)
        system = BorderedSystem.factorise(linearised, metric.unit(point.tangent), metric)
        dx, domega = system.newton_step(second.residual[:n_old])
        x[:n_old] += dx
        output = output_under_forces(wider.receptance, point.omega + domega, wider.forces(x), self._output)
        return self._relative_change(largest_amplitude(output).value, point)

    def _estimate_by_solution(
        self, continuation: Continuation, point: SolutionPoint, wider: HarmonicBalance
    ) -> float:
        """The same from the solution with more harmonics, with the next higher number where it is not found.

        NaN where neither is found: harmonics that lead to no solution are no reason for more of them.
        """
        numbers = (wider.n_harmonics, *self._higher(point)[:1])
        found = (self._with_harmonics(continuation, point, n) for n in numbers)
        solution = next((each for each in found if each is not None), None)
        return math.nan if solution is None else self._relative_change(self._amplitude(solution), point)

    def _relative_change(self, amplitude: float, point: SolutionPoint) -> float:
        return abs(amplitude - self._amplitude(point)) / max(self.highest_amplitude, 1e-300)

    @property
    def _output(self) -> str:
        return self.balances.options.output

    def _amplitude(self, point: SolutionPoint) -> float:
        return output_amplitude(point, self._output)

    def _with_harmonics(
        self, continuation: Continuation, point: SolutionPoint, n_harmonics: int
    ) -> SolutionPoint | None:
        if point.balance.n_harmonics == n_harmonics:
            return point
        return continuation.with_balance(self.balances.balance(n_harmonics)).solver.refit(point)

    def _higher(self, point: SolutionPoint) -> list[int]:
        """The numbers of harmonics above that of the point."""
        feasible = feasible_harmonic_numbers(self.balances.base.n_contacts)
        return [n for n in feasible if n > point.balance.n_harmonics]

    def _raise_harmonics(
        self, continuation: Continuation, point: SolutionPoint, higher: list[int]
    ) -> SolutionPoint | None:
        """The point with the first of the `higher` numbers of harmonics with which it is found."""
        for n_harmonics in higher[:MOST_RAISES]:
            found = self._with_harmonics(continuation, point, n_harmonics)
            if found is not None:
                return found
        return None

    def _lower_harmonics(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint:
        """The point, with the next lower number of harmonics if the highest were negligible at the last points."""
        lower = [n for n in HARMONIC_NUMBERS if self.min_harmonics <= n < point.balance.n_harmonics]
        if not lower:
            return point
        dropped = slice(2 * lower[-1] + 1, None)
        vibration = max(point.balance.vibration(point.unknown), point.balance.tiny)
        of_displacement = float(np.linalg.norm(point.displacement[dropped])) / vibration
        dropped_output = np.abs(output_harmonics(point, self._output)[lower[-1] + 1 :]).sum()
        of_output = dropped_output / max(self.highest_amplitude, 1e-300)
        negligible = of_displacement + of_output < NEGLIGIBLE * self.tolerance
        self.negligible_points = self.negligible_points + 1 if negligible else 0
        if self.negligible_points < CONSECUTIVE_POINTS:
            return point
        self.negligible_points = 0
        return self._with_harmonics(continuation, point, lower[-1]) or point
