"""SIGINT (Ctrl-C), SIGTERM and SIGHUP stop a run cleanly.

Python drops an exception that a signal handler raises within a callback from C. So the first signal only sets a flag
while the run polls it, and raises an exception otherwise. Where the run does not come to poll, as within one long
point, a thread raises the signal once more, and then there is an exception. In a long call in C or in a kernel no
handler runs at all: then the thread ends the process, as SIGKILL would, with the exit status of the signal. The
kernels release the lock of the interpreter, so that the thread can.
"""

from __future__ import annotations

import math
import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

_SIGNALS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}
_SAFE_PATH = "PYTHONSAFEPATH"
PATIENCE = 0.8  # seconds until a signal that is not heeded is raised again, and as long again until the process ends
_LOOK = 0.05  # seconds
_BEFORE = 1.0  # seconds that a handler may run before the thread knows of the signal


class Stopped(KeyboardInterrupt):
    """The run is to stop because of the signal `signal`; `summary`: of what it has done, as in summary.json."""

    def __init__(self, number: int) -> None:
        self.signal = signal.Signals(number)
        self.summary: dict[str, Any] | None = None
        super().__init__(self.said)

    @property
    def said(self) -> str:
        """The signal in words."""
        return _SIGNALS.get(self.signal, self.signal.name)

    @property
    def line(self) -> str:
        """What is said of it."""
        return f"shroud: {self.said}; what is done is kept, the same command goes on from there"


@dataclass
class Interrupts:
    """Signals received. The first one waits for `check` in a block of `looking`; any other raises at once."""

    noticed: int = 0  # number of the first signal
    looked_for: bool = False
    handled: float = -math.inf  # time of the last call of the handler

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Signal handler."""
        self.handled = time.monotonic()
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

    def watch(self, pipe: socket.socket) -> None:
        """In a thread: insist on signals, numbers of which come through the pipe, that the run does not heed."""
        main = threading.main_thread().ident or 0
        while numbers := pipe.recv(64):
            number, came = numbers[0], time.monotonic()
            if number not in _SIGNALS or self._heeds(came):
                continue
            signal.pthread_kill(main, number)
            if not self._heeds(came):
                os.write(2, f"{Stopped(number).line}\n".encode())
                os._exit(128 + number)

    def _heeds(self, came: float) -> bool:
        """Wait until the run stops for a signal that came at a time; False where it does not in time."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if self.handled > came - _BEFORE and not (self.looked_for and self.noticed):
                return True
            time.sleep(_LOOK)
        return False


@contextmanager
def handling_interrupts() -> Iterator[Interrupts]:
    """Handle the signals by `Interrupts` within the block; SIGHUP stays ignored where it was (nohup)."""
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    told, tells = socket.socketpair()
    tells.setblocking(False)
    watcher = threading.Thread(target=interrupts.watch, args=(told,), name="watch signals", daemon=True)
    watcher.start()
    descriptor = signal.set_wakeup_fd(tells.fileno(), warn_on_full_buffer=False)
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
        signal.set_wakeup_fd(descriptor)
        tells.close()
        watcher.join()
        told.close()


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
