"""Cases solved one after another or in worker processes, and their results as lines of a table."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from results import write_rows
from stress_cases import StressCase

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

Result = TypeVar("Result")


class Row(Protocol):
    """A result that can be a line of a table."""

    def row(self) -> dict[str, Any]:
        """Column -> value."""
        ...


def positive(text: str) -> int:
    """A whole number of an option, 1 or more."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}, allowed: 1 or more")
    return value


def each(
    solve: Callable[[StressCase, Path, float], Result],
    cases: Sequence[StressCase],
    models: dict[float, Path],
    limit: float,
    jobs: int,
) -> Iterator[Result]:
    """solve(case, model, limit) of every case as it comes, by `jobs` processes with one BLAS thread each."""
    if jobs == 1:
        for case in cases:
            yield solve(case, models[case.angle], limit)
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed

    for name in THREAD_VARIABLES:
        os.environ[name] = "1"  # the workers inherit it before they load any library
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures = [pool.submit(solve, case, models[case.angle], limit) for case in cases]
        for future in as_completed(futures):
            yield future.result()


def write_csv(path: Path, results: Sequence[Row]) -> None:
    """One line a case."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [result.row() for result in results]
    beside = path.with_suffix(".new")  # whoever stops the run finds a whole file
    write_rows(beside, rows)
    beside.replace(path)
