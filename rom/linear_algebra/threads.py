"""One BLAS thread, in this process and in the processes started from it; large work shared by two threads of ours.

The matrices and blocks here are too small to be shared out: with two threads, and still more beside another busy
process, a reduction takes up to ten times as long. And one thread sums in one order: the same input gives the same
bits on any number of cores. Where two threads pay, the work is cut in two by its size alone, so that it is the same
on one core.
"""

from __future__ import annotations

import ctypes
import importlib
import mmap
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

P = TypeVar("P")
T = TypeVar("T")

_MEGABYTE = 1 << 20
_FIRST, _MORE, _THREAD = 450, 150, 200  # megabytes: libraries and their buffers, work, another thread
_TOUCHED = 192  # rows of matrices in a product for which OpenBLAS takes its buffer
SHARED_FROM = 60_000  # unknowns: below, work is too short for two threads

_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Context manager or decorator: limit BLAS to one thread in this process."""
    libraries = _blas_libraries()
    require_memory(_MORE)
    with libraries.limit(limits=1, user_api="blas"):
        yield


@lru_cache(maxsize=1)
def _blas_libraries() -> ThreadpoolController:
    """The BLAS libraries of NumPy and SciPy; to look for them takes 2 ms. That of cvxopt has one thread anyway.

    Each takes the buffer now that it keeps: where there is no room for it later, OpenBLAS asks again for ever.
    """
    require_memory(_FIRST)
    import numpy as np
    from threadpoolctl import ThreadpoolController

    blas = importlib.import_module("scipy.linalg.blas")  # only libraries that are loaded by now are limited
    square = np.ones((_TOUCHED, _TOUCHED))
    blas.dgemm(1.0, square, square @ square)
    return ThreadpoolController()


def require_memory(megabytes: int) -> None:
    """Make sure that this process can get so much more memory: libraries in C crash or loop for ever without it.

    Nothing is used: only room in the address space is asked for (ulimit -v and -d).
    """
    try:
        mmap.mmap(-1, megabytes * _MEGABYTE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS).close()
    except OSError:
        raise MemoryError(f"no room for {megabytes} MB more{_limits()}") from None


def _limits() -> str:
    """What to raise where the memory of a process is limited; "" where it is not."""
    import resource

    kinds = (("ulimit -v", resource.RLIMIT_AS), ("ulimit -d", resource.RLIMIT_DATA))
    found = [(option, resource.getrlimit(kind)[0]) for option, kind in kinds]
    said = [f"{option} ({size // _MEGABYTE} MB)" for option, size in found if size != resource.RLIM_INFINITY]
    return f": raise {' and '.join(said)}, the limit of each process" if said else ""


@contextmanager
def one_blas_thread_in_children() -> Iterator[None]:
    """Context manager: processes started inside the block limit BLAS to one thread before they load it."""
    before = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def at_once(work: Callable[[P], T], parts: Sequence[P]) -> list[T]:
    """Results of the same work on each part, in their order, each part in a thread of its own."""
    if len(parts) == 1:
        return [work(parts[0])]
    require_memory(_THREAD * len(parts))
    with ThreadPoolExecutor(len(parts)) as pool:
        return list(pool.map(work, parts))


def beside(size: int, one: Callable[[], P], other: Callable[[], T], threads: bool = True) -> tuple[P, T]:
    """Results of two pieces of work on so many unknowns, each in a thread of its own below 60 000.

    From there on one comes after the other: they share themselves out, and memory is short. So it is too without
    `threads`, where the two do not bear each other.
    """
    if size >= SHARED_FROM or not threads:
        return one(), other()
    require_memory(_THREAD)
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(one)
        found = other()
        both = waiting.result(), found
    return_memory()
    return both


def return_memory() -> None:
    """Give freed memory back to the system: glibc keeps what each thread has freed for that thread."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def shared(size: int) -> tuple[slice, ...]:
    """Parts of so many unknowns for `at_once`: two from 60 000 on."""
    if size < SHARED_FROM:
        return (slice(0, size),)
    return slice(0, size // 2), slice(size // 2, size)
