"""Where over the range of a parameter the next responses are solved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from nonlinear.peak_curves.peak_search import PeakSearch, ResponseAt
from nonlinear.peak_curves.worst_envelope import NARROW, EnvelopeOfPeaks, Gap

FIRST_SHARES = (0.0, 0.5, 1.0)  # of the range
QUASI_RANDOM = 3  # shares without a reason: a branch may exist anywhere
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
BISECTIONS = 2  # of a part between two responses with different numbers of branches
EXTREMA = 3  # of the envelope, at most, at which responses are solved
ACCURATE = 0.01  # relative error of the envelope that is good enough
SHOWS, WIDE = 0.1, 0.04  # relative error and width, in shares, of a gap that is halved wherever it is
AT_ONCE = 4  # gaps that are halved in one round
APART = 0.01  # of the share, from a solved response, below which none is solved without a reason


@dataclass
class Placement:
    """Solves responses where they tell most, up to a limit."""

    search: PeakSearch  # responses and peaks
    most: int  # largest number of responses
    # relative error of what was expected, by the share of a response that was solved in a gap
    errors: dict[float, float] = field(default_factory=dict)

    def envelope(self) -> EnvelopeOfPeaks:
        """The worst motion as known now."""
        return EnvelopeOfPeaks(tuple(self.search.pieces), tuple(self.search.responses), dict(self.errors))

    @property
    def left(self) -> int:
        """Responses that may still be solved."""
        return self.most - len(self.search.responses)

    def solve(self, shares: Sequence[float], reason: str, checked: bool = True) -> list[ResponseAt]:
        """Responses at some shares, as far as the limit allows; what was expected there is compared if `checked`."""
        shares = list(shares)[: max(self.left, 0)]
        if not shares:
            return []
        expected = self.envelope().at(np.array(shares)) if checked else np.full(len(shares), np.nan)
        found = self.search.solve(shares, reason)
        heights = dict(zip(shares, expected, strict=True))
        for response in found:
            height, guess = response.solved.height, float(heights[response.share])
            if checked and np.isfinite(guess) and np.isfinite(height):
                self.errors[response.share] = abs(height / guess - 1.0)
        return found

    def explore(self) -> None:
        """Responses at both ends and in the middle; between differing ones; at extrema; without a reason."""
        self.solve(FIRST_SHARES, "first", checked=False)
        for _ in range(BISECTIONS):
            self.solve(self._between_differing(), "between")
        self.solve(self._extrema(), "search")
        sequence = [(0.5 + GOLDEN * k) % 1.0 for k in range(1, 1 + 2 * QUASI_RANDOM)]
        self.solve([s for s in sequence if self._is_new(s)][:QUASI_RANDOM], "search")

    def refine(self, reserve: int, near: Callable[[EnvelopeOfPeaks], float]) -> None:
        """Halve the gaps whose error matters until all are accurate, or all but `reserve` responses are spent.

        `near` gives the lowest height of the envelope: an error counts less where the envelope is far above that.
        """
        while self.left > reserve:
            envelope = self.envelope()
            lowest = near(envelope)
            open_gaps = [gap for gap in envelope.gaps if is_open(gap, lowest)]
            if not open_gaps:
                return
            chosen = sorted(open_gaps, key=lambda gap: -weight(gap, lowest))[: min(AT_ONCE, self.left - reserve)]
            self.solve([0.5 * (gap.before.share + gap.after.share) for gap in chosen], "refinement")

    def _between_differing(self) -> list[float]:
        """The middle between neighbouring responses with different numbers of branches."""
        return [
            0.5 * (before.share + after.share)
            for before, after in pairwise(self.search.responses)
            if before.solved.branches != after.solved.branches and after.share - before.share > APART
        ]

    def _extrema(self) -> list[float]:
        """The lowest and the highest local extrema of the envelope inside the range, that are no responses yet."""
        envelope = self.envelope()
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
        return all(abs(share - known) > APART for known in self.search.shares)


def is_open(gap: Gap, lowest: float) -> bool:
    """Whether a gap is to be halved: its error matters to the optimum, or is large and would show in a figure."""
    shows = gap.error > SHOWS and gap.width > WIDE and weight(gap, lowest) > 0.0
    return shows or (gap.width > NARROW and weight(gap, lowest) > ACCURATE)


def weight(gap: Gap, lowest: float) -> float:
    """Relative error of a gap that matters: less where the gap lies far above the lowest height of the envelope."""
    if gap.before.at_end and gap.after.at_end:  # between them the frequency range ends too early as well
        return 0.0
    height = min(gap.before.height, gap.after.height)
    above = lowest / height if np.isfinite(height) and height > 0.0 else 1.0
    return float(gap.error * min(1.0, above) ** 2)
