"""Ctrl-C neither lost nor torn: Python drops an exception that a signal raises within a callback from C.

What ends a program from outside (SIGTERM) or with its terminal (SIGHUP) is taken like Ctrl-C.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

_SIGNALS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}


class Stopped(KeyboardInterrupt):
    """The run is to stop; `signal`: what asked for it."""

    def __init__(self, number: int) -> None:
        self.signal = signal.Signals(number)
        super().__init__(self.said)

    @property
    def said(self) -> str:
        """What happened, in words."""
        return _SIGNALS.get(self.signal, self.signal.name)


@dataclass
class Interrupts:
    """Interrupts asked for. While somebody looks often, the first one waits for the look; others raise at once."""

    noticed: int = 0  # number of the first signal
    looked_for: bool = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        """What the signals do."""
        first, self.noticed = not self.noticed, self.noticed or number
        if not (first and self.looked_for):
            raise Stopped(self.noticed)

    def check(self) -> None:
        """Raise Stopped where that was asked for."""
        if self.noticed:
            raise Stopped(self.noticed)

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
    """Within the block the signals go by `Interrupts`; SIGHUP stays ignored where it was (nohup)."""
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    before = {
        number: signal.signal(number, interrupts.handle)
        for number in _SIGNALS
        if not (number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN)
    }
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def kept_from_children() -> Iterator[None]:
    """Processes started within the block never see Ctrl-C or the end of the terminal: their parent ends them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
