"""The executor of a run: this machine, or the cluster that the user names."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from pipeline.executor.cluster_address import local_workers
from pipeline.executor.local import LocalExecutor
from pipeline.executor.task import Executor
from pipeline.process.workers import kept_workers

if TYPE_CHECKING:
    from pipeline.process.progress import Reporter
    from pipeline.stages.request import Request
    from pipeline.store.content_store import Store


@contextmanager
def open_executor(request: Request, store: Store, reporter: Reporter) -> Iterator[Executor]:
    """What runs the tasks of a run within the block; worker processes and a cluster are started when needed."""
    scratch = store.root / "tmp"
    with kept_workers() as pool:
        executor: Executor
        if request.scheduler is None:
            fixed = None if request.cluster is None else local_workers(request.cluster)
            executor = LocalExecutor(pool, scratch, reporter.interrupts, reporter.line, fixed)
        else:
            from pipeline.executor.cluster import ClusterExecutor

            executor = ClusterExecutor(request.scheduler, scratch, reporter.interrupts, reporter.line)
        try:
            yield executor
        finally:
            executor.close()
