"""Which kernels the OpenBLAS of cvxopt works with: the best that the processor has the instructions for.

That library dates from 2021. To processors that it does not know it may give kernels of 2007, with which products of
matrices take four times as long.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_VARIABLE = "OPENBLAS_CORETYPE"
# The kernels by the names of OpenBLAS, best first, and what they are made of by the names of Linux.
_KERNELS = (
    ("SKYLAKEX", frozenset({"avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl", "avx2", "fma"})),
    ("HASWELL", frozenset({"avx2", "fma"})),
)
_PROCESSOR = Path("/proc/cpuinfo")


@contextmanager
def best_kernels() -> Iterator[None]:
    """An OpenBLAS that is loaded inside the block gets the best kernels that the processor has the instructions for.

    What the user says by OPENBLAS_CORETYPE goes before. The variable is gone after the block, so that no process
    started from here takes other kernels than this one.
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
    """The first of the kernels that the processor has the instructions for."""
    features = _features()
    return next((name for name, needed in _KERNELS if needed <= features), None)


def _features() -> frozenset[str]:
    """What the processor has, by its names in Linux; nothing where that cannot be read."""
    try:
        lines = _PROCESSOR.read_text().splitlines()
    except OSError:
        return frozenset()
    flags = next((line for line in lines if line.startswith("flags")), ":")
    return frozenset(flags.split(":", 1)[1].split())
