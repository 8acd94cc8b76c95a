"""What a run says while it works, on stderr: a live line at a terminal, plain lines elsewhere, nothing when quiet."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TextIO

from pipeline.interruption import Interrupts

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_PAUSE = 0.1  # seconds between two updates of a live line


@dataclass
class Reporter:
    """Tells people what is going on. `quiet`: nothing but errors. `interrupts`: whether they want it to stop."""

    quiet: bool = False
    stream: TextIO = field(default_factory=lambda: sys.stderr)
    interrupts: Interrupts = field(default_factory=Interrupts)

    def line(self, text: str) -> None:
        """One plain line."""
        if not self.quiet:
            print(text, file=self.stream, flush=True)

    @contextmanager
    def working(self, text: str) -> Iterator[None]:
        """Say that something has begun, and how long it took."""
        start = time.perf_counter()
        if self._live():
            from rich.console import Console

            with Console(file=self.stream).status(text):
                yield
        else:
            yield
        self.line(f"{text}: {time.perf_counter() - start:.2f} s")

    @contextmanager
    def counting(self, text: str, total: int) -> Iterator[Counter]:
        """A bar over `total` pieces of work."""
        if self.quiet or total == 0:
            yield Counter()
        elif self._live():
            with _bar(self.stream) as progress:
                yield LiveCounter(progress, progress.add_task(text, total=total, detail=""))
        else:
            yield LineCounter(self, text, total)

    def _live(self) -> bool:
        return not self.quiet and self.stream.isatty()


@dataclass
class Counter:
    """Counts pieces of work; this one in silence."""

    def within(self, detail: str) -> None:
        """Say where the piece in hand stands."""

    def done(self, detail: str) -> None:
        """One piece is done."""


@dataclass
class LineCounter(Counter):
    """One line for every piece."""

    reporter: Reporter
    text: str
    total: int
    count: int = 0

    def done(self, detail: str) -> None:
        """One piece is done."""
        self.count += 1
        self.reporter.line(f"{self.text} {self.count}/{self.total}: {detail}")


@dataclass
class LiveCounter(Counter):
    """A bar with the time left."""

    progress: Progress
    task: TaskID
    last: float = 0.0

    def within(self, detail: str) -> None:
        """Say where the piece in hand stands, not more often than a person can read."""
        now = time.perf_counter()
        if now - self.last > _PAUSE:
            self.last = now
            self.progress.update(self.task, detail=detail)

    def done(self, detail: str) -> None:
        """One piece is done."""
        self.progress.update(self.task, advance=1, detail=detail)


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
