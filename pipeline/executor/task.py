"""A task, and the interface of what runs tasks: this machine or a cluster."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from pipeline.errors import reason_of
from pipeline.process.clock import seconds_since
from pipeline.process.workers import Call
from pipeline.store.disk_errors import storage_error
from rom import require_memory

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
