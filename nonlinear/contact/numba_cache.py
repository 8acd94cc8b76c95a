"""Compilation of the kernels by numba, kept on disk from one run to the next.

numba keys its cache by the file of a function and does not see that a function called from another file has changed.
Here the key is the source of all kernels: a change in any compiles all anew, and nothing stale is run.

Each function is optimised and translated again in every one that calls it, and in those that call these: calls should
not go deep.
"""

import hashlib
import os
import re
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


def _compile(function: Function, **options: bool) -> Any:
    import numba
    from numba.core import config

    settings: Any = config
    njit: Any = numba.njit
    before = settings.CACHE_DIR
    settings.CACHE_DIR = before or str(cache_directory())
    try:
        kernel = njit(cache=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)
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
    name = f"compiled-{source_digest(package)}"
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


def source_digest(package: Path) -> str:
    """Hash of the sources of all kernels below `package` and of the modules of the package that these import.

    A kernel depends on the constants and types of the modules that it imports, so these count too.
    """
    sources = {source: source.read_bytes() for source in package.rglob("*.py")}
    needed = [source for source, text in sources.items() if b"from nonlinear.contact.numba_cache import" in text]
    for source in needed:  # grows
        for module in re.findall(rb"from nonlinear\.([\w.]+) import", sources[source]):
            imported = package / (module.decode().replace(".", "/") + ".py")
            if imported in sources and imported not in needed:
                needed.append(imported)
    digest = hashlib.sha256()
    for source in sorted(needed):
        digest.update(source.relative_to(package).as_posix().encode() + sources[source])
    return digest.hexdigest()[:16]
