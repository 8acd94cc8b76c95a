"""Worker processes: calls that come through a pipe, one after the other, as long as the parent lives.

They are started alone, or forked from one process that is prepared for all: what it has loaded is loaded once.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import Pipe, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from pipeline.errors import reason_of
from pipeline.process.interrupts import kept_from_children
from rom.linear_algebra.threads import one_blas_thread_in_children

_REPORTED_EVERY = 1.0  # seconds between two reports of a call


@contextmanager
def without_main() -> Iterator[None]:
    """Within the block a process is started that does not import `__main__`.

    multiprocessing imports the file of `__main__` in the child, so that functions of it can be called there. Ours
    stand in our packages. A script that runs a scene would run it again, and would wait for its own output folder.
    """
    main = sys.modules["__main__"]
    hidden: dict[str, Any] = {name: vars(main).get(name) for name in ("__spec__", "__file__") if name in vars(main)}
    vars(main).pop("__file__", None)
    vars(main)["__spec__"] = None
    try:
        yield
    finally:
        vars(main).update(hidden)


def start_process(target: Callable[..., None], *args: Any) -> SpawnProcess:
    """A process of Python's own that calls a function, with one BLAS thread; signals from the keyboard pass it by."""
    context: SpawnContext = multiprocessing.get_context("spawn")
    with kept_from_children():
        resource_tracker.ensure_running()  # also a process, the start of which undoes the block
    with kept_from_children(), one_blas_thread_in_children(), without_main():
        process = context.Process(target=target, args=args)
        process.start()
    return process


def serve(pipe: Connection) -> None:
    """In a worker: take calls, send (whether there is a result, result or exception) for each.

    A call that reports gets `progress`, a function that sends (None, its arguments), at most one a second.
    """
    end_with_parent()
    last = 0.0

    def progress(*state: Any) -> None:
        nonlocal last
        if time.monotonic() - last >= _REPORTED_EVERY:
            last = time.monotonic()
            pipe.send((None, state))

    with suppress(EOFError, OSError):
        while True:
            function, args, kwargs, reports = pipe.recv()
            pipe.send(_outcome(function, args, {**kwargs, "progress": progress} if reports else kwargs))


def end_with_parent() -> None:
    """Have this process end when the one ends that all workers are started for."""
    threading.Thread(target=_wait_for_parent, name="watch parent", daemon=True).start()


def _outcome(function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[bool, Any]:
    """Whether there is a result, and the result or the exception."""
    try:
        return True, function(*args, **kwargs)
    except Exception as error:
        try:
            multiprocessing.reduction.ForkingPickler.loads(multiprocessing.reduction.ForkingPickler.dumps(error))
        except Exception:  # some exceptions cannot leave their process
            return False, RuntimeError(reason_of(error))
        return False, error


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def can_fork() -> bool:
    """Whether processes can be forked from one that has loaded libraries: on Linux."""
    return sys.platform == "linux"


@dataclass
class PreparedProcess:
    """A process that makes a call and then forks workers; it stays, to tell how each of them ends."""

    process: SpawnProcess  # the process
    # from it come (number of the worker, its process id, None) and (number, process id, exit code)
    reports: Connection
    # `pids`, `codes`: what has come so far, by the numbers of the workers
    pids: dict[int, int] = field(default_factory=dict)
    codes: dict[int, int] = field(default_factory=dict)

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
                _work(number, pipe, reports, [*pipes[:number], *pipes[number + 1 :]])
            numbers[pid] = number
        for pipe in pipes:
            pipe.close()
        end_with_parent()
        while numbers:
            pid, status = os.wait()
            if pid in numbers:
                reports.send((numbers.pop(pid), pid, os.waitstatus_to_exitcode(status)))


def _work(number: int, pipe: Connection, reports: Connection, others: list[Connection]) -> None:
    """In a worker: tell its process, serve, and end without what is left to do in the one it was forked from."""
    code = 1
    try:
        reports.send((number, os.getpid(), None))  # itself: the other process may be killed before it could
        for other in (reports, *others):
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
