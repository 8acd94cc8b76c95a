"""Compilation of the kernels, kept on disk from one run to the next.

The compiler keys its cache by the file of a function and does not see that a function called from another file has
changed. Here the key is the source of all kernels: a change in any compiles all anew, and nothing stale is run.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable)


def compiled(function: Function) -> Function:
    """Compile `function` at its first call, or load it from the cache."""
    from numba import njit
    from numba.core import config

    settings: Any = config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = before or str(cache_directory())
    try:
        return cast(Function, njit(cache=True, error_model="numpy")(function))
    finally:
        settings.CACHE_DIR = before


@lru_cache(maxsize=1)
def cache_directory() -> Path:
    """Folder of the kernels of this very source: beside it or, where that is read-only, in the user's cache."""
    package = Path(__file__).parent
    digest = hashlib.sha256()
    for source in sorted(package.glob("*.py")):
        text = source.read_bytes()
        if b"@compiled" in text:
            digest.update(source.name.encode() + text)
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
