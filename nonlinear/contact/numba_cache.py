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

from nonlinear.contact.compile_lock import CompileLock
from nonlinear.contact.kernel_folder import kernel_folder

_LOCK = CompileLock()
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


def inner_counted(function: Function) -> Function:
    """The same with reference counts, as numpy's products of arrays need them."""
    return _compile(function, no_cpython_wrapper=True)


def lapack_lu(of_complex: bool = False) -> Any:
    """LAPACK's dgetrf for kernels: (ord("d"), m, n, a.ctypes, lda, pivots.ctypes), pivots int32; zero: it succeeded.

    Of complex matrices zgetrf, with ord("z").

    numba has it for its own `numpy.linalg.solve`, which allocates and forgets the factors (its version is pinned).
    """
    from numba import types
    from numba.np import linalg

    library: Any = linalg
    return library._LAPACK().numba_xxgetrf(types.complex128 if of_complex else types.float64)


def inlined(function: Function) -> Function:
    """Compile a function as `inner` does, and copy it into every kernel that calls it.

    A call passes every array of a NamedTuple by its seven numbers, which takes longer than a short function.
    """
    return _compile(function, _nrt=False, no_cpython_wrapper=True, forceinline=True)


def _compile(function: Function, **options: bool) -> Any:
    import numba
    from numba.core import config

    settings: Any = config
    njit: Any = numba.njit
    # nogil: while a kernel runs, the thread that watches signals can end the process
    fixed = {"error_model": "numpy", "no_cfunc_wrapper": True, "nogil": True}
    before = settings.CACHE_DIR
    folder = kernel_folder(before)
    settings.CACHE_DIR = str(folder or "")
    try:
        kernel = njit(cache=folder is not None, **fixed, **options)(function)
    finally:
        settings.CACHE_DIR = before
    if folder is not None:
        _guard(kernel, folder)
    return kernel


def _guard(kernel: Any, folder: Path) -> None:
    """Hold a kernel to the folder, and compile it anew where its file cannot be read or written."""
    from numba.core.caching import NullCache

    cache = getattr(kernel, "_cache", None)  # none where the compiler is switched off
    if cache is None:
        return
    if not Path(cache.cache_path).is_relative_to(folder):  # numba chooses another where it cannot write this one
        kernel._cache = NullCache()
        return
    save, load, compile_now = cache.save_overload, cache.load_overload, kernel.compile

    def saved(*arguments: Any) -> None:
        with suppress(OSError):
            save(*arguments)

    def loaded_or_none(*arguments: Any) -> Any:
        try:
            return load(*arguments)
        except Exception:  # whatever unpickling stumbles over in a damaged file
            with suppress(OSError):
                cache.flush()
            return None

    def loaded(*arguments: Any) -> Any:
        found = loaded_or_none(*arguments)
        if found is None and _LOCK.take(
            folder / f"{kernel.__name__}.lock"
        ):  # another process may have compiled it meanwhile
            found = loaded_or_none(*arguments)
        return found

    def compile_alone(signature: Any) -> Any:
        with _LOCK.compilation():
            return compile_now(signature)

    cache.save_overload, cache.load_overload, kernel.compile = saved, loaded, compile_alone
