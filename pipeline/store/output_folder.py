"""The output folder of a run: one of this program, checked that it can be written, locked, and cleared.

One run at a time works in an output folder; the next one waits. The lock is the operating system's (flock): it ends
with the process that holds it, however that process ends. Where the file system has no flock, filelock's soft lock
takes its place: a file that exists as long as the lock is held and names the process that holds it.
"""

from __future__ import annotations

import errno
import fcntl
import os
import re
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from pipeline.errors import InputError, input_error, reason_of, shown, system_reason
from pipeline.output_paths import check_output_path
from pipeline.process.progress import Reporter
from pipeline.store.content_store import Manifest, Store, read_json
from pipeline.store.disk_errors import StorageError, storage_error

SOFT = ".soft"  # added to the name of the lock file where the lock is a soft one
_NO_FLOCK = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL}
_NO_FILE = {errno.ELOOP, errno.EISDIR, errno.ENXIO, errno.EMLINK}  # a link, a folder, a pipe or a socket
_OPENED = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_LOOK = 0.05  # seconds between two looks whether the lock is free
_LONGEST = 20  # bytes of the number of a process


@contextmanager
def locked(path: Path, waiting: Callable[[str], None]) -> Iterator[None]:
    """Hold the lock file `path` within the block."""
    try:
        held = _flocked(path, waiting)
    except OSError as error:
        if error.errno not in _NO_FLOCK:
            raise
        with _softly(path.with_name(path.name + SOFT), waiting):
            yield
        return
    try:
        yield
    finally:
        os.close(held)


def _flocked(path: Path, waiting: Callable[[str], None]) -> int:
    """Descriptor of the locked file, also where another process deletes its folder meanwhile."""
    announced = False
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            held = _opened(path)
        except FileNotFoundError:  # deleted in between
            if not announced:
                raise
            continue
        holder = None
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_at(held, path):
                _write_number(held)
                return held
        except BlockingIOError:
            holder = _number(held)
        except BaseException:
            os.close(held)
            raise
        os.close(held)
        if holder is not None:
            if not announced:
                waiting(holder)
                announced = True
            time.sleep(_LOOK)


def _opened(path: Path) -> int:
    """The lock file, opened without a change to what stands there."""
    try:
        held = os.open(path, _OPENED, 0o644)
    except OSError as error:
        if error.errno in _NO_FILE:
            raise ValueError(f"{path} is a link, a folder or a pipe, not the lock of a run; delete it") from None
        raise
    found = os.fstat(held)
    if stat.S_ISREG(found.st_mode) and found.st_nlink <= 1:
        return held
    os.close(held)
    raise ValueError(f"{path} is a device or a second name of another file, not the lock of a run; delete it")


def _is_at(held: int, path: Path) -> bool:
    """Whether the locked file is still the one of this name."""
    try:
        return os.path.samestat(os.fstat(held), os.stat(path))
    except OSError:
        return False


def _write_number(held: int) -> None:
    """The number of this process, which only serves the message; a text that is no number is left as it is."""
    with suppress(OSError):
        text = os.pread(held, _LONGEST + 1, 0)
        if len(text) <= _LONGEST and (not text.strip() or text.strip().isdigit()):
            os.ftruncate(held, 0)
            os.pwrite(held, str(os.getpid()).encode(), 0)


def _number(held: int) -> str:
    """Number of the process that holds the lock, as its file says."""
    with suppress(OSError):
        return os.pread(held, _LONGEST, 0).decode("ascii", errors="replace").strip()
    return ""


@contextmanager
def _softly(path: Path, waiting: Callable[[str], None]) -> Iterator[None]:
    """Hold the soft lock `path` within the block."""
    from filelock import SoftFileLock, Timeout

    lock, announced = SoftFileLock(path), False
    while not lock.is_locked:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=1.0 if announced else 0.0)
        except Timeout:
            if not announced:
                with suppress(OSError):
                    waiting(path.read_text(encoding="ascii", errors="replace").partition("\n")[0].strip())
                announced = True
        except FileNotFoundError:
            if not announced:
                raise
    try:
        yield
    finally:
        lock.release()


STORE, LOCKS = "store", ("lock", "lock.soft")
TEMPORARY, _NAME = "tmp", re.compile(r"[0-9a-f]{32}")  # folder of what is not finished, and names in it
INPUTS = (".toml", ".schema.json")  # scenes may stand beside their results


def check_output_folder(out: Path) -> None:
    """Refuse a folder with files that are not of this program, so that none of them is mixed up or overwritten."""
    real = Path(os.path.realpath(out))
    try:
        inside = next((folder for folder in [real, *real.parents] if is_store(folder)), None)
        ours = not real.is_dir() or is_store(real / STORE) or _has_results(real)
        others = [] if ours else sorted(path.name for path in real.iterdir() if not _expected(path))
    except OSError:  # what cannot be read cannot be written either, which is said where that is tried
        return
    if inside is not None:
        raise input_error("--out", str(out), f"is inside the store of {inside.parent}", "a folder of its own")
    if others:
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        found = f"holds {shown(others[0])}{more} and no earlier results"
        raise input_error("--out", str(out), found, f"a new or empty folder, such as {out / 'results'}")


def is_store(folder: Path) -> bool:
    """Whether the folder is the store of an output folder: it has a lock, or entries and nothing else."""
    if folder.name != STORE or not folder.is_dir():
        return False
    return any((folder / lock).is_file() for lock in LOCKS) or (_is_begun(folder) and bool(_entries(folder)))


def _is_begun(store: Path) -> bool:
    """Whether a store without a lock holds nothing but entries and what an interrupted run has begun."""
    begun = store / TEMPORARY
    names = [path.name for path in begun.iterdir()] if begun.is_dir() else []
    return all(map(_NAME.fullmatch, names)) and all(Manifest.read(entry) is not None for entry in _entries(store))


def _entries(store: Path) -> list[Path]:
    """What should be entries: all that is neither a lock nor temporary."""
    kinds = [path for path in store.iterdir() if path.name not in (TEMPORARY, *LOCKS)]
    return [entry for kind in kinds for entry in (kind.iterdir() if kind.is_dir() else [kind])]


def _expected(path: Path) -> bool:
    """Hidden files, scenes, and a store that an interrupted run has only begun."""
    begun = path.name == STORE and path.is_dir() and _is_begun(path)
    return path.name.startswith(".") or path.name.endswith(INPUTS) or begun


def _has_results(out: Path) -> bool:
    """Whether a summary of this program lies in a folder whose store was deleted."""
    try:
        summary = read_json(out / "summary.json")
    except (OSError, ValueError):
        return False
    return isinstance(summary, dict) and {"scene", "stages", "curves"} <= set(summary)


LOCK = "lock"
_FILES = ("response.h5", "response.csv", "curves.csv", "summary.json", "report.html")
_FOLDERS = ("figures", "renders", "check")
ROOM = 100  # characters of the longest path inside an output folder, with room to spare
_PROBE = bytes(8192)  # a full disk may still have room for a name


@contextmanager
def working_store(out: Path, recompute: bool, reporter: Reporter) -> Iterator[Store]:
    """The store of the output folder `out`, locked within the block; a second run waits for the first."""
    check_output_path(out, "--out", ROOM)
    check_output_folder(out)
    store, was_there = Store(out / "store", recompute=recompute), os.path.lexists(out)
    with ExitStack() as stack:
        try:
            stack.enter_context(locked(store.root / LOCK, lambda holder: _say_waiting(reporter, out, holder)))
            with store.temporary() as folder:
                (folder / "probe").write_bytes(_PROBE)
        except (StorageError, OSError, ValueError) as error:
            raise _unusable(out, error) from None
        _check_names(out)
        store.remove_temporary()
        try:
            yield store
        except BaseException:
            store.remove_temporary()  # of workers that were ended, and of a clean-up that Ctrl-C interrupted
            if not was_there:
                _remove_where_empty(store, out)
            raise
        store.remove_temporary()  # of workers that died


def relative_path(path: Path, out: Path) -> str:
    """A path as the output files name it: relative to the output folder."""
    return Path(os.path.relpath(path, out)).as_posix()


def path_inside(out: Path, text: str) -> Path:
    """The file of the output folder that a text names, which may have been altered."""
    try:
        inside = Path(os.path.realpath(out / text)).is_relative_to(os.path.realpath(out))
    except (ValueError, OSError):  # a zero byte, a surrogate, a circle of links
        inside = False
    if not text or os.path.isabs(text) or not inside:
        raise ValueError("a file inside the output folder")
    return out / text


def _remove_where_empty(store: Store, out: Path) -> None:
    """Remove a new output folder that holds no result."""
    with suppress(OSError):
        if {path.name for path in store.root.iterdir()} <= {LOCK, LOCK + SOFT}:
            shutil.rmtree(store.root)
            out.rmdir()


def _check_names(out: Path) -> None:
    """Refuse before the computation what would fail after it."""
    if not os.access(out, os.W_OK | os.X_OK):
        raise _unusable(out, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))
    for name in _FILES:
        if (out / name).is_dir():
            raise input_error("--out", str(out / name), "is a folder", "a file, or nothing, of this name")
    for name in _FOLDERS:
        if (out / name).exists() and not (out / name).is_dir():
            raise input_error("--out", str(out / name), "is a file", "a folder, or nothing, of this name")


def _unusable(out: Path, error: StorageError | OSError | ValueError) -> InputError | StorageError:
    """The error to raise: a full disk is no fault of the input."""
    storage = storage_error(error, out)
    if storage is not None and storage.full:
        return storage
    cause = error.__cause__ if isinstance(error, StorageError) else error
    reason = system_reason(cause) if isinstance(cause, OSError) else reason_of(error)
    if os.path.islink(out) and not os.path.exists(out):
        reason = f"a symbolic link to {os.readlink(out)}, which does not exist"
    return input_error("--out", str(out), f"cannot be written: {reason}", "a folder that can be written")


def _say_waiting(reporter: Reporter, out: Path, holder: str) -> None:
    process = f" (process {holder})" if holder.isdigit() else ""
    reporter.line(f"{out}: another run{process} is using this folder; waiting for it to end")
