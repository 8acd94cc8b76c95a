"""One BLAS thread, in this process and in the processes started from it.

The matrices and blocks here are too small to be shared out: with two threads, and still more beside another busy
process, a reduction takes up to ten times as long. And one thread sums in one order: the same input gives the same
bits on any number of cores.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Context manager or decorator: limit BLAS to one thread in this process."""
    with _blas_libraries().limit(limits=1, user_api="blas"):
        yield


@lru_cache(maxsize=1)
def _blas_libraries() -> ThreadpoolController:
    """The BLAS libraries of NumPy and SciPy; to look for them takes 2 ms. That of cvxopt has one thread anyway."""
    from threadpoolctl import ThreadpoolController

    importlib.import_module("scipy.linalg")  # only libraries that are loaded by now are limited
    return ThreadpoolController()


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
