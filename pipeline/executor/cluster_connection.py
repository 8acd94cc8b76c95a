"""The way to a cluster that exists: connected, and its workers looked at before they get any work."""

from __future__ import annotations

import importlib.util
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError, input_error, reason_of
from pipeline.executor.cluster_address import SCHEDULER, scheduler_address
from pipeline.executor.cluster_task import WorkerFacts, described, other_versions
from pipeline.executor.task import Preparation, workers_line

if TYPE_CHECKING:
    from distributed import Client

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
