"""Files from elsewhere are first read in a process of their own, because of what no exception tells of.

The HDF5 library has bugs that a few damaged bytes lead to: it crashes, or goes round in circles where no interrupt
reaches it. There that process ends, and this one can say so.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from pipeline.errors import InputError, input_error, reason_of

if TYPE_CHECKING:
    from rom import ReducedModel

T = TypeVar("T")
PATIENCE = 30.0  # s for a file of no size
SLOWEST = 5e6  # bytes/s that any disk reads
CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL)


def rehearsed(path: Path, allowed: str, read: Callable[[], T]) -> T:
    """The result of `read()`, which reads the file `path`, once that has come to an end elsewhere.

    Raises
    ------
    InputError : reading crashes or does not end. What `read` raises otherwise comes through.
    """
    if hasattr(os, "fork") and path.is_file():
        _rehearse(path, allowed, read)
    return read()


def read_model(path: Path) -> ReducedModel:
    """The reduced model in a file, read here and now.

    Raises
    ------
    InputError : it cannot be read, or is no reduced model.
    """
    from rom import ReducedModelError, read_reduced_model

    try:
        return read_reduced_model(path)
    except ReducedModelError as error:
        raise InputError(reason_of(error)) from None


def _rehearse(path: Path, allowed: str, read: Callable[[], object]) -> None:
    patience = PATIENCE + path.stat().st_size / SLOWEST
    try:
        child = os.fork()
    except OSError:  # no process to be had: reading it here is better than not at all
        return
    if child == 0:
        try:
            _try(read, patience)
        finally:
            os._exit(0)
    try:
        _, status = os.waitpid(child, 0)
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    code = os.waitstatus_to_exitcode(status)
    if code == -signal.SIGALRM:
        raise _damaged(path, f"the HDF5 library has not come to an end after {patience:.0f} s", allowed)
    if code < 0:
        raise _damaged(path, f"the HDF5 library crashes on it ({signal.Signals(-code).name})", allowed)


def _damaged(path: Path, found: str, allowed: str) -> InputError:
    return input_error(path, "", f"cannot be read: {found}", allowed)


def _try(read: Callable[[], object], patience: float) -> None:
    """Read, and say nothing of it: whatever can be said is said where it is read again."""
    for number in (*CRASHES, signal.SIGALRM):
        signal.signal(number, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, patience)  # the one thing that reaches a library that hangs
    with open(os.devnull, "w") as nowhere, suppress(BaseException):
        os.dup2(nowhere.fileno(), 2)
        read()
