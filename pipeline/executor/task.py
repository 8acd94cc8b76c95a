"""A task, and what runs tasks on this machine: in this process, or in worker processes.

Worker processes are reached by pipes alone. None listens at a port, where any user of the machine could connect.
"""

from __future__ import annotations

import heapq
import itertools
import os
import shutil
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from pipeline.errors import reason_of
from pipeline.process.interrupts import Interrupts
from pipeline.process.progress import seconds_since
from pipeline.process.workers import Call, Workers, workers
from pipeline.store.disk_errors import storage_error
from rom.linear_algebra.threads import require_memory

ROOM, LOADED = 300, 100  # megabytes of a curve: with the kernels and the libraries behind them, with these loaded
Progress = Callable[[float, int], None]


@dataclass(frozen=True)
class Task:
    """One curve or one reduced model: files in, files out, wherever it runs."""

    label: str  # what messages call it
    # `function(folder, files, *args, progress)` writes the result into `folder`; a function of a module. It depends
    # on the contents of `files` and on `args` only. It calls `progress` with the frequency reached, Hz, and the
    # number of points
    function: Callable[..., None]
    files: Mapping[str, Path]  # the files that it reads, by names of its own
    args: tuple[Any, ...] = ()  # further arguments, which can be pickled
    order: tuple[float, ...] = ()  # of the tasks that wait, the one with the smallest is begun first


@dataclass(frozen=True)
class TaskResult:
    """Files of a result."""

    folder: Path  # A folder on this machine with the files, for the receiver to keep or to remove
    seconds: float  # how long the task ran


@dataclass(frozen=True)
class Preparation:
    """What a worker needs before its first task."""

    # called once in each worker: imports, and kernels to compile or to load
    call: Call[Any] = field(default_factory=lambda: Call(dict))
    # gives the versions of what decides numbers, by name; a worker with others is refused
    versions: Callable[[], dict[str, str]] = dict


class TaskFailed(Exception):
    """A task raised an exception; the message says why."""


class Executor(Protocol):
    """Runs tasks."""

    @property
    def count(self) -> int:
        """Number of tasks that run at the same time."""

    def prepare(self, processes: int, preparation: Preparation | None = None) -> None:
        """Get workers ready, for work that is worth this number of processes on one machine."""

    def submit(self, task: Task) -> Future[TaskResult]:
        """Queue a task.

        Its future gets the result, or an exception: TaskFailed, StorageError, or WorkerDied where the worker was lost
        in every attempt.
        """

    def completed(self, within: Callable[[str], None]) -> Iterator[Future[TaskResult]]:
        """The futures as they are done, until none is left; more may be submitted meanwhile."""

    def close(self) -> None:
        """End all tasks, and the workers that were started here."""


def workers_line(place: str, limits: Sequence[int]) -> str:
    """What workers there are; `limits`: bytes of memory that each may use, 0 where that is not bounded."""
    if not all(limits):
        memory = "memory not bounded"
    else:
        least, most = (f"{limit / 1e9:.3g}" for limit in (min(limits), max(limits)))
        memory = f"at most {most} GB of memory each" if least == most else f"at most {least} to {most} GB of memory"
    number = f"{len(limits)} worker{'s' if len(limits) > 1 else ''}"
    return f"{number} {place}: one task and one BLAS thread each, {memory}"


def run_task(
    folder: Path,
    function: Callable[..., None],
    files: Mapping[str, Path],
    args: tuple[Any, ...],
    progress: Progress | None = None,
) -> TaskResult:
    """Run a task where its files are; `folder` is made anew, and removed where it fails."""
    start = time.perf_counter()
    try:
        shutil.rmtree(folder, ignore_errors=True)  # of an attempt whose process died
        folder.mkdir(parents=True)
        require_memory(LOADED if "numba" in sys.modules else ROOM)
        function(folder, files, *args, progress=progress)
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        if not isinstance(error, Exception):
            raise
        if cause := storage_error(error, folder.parents[2]):
            raise cause from error
        raise TaskFailed(reason_of(error)) from error
    return TaskResult(folder, seconds_since(start))


_SHARE = 0.9  # of the memory of this machine, for a fixed number of workers together


@dataclass
class LocalExecutor:
    """Runs tasks one by one here, or `count` at a time in worker processes."""

    pool: Workers  # the processes of the run
    scratch: Path  # where the folders of results are made
    interrupts: Interrupts  # requests to stop
    say: Callable[[str], None]  # takes a line for the user
    # number of worker processes, whatever the work; each may use its share of the memory. None: as many as the work
    # is worth
    fixed: int | None = None
    count: int = 1
    _here: list[tuple[tuple[float, ...], int, Task]] = field(default_factory=list)
    _futures: dict[int, tuple[Task, Future[TaskResult]]] = field(default_factory=dict)
    _numbers: Iterator[int] = field(default_factory=itertools.count)

    def prepare(self, processes: int, preparation: Preparation | None = None) -> None:
        """Decide on the number of processes; with a preparation they are started now, and nothing is waited for."""
        if self.fixed is not None and self.pool.started == 0:
            self.say(workers_line("on this machine", [self._memory()] * self.fixed))
        self.count = self.pool.count = self.fixed or processes
        if preparation is not None and self._apart:
            self.pool.prepare(preparation.call)

    def submit(self, task: Task) -> Future[TaskResult]:
        """Queue a task."""
        number, future = next(self._numbers), Future[TaskResult]()
        self._futures[number] = task, future
        if not self._apart:
            heapq.heappush(self._here, (task.order, number, task))
        else:
            arguments = (self._memory(), self._folder(), task.function, dict(task.files), task.args)
            self.pool.submit(number, Call(_run_within, arguments, reports=True), task.order)
        return future

    def completed(self, within: Callable[[str], None]) -> Iterator[Future[TaskResult]]:
        """The futures as they are done."""
        with self.interrupts.looking():
            yield from self._in_workers(within) if self._apart else self._one_by_one(within)

    def close(self) -> None:
        """Nothing is left to do: the processes belong to the run."""

    @property
    def _apart(self) -> bool:
        """Whether tasks run in worker processes."""
        return self.fixed is not None or self.count > 1

    def _memory(self) -> int:
        """Bytes that a worker may use; 0: not bounded."""
        if self.fixed is None:
            return 0
        return int(_SHARE * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / self.fixed)

    def _one_by_one(self, within: Callable[[str], None]) -> Iterator[Future[TaskResult]]:
        while self._here:
            _, number, task = heapq.heappop(self._here)
            _, future = self._futures.pop(number)
            try:
                result = run_task(
                    self._folder(), task.function, task.files, task.args, self._progress(task.label, within)
                )
            except Exception as error:
                future.set_exception(error)
            else:
                future.set_result(result)
            yield future

    def _progress(self, label: str, within: Callable[[str], None]) -> Progress:
        def progress(frequency_hz: float, points: int) -> None:
            self.interrupts.check()
            within(_state(label, frequency_hz, points))

        return progress

    def _in_workers(self, within: Callable[[str], None]) -> Iterator[Future[TaskResult]]:
        states: dict[int, str] = {}

        def reported(number: int, state: tuple[Any, ...]) -> None:
            if number in self._futures:
                states[number] = _state(self._futures[number][0].label, *state)
                within("; ".join(states.values()))

        with workers(self.count, self.interrupts.check) as pool:
            done: Future[TaskResult]
            for number, done in pool.completed(retried=self._retried, reported=reported):
                _, future = self._futures.pop(number)
                states.pop(number, None)
                error = done.exception()
                if error is None:
                    future.set_result(done.result())
                else:
                    future.set_exception(error)
                yield future

    def _retried(self, number: int, reason: str) -> None:
        task, _ = self._futures[number]
        self.say(f"{task.label}: {reason}; begun again in another process")

    def _folder(self) -> Path:
        return self.scratch / uuid.uuid4().hex


def _state(label: str, frequency_hz: float, points: int) -> str:
    """How far a task has come."""
    return f"{label}: {frequency_hz:.5g} Hz, {points} points"


def _run_within(
    memory: int,
    folder: Path,
    function: Callable[..., None],
    files: Mapping[str, Path],
    args: tuple[Any, ...],
    progress: Progress | None = None,
) -> TaskResult:
    """Run a task in a process that may use so many bytes of data; 0: not bounded."""
    if memory:
        with suppress(ImportError, OSError, ValueError):
            import resource

            hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
            resource.setrlimit(resource.RLIMIT_DATA, (memory if hard < 0 else min(memory, hard), hard))
    return run_task(folder, function, files, args, progress)
