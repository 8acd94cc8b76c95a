"""Adaptive number of harmonics: the truncation error is estimated at every point of a branch."""

from dataclasses import dataclass

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.corrector import BorderedSystem
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

HARMONIC_NUMBERS = (1, 3, 5, 7, 9, 11, 15, 21, 31)  # numbers of harmonics that are tried
MAX_CONTRACTION = 0.5  # of the residual of the added harmonics by one sweep; above, the sweep counts as divergent
NEGLIGIBLE = 0.02  # part of the tolerance below which the highest harmonics count as negligible
CLEARLY_BELOW = 0.2  # part of the tolerance below which an estimate is used for the next few points too
CONSECUTIVE_POINTS = 4  # so many with negligible harmonics before these are dropped; so many without a new estimate
TRIAL_INTERVAL, LONGEST_TRIAL_INTERVAL = 4, 32  # points between two trials with fewer harmonics
ENOUGH = 0.5  # part of the tolerance below which the error with fewer harmonics is small enough to drop the others


def feasible_harmonic_numbers(n_contacts: int, least: int = 1) -> tuple[int, ...]:
    """The numbers of harmonics, `least` or more, that are tried with `n_contacts` contact nodes; the first always."""
    numbers = [n for n in HARMONIC_NUMBERS if n >= least]
    return tuple(n for n in numbers if n == numbers[0] or 3 * n_contacts * (2 * n + 1) <= MOST_UNKNOWNS)


@dataclass
class HarmonicSelection:
    """Raises and lowers the number of harmonics along a branch, to keep the truncation error below a tolerance."""

    balances: TruncatedBalances  # the balances with other numbers of harmonics
    tolerance: float  # largest truncation error, relative to the highest amplitude so far
    min_harmonics: int = 1  # smallest number of harmonics
    highest_amplitude: float = 0.0  # highest amplitude so far, m. It is kept from one branch to the next
    negligible_points: int = 0  # number of successive points, up to now, whose highest harmonics are negligible
    points_without_estimate: int = 0  # number of points that the last estimate still holds for
    points_to_trial: int = TRIAL_INTERVAL  # number of points until the next trial with fewer harmonics
    trial_interval: int = TRIAL_INTERVAL  # number of points between two trials. It doubles with each one that fails

    def __call__(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
        """The point with as many harmonics as it needs; None if it is not found with them."""
        self.highest_amplitude = max(self.highest_amplitude, self._amplitude(point))
        if continuation.is_linear(point):
            self.negligible_points = self.points_without_estimate = 0
            return self._with_harmonics(continuation, point, self.min_harmonics)
        if self.points_without_estimate:
            self.points_without_estimate -= 1
            return point
        if not self._higher(point) and self.points_to_trial > 1:  # an estimate could not raise the number
            self.points_to_trial -= 1
            return self._lower_harmonics(continuation, point)
        while (error := self.estimate(continuation, point)) > self.tolerance:
            self.negligible_points = 0
            self.points_to_trial = self.trial_interval
            higher = self._higher(point)
            if not higher:
                break
            raised = self._raise_harmonics(continuation, point, higher)
            if raised is None:
                return None
            point = raised
        self.points_without_estimate = CONSECUTIVE_POINTS if error < CLEARLY_BELOW * self.tolerance else 0
        return self._with_fewer(continuation, self._lower_harmonics(continuation, point), error)

    def _with_fewer(self, continuation: Continuation, point: SolutionPoint, error: float) -> SolutionPoint:
        """The point, with the next lower number of harmonics where a trial shows that these are enough."""
        lower = [n for n in HARMONIC_NUMBERS if self.min_harmonics <= n < point.balance.n_harmonics]
        self.points_to_trial -= 1
        if not lower or self.points_to_trial > 0:
            return point
        found = self._with_harmonics(continuation, point, lower[-1])
        if (
            found is not None
            and self._relative_change(self._amplitude(found), point) + error < ENOUGH * self.tolerance
        ):
            self.points_to_trial = self.trial_interval = TRIAL_INTERVAL
            return found
        self.trial_interval = self.points_to_trial = min(2 * self.trial_interval, LONGEST_TRIAL_INTERVAL)
        return point

    def estimate(self, continuation: Continuation, point: SolutionPoint) -> float:
        """Truncation error of the amplitude at a point, relative to the highest amplitude; inf if it is unknown.

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
        """The same from the solution with more harmonics."""
        found = continuation.with_balance(wider).solver.refit(point)
        return float("inf") if found is None else self._relative_change(self._amplitude(found), point)

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
        for n_harmonics in higher:
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
