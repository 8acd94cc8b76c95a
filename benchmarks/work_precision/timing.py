"""Wall seconds of a piece of work, the median of repeats where it is short."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import TypeVar

REPEATS = 3
SHORT = 1.5  # seconds; work that takes longer is timed once

Result = TypeVar("Result")


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What `work` returned at first, and its median seconds. Compiled kernels are to be warm before."""

    def once() -> tuple[Result, float]:
        start = time.perf_counter()
        result = work()
        return result, time.perf_counter() - start

    return median_of(once)


def median_of(work: Callable[[], tuple[Result, float]]) -> tuple[Result, float]:
    """The same of work that says itself how many of its seconds count."""
    result, first = work()
    seconds = [first]
    while first < SHORT and len(seconds) < REPEATS:
        seconds.append(work()[1])
    return result, statistics.median(seconds)
