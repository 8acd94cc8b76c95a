"""Why the continuation of a branch ended."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal["complete", "start failed", "step too small", "too many points", "turned back"]


@dataclass(frozen=True)
class TerminationReason:
    """Why a continuation ended, and where.

    Attributes
    ----------
    kind
        "complete": the frequency range is covered. "start failed": no solution at its low end. "step too small":
        Newton's method found no next point. "too many points": `max_points` of the options. "turned back": the curve
        left the range at the end where it began.
    frequency_hz
        Frequency of the last point, Hz.
    message
        A sentence for people.
    """

    kind: Kind
    frequency_hz: float
    message: str

    @property
    def complete(self) -> bool:
        """Whether the whole frequency range was covered."""
        return self.kind == "complete"
