"""Compilation of the kernels by numba, kept on disk from one run to the next.

numba keys its cache by the file of a function and does not see that a function called from another file has changed.
Here the key is the source of all kernels: a change in any compiles all anew, and nothing stale is run.

Each function is optimised and translated again in every one that calls it, and in those that call these: calls should
not go deep.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from nonlinear.contact.kernel_folder import kernel_folder

Function = TypeVar("Function", bound=Callable)


def compiled(function: Function) -> Function:
    """Compile `function` at its first call, or load it from the cache."""
    return _compile(function)


def lean(function: Function) -> Function:
    """Compile a function that makes no array, without reference counts.

    numba has the option `_nrt` but does not document it (its version is pinned). Counting is atomic and comes with
    every view of an array: without it an evaluation of `EventDrivenJenkins` with 9 nodes takes 23 us, not 28 us, with
    1 harmonic, 48, not 55, with 3 and 152, not 163, with 7.
    """
    return _compile(function, _nrt=False)


def inner(function: Function) -> Function:
    """Compile a function that makes no array and is called by kernels only, never from Python.

    It has no entry from Python, which unpacks every array of a NamedTuple: all kernels compile in 37 s, not 46 s.
    """
    return _compile(function, _nrt=False, no_cpython_wrapper=True)


def inlined(function: Function) -> Function:
    """Compile a function as `inner` does, and copy it into every kernel that calls it.

    A call passes every array of a NamedTuple by its seven numbers, which takes longer than a short function.
    """
    return _compile(function, _nrt=False, no_cpython_wrapper=True, forceinline=True)
