"""Worker processes: one call at a time each, replaced where they die, ended with their parent."""

from __future__ import annotations

import heapq
import itertools
import signal
import sys
import warnings
from collections.abc import Callable, Hashable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, Generic, ParamSpec, TypeVar

from pipeline.errors import SAVES_MEMORY
from pipeline.process.worker_processes import ForkedWorker, can_fork, fork_workers, serve, start_process

P = ParamSpec("P")
T = TypeVar("T")
K = TypeVar("K", bound=Hashable)

ATTEMPTS = 3  # for a call whose process dies; the last one runs while no other call does
_PREPARATION = object()  # key of the call that prepares a worker
_PATIENCE = 1.0  # seconds from the end of a pipe to that of its process
_LOOK = 0.05  # seconds between two looks whether the work is to stop


class WorkerDied(Exception):
    """The process of a call ended without a result; the message says how."""


@dataclass(frozen=True)
class Call(Generic[T]):
    """A call of a function, arguments and result of which can be pickled."""

    function: Callable[..., T]
    args: tuple[Any, ...] = ()
    kwargs: Mapping[str, Any] = field(default_factory=dict, hash=False)
    reports: bool = False  # whether it takes `progress`, a function that tells its state


@dataclass
class _Worker:
    """A process with our end of its pipe, its call with its key, and the number of the attempt at it."""

    process: SpawnProcess | ForkedWorker
    pipe: Connection
    key: Any = None
    call: Call[Any] | None = None
    attempt: int = 0
    has_begun: bool = False

    @property
    def busy(self) -> bool:
        return self.attempt > 0

    def kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


@dataclass(order=True)
class _Waiting:
    """A call that waits for a worker; first attempts go before others."""

    attempt: int
    order: tuple[float, ...]
    number: int
    key: Any = field(compare=False)
    call: Call[Any] = field(compare=False)


@dataclass
class Workers:
    """Up to `count` processes; one that dies is replaced, and takes nothing with it but its own call.

    While it waits it calls `check` every few milliseconds, which raises an exception where the work is to stop.
    """

    count: int
    check: Callable[[], None] = lambda: None
    _all: list[_Worker] = field(default_factory=list)
    _waiting: list[_Waiting] = field(default_factory=list)
    _numbers: Iterator[int] = field(default_factory=itertools.count)

    @property
    def started(self) -> int:
        """Number of processes that there are."""
        return len(self._all)

    def prepare(self, call: Call[Any]) -> None:
        """Start all processes now, with a call that prepares them for those to come, such as imports.

        Several are forked from one that has made the call. Nothing is waited for. What comes of the call does not
        matter; where it dies, its processes are replaced later.
        """
        missing = self.count - len(self._all)
        with suppress(OSError):  # the calls to come will tell
            if missing > 1 and can_fork() and not call.kwargs:
                for process, pipe in fork_workers(missing, call.function, call.args, not sys.warnoptions):
                    self._all.append(_Worker(process, pipe, _PREPARATION, attempt=1))
            while len(self._all) < self.count:
                worker = _start()
                self._all.append(worker)
                worker.pipe.send((call.function, call.args, dict(call.kwargs), call.reports))
                worker.key, worker.attempt = _PREPARATION, 1

    def submit(self, key: Any, call: Call[Any], order: tuple[float, ...] = ()) -> None:
        """Queue a call for `completed`; of those that wait, the one with the smallest `order` is begun first."""
        self._wait(1, order, key, call)

    def completed(
        self,
        calls: Mapping[K, Call[T]] | None = None,
        attempts: int = ATTEMPTS,
        retried: Callable[[K, str], None] = lambda key, reason: None,
        reported: Callable[[K, tuple[Any, ...]], None] = lambda key, state: None,
    ) -> Iterator[tuple[K, Future[T]]]:
        """The keys of the calls as they are completed, each with its result or exception; until none is left.

        `reported` gets the state of a call meanwhile.
        """
        for key, call in (calls or {}).items():
            self.submit(key, call)
        while self._waiting or any(worker.busy and worker.key is not _PREPARATION for worker in self._all):
            self._hand_out()
            for worker in self._with_news():
                key, future = worker.key, Future[T]()
                try:
                    has_result, value = worker.pipe.recv()
                except (EOFError, OSError):
                    reason = self._end_of(worker)
                    if key is _PREPARATION:
                        continue
                    if worker.attempt < attempts:
                        assert worker.call is not None
                        self._wait(worker.attempt + 1, (), key, worker.call)
                        retried(key, reason)
                        continue
                    future.set_exception(WorkerDied(reason + _in_attempts(attempts)))
                else:
                    if has_result is None and value is not None:
                        reported(key, value)
                    if has_result is None:
                        worker.has_begun = True
                        continue
                    worker.attempt = 0
                    if key is _PREPARATION:
                        continue
                    (future.set_result if has_result else future.set_exception)(value)
                    self._hand_out()  # the worker is busy again while the result is looked at
                yield key, future

    def _wait(self, attempt: int, order: tuple[float, ...], key: Any, call: Call[Any]) -> None:
        heapq.heappush(self._waiting, _Waiting(attempt, order, next(self._numbers), key, call))

    def _hand_out(self) -> None:
        """Give calls to idle workers, new ones where all are busy; a last attempt is given out and runs alone."""
        while self._waiting:
            first = self._waiting[0]
            busy = [worker for worker in self._all if worker.busy]
            alone = max((worker.attempt for worker in busy), default=0) == ATTEMPTS or first.attempt == ATTEMPTS
            if len(busy) >= self.count or (busy and alone):
                return
            worker = self._idle()
            if worker is None:
                return
            try:
                call = first.call
                worker.pipe.send((call.function, call.args, dict(call.kwargs), call.reports))
            except (BrokenPipeError, ConnectionResetError):  # it died idle: no fault of the call
                self._end_of(worker)
                continue
            worker.key, worker.call, worker.attempt = first.key, first.call, first.attempt
            heapq.heappop(self._waiting)

    def _idle(self) -> _Worker | None:
        """A worker without a call; None where no further one can be started and others are busy."""
        for worker in self._all:
            if not worker.busy:
                return worker
        try:
            worker = _start()
        except OSError:  # too many files, processes or too little memory: those that there are go on
            if not self._all:
                raise
            return None
        self._all.append(worker)
        return worker

    def _with_news(self) -> list[_Worker]:
        """Busy workers that have sent something or ended; waits for the first."""
        by_pipe = {worker.pipe: worker for worker in self._all if worker.busy}
        ready: list[Any] = []
        while not ready:
            self.check()
            ready = wait(list(by_pipe), _LOOK)
        return [by_pipe[pipe] for pipe in ready]

    def _end_of(self, worker: _Worker) -> str:
        """How a worker has ended; it is removed."""
        worker.process.join(_PATIENCE)
        worker.kill()
        self._all.remove(worker)
        code = worker.process.exitcode or 0
        if not worker.has_begun and code > 0:
            raise RuntimeError(f"worker processes end with exit status {code} before they begin")
        return _ending(code)

    def end(self) -> None:
        """Kill all workers; what they have to lose is the calls that they are busy with."""
        while self._all:
            self._all.pop().kill()

    def end_busy(self) -> None:
        """Kill the workers that are busy with a call, and forget the calls that wait."""
        self._waiting.clear()
        for worker in [each for each in self._all if each.busy and each.key is not _PREPARATION]:
            self._all.remove(worker)
            worker.kill()


_kept: list[Workers] = []  # of the run that this process executes


@contextmanager
def kept_workers() -> Iterator[Workers]:
    """Within the block `workers` gives the same processes again and again: what they have loaded stays."""
    pool = Workers(1)
    _kept.append(pool)
    try:
        yield pool
    finally:
        _kept.remove(pool)
        pool.end()


def kept_count() -> int:
    """Number of processes that `kept_workers` has started so far."""
    return _kept[-1].started if _kept else 0


@contextmanager
def workers(count: int, check: Callable[[], None] = lambda: None) -> Iterator[Workers]:
    """Up to `count` worker processes with one BLAS thread each; `check`: see `Workers`.

    They end with the block, but for those of `kept_workers`: of these only such as are busy then.
    """
    if not _kept:
        with own_workers(count, check) as pool:
            yield pool
        return
    pool = _kept[-1]
    pool.count, pool.check = count, check
    try:
        yield pool
    finally:
        pool.end_busy()
        pool.check = lambda: None


@contextmanager
def own_workers(count: int, check: Callable[[], None] = lambda: None) -> Iterator[Workers]:
    """As `workers`, with processes of the block's own in any case."""
    pool = Workers(count, check)
    try:
        yield pool
    finally:
        pool.end()


def call_apart(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Call the function in a process of its own, which can be stopped at any time."""
    with own_workers(1) as pool:
        ((_, future),) = pool.completed({None: Call(function, args, kwargs)}, attempts=1)
    return future.result()


def _ending(code: int) -> str:
    """What an exit code of a process means."""
    if code >= 0:
        return f"its process ended with exit status {code}"
    names = {number.value: f" ({number.name})" for number in signal.Signals}
    cause = f", most likely for want of memory; {SAVES_MEMORY}" if -code == signal.SIGKILL else ""
    return f"its process was killed by signal {-code}{names.get(-code, '')}{cause}"


def _in_attempts(attempts: int) -> str:
    return f" ({attempts} attempts)" if attempts > 1 else ""


def _start() -> _Worker:
    ours, theirs = Pipe()
    try:
        process = start_process(_work, theirs, not sys.warnoptions)
    except BaseException:
        ours.close()
        raise
    finally:
        theirs.close()
    return _Worker(process, ours)


def _work(pipe: Connection, quiet: bool) -> None:
    """A worker: ends when its parent has ended; `quiet` ignores warnings as the parent does."""
    if quiet:
        warnings.simplefilter("ignore")
    with suppress(EOFError, OSError):
        pipe.send((None, None))
        serve(pipe)
