"""What is measured in a process of its own: `python measured_process.py CASE '{"models": FOLDER, ...}'`.

The folders of `PYTHONPATH` say which state of the program is measured: its root and its `benchmarks`, whose modules
are imported here. So only what both states have may be used. The last line printed is the answer: names -> numbers.
"""

from __future__ import annotations

import json
import signal
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Answer = dict[str, Any]


class OutOfTimeError(BaseException):
    """The processor time that a curve may take is over; no `except Exception` of the solver stops it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """At most so many seconds of processor time.

    Raises
    ------
    OutOfTimeError
        They are over.
    """

    def stop(*_: Any) -> None:
        raise OutOfTimeError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def cpu_seconds(work: Callable[[], Any], most: int = 3, short: float = 0.5) -> tuple[Any, float]:
    """What `work` returned at first and its processor seconds: the median of `most` runs where it is short."""
    times: list[float] = []
    result: Any = None
    while not times or (times[0] < short and len(times) < most):
        start = time.process_time()
        found = work()
        times.append(time.process_time() - start)
        result = found if len(times) == 1 else result
    return result, statistics.median(times)


def main() -> None:
    """Measure the case that the arguments name, with one BLAS thread unless it says otherwise."""
    import curve_cases
    import model_cases

    name, arguments = sys.argv[1], json.loads(sys.argv[2])
    found = getattr(model_cases, name, None) or getattr(curve_cases, name)
    print(json.dumps(found(**arguments)))


if __name__ == "__main__":
    main()
