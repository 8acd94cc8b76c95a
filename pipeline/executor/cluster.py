"""Tasks on a cluster of dask.distributed: sent with their files, brought back with their results.

Before they get any work, the workers of the cluster are looked at.
"""

from __future__ import annotations

import heapq
import importlib.util
import itertools
import logging
import queue
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import SAVES_MEMORY, ExecutorLost, InputError, input_error, reason_of
from pipeline.executor.cluster_address import SCHEDULER, check_cluster, scheduler_address
from pipeline.executor.cluster_task import (
    Parcel,
    Returned,
    WorkerFacts,
    content_hash,
    described,
    other_versions,
    run_parcel,
)
from pipeline.executor.task import Preparation, Task, TaskFailed, TaskResult, workers_line
from pipeline.process.interrupts import Interrupts
from pipeline.process.workers import ATTEMPTS, WorkerDied
from pipeline.store.disk_errors import storage_error

if TYPE_CHECKING:
    from distributed import Client
    from distributed import Future as DaskFuture


PATIENCE = 10.0  # seconds in which a scheduler has to answer
WAIT_FOR_WORKERS = 60.0  # seconds in which a first worker has to be there
_PAUSE = 0.1
_SILENT = logging.CRITICAL + 1  # what a user needs to know is said here


@dataclass(frozen=True)
class Cluster:
    """A client of a scheduler."""

    client: Client  # client of dask.distributed
    name: str  # what messages call it

    def close(self) -> None:
        """Leave the cluster."""
        self.client.close(timeout=PATIENCE)


def connected(scheduler: str) -> Cluster:
    """Connect to the cluster of a scheduler, by its address or its scheduler file."""
    try:
        import dask
        from distributed import Client
    except ImportError:
        allowed = "after `pip install 'shroud[distributed]'`"
        raise input_error(SCHEDULER, "", "needs dask.distributed, which is not installed", allowed) from None
    for name in [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]:
        logging.getLogger(name).setLevel(_SILENT)
    address = scheduler_address(scheduler)
    try:
        with dask.config.set({"distributed.comm.timeouts.connect": f"{PATIENCE:.0f}s"}):
            client = Client(address, timeout=PATIENCE, set_as_default=False)
    except Exception as error:  # of many kinds: a host without a name, another program there, TLS
        reason = reason_of(error) if not isinstance(error, OSError) else "no answer"
        found = f"no scheduler at {address} ({reason}, within {PATIENCE:.0f} s)"
        raise input_error(SCHEDULER, "", found, "the address of a scheduler that runs") from None
    return Cluster(client, f"at {address}")


def check_workers(
    cluster: Cluster,
    preparation: Preparation,
    expected: Mapping[str, str],
    check: Callable[[], None],
    say: Callable[[str], None],
) -> None:
    """Wait for workers, refuse those that would compute other numbers, and say what there is."""
    _wait(cluster, check, say)
    answers: dict[str, Any] = cluster.client.run(described, preparation, on_error="return")
    found = {worker: facts for worker, facts in answers.items() if not isinstance(facts, OSError)}  # others have left
    processors = 0
    for worker, facts in sorted(found.items()):
        if not isinstance(facts, WorkerFacts):
            raise InputError(f"worker {worker}: cannot run this program: {reason_of(facts)}")
        if (line := version_line(worker, expected, facts.versions)) is not None:
            raise InputError(line)
        if facts.threads != 1:
            several = f"runs {facts.threads} tasks at the same time"
            raise input_error(f"worker {worker}", "", several, "one: start it with --nthreads 1")
        processors += facts.versions.get("processor") != expected.get("processor")
    if processors:
        say(
            f"warning: {processors} of {len(found)} workers have another processor, C library or arithmetic settings "
            "than this machine: results may differ in their last digits"
        )
    say(_description(cluster, [facts.memory for facts in found.values()]))


def version_line(worker: str, expected: Mapping[str, str], found: Mapping[str, str]) -> str | None:
    """The line on a worker with other versions than this machine, all of them named; None where they agree."""
    other = other_versions(expected, found)
    if not other:
        return None
    names = sorted(other, key=lambda name: (name != "program", name))
    parts = [f"{name} {other[name]} (here {expected.get(name, 'absent')})" for name in names[:3]]
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f"worker {worker}: other versions than here: {', '.join(parts)}{more}; install the same on both"


def _wait(cluster: Cluster, check: Callable[[], None], say: Callable[[str], None]) -> None:
    start, told = time.monotonic(), False
    while not cluster.client.nthreads():
        check()
        if not told:
            say(f"no workers yet {cluster.name}; waiting for up to {WAIT_FOR_WORKERS:.0f} s")
            told = True
        if time.monotonic() - start > WAIT_FOR_WORKERS:
            found = f"no worker {cluster.name} within {WAIT_FOR_WORKERS:.0f} s"
            raise input_error(
                SCHEDULER, "", found, "a cluster with one worker or more: dask worker ADDRESS --nthreads 1"
            )
        time.sleep(_PAUSE)


def _description(cluster: Cluster, limits: Sequence[int]) -> str:
    """What there is; `limits`: bytes of memory that each worker may use, 0 where that is not bounded."""
    link = cluster.client.dashboard_link if importlib.util.find_spec("bokeh") is not None else ""
    dashboard = f"; dashboard {link}" if link and "None" not in link else ""
    return workers_line(cluster.name, limits) + dashboard


WITHOUT_WORKERS = 60.0  # seconds without any worker after which a run is given up
_AHEAD = 2  # tasks at the cluster for each worker: one runs, one is there when it ends
_LOOK = 0.05  # seconds between two looks for signals
_LOOK_AT_WORKERS = 2.0
_GOES_ON = "what is done is kept, the same command goes on from there"


@dataclass
class _Job:
    """A task with its future; its attempts, and where the present one runs."""

    number: int
    task: Task
    future: Future[TaskResult]
    names: Mapping[str, str] = field(default_factory=dict)  # hashes of its files
    attempts: int = 0
    worker: str = ""
    needed: tuple[str, ...] = ()  # hashes of files that the worker of the last attempt does not have
    preferred: str = ""  # that worker
    avoided: frozenset[str] = frozenset()  # workers with a full disk
    only: set[str] = field(default_factory=set)  # the workers that may have it; empty: all
    key: str = ""

    def __lt__(self, other: _Job) -> bool:
        return self._place < other._place

    @property
    def _place(self) -> tuple[bool, int, tuple[float, ...], int]:
        """Those for which a worker is waiting go first, first attempts before others."""
        return not self.preferred, self.attempts, self.task.order, self.number


class ClusterExecutor:
    """Runs tasks on a cluster that exists.

    No more tasks are at the scheduler than the workers need; the others wait here. A task is begun again on another
    worker where its own one is lost while it runs.
    """

    def __init__(
        self,
        scheduler: str,
        scratch: Path,
        interrupts: Interrupts,
        say: Callable[[str], None],
    ) -> None:
        check_cluster(scheduler, None, None)
        self._scheduler = scheduler
        self._scratch, self._interrupts, self._say = scratch, interrupts, say
        self._preparation = Preparation()
        self._expected: dict[str, str] = {}
        self._cluster: Cluster | None = None
        self._workers: set[str] = set()
        self._without_since: float | None = None
        self._looked = 0.0
        self._waiting: list[_Job] = []
        self._running: dict[str, tuple[_Job, DaskFuture]] = {}
        self._news: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._known: dict[str, set[str]] = {}  # hashes of the files that a worker has
        self._hashes: dict[Path, str] = {}
        self._numbers = itertools.count()
        self._topic = f"shroud-{uuid.uuid4().hex}"

    @property
    def count(self) -> int:
        """Number of workers."""
        return max(1, len(self._workers))

    def prepare(self, processes: int, preparation: Preparation | None = None) -> None:
        """Connect to the cluster and look at its workers."""
        if preparation is not None:
            self._preparation = preparation
        if self._cluster is not None:
            return
        self._expected = self._preparation.versions()
        self._cluster = connected(self._scheduler)
        check_workers(self._cluster, self._preparation, self._expected, self._interrupts.check, self._say)
        client = self._cluster.client
        for topic in ("all", self._topic):
            client.subscribe_topic(topic, lambda event: self._news.put(("event", event[1])))
        self._look_at_workers()

    def submit(self, task: Task) -> Future[TaskResult]:
        """Queue a task."""
        job = _Job(next(self._numbers), task, Future())
        heapq.heappush(self._waiting, job)
        return job.future

    def completed(self, within: Callable[[str], None]) -> Iterator[Future[TaskResult]]:
        """The futures as they are done."""
        with self._interrupts.looking():
            while self._waiting or self._running:
                self._fill()
                for job in self._done():
                    self._fill()
                    yield job.future

    def close(self) -> None:
        """Cancel what runs, and leave the cluster."""
        if self._cluster is None:
            return
        if self._running and self._cluster.client.status == "running":
            self._cluster.client.cancel([future for _, future in self._running.values()], force=True)
        self._running.clear()
        self._cluster.close()
        self._cluster = None

    def _fill(self) -> None:
        """Send as many tasks as the workers need."""
        assert self._cluster is not None
        client = self._cluster.client
        while self._waiting and self._workers and len(self._running) < _AHEAD * self.count:
            if client.status != "running":  # the way to the scheduler is interrupted
                return
            job = heapq.heappop(self._waiting)
            try:
                self._send(job)
            except OSError as error:  # a file of ours that cannot be read
                job.future.set_exception(
                    storage_error(error, self._scratch.parents[1]) or TaskFailed(reason_of(error))
                )
                self._news.put(("failed", job))

    def _send(self, job: _Job) -> None:
        assert self._cluster is not None
        job.names = {name: self._hash(path) for name, path in job.task.files.items()}
        there = set().union(*self._known.values()) - set(job.needed)
        paths = {job.names[name]: path for name, path in job.task.files.items() if job.names[name] not in there}
        contents = {content: path.read_bytes() for content, path in paths.items()}
        parcel = Parcel(self._topic, self._preparation, job.task.function, job.names, job.task.args, contents)
        job.key, job.worker = f"{job.task.function.__name__.strip('_')}-{uuid.uuid4().hex}", ""
        job.only = self._workers - job.avoided if job.avoided else {job.preferred} & self._workers
        # Without allow_other_workers: where all workers leave, the scheduler would wait for this one for ever.
        where: dict[str, Any] = {"workers": sorted(job.only)} if job.only else {}
        future = self._cluster.client.submit(run_parcel, parcel, self._expected, key=job.key, pure=False, **where)
        self._running[job.key] = job, future
        future.add_done_callback(lambda done: self._news.put(("done", done.key)))

    def _hash(self, path: Path) -> str:
        """Hash of a file of the store, which does not change in a run."""
        if path not in self._hashes:
            self._hashes[path] = content_hash(path.read_bytes())
        return self._hashes[path]

    def _done(self) -> Iterator[_Job]:
        """The jobs that are done by now; waits for news."""
        for kind, news in self._received():
            if kind == "failed":
                yield news
            elif kind == "event":
                yield from self._note(news)
            elif news in self._running:
                job, future = self._running.pop(news)
                if self._settled(job, future):
                    yield job

    def _received(self) -> list[tuple[str, Any]]:
        """News from the cluster, all that there is."""
        while True:
            self._interrupts.check()
            self._look_after()
            try:
                found = [self._news.get(timeout=_LOOK)]
            except queue.Empty:
                continue
            while not self._news.empty():
                found.append(self._news.get())
            return found

    def _settled(self, job: _Job, future: DaskFuture) -> bool:
        """Whether the future of a job has its result or its exception now; otherwise the job waits again."""
        status = future.status
        if status in ("cancelled", "lost"):  # the way to the scheduler was interrupted
            return self._again(job)
        if status == "error":
            error = future.exception()
            if type(error).__name__ == "KilledWorker":  # the scheduler counts in its own way
                return self._again(job)
            job.future.set_exception(error if isinstance(error, TaskFailed) else TaskFailed(reason_of(error)))
            return True
        try:
            returned: Returned = future.result(timeout=WITHOUT_WORKERS)
        except Exception:  # its worker is lost with the result
            return self._again(job)
        self._known.setdefault(returned.worker, set()).update(set(job.names.values()) - set(returned.missing))
        return self._taken(job, returned)

    def _taken(self, job: _Job, returned: Returned) -> bool:
        if returned.versions:
            found = {**self._expected, **returned.versions}
            line = version_line(returned.worker, self._expected, found)
            raise ExecutorLost(f"{line}; {_GOES_ON}")
        if returned.missing:
            self._known[returned.worker] -= set(returned.missing)
            job.needed, job.preferred = returned.missing, returned.worker
            return self._again(job)
        if returned.full:
            job.attempts, job.avoided = job.attempts + 1, job.avoided | {returned.worker}
            if job.attempts < ATTEMPTS and self._workers - job.avoided:
                self._say(
                    f"{job.task.label}: worker {returned.worker}: {returned.full}; begun again on another worker"
                )
                return self._again(job)
            job.future.set_exception(TaskFailed(f"worker {returned.worker}: {returned.full}"))
            return True
        folder = self._scratch / uuid.uuid4().hex
        try:
            for name, content in returned.contents.items():
                path = folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        except OSError as error:
            cause = storage_error(error, self._scratch.parents[1])
            job.future.set_exception(cause or TaskFailed(reason_of(error)))
            return True
        job.future.set_result(TaskResult(folder, returned.seconds))
        return True

    def _again(self, job: _Job) -> bool:
        heapq.heappush(self._waiting, job)
        return False

    def _note(self, event: Any) -> Iterator[_Job]:
        """An event at the scheduler: a task was begun, a worker came or went; the jobs that this ends."""
        if not isinstance(event, dict):
            return
        if "begun" in event:
            if event["begun"] in self._running:
                self._running[event["begun"]][0].worker = event["worker"]
        elif event.get("action") == "add-worker":
            self._look_at_workers()
        elif event.get("action") == "remove-worker":
            worker = event["worker"]
            self._workers.discard(worker)
            self._known.pop(worker, None)
            self._look_at_workers()
            for job in [job for job, _ in self._running.values()]:
                if job.worker == worker and not event.get("expected") and self._lose(job, worker):
                    yield job
            self._take_back()

    def _take_back(self) -> None:
        """Have the jobs wait again of which no worker is left that may have them; the scheduler waits for ever."""
        for job in [job for job, _ in self._running.values() if job.only and not job.only & self._workers]:
            self._running.pop(job.key)[1].cancel(force=True)
            self._again(job)

    def _lose(self, job: _Job, worker: str) -> bool:
        """The worker of a job is lost: whether that was the last attempt. The scheduler has begun it again."""
        job.attempts, job.worker = job.attempts + 1, ""
        if job.attempts < ATTEMPTS:
            self._say(f"{job.task.label}: worker {worker} is lost; begun again on another worker")
            return False
        _, future = self._running.pop(job.key)
        future.cancel(force=True)
        said = f"its workers were lost, most likely for want of memory; {SAVES_MEMORY} ({ATTEMPTS} attempts)"
        job.future.set_exception(WorkerDied(said))
        return True

    def _look_after(self) -> None:
        """Look at scheduler and workers from time to time."""
        assert self._cluster is not None
        if time.monotonic() - self._looked < _LOOK_AT_WORKERS:
            return
        if self._cluster.client.status == "closed":
            raise ExecutorLost(f"the scheduler {self._cluster.name} is lost; {_GOES_ON}")
        self._look_at_workers()
        self._take_back()
        if self._workers:
            self._without_since = None
            return
        self._without_since = self._without_since or time.monotonic()
        if time.monotonic() - self._without_since > WITHOUT_WORKERS:
            raise ExecutorLost(f"no worker {self._cluster.name} for {WITHOUT_WORKERS:.0f} s; {_GOES_ON}")

    def _look_at_workers(self) -> None:
        assert self._cluster is not None
        self._looked = time.monotonic()
        if self._cluster.client.status == "running":
            try:
                self._workers = set(self._cluster.client.nthreads())
            except Exception:  # the scheduler is just being lost; its status will tell
                return
