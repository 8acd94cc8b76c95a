"""How a curve ended: a typed outcome with a message for people."""

from dataclasses import dataclass
from enum import Enum


class Ending(Enum):
    """Why the continuation stopped."""

    COMPLETE = "complete"
    START_FAILED = "start failed"
    STEP_TOO_SMALL = "step too small"
    TOO_MANY_POINTS = "too many points"
    TURNED_BACK = "turned back"


@dataclass(frozen=True)
class Outcome:
    """Ending of a curve, the frequency where it happened (Hz) and a sentence that says so."""

    ending: Ending
    frequency_hz: float
    message: str

    @property
    def complete(self) -> bool:
        """Whether the whole frequency range was covered."""
        return self.ending is Ending.COMPLETE
