"""What a run says while it works, on stderr: a live line at a terminal, plain lines elsewhere, nothing when quiet."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TextIO

from pipeline.process.clock import now, seconds_since
from pipeline.process.interrupts import Interrupts

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_PAUSE = 0.1  # seconds between two updates of a live line
_FIRST_WORD = 5.0  # seconds after which a single piece of work says that it is still going on,
_LATER_WORDS = 3.0  # and how many times longer every later time


@dataclass
class Reporter:
    """Tells people what is going on. `quiet`: nothing but errors. `interrupts`: whether they want it to stop."""

    quiet: bool = False
    stream: TextIO = field(default_factory=lambda: sys.stderr)
    interrupts: Interrupts = field(default_factory=Interrupts)

    def line(self, text: str) -> None:
        """One plain line. Nobody has to listen: a closed pipe or a full log does not stop the work."""
        if not self.quiet:
            with suppress(OSError):
                print(text, file=self.stream, flush=True)

    @contextmanager
    def working(self, text: str) -> Iterator[None]:
        """Say what is being done as long as it takes, and how long it took."""
        start = now()
        if self._live():
            with _spinner(self.stream) as progress:
                progress.add_task(text, total=None)
                yield
        elif self.quiet:
            yield
        else:
            with self._speaking(text, start):
                yield
        self.line(f"{text}: {seconds_since(start):.2f} s")

    @contextmanager
    def _speaking(self, text: str, start: float) -> Iterator[None]:
        """Say from time to time that it still goes on."""
        done = threading.Event()

        def speak() -> None:
            pause = _FIRST_WORD
            while not done.wait(pause):
                self.line(f"{text}: {seconds_since(start):.0f} s so far")
                pause *= _LATER_WORDS

        speaker = threading.Thread(target=speak, name=text, daemon=True)
        speaker.start()
        try:
            yield
        finally:
            done.set()
            speaker.join()

    @contextmanager
    def counting(self, text: str, total: int, at_once: int = 1) -> Iterator[Counter]:
        """A bar over `total` pieces of work, so many of them at once."""
        if self.quiet or total == 0:
            yield Counter()
        elif self._live():
            with _bar(self.stream) as progress:
                yield LiveCounter(progress, progress.add_task(text, total=total, detail=""))
        else:
            yield LineCounter(self, text, Pace(total, at_once))

    def _live(self) -> bool:
        return not self.quiet and self.stream.isatty()


@dataclass
class Pace:
    """How fast pieces of work get done, where all are taken to be alike and those in hand to be half done."""

    total: int
    at_once: int = 1
    start: float = field(default_factory=now)

    def left(self, done: int) -> float:
        """Seconds until all are done; `done`: pieces by now, one or more."""
        remaining = self.total - done
        worth = done + 0.5 * (min(self.at_once, remaining + 1) - 1)
        return seconds_since(self.start) * (self.total - worth) / worth if remaining else 0.0


def duration(seconds: float) -> str:
    """A time for people: 0.4 s, 12 s, 3 min, 2.5 h."""
    if seconds < 90.0:
        return f"{seconds:.1f} s" if seconds < 3.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


@dataclass
class Counter:
    """Counts pieces of work; this one in silence."""

    def within(self, detail: str) -> None:
        """Say where the piece in hand stands."""

    def done(self, detail: str) -> None:
        """One piece is done."""


@dataclass
class LineCounter(Counter):
    """One line for every piece, with the time left."""

    reporter: Reporter
    text: str
    pace: Pace
    count: int = 0

    def done(self, detail: str) -> None:
        """One piece is done."""
        self.count += 1
        left = f", about {duration(self.pace.left(self.count))} left" if self.count < self.pace.total else ""
        self.reporter.line(f"{self.text} {self.count}/{self.pace.total}: {detail}{left}")


@dataclass
class LiveCounter(Counter):
    """A bar with the time left."""

    progress: Progress
    task: TaskID
    last: float = 0.0

    def within(self, detail: str) -> None:
        """Say where the piece in hand stands, not more often than a person can read."""
        if seconds_since(self.last) > _PAUSE:
            self.last = now()
            self.progress.update(self.task, detail=detail)

    def done(self, detail: str) -> None:
        """One piece is done."""
        self.progress.update(self.task, advance=1, detail=detail)


def _spinner(stream: TextIO) -> Progress:
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    return Progress(*columns, console=Console(file=stream), transient=True)


def _bar(stream: TextIO) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[detail]}"),
    )
    return Progress(*columns, console=Console(file=stream))
