"""Garbage collection while modules are loaded: it finds nothing there, and takes a tenth of the time."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_THRESHOLDS = 20_000, 10, 10  # Python's own first one, 700, is for programs that make less than libraries at import


def collect_rarely() -> None:
    """Look for garbage in this process after 20 000 new objects and not after 700: for a command, which soon ends."""
    gc.set_threshold(*_THRESHOLDS)


@contextmanager
def loading() -> Iterator[None]:
    """Do not look for garbage within the block, nor ever among what was loaded there: for a process that lives on."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()
