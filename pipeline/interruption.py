"""Ctrl-C neither lost nor torn: Python drops an exception that a signal raises within a callback from C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass
class Interrupts:
    """Interrupts asked for. While somebody looks often, the first one waits for the look; others raise at once."""

    noticed: bool = False
    looked_for: bool = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        """What SIGINT does."""
        first, self.noticed = not self.noticed, True
        if not (first and self.looked_for):
            raise KeyboardInterrupt

    def check(self) -> None:
        """Raise KeyboardInterrupt where one was asked for."""
        if self.noticed:
            raise KeyboardInterrupt

    @contextmanager
    def looking(self) -> Iterator[None]:
        """A block that calls `check` every few milliseconds."""
        self.check()
        self.looked_for = True
        try:
            yield
        finally:
            self.looked_for = False
        self.check()


@contextmanager
def handling_interrupts() -> Iterator[Interrupts]:
    """Within the block SIGINT goes by `Interrupts`."""
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    before = signal.signal(signal.SIGINT, interrupts.handle)
    try:
        yield interrupts
    finally:
        signal.signal(signal.SIGINT, before)
