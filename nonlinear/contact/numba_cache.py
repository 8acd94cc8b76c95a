"""Compilation of the kernels by numba, kept on disk from one run to the next.

numba keys its cache by the file of a function and does not see that a function called from another file has changed.
Here the key is the source of all kernels: a change in any compiles all anew, and nothing stale is run.

Each function is optimised and translated again in every one that calls it, and in those that call these: calls should
not go deep.

One process at a time compiles: what another one is just compiling is waited for and loaded, not compiled again.

A file of compiled kernels is code: numba unpickles it. Whoever can write its folder, or put another in its place, can
run code as the user. So there is one folder for every state of the source, that nobody but the user can write.
"""

import hashlib
import os
import re
import stat
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import IO, Any, TypeVar


class CompileLock(threading.local):
    """The lock of the kernel that this thread compiles, the operating system's: it ends with its process.

    A kernel compiles those that it calls, under the lock of the outermost one, which is given back at its end.
    `depth`: number of compilations under way in this thread, one within another.
    """

    depth = 0
    _file: IO[bytes] | None = None

    def take(self, file: Path) -> bool:
        """Wait until no other process holds the lock `file`; False where this one has the lock already.

        Nothing is waited for where the file system has no locks, or this system no flock.
        """
        if self._file is not None:
            return False
        with suppress(ImportError, OSError):
            import fcntl

            self._file = file.open("ab")
            fcntl.flock(self._file, fcntl.LOCK_EX)
        return True

    @contextmanager
    def compilation(self) -> Iterator[None]:
        """A block that may take the lock, which it gives back."""
        self.depth += 1
        try:
            yield
        finally:
            self.depth -= 1
            if self.depth == 0 and self._file is not None:
                self._file.close()
                self._file = None


@cache
def kernel_folder(chosen: str = "") -> Path | None:
    """Folder of the kernels of this very source, made where it is missing."""
    package = Path(__file__).parent.parent
    name = f"compiled-{source_digest(package)}"
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    usual = (package / "__pycache__", home / "shroud", Path(tempfile.gettempdir()) / f"shroud-{os.getuid()}")
    candidates = (Path(chosen), *usual) if chosen else usual
    return next((found for parent in candidates if (found := own_folder(parent, name)) is not None), None)


def own_folder(parent: Path, name: str) -> Path | None:
    """The folder `name` in `parent`, made where it is missing; None where others could write it or replace it.

    The folder belongs to the user, and those above to the user or the superuser; nobody else can write them. In a
    sticky folder, such as /tmp, others may write, as they cannot rename what is not theirs.
    """
    try:
        _make(parent)
        folder = parent.resolve() / name
        _make(folder)
        above = [path.lstat() for path in folder.parents]
        own, link = folder.lstat(), parent.lstat()
    except OSError:
        return None
    user = os.getuid()
    trusted = {user, 0, above[-1].st_uid}  # whoever owns / owns the system, under whatever number
    safe = all(each.st_uid in trusted and (not _others_write(each) or each.st_mode & stat.S_ISVTX) for each in above)
    if not safe or link.st_uid not in trusted:
        return None
    mine = stat.S_ISDIR(own.st_mode) and own.st_uid == user and not _others_write(own)
    return folder if mine and os.access(folder, os.W_OK | os.X_OK) else None


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


def _make(folder: Path) -> None:
    """Make the folder and those above it that are missing, for the user alone from the start."""
    for path in reversed(list(_missing(folder))):
        try:
            path.mkdir(mode=0o700)
        except FileExistsError:  # another process was faster
            continue


def _missing(folder: Path) -> Iterator[Path]:
    for path in (folder, *folder.parents):
        if os.path.lexists(path):
            return
        yield path


def _others_write(status: os.stat_result) -> bool:
    """Whether anybody but the owner can write; a group that has the user as its only member does not count."""
    by_group = bool(status.st_mode & stat.S_IWGRP) and not _is_private(status.st_gid)
    return by_group or bool(status.st_mode & stat.S_IWOTH)


@cache
def _is_private(group_id: int) -> bool:
    """Whether a group is the one that many systems make for each user: of the same name, with no other member."""
    import grp
    import pwd

    try:
        user, group = pwd.getpwuid(os.getuid()), grp.getgrgid(group_id)
    except KeyError:
        return False
    return (group.gr_gid, group.gr_name) == (user.pw_gid, user.pw_name) and not set(group.gr_mem) - {user.pw_name}


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


def woven(function: Function) -> Function:
    """Put the statements of a function in the place of its call, before anything is compiled.

    A long function with one caller is not optimised and translated for itself then.
    """
    return _compile(function, no_cpython_wrapper=True, inline="always")


def _compile(function: Function, **options: bool | str) -> Any:
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
