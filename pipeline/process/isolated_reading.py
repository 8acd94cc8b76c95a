"""Files from elsewhere are read in a process of their own, with limits on its time and memory.

On some damaged files the HDF5 library crashes, corrupts memory or loops for ever, which no exception reports; a few
compressed megabytes may unfold to any size. Then that process ends; this one never opens the file.
"""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from pipeline.errors import InputError, input_error, reason_of, shown

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from rom.cyclic.reduced_model import ReducedModel

T = TypeVar("T")
PATIENCE = 30.0  # timeout for an empty file, s
SLOWEST = 5e6  # reading speed that the timeout assumes, bytes/s
BUSY = 4.0  # times the limit of processor time that a busy machine may take for it
MEMORY, MEMORY_PER_BYTE = 2**30, 100  # that reading may take: bytes, and bytes for each of the file
LIMITS = "SHROUD_READING_LIMITS"  # environment variable: how many times the time and the memory are allowed
CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL)


def read_apart(
    path: Path, allowed: str, read: Callable[[], T], reader: str = "the HDF5 library", memory: int | None = None
) -> T:
    """The result of `read()`, which reads the file `path`, computed in a forked process."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise input_error(path, "", "not a file but a device or a pipe", allowed)
    if not hasattr(os, "fork") or not path.is_file():
        return read()
    from multiprocessing import Pipe

    times, size = _times(), path.stat().st_size
    patience = times * (PATIENCE + size / SLOWEST)
    memory = round(times * (MEMORY + MEMORY_PER_BYTE * size if memory is None else memory))
    here, there = Pipe(duplex=False)
    child = os.fork()
    if child == 0:
        try:
            _limit(memory, patience)
            _read_and_send(there, path, read, patience)
        finally:
            os._exit(0)
    there.close()
    try:
        sent = _received(here)
        _, status = os.waitpid(child, 0)
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    finally:
        here.close()
    if sent is None:
        code = os.waitstatus_to_exitcode(status)
        raise input_error(path, "", f"cannot be read: {_end(code, patience, reader)}", _more(allowed, times))
    result, error = sent
    if isinstance(error, MemoryError):
        found = f"cannot be read: {reader} takes more than {memory / 1e9:.2g} GB of memory"
        raise input_error(path, "", found, _more(allowed, times)) from None
    if error is not None:
        raise error
    return result  # type is what `read` returns: the other process is a copy of this one


def read_given_model(path: Path) -> ReducedModel:
    """A reduced model from elsewhere, read in isolation."""
    return read_apart(path, "an HDF5 file with a reduced model", lambda: read_model(path))


def read_model(path: Path) -> ReducedModel:
    """The reduced model in a file, read in this process."""
    from rom.errors import ReducedModelError
    from rom.files.reduced_model_file import read_reduced_model

    try:
        return read_reduced_model(path)
    except ReducedModelError as error:
        raise InputError(reason_of(error)) from None


def _times() -> float:
    """How many times the usual limits are allowed."""
    given = os.environ.get(LIMITS, "1")
    with suppress(ValueError):
        if 0.0 < float(given) <= 1e6:
            return float(given)
    raise input_error(
        LIMITS, "", shown(given), "a number above 0, 1e6 at most: 4 allows four times the time and memory"
    )


def _more(allowed: str, times: float) -> str:
    return f"{allowed}; {LIMITS}={4 * times:g} in the environment allows it more time and memory"


def _limit(memory: int, patience: float) -> None:
    """Let this process take so many bytes more, and so many seconds, where the system can hold it to that."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        limit = pages * resource.getpagesize() + memory
        resource.setrlimit(resource.RLIMIT_AS, (limit if hard < 0 else min(limit, hard), hard))
        hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
        seconds = math.ceil(patience) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (seconds if hard < 0 else min(seconds, hard), hard))


def _received(here: Connection) -> tuple[Any, Exception | None] | None:
    """The result or exception sent; None where the other process ended before."""
    try:
        sent: tuple[Any, Exception | None] = here.recv()
    except (EOFError, OSError):
        return None
    return sent


def _end(code: int, patience: float, reader: str) -> str:
    if -code in (signal.SIGALRM, signal.SIGXCPU):
        return f"{reader} has not come to an end after {patience:.0f} s"
    name = signal.Signals(-code).name if code < 0 else f"exit status {code}"
    return f"{reader} crashes on it ({name})"


def _lacks_memory(error: BaseException) -> bool:
    """Whether an exception comes of another that tells of too little memory."""
    cause = error.__cause__ or error.__context__
    return isinstance(error, MemoryError) or (cause is not None and _lacks_memory(cause))


def _read_and_send(there: Connection, path: Path, read: Callable[[], object], patience: float) -> None:
    for number in (*CRASHES, signal.SIGALRM, signal.SIGXCPU):
        signal.signal(number, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, BUSY * patience)  # the only way to end a library that waits for ever
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 2)  # messages of a crashing library
    try:
        sent: tuple[object, Exception | None] = read(), None
    except Exception as error:
        sent = None, MemoryError() if _lacks_memory(error) else error
    try:
        there.send(sent)
    except MemoryError as error:
        there.send((None, error))
    except Exception as error:  # some objects of h5py cannot leave their process
        found = f"cannot be read: {reason_of(error)}"
        there.send((None, input_error(path, "", found, "numbers and text")))
