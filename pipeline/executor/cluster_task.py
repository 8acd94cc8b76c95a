"""What runs on a worker of a cluster: a task with its files as bytes, from anywhere, to anywhere."""

from __future__ import annotations

import hashlib
import shutil
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from pipeline.executor.task import Preparation, Progress, TaskFailed, run_task
from pipeline.store.disk_errors import StorageError, storage_error

FILES = "shroud-files"  # folder of a worker: the input files that it has, by their hashes
MOST_FILES = 512  # of them; those not read for longest are removed


@dataclass(frozen=True)
class Parcel:
    """A task on its way to a worker."""

    topic: str  # where the beginning of the task is reported
    preparation: Preparation  # what the worker has to call first, once
    function: Callable[..., None]  # see `Task`
    names: Mapping[str, str]  # hashes of its files by their names
    args: tuple[Any, ...]  # see `Task`
    contents: Mapping[str, bytes]  # files by their hashes, as far as the workers are not known to have them


@dataclass(frozen=True)
class Returned:
    """What a worker sends back."""

    worker: str  # its address
    seconds: float = 0.0  # how long the task ran
    contents: Mapping[str, bytes] = field(default_factory=dict)  # files of the result by their names
    missing: tuple[str, ...] = ()  # hashes of files that the worker does not have: it has not run the task
    full: str = ""  # why the disk of the worker takes no more, or an empty text
    # versions of the worker, where they are others than those asked for: it has not run the task
    versions: Mapping[str, str] = field(default_factory=dict)


class Unwanted(Exception):
    """The task has been cancelled."""


def content_hash(content: bytes) -> str:
    """SHA-256 of the content of a file, hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def run_parcel(parcel: Parcel, expected: Mapping[str, str]) -> Returned:
    """Run a task on the worker that calls this."""
    from distributed import get_worker

    worker = get_worker()
    found = other_versions(expected, versions_here(parcel.preparation))
    if found:
        return Returned(worker.address, versions=found)
    folder = Path(worker.local_directory) / uuid.uuid4().hex
    try:
        files, missing = _files_here(Path(worker.local_directory) / FILES, parcel)
        if missing:
            return Returned(worker.address, missing=missing)
        _prepared(parcel.preparation)
        key = str(worker.get_current_task())
        worker.log_event(parcel.topic, {"begun": key, "worker": worker.address})
        result = run_task(folder / "store" / "tmp", parcel.function, files, parcel.args, _while_wanted(worker, key))
        return Returned(worker.address, result.seconds, _contents(result.folder))
    except StorageError as error:
        return Returned(worker.address, full=str(error))
    except OSError as error:
        full = storage_error(error, folder)
        if full is None:
            raise TaskFailed(str(error)) from error
        return Returned(worker.address, full=str(full))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def other_versions(expected: Mapping[str, str], found: Mapping[str, str]) -> dict[str, str]:
    """What a worker has in another version than is expected; its processor may be another one."""
    names = (name for name in {*expected, *found} if name != "processor")
    return {name: found.get(name, "absent") for name in names if expected.get(name) != found.get(name)}


@dataclass(frozen=True)
class WorkerFacts:
    """What a worker is."""

    versions: Mapping[str, str]  # versions of what decides numbers
    threads: int  # number of tasks that it runs at the same time
    memory: int  # bytes that it may use, 0 where that is not bounded


def described(preparation: Preparation, dask_worker: Any) -> WorkerFacts:
    """What the worker is that calls this."""
    memory = int(dask_worker.memory_manager.memory_limit or 0)
    return WorkerFacts(versions_here(preparation), dask_worker.state.nthreads, memory)


@cache
def versions_here(preparation: Preparation) -> Mapping[str, str]:
    """Versions of what decides numbers in this process."""
    return preparation.versions()


@cache
def _prepared(preparation: Preparation) -> None:
    """Prepare this process, once."""
    call = preparation.call
    call.function(*call.args, **call.kwargs)


def _files_here(folder: Path, parcel: Parcel) -> tuple[dict[str, Path], tuple[str, ...]]:
    """The input files of a task by their names, and the hashes of those that are not here."""
    folder.mkdir(parents=True, exist_ok=True)
    for content in parcel.contents.values():
        path = folder / content_hash(content)  # what has been damaged on its way counts as missing
        if not path.exists():
            part = path.with_suffix(".part")
            part.write_bytes(content)
            part.replace(path)
    paths = {name: folder / content for name, content in parcel.names.items()}
    missing = tuple(sorted({path.name for path in paths.values() if not path.exists()}))
    if not missing:
        for path in paths.values():
            path.touch()
        _remove_oldest(folder, len(paths))
    return paths, missing


def _remove_oldest(folder: Path, used: int) -> None:
    files = list(folder.iterdir())
    if len(files) > MOST_FILES + used:
        files.sort(key=lambda path: path.stat().st_mtime_ns)
        for path in files[: len(files) - MOST_FILES]:
            path.unlink()


def _contents(folder: Path) -> dict[str, bytes]:
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def _while_wanted(worker: Any, key: str) -> Progress:
    """Progress of a task that ends it where nobody waits for it any more."""

    def progress(frequency_hz: float, points: int) -> None:
        state = worker.state.tasks.get(key)
        if state is None or state.state == "cancelled":
            raise Unwanted

    return progress
