"""What the tests of faults share: limits on files, whole stores, processes that are really gone."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pipeline.store.content_store import MANIFEST, Store

PATIENCE = 60.0  # seconds after which it is looked whether what is waited for is still being worked on
MOST_PATIENCE = 600.0  # seconds for what works without end


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """No file gets larger than `size` bytes, here and in processes started here: writes fail as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def entries(out: Path, kind: str) -> list[Path]:
    """Entries of one kind in the store."""
    folder = out / "store" / kind
    return sorted(folder.iterdir()) if folder.is_dir() else []


def broken_entries(out: Path) -> list[Path]:
    """What in the store is neither a whole entry nor absent."""
    kinds = [path for path in (out / "store").iterdir() if path.is_dir() and path.name != "tmp"]
    store = Store(out / "store")
    found = [entry for kind in kinds for entry in kind.iterdir() if store.find(kind.name, entry.name) is None]
    return found + [entry for kind in kinds for entry in kind.iterdir() if not (entry / MANIFEST).is_file()]


def wait_until(condition: Callable[[], object], what: str) -> None:
    """Look until the condition holds; fails when nothing that this process has started works for it any more."""
    done, looked = work_done(), time.monotonic()
    latest = looked + MOST_PATIENCE
    while not condition():
        if time.monotonic() > looked + PATIENCE:
            before, done, looked = done, work_done(), time.monotonic()
            assert before + 1.0 < done, f"waited in vain for {what}"
            assert looked < latest, f"waited too long for {what}"
        time.sleep(0.005)


def end_of(process: subprocess.Popen[str]) -> tuple[str, str]:
    """What a process has said by its end, which is waited for as `wait_until` does."""
    done, latest = work_done(), time.monotonic() + MOST_PATIENCE
    while True:
        try:
            return process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            before, done = done, work_done()
            assert before + 1.0 < done, "waited in vain for the end of a process"
            assert time.monotonic() < latest, "waited too long for the end of a process"


def work_done() -> float:
    """Processor time of all processes below this one, s, as Linux tells."""
    parents, times = {}, {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            values = status.read_text().rpartition(")")[2].split()
            parents[int(status.parent.name)] = int(values[1])
            times[int(status.parent.name)] = sum(int(value) for value in values[11:15])  # with its ended children
    return sum(times[pid] for pid in below(os.getpid(), parents)) / os.sysconf("SC_CLK_TCK")


def below(root: int, parents: dict[int, int]) -> set[int]:
    """Processes that a process has started, and those have."""
    tree, more = set(), {pid for pid, parent in parents.items() if parent == root}
    while more:
        tree |= more
        more = {pid for pid, parent in parents.items() if parent in more} - tree
    return tree


def start(*arguments: object, mark: str = "", **options: object) -> subprocess.Popen[str]:
    """A command line in a process and a session of its own; `mark` is handed on to all that it starts."""
    command = [sys.executable, "-m", "pipeline", *(str(a) for a in arguments)]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "SHROUD_TEST_MARK": mark}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = {"start_new_session": True, "preexec_fn": heeding_hang_up}
    return subprocess.Popen(command, env=environment, **(process | pipes | options))


def heeding_hang_up() -> None:
    """SIGHUP as a terminal has it, also where the tests run under nohup."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def alive(mark: str) -> list[int]:
    """Processes that were handed the mark and still run."""
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdigit() and f"SHROUD_TEST_MARK={mark}\0".encode() in (folder / "environ").read_bytes():
                running = (folder / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
                found += [int(folder.name)] if running else []
        except OSError:
            continue
    return found
