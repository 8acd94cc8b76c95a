"""What a worker process does: calls that come through its pipe, one after the other, as long as its parent lives."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from pipeline.errors import reason_of
from pipeline.process.interrupts import kept_from_children
from pipeline.process.without_main import without_main
from rom import one_blas_thread_in_children


def start_process(target: Callable[..., None], *args: Any) -> SpawnProcess:
    """A process of Python's own that calls a function, with one BLAS thread; signals from the keyboard pass it by."""
    context: SpawnContext = multiprocessing.get_context("spawn")
    with kept_from_children():
        resource_tracker.ensure_running()  # also a process, the start of which undoes the block
    with kept_from_children(), one_blas_thread_in_children(), without_main():
        process = context.Process(target=target, args=args)
        process.start()
    return process


def serve(pipe: Connection) -> None:
    """In a worker: take calls, send (whether there is a result, result or exception) for each."""
    end_with_parent()
    with suppress(EOFError, OSError):
        while True:
            function, args, kwargs = pipe.recv()
            pipe.send(_outcome(function, args, kwargs))


def end_with_parent() -> None:
    """Have this process end when the one ends that all workers are started for."""
    threading.Thread(target=_wait_for_parent, name="watch parent", daemon=True).start()


def _outcome(function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[bool, Any]:
    """Whether there is a result, and the result or the exception."""
    try:
        return True, function(*args, **kwargs)
    except Exception as error:
        try:
            multiprocessing.reduction.ForkingPickler.loads(multiprocessing.reduction.ForkingPickler.dumps(error))
        except Exception:  # some exceptions cannot leave their process
            return False, RuntimeError(reason_of(error))
        return False, error


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
