"""Why the continuation of a branch ended."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal["complete", "start failed", "step too small", "too many points", "turned back"]


@dataclass(frozen=True)
class TerminationReason:
    """Why a continuation ended, and where.

    Attributes
    ----------
    kind : str
        "complete": the frequency range is covered, or the branch is closed. "start failed": no solution at its start.
        "step too small": no next point was found with the smallest step. "too many points": `max_points` of the
        options was reached. "turned back": the branch left the range at the end where it began.
    frequency_hz : float
        Frequency of the last point, Hz.
    message : str
        The reason in a sentence.

    Examples
    --------
    With the names of the example of `forced_response`:

    >>> curve.termination.kind, curve.termination.complete, curve.termination.frequency_hz
    ('complete', True, 0.4)
    """

    kind: Kind
    frequency_hz: float
    message: str

    @property
    def complete(self) -> bool:
        """Whether the frequency range was covered, or the branch is closed."""
        return self.kind == "complete"
