"""Compilation of the kernels, kept on disk from one run to the next.

The compiler keys its cache by the file of a function and does not see that a function called from another file has
changed. Here the key is the source of all kernels: a change in any compiles all anew, and nothing stale is run.

Each function is optimised and translated again in every one that calls it, and in those that call these: calls should
not go deep. `lean` and `inner` leave out what small kernels do not need, by options that numba has but does not
document (its version is pinned).
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable)


def compiled(function: Function) -> Function:
    """Compile `function` at its first call, or load it from the cache."""
    return _compile(function)


def lean(function: Function) -> Function:
    """The same for a function that makes no array: references are not counted (atomically, for every view)."""
    return _compile(function, _nrt=False)


def inner(function: Function) -> Function:
    """The same for a function that makes no array and is called from compiled ones: it has no entry from Python.

    Called from Python all the same, it runs uncompiled.
    """
    kernel = _compile(function, _nrt=False, no_cpython_wrapper=True)
    if kernel is not function:  # the compiler may be switched off
        kernel.__class__ = _without_entry()
    return kernel


@lru_cache(maxsize=1)
def _without_entry() -> type:
    from numba.core.registry import CPUDispatcher

    class WithoutEntry(CPUDispatcher):
        """A compiled function that Python must not enter."""

        def __call__(self, *arguments: Any) -> Any:
            return self.py_func(*arguments)

    return WithoutEntry


def _compile(function: Function, **options: bool) -> Any:
    import numba
    from numba.core import config

    settings: Any = config
    compiler: Any = numba.njit
    before = settings.CACHE_DIR
    settings.CACHE_DIR = before or str(cache_directory())
    try:
        kernel = compiler(cache=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)
    finally:
        settings.CACHE_DIR = before
    _may_stay_unsaved(kernel)
    return kernel


def _may_stay_unsaved(kernel: Any) -> None:
    """Where the disk of the cache is full a kernel is compiled again the next time: no reason to fail."""
    cache = getattr(kernel, "_cache", None)  # none where the compiler is switched off
    if cache is None:
        return
    save = cache.save_overload

    def saved(*arguments: Any) -> None:
        with suppress(OSError):
            save(*arguments)

    cache.save_overload = saved


@lru_cache(maxsize=1)
def cache_directory() -> Path:
    """Folder of the kernels of this very source: beside it or, where that is read-only, in the user's cache."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        if b"from nonlinear.contact.numba_cache import" in text:  # this file too
            digest.update(source.relative_to(package).as_posix().encode() + text)
    name = f"compiled-{digest.hexdigest()[:16]}"
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    for parent in (package / "__pycache__", home / "shroud", Path(tempfile.gettempdir()) / f"shroud-{os.getuid()}"):
        try:
            folder = parent / name
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    raise OSError("no writable folder for compiled kernels: set NUMBA_CACHE_DIR to one")
