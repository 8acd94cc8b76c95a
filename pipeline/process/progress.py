"""Progress of a run on stderr: a live line at a terminal, plain lines elsewhere, nothing when quiet; elapsed time."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TextIO

from pipeline.process.interrupts import Interrupts

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


def seconds_since(start: float) -> float:
    """Seconds since `start`, a value of `time.perf_counter`; never negative, even where that clock is set back."""
    return max(0.0, time.perf_counter() - start)


_PAUSE = 0.1  # seconds between two updates of a live line
_FIRST_LINE = 5.0  # seconds after which a plain line reports that a single piece of work still goes on
_GROWTH = 3.0  # ratio of the pauses between such lines
_PAUSE_OF_LINES = 30.0  # seconds, the longest of these pauses, and that between lines while pieces are counted


@dataclass
class Reporter:
    """Reports the progress of a run."""

    quiet: bool = False  # whether to write nothing but errors
    # where to write, stderr by default; None, as stderr is where it was closed, writes nothing
    stream: TextIO | None = field(default_factory=lambda: sys.stderr)
    interrupts: Interrupts = field(default_factory=Interrupts)  # requests to stop the run
    # whether a live line can be shown though the stream is no terminal, as in a notebook with widgets
    live: bool = False

    def line(self, text: str) -> None:
        """Write one plain line. A closed pipe or a full log does not stop the run."""
        if not self.quiet and self.stream is not None:
            with suppress(OSError):
                print(text, file=self.stream, flush=True)

    @contextmanager
    def working(self, text: str) -> Iterator[None]:
        """Show `text` during the block, and the time it took at its end."""
        start = time.perf_counter()
        if self._live():
            with _spinner(self.stream) as progress:
                progress.add_task(text, total=None)
                yield
        elif self.quiet:
            yield
        else:
            with self._repeated_lines(text, start):
                yield
        self.line(f"{text}: {seconds_since(start):.2f} s")

    @contextmanager
    def _repeated_lines(self, text: str, start: float) -> Iterator[None]:
        """Write from time to time that the block still goes on."""
        done = threading.Event()

        def write() -> None:
            pause = _FIRST_LINE
            while not done.wait(pause):
                self.line(f"{text}: {seconds_since(start):.0f} s so far")
                pause = min(pause * _GROWTH, _PAUSE_OF_LINES)

        with _beside(write, done):
            yield

    @contextmanager
    def counting(self, text: str, total: int, at_once: int = 1) -> Iterator[Counter]:
        """A counter of `total` pieces of work, `at_once` of them in parallel."""
        with self.counting_several({text: total}, at_once) as counters:
            yield counters[text]

    @contextmanager
    def counting_several(self, totals: Mapping[str, int], at_once: int = 1) -> Iterator[dict[str, Counter]]:
        """Counters of several kinds of work at the same time, by what each counts."""
        if self.quiet or not any(totals.values()):
            yield {text: Counter() for text in totals}
        elif self._live():
            with _bar(self.stream) as progress:
                tasks = {text: progress.add_task(text, total=total, detail="") for text, total in totals.items()}
                yield {text: LiveCounter(progress, task) for text, task in tasks.items()}
        else:
            start, done = time.perf_counter(), threading.Event()
            counters = {text: LineCounter(self, text, total, at_once, start) for text, total in totals.items()}

            def write() -> None:
                while not done.wait(_PAUSE_OF_LINES / 10.0):
                    if all(counter.silent_for > _PAUSE_OF_LINES for counter in counters.values()):
                        going = [counter for counter in counters.values() if counter.count < counter.total]
                        (going or list(counters.values()))[0].goes_on(seconds_since(start))

            with _beside(write, done):
                yield dict(counters)

    def _live(self) -> bool:
        return not self.quiet and self.stream is not None and (self.live or self.stream.isatty())


@contextmanager
def _beside(write: Callable[[], None], done: threading.Event) -> Iterator[None]:
    """A thread that writes during the block, until `done`."""
    writer = threading.Thread(target=write, name="progress", daemon=True)
    writer.start()
    try:
        yield
    finally:
        done.set()
        writer.join()


def time_left(elapsed: float, done: int, total: int, at_once: int = 1) -> float:
    """Seconds left when `done` of `total` equal pieces of work, `at_once` in parallel, took `elapsed` seconds."""
    rounds, rounds_done = math.ceil(total / at_once), math.ceil(done / at_once)
    return elapsed / rounds_done * (rounds - rounds_done)


def duration(seconds: float) -> str:
    """A time in the unit that suits it: 0.4 s, 12 s, 3 min, 2.5 h."""
    if seconds < 90.0:
        return f"{seconds:.1f} s" if seconds < 3.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


@dataclass
class Counter:
    """Counts pieces of work and writes nothing."""

    def within(self, detail: str) -> None:
        """Report the state of the piece being worked on."""

    def done(self, detail: str, *, notable: bool = True) -> None:
        """One piece is done; without a line of its own where that is not notable."""

    def grow(self, count: int) -> None:
        """`count` pieces have been begun or wait so far, which may be more than was expected."""


@dataclass
class LineCounter(Counter):
    """A line for every notable piece, with the time left, and one from time to time where none is done."""

    reporter: Reporter
    text: str
    total: int
    at_once: int
    start: float
    count: int = 0
    grown: int = 0
    state: str = ""  # of the pieces being worked on
    last: float = field(default_factory=time.perf_counter)  # when the last line was written

    @property
    def silent_for(self) -> float:
        """Seconds since the last line."""
        return seconds_since(self.last)

    def within(self, detail: str) -> None:
        """Report the state of the pieces being worked on."""
        self.state = detail

    def grow(self, count: int) -> None:
        """More pieces than expected raise the total; the time counts from the first of them."""
        if not self.grown:
            self.start = time.perf_counter()
        self.grown, self.total = count, max(self.total, count)

    def done(self, detail: str, *, notable: bool = True) -> None:
        """One piece is done."""
        self.count += 1
        if not notable:
            return
        seconds = time_left(seconds_since(self.start), self.count, self.total, self.at_once)
        left = f"; about {duration(seconds)} left" if seconds > 0.0 else ""
        self._line(f"{detail}{left}")

    def goes_on(self, elapsed: float) -> None:
        """Say that the work goes on after so many seconds."""
        state = f", {self.state}" if self.state else ""
        self._line(f"{duration(elapsed)} so far{state}")

    def _line(self, text: str) -> None:
        self.last = time.perf_counter()
        self.reporter.line(f"{self.text}, {self.count} of {self.total} done: {text}")


@dataclass
class LiveCounter(Counter):
    """A progress bar of rich with the time left."""

    progress: Progress
    task: TaskID
    last: float = 0.0

    def grow(self, count: int) -> None:
        """More pieces than expected raise the total."""
        if count > (self.progress.tasks[self.task].total or 0):
            self.progress.update(self.task, total=count)

    def within(self, detail: str) -> None:
        """Report the state of the piece being worked on, at most every 0.1 s."""
        if seconds_since(self.last) > _PAUSE:
            self.last = time.perf_counter()
            self.progress.update(self.task, detail=detail)

    def done(self, detail: str, *, notable: bool = True) -> None:
        """One piece is done."""
        self.progress.update(self.task, advance=1, detail=detail)


def _spinner(stream: TextIO | None) -> Progress:
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    return Progress(*columns, console=Console(file=stream), transient=True)


def _bar(stream: TextIO | None) -> Progress:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.table import Column

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=16),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[detail]}", table_column=Column(no_wrap=True, overflow="ellipsis")),
    )
    return Progress(*columns, console=Console(file=stream))
