"""As many harmonics as a point needs: what those left out would change is estimated at every point of a trace."""

from dataclasses import dataclass, field

import numpy as np

from nonlinear.continuation.arclength_continuation import Continuation
from nonlinear.continuation.bordered_system import BorderedSystem
from nonlinear.continuation.response_quantities import largest_amplitude, output_harmonics, output_under
from nonlinear.continuation.solution_point import SolutionPoint
from nonlinear.harmonic_balance.balance_family import BalanceFamily, resized
from nonlinear.harmonic_balance.residual import HarmonicBalance
from nonlinear.harmonic_selection.truncation_error import wider_harmonics
from nonlinear.options import MOST_UNKNOWNS

LADDER = (1, 3, 5, 7, 9, 11, 15, 21, 31)  # numbers of harmonics that are tried
DIVERGES = 0.5  # part of the residual of the new harmonics that one sweep may leave
CLEARLY_ENOUGH = 0.02  # part of the tolerance below which the highest harmonics are dropped again
CLEARLY_BELOW = 0.2  # part of the tolerance below which an estimate is believed for the next few points too
PATIENCE = 4  # points in a row of which that must be true


def ladder(n_contacts: int) -> tuple[int, ...]:
    """The numbers of harmonics that are tried with so many contact nodes; one harmonic always."""
    return tuple(n for n in LADDER if n == LADDER[0] or 3 * n_contacts * (2 * n + 1) <= MOST_UNKNOWNS)


@dataclass
class HarmonicSelection:
    """Raises and lowers the number of harmonics along a trace, so that `tolerance` holds relative to the peak so far.

    `least`: never fewer than these. The highest amplitude met so far is kept from one trace to the next.
    """

    family: BalanceFamily
    tolerance: float
    least: int = 1
    highest: float = 0.0
    quiet: int = field(default=0)
    believed: int = field(default=0)

    def __call__(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint | None:
        """The point with as many harmonics as it needs; None if it is not found with them."""
        self.highest = max(self.highest, self._height(point))
        if continuation.is_linear(point):
            self.quiet = self.believed = 0
            return self._with(continuation, point, self.least)
        if self.believed:
            self.believed -= 1
            return point
        while (missing := self.missing(continuation, point)) > self.tolerance:
            self.quiet = 0
            more = [n for n in ladder(self.family.base.n_contacts) if n > point.balance.n_harmonics]
            if not more:
                break
            raised = self._raised(continuation, point, more)
            if raised is None:
                return None
            point = raised
        self.believed = PATIENCE if missing < CLEARLY_BELOW * self.tolerance else 0
        return self._lowered(continuation, point)

    def missing(self, continuation: Continuation, point: SolutionPoint) -> float:
        """Estimated relative change of the amplitude by the harmonics left out; inf where it cannot be told.

        One sweep of a block iteration: the new harmonics of the displacement from the forces that the old ones
        cause, the old ones again from those by a Newton step normal to the curve. Where that iteration would
        diverge, the point is solved with more harmonics.
        """
        n_old = point.unknown.size
        wider = self.family.balance(wider_harmonics(point.balance.n_harmonics))
        x = resized(point, wider).unknown
        first = wider.evaluate(x, point.omega).residual[n_old:]
        x[n_old:] -= first
        second = wider.evaluate(x, point.omega)
        if np.linalg.norm(second.residual[n_old:]) > DIVERGES * np.linalg.norm(first):
            return self._missing_by_solution(continuation, point, wider)
        metric = continuation.metric(point.unknown)
        at = point.balance.evaluate(point.unknown, point.omega)
        system = BorderedSystem.factorise(at, metric.unit(point.tangent), metric)
        moved, shift = system.step(second.residual[:n_old])
        x[:n_old] += moved
        output = output_under(wider.receptance, point.omega + shift, wider.forces(x), self._output)
        changed = largest_amplitude(output)
        return abs(changed.value - self._height(point)) / max(self.highest, 1e-300)

    def _missing_by_solution(self, continuation: Continuation, point: SolutionPoint, wider: HarmonicBalance) -> float:
        found = continuation.of(wider).refit(point)
        if found is None:
            return float("inf")
        return abs(self._height(found) - self._height(point)) / max(self.highest, 1e-300)

    @property
    def _output(self) -> str:
        return self.family.options.output

    def _height(self, point: SolutionPoint) -> float:
        return largest_amplitude(output_harmonics(point, self._output)).value

    def _with(self, continuation: Continuation, point: SolutionPoint, n_harmonics: int) -> SolutionPoint | None:
        if point.balance.n_harmonics == n_harmonics:
            return point
        return continuation.of(self.family.balance(n_harmonics)).refit(point)

    def _raised(self, continuation: Continuation, point: SolutionPoint, more: list[int]) -> SolutionPoint | None:
        """The point with the fewest more harmonics with which it is found."""
        for n_harmonics in more:
            found = self._with(continuation, point, n_harmonics)
            if found is not None:
                return found
        return None

    def _lowered(self, continuation: Continuation, point: SolutionPoint) -> SolutionPoint:
        """The point, with one step fewer harmonics if the last few points could have done without those."""
        fewer = [n for n in LADDER if self.least <= n < point.balance.n_harmonics]
        if not fewer:
            return point
        rest = slice(2 * fewer[-1] + 1, None)
        vibration = max(point.balance.vibration(point.unknown), point.balance.tiny)
        surplus = float(np.linalg.norm(point.displacement[rest])) / vibration
        share = np.abs(output_harmonics(point, self._output)[fewer[-1] + 1 :]).sum() / max(self.highest, 1e-300)
        self.quiet = self.quiet + 1 if surplus + share < CLEARLY_ENOUGH * self.tolerance else 0
        if self.quiet < PATIENCE:
            return point
        self.quiet = 0
        return self._with(continuation, point, fewer[-1]) or point
