"""Calls for worker processes, in a module that imports next to nothing: each process that dies imports it again."""

import os
import signal
import threading
import time
from pathlib import Path

ATTEMPTS = 3


def attempts_in(folder: Path, name: str) -> int:
    """Number of this attempt, counted in files that outlive a process."""
    made = len(list(folder.glob(f"{name}-*")))
    (folder / f"{name}-{made}").touch()
    return made + 1


def work(folder: Path, name: str, deaths: int, number: int) -> str:
    """A call whose process dies in the first attempts; others take long enough to be under way meanwhile."""
    if attempts_in(folder, name) <= deaths:
        os.kill(os.getpid(), number)
    time.sleep(0.05)
    return name


def fail(message: str) -> None:
    raise ValueError(message)


class Stubborn(Exception):
    """An exception that cannot be sent from one process to another."""

    def __init__(self) -> None:
        super().__init__("stubborn")
        self.lock = threading.Lock()


def fail_stubbornly() -> None:
    raise Stubborn


def beside(folder: Path, name: str) -> int:
    """How many calls are under way, this one included; the last attempt of `name` begins after its deaths."""
    mark = folder / f"under-way-{os.getpid()}"
    mark.touch()
    if name == "greedy" and attempts_in(folder, name) < ATTEMPTS:
        mark.unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    count = len(list(folder.glob("under-way-*")))
    time.sleep(0.02)
    count = max(count, len(list(folder.glob("under-way-*"))))
    mark.unlink()
    return count
