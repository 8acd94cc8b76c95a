"""One BLAS thread for the linear algebra of this package."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Hold BLAS to one thread inside the block.

    The vectors and blocks here are too small to share out: with two threads, and still more beside another busy
    process, the reduction takes up to ten times as long. And one thread adds up in one order: the same input gives
    the same bits whatever the number of cores.
    """
    from threadpoolctl import threadpool_limits

    # Only libraries that are loaded by now are limited; NumPy's is, and cvxopt's has one thread anyway.
    importlib.import_module("scipy.linalg")
    with threadpool_limits(1, user_api="blas"):
        yield
