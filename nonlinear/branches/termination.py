"""How a curve ended: a typed outcome with a message for people."""

from dataclasses import dataclass
from enum import Enum


class Ending(Enum):
    """Why the continuation stopped. The value is the name for people.

    COMPLETE: the range is covered. START_FAILED: no solution at its low end. STEP_TOO_SMALL: Newton's method found
    no next point. TOO_MANY_POINTS: `max_points` of the options. TURNED_BACK: the curve left at the end it began.
    """

    COMPLETE = "complete"
    START_FAILED = "start failed"
    STEP_TOO_SMALL = "step too small"
    TOO_MANY_POINTS = "too many points"
    TURNED_BACK = "turned back"


@dataclass(frozen=True)
class Outcome:
    """How a curve ended: its `ending`, `frequency_hz` where that was, and `message`, a sentence that says so."""

    ending: Ending
    frequency_hz: float
    message: str

    @property
    def complete(self) -> bool:
        """Whether the whole frequency range was covered."""
        return self.ending is Ending.COMPLETE
