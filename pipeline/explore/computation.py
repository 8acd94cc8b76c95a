"""The computation behind a page: one call at a time, in a process of its own that is told to stop, or ended.

A call sends its results as they come. It is stopped by a signal, on which the process raises an exception where it
computes, and stays warm for the next call; one that does not heed is replaced.
"""

from __future__ import annotations

import os
import signal
import threading
import time
import weakref
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from types import FrameType
from typing import Any

from pipeline.process.worker_processes import end_with_parent, start_process

STOP = signal.SIGUSR1
LOOK = 0.02  # seconds between two looks whether a call is cancelled
PATIENCE = 1.0  # seconds that a process may take to stop before it is replaced
READY, SENT, DONE, FAILED, STOPPED = "ready", "sent", "done", "failed", "stopped"


class _Stop(BaseException):
    """The call is to stop."""


class ComputationDied(Exception):
    """The process of a computation ended without a result."""


@dataclass
class _Gate:
    """Lets the signal raise within a call alone, and not while a result is being sent."""

    is_open: bool = False
    asked: bool = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        if self.is_open:
            self.is_open = False
            raise _Stop

    def enter(self) -> None:
        self.is_open = True
        if self.asked:
            self.is_open = False
            raise _Stop


@dataclass
class Computation:
    """A process that computes for one page after the other; calls wait for each other."""

    _process: SpawnProcess | None = None
    _pipe: Connection | None = None
    _waits_for: str = ""  # what its process owes: READY, or DONE in place of the end of a call
    _turn: threading.Lock = field(default_factory=threading.Lock)
    _kernels: tuple[tuple[str, str], ...] = ()

    def start(self, *kernels: tuple[str, str]) -> None:
        """Have the process started, with the kernels of friction laws and integrations; nothing is waited for."""
        with self._turn:
            self._kernels = kernels
            self._started()

    def call(
        self, function: Callable[..., Any], args: tuple[Any, ...], cancelled: Callable[[], bool]
    ) -> Generator[Any]:
        """What `function(send, *args)` sends, as it comes; ends early where it is cancelled."""
        while not self._turn.acquire(timeout=LOOK):
            if cancelled():
                return
        try:
            yield from self._results(function, args, cancelled)
        finally:
            self._turn.release()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            _end(self._process)
        self._process, self._waits_for = None, ""

    def _results(
        self, function: Callable[..., Any], args: tuple[Any, ...], cancelled: Callable[[], bool]
    ) -> Generator[Any]:
        try:
            if cancelled() or not self._settled(cancelled):
                return
            pipe = self._started()
            pipe.send((function, args))
            self._waits_for = DONE
            while not cancelled():
                if not pipe.poll(LOOK):
                    continue
                kind, result = pipe.recv()
                if kind == SENT:
                    yield result
                    continue
                self._waits_for = ""
                if kind == FAILED:
                    raise result
                return
        except (EOFError, OSError):
            self.close()
            raise ComputationDied("the process of the computation has ended; out of memory?") from None
        finally:
            self._tell_to_stop()

    def _tell_to_stop(self) -> None:
        if self._waits_for == DONE and self._process is not None and self._process.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(self._process.pid, STOP)

    def _settled(self, cancelled: Callable[[], bool]) -> bool:
        """Wait until the process is ready, or has stopped its last call; False where this one is cancelled."""
        pipe, end = self._started(), time.monotonic() + PATIENCE
        while self._waits_for:
            if cancelled():
                return False
            if pipe.poll(LOOK) and pipe.recv()[0] != SENT:
                self._waits_for = ""
            elif self._waits_for == DONE and time.monotonic() > end:
                self.close()
                pipe = self._started()
        return True

    def _started(self) -> Connection:
        if self._process is None or not self._process.is_alive() or self._pipe is None:
            self._pipe, other = Pipe()
            self._process = start_process(_serve, other, self._kernels)
            weakref.finalize(self, _end, self._process)  # also where Python ends
            self._waits_for = READY
            other.close()
        return self._pipe


def _end(process: SpawnProcess) -> None:
    process.kill()
    process.join()


def _serve(pipe: Connection, kernels: tuple[tuple[str, str], ...]) -> None:
    """In the process: load what curves need, then take calls."""
    from pipeline.stages.worker_start import prepare

    end_with_parent()
    gate = _Gate()
    signal.signal(STOP, gate.handle)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(Exception):
        prepare(kernels, False)
    with suppress(EOFError, OSError):
        pipe.send((READY, None))
        while True:
            function, args = pipe.recv()
            gate.asked = False
            pipe.send(_outcome(pipe, gate, function, args))


def _outcome(pipe: Connection, gate: _Gate, function: Callable[..., Any], args: tuple[Any, ...]) -> tuple[str, Any]:
    """Make a call and send its results; how it ended."""

    def send(result: Any) -> None:
        gate.is_open = False
        pipe.send((SENT, result))
        gate.enter()

    try:
        gate.enter()
        function(send, *args)
        gate.is_open = False
    except _Stop:
        return STOPPED, None
    except Exception as error:
        gate.is_open = False
        return FAILED, error
    return DONE, None
