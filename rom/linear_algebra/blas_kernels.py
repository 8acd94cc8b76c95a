"""The OpenBLAS kernels of cvxopt: the best that the processor has the instructions for.

That OpenBLAS dates from 2021. For processors that it does not know it may choose kernels of 2007, with which matrix
products take four times as long.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import takewhile
from pathlib import Path

_VARIABLE = "OPENBLAS_CORETYPE"
# Kernels by their OpenBLAS names, best first, and the instructions they need by their Linux names.
_KERNELS = (
    ("SKYLAKEX", frozenset({"avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl", "avx2", "fma"})),
    ("HASWELL", frozenset({"avx2", "fma"})),
)
_PROCESSOR = Path("/proc/cpuinfo")


@contextmanager
def best_kernels() -> Iterator[None]:
    """Context manager: an OpenBLAS loaded inside the block takes the best kernels that the processor supports.

    OPENBLAS_CORETYPE set by the user takes precedence. The variable is removed after the block, so that processes
    started later take the same kernels as this one.
    """
    best = None if _VARIABLE in os.environ else _best()
    if best is None:
        yield
        return
    os.environ[_VARIABLE] = best
    try:
        yield
    finally:
        del os.environ[_VARIABLE]


def _best() -> str | None:
    """The best kernels that the processor supports."""
    features = _features()
    return next((name for name, needed in _KERNELS if needed <= features), None)


def processor() -> dict[str, str]:
    """Description of the first processor by the names that Linux gives; empty where it cannot be read."""
    described = {}
    try:
        with _PROCESSOR.open() as lines:
            for name, _, value in (line.partition(":") for line in takewhile(str.strip, lines)):
                described[name.strip()] = value.strip()
    except OSError:
        return {}
    return described


def _features() -> frozenset[str]:
    """Instruction sets of the processor by their Linux names; empty where they cannot be read."""
    return frozenset(processor().get("flags", "").split())


def holds_locks(file: Path) -> bool:
    """Whether an OpenBLAS library locks a mutex, by the names that it takes from the system."""
    try:
        with file.open("rb") as library, mmap.mmap(library.fileno(), 0, access=mmap.ACCESS_READ) as content:
            return content.find(b"pthread_mutex_lock") >= 0
    except (OSError, ValueError):
        return False
