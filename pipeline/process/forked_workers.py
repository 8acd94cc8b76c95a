"""Worker processes forked from one that is prepared for all of them: what it has loaded is loaded once."""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

from pipeline.process.worker_loop import end_with_parent, serve, start_process


def can_fork() -> bool:
    """Whether processes can be forked from one that has loaded libraries: on Linux."""
    return sys.platform == "linux"


@dataclass
class PreparedProcess:
    """A process that makes a call and then forks workers; it stays, to tell how each of them ends."""

    process: SpawnProcess  # the process
    # from it come (number of the worker, its process id, None) and (number, process id, exit code)
    reports: Connection
    pids: dict[int, int] = field(default_factory=dict)  # what has come so far, by the numbers of the workers
    codes: dict[int, int] = field(default_factory=dict)  # what has come so far, by the numbers of the workers

    def look(self, timeout: float | None) -> bool:
        """Take in the next report, if one comes in time; False where none can come any more."""
        try:
            if not self.reports.poll(timeout):
                return True
            number, pid, code = self.reports.recv()
        except (EOFError, OSError):
            self.process.join()
            return False
        self.pids[number] = pid
        if code is not None:
            self.codes[number] = code
        return True


@dataclass
class ForkedWorker:
    """One of the workers, with what a process of multiprocessing offers."""

    parent: PreparedProcess
    number: int

    @property
    def exitcode(self) -> int | None:
        """How it ended; as the process that it was forked from, where that ended first."""
        code = self.parent.codes.get(self.number)
        return self.parent.process.exitcode if code is None else code

    def kill(self) -> None:
        """End it; before it is forked, all of them."""
        while self.parent.reports.poll() and self.parent.look(0.0):
            pass
        pid = self.parent.pids.get(self.number)
        if pid is None:
            self.parent.process.kill()
        elif self.number not in self.parent.codes:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end, at most `timeout` seconds."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while self.number not in self.parent.codes:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            if not self.parent.look(left) or left == 0.0:
                return


def fork_workers(
    count: int, function: Callable[..., Any], args: tuple[Any, ...], quiet: bool
) -> list[tuple[ForkedWorker, Connection]]:
    """Start a process that calls a function, whatever comes of it, and then forks workers; nothing is waited for.

    Shapes: returns (ForkedWorker, Connection).
    """
    ends = [Pipe() for _ in range(count)]
    reports, told = Pipe(duplex=False)
    theirs = [other for _, other in ends]
    try:
        process = start_process(_prepare_and_fork, theirs, told, function, args, quiet)
    except BaseException:
        for end in (reports, *(ours for ours, _ in ends)):
            end.close()
        raise
    finally:
        for end in (told, *theirs):
            end.close()
    parent = PreparedProcess(process, reports)
    return [(ForkedWorker(parent, number), ours) for number, (ours, _) in enumerate(ends)]


def _prepare_and_fork(
    pipes: list[Connection], reports: Connection, function: Callable[..., Any], args: tuple[Any, ...], quiet: bool
) -> None:
    """In the process: prepare, fork, and tell of the ends. No thread runs while it forks."""
    if quiet:
        warnings.simplefilter("ignore")
    with suppress(Exception):
        function(*args)
    numbers = {}
    with suppress(OSError):  # nobody listens any more
        for number, pipe in enumerate(pipes):
            sys.stdout.flush()
            sys.stderr.flush()
            pid = os.fork()
            if pid == 0:
                _work(pipe, [reports, *pipes[:number], *pipes[number + 1 :]])
            numbers[pid] = number
            reports.send((number, pid, None))
        for pipe in pipes:
            pipe.close()
        end_with_parent()
        while numbers:
            pid, status = os.wait()
            if pid in numbers:
                reports.send((numbers.pop(pid), pid, os.waitstatus_to_exitcode(status)))


def _work(pipe: Connection, others: list[Connection]) -> None:
    """In a worker: serve, and end without what is left to do in the process that it was forked from."""
    code = 1
    try:
        for other in others:
            other.close()
        pipe.send((None, None))
        pipe.send((True, None))
        serve(pipe)
        code = 0
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        with suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)
