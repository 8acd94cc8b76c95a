"""Worker processes that end with their parent, also where that is stopped or killed."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from typing import ParamSpec, TypeVar

from pipeline.process.interrupts import kept_from_children
from rom import one_blas_thread_in_children

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Workers:
    """A pool of processes."""

    pool: ProcessPoolExecutor

    def submit(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Call `function` in a worker; starts a new one where all are busy, up to the limit of the pool."""
        with kept_from_children():
            return self.pool.submit(function, *args, **kwargs)


@contextmanager
def workers(count: int) -> Iterator[Workers]:
    """Up to `count` worker processes with one BLAS thread each; an exception in the block kills them."""
    others = set(multiprocessing.active_children())
    with one_blas_thread_in_children():
        context = multiprocessing.get_context("spawn")
        with kept_from_children():
            resource_tracker.ensure_running()  # also a process; it tracks the semaphores of the pool
        pool = ProcessPoolExecutor(count, mp_context=context, initializer=_begin, initargs=(not sys.warnoptions,))
        try:
            yield Workers(pool)
        except BaseException:
            for process in set(multiprocessing.active_children()) - others:
                process.kill()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


def call_apart(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Call the function in a process of its own, which can be stopped at any time.

    Raises
    ------
    RuntimeError
        The process died.
    """
    with workers(1) as pool:
        try:
            return pool.submit(function, *args, **kwargs).result()
        except BrokenProcessPool:
            raise RuntimeError("its process died (out of memory?)") from None


def _begin(quiet: bool) -> None:
    """Start of a worker: ends when its parent has ended; `quiet` ignores warnings as the parent does."""
    if quiet:
        warnings.simplefilter("ignore")
    threading.Thread(target=_end_with_parent, name="watch parent", daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
