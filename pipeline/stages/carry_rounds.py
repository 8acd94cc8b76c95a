"""Rounds in which branches are carried across a sweep: which curve is due, and offered the branches of which others.

In each round every curve is offered the branches that its neighbours have got in the round before. A curve takes part
in a round as soon as it and its neighbours have finished the round before; nothing waits for the rest of the sweep.
What a curve gets is the same as if all did.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Turn:
    """A curve that is due."""

    curve: str  # key of the curve
    round: int  # number of the round, from 1
    sources: tuple[str, ...]  # its neighbours that have changed in the round before


@dataclass
class CarryRounds:
    """Rounds across a sweep; they end where no curve has changed in the last one."""

    neighbours: Mapping[str, Sequence[str]]  # the neighbours of every curve that has any, each once. They are mutual
    most: int  # number of rounds after which they are ended in any case
    _changed: dict[str, list[bool]] = field(default_factory=dict)  # of a curve, in each round that it has finished
    _left_out: set[str] = field(default_factory=set)
    _due: set[str] = field(default_factory=set)
    _last: int = -1  # last round in which a curve has changed so far

    @property
    def are_cut_short(self) -> bool:
        """Whether curves still changed in the last round allowed."""
        return self._last == self.most

    @property
    def before_first(self) -> int:
        """Number of curves that have not finished the first round."""
        return sum(len(self._changed.get(key, ())) < 2 for key in self.neighbours if key not in self._left_out)

    def leave_out(self, curve: str) -> list[Turn]:
        """A curve that could not be solved; returns which curves are due now."""
        self._left_out.add(curve)
        return self._advanced(self.neighbours[curve])

    def finished(self, curve: str, changed: bool) -> list[Turn]:
        """A curve has been solved (round 0), or has finished the next round; returns which curves are due now."""
        self._due.discard(curve)
        self._note(curve, changed)
        last = len(self._changed[curve]) - 1
        if changed and last > self._last:
            self._last = last
            return self._advanced(self.neighbours)
        return self._advanced([curve, *self.neighbours[curve]])

    def _note(self, curve: str, changed: bool) -> None:
        self._changed.setdefault(curve, []).append(changed)

    def _advanced(self, curves: Mapping[str, Sequence[str]] | Sequence[str]) -> list[Turn]:
        """Begin the next round of these curves, and of others that are due with them, where they have one."""
        waiting, turns = list(curves), []
        while waiting:
            curve = waiting.pop()
            number = len(self._changed.get(curve, ()))
            if not self._may_begin(curve, number):
                continue
            others = [other for other in self.neighbours[curve] if other not in self._left_out]
            sources = tuple(other for other in others if self._changed[other][number - 1])
            if sources:
                self._due.add(curve)
                turns.append(Turn(curve, number, sources))
            else:
                self._note(curve, False)
                waiting += [curve, *others]
        return turns

    def _may_begin(self, curve: str, number: int) -> bool:
        if curve in self._due or curve in self._left_out or not 0 < number <= min(self.most, self._last + 1):
            return False
        return all(
            other in self._left_out or len(self._changed.get(other, ())) >= number for other in self.neighbours[curve]
        )
