"""SIGINT (Ctrl-C), SIGTERM and SIGHUP stop a run cleanly.

Python drops an exception that a signal handler raises within a callback from C. So the first signal only sets a flag
while the run polls it, and raises an exception otherwise.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

_SIGNALS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}
_SAFE_PATH = "PYTHONSAFEPATH"


class Stopped(KeyboardInterrupt):
    """The run is to stop because of the signal `signal`."""

    def __init__(self, number: int) -> None:
        self.signal = signal.Signals(number)
        super().__init__(self.said)

    @property
    def said(self) -> str:
        """The signal in words."""
        return _SIGNALS.get(self.signal, self.signal.name)


@dataclass
class Interrupts:
    """Signals received. The first one waits for `check` in a block of `looking`; any other raises at once."""

    noticed: int = 0  # number of the first signal
    looked_for: bool = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Signal handler."""
        first, self.noticed = not self.noticed, self.noticed or number
        if not (first and self.looked_for):
            raise Stopped(self.noticed)

    def check(self) -> None:
        """Raise Stopped if a signal has been received."""
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
    """Handle the signals by `Interrupts` within the block; SIGHUP stays ignored where it was (nohup)."""
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
    """Processes started within the block do not receive SIGINT or SIGHUP: their parent ends them.

    Nor do they look for modules in the working folder, as Python started with -c or -m does: it may be one where
    others can write.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    setting = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if setting is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = setting
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
