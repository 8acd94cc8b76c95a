"""The cluster that a user names: the address of a scheduler, a scheduler file, or `local:N`."""

from __future__ import annotations

import json
import re

from pipeline.errors import input_error, shown, system_reason
from pipeline.scene.input_files import open_regular

MOST_WORKERS = 256
LARGEST_FILE = 1_000_000  # bytes of a scheduler file
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://([\w.-]+|\[[0-9a-fA-F:]+\]):\d{1,5}/?")
_LOCAL = re.compile(r"local:(\d{1,3})")
SCHEDULER, CLUSTER = "--scheduler", "--cluster"


def check_cluster(scheduler: str | None, cluster: str | None, jobs: int | None) -> None:
    """Refuse options that contradict each other, and addresses that cannot be any."""
    if scheduler is not None and cluster is not None:
        raise input_error(CLUSTER, "", f"{shown(cluster)} beside {SCHEDULER}", "one of the two")
    if jobs is not None and (scheduler is not None or cluster is not None):
        given = SCHEDULER if scheduler is not None else CLUSTER
        raise input_error("--jobs", "", f"{jobs} beside {given}", "one of the two")
    if scheduler is not None:
        scheduler_address(scheduler)
    if cluster is not None:
        local_workers(cluster)


def scheduler_address(text: str) -> str:
    """Address of a scheduler, from the text of an address or from the scheduler file of that name."""
    if _ADDRESS.fullmatch(text):
        return text.rstrip("/")
    if "://" in text or not text.endswith(".json"):
        raise input_error(SCHEDULER, "", shown(text), "tcp://HOST:PORT, tls://HOST:PORT or a scheduler file, *.json")
    allowed = "the file that `dask scheduler --scheduler-file` writes"
    try:
        with open_regular(text) as file:
            found = json.loads(file.read(LARGEST_FILE))
        address = found["address"] if isinstance(found, dict) else None
    except OSError as error:
        raise input_error(SCHEDULER, text, system_reason(error), allowed) from None
    except (ValueError, KeyError, RecursionError):
        address = None
    if not isinstance(address, str) or not _ADDRESS.fullmatch(address):
        raise input_error(SCHEDULER, text, "no scheduler file", allowed)
    return address


def local_workers(text: str) -> int:
    """Number of workers of `local:N`."""
    found = _LOCAL.fullmatch(text)
    if found is None or not 1 <= int(found[1]) <= MOST_WORKERS:
        raise input_error(CLUSTER, "", shown(text), f"local:N, a number N of workers from 1 to {MOST_WORKERS}")
    return int(found[1])
