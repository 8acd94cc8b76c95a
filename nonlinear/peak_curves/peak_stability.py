"""Whether the motion at a followed peak persists, and where along a followed peak this changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from nonlinear.continuation.point_stability import PointStability
from nonlinear.harmonic_balance.truncated_balances import TruncatedBalances
from nonlinear.peak_curves.peak_curve import PeakContinuation, PeakPoint
from nonlinear.worst_motion.candidates import LONG

CHANGE = 1e-6  # of the share, to which a change is located


@dataclass(frozen=True)
class PeakStability:
    """Stability of followed peaks, counted as in the worst motion of a response (`candidates.persists`)."""

    follower: PeakContinuation  # the family of problems

    def judged(self, peak: PeakPoint) -> PeakPoint:
        """The peak with its largest growth rate, and whether it persists.

        With the option `stability` "folds" only the sign of det dR/dx tells.
        """
        _, contact, _, options = self.follower.family.at(peak.share)
        point = peak.point
        if options.stability == "folds":
            return replace(peak, persists=point.stable)
        balances = TruncatedBalances(point.balance, contact, options)
        stability = PointStability(contact, balances, options.stability == "ring")
        point = replace(point, contact=point.balance.element.evaluate(point.displacement))
        point = replace(point, exponents=stability.exponents(point))
        if stability.has_patterns(point):
            point = replace(point, pattern=stability.worst_pattern(point))
        slow = point.growth_rate * LONG < peak.frequency_hz
        return replace(peak, growth_rate=point.growth_rate, persists=point.stable or slow)

    def with_changes(self, peaks: Sequence[PeakPoint]) -> list[PeakPoint]:
        """Judged peaks by growing share, with two more at each change: the last before it, the first after it."""
        found = list(peaks[:1])
        for before, after in pairwise(peaks):
            if before.persists != after.persists:
                found += [peak for peak in self._change(before, after) if before.share < peak.share < after.share]
            found.append(after)
        return found

    def _change(self, before: PeakPoint, after: PeakPoint) -> tuple[PeakPoint, PeakPoint]:
        """The two peaks on either side of a change, by bisection; as near to it as peaks were found."""
        while after.share - before.share > CHANGE:
            nearer = before if before.share > after.share - 0.1 else after
            middle = self.follower.moved(nearer, 0.5 * (before.share + after.share))
            if middle is None:
                break
            middle = self.judged(middle)
            before, after = (middle, after) if middle.persists == before.persists else (before, middle)
        return before, after
