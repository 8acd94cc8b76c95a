"""Tasks in this process or in worker processes on this machine: nothing to start, nothing to configure.

Worker processes are reached by pipes alone. None listens at a port, where any user of the machine could connect.
"""

from __future__ import annotations

import heapq
import itertools
import os
import uuid
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.executor.task import Preparation, Progress, Task, TaskResult, run_task, workers_line
from pipeline.process.interrupts import Interrupts
from pipeline.process.workers import Call, Workers, workers

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
            self.pool.submit(number, Call(_run_within, arguments), task.order)
        return future

    def completed(self, within: Callable[[str], None]) -> Iterator[Future[TaskResult]]:
        """The futures as they are done."""
        with self.interrupts.looking():
            yield from self._in_workers() if self._apart else self._one_by_one(within)

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
            within(f"{label} at {frequency_hz:.5g} Hz, {points} points")

        return progress

    def _in_workers(self) -> Iterator[Future[TaskResult]]:
        with workers(self.count, self.interrupts.check) as pool:
            done: Future[TaskResult]
            for number, done in pool.completed(retried=self._retried):
                _, future = self._futures.pop(number)
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


def _run_within(
    memory: int, folder: Path, function: Callable[..., None], files: Mapping[str, Path], args: tuple[Any, ...]
) -> TaskResult:
    """Run a task in a process that may use so many bytes of data; 0: not bounded."""
    if memory:
        with suppress(ImportError, OSError, ValueError):
            import resource

            hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
            resource.setrlimit(resource.RLIMIT_DATA, (memory if hard < 0 else min(memory, hard), hard))
    return run_task(folder, function, files, args)
