"""Time that never runs backwards."""

from __future__ import annotations

import time


def now() -> float:
    """Seconds on a clock that has nothing to do with the time of day."""
    return time.perf_counter()


def seconds_since(start: float) -> float:
    """Seconds since `start` of `now`, never below 0: a virtual machine that moves may set back even this clock."""
    return max(0.0, now() - start)
