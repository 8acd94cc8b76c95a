"""Ctrl-C that is never lost: Python drops the exception where the signal arrives within a callback from C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def noticing_interrupts() -> Iterator[threading.Event]:
    """Within the block SIGINT raises KeyboardInterrupt as ever, and sets the event, for those who look again."""
    noticed = threading.Event()

    def handle(number: int, frame: FrameType | None) -> None:
        noticed.set()
        signal.default_int_handler(number, frame)

    if threading.current_thread() is not threading.main_thread():
        yield noticed
        return
    before = signal.signal(signal.SIGINT, handle)
    try:
        yield noticed
    finally:
        signal.signal(signal.SIGINT, before)
