"""The output folder of a run: checked that it can be written, locked, and cleared of temporary files."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from pipeline.errors import InputError, input_error, reason_of, system_reason
from pipeline.output_paths import check_output_path
from pipeline.process.progress import Reporter
from pipeline.store.content_store import Store
from pipeline.store.disk_errors import StorageError, storage_error
from pipeline.store.folder_lock import SOFT, locked
from pipeline.store.own_folder import check_output_folder

LOCK = "lock"
_FILES = ("response.h5", "response.csv", "curves.csv", "summary.json", "report.html")
_FOLDERS = ("figures", "renders", "check")
ROOM = 100  # characters of the longest path inside an output folder, with room to spare
_PROBE = bytes(8192)  # a full disk may still have room for a name


@contextmanager
def working_store(out: Path, force: bool, reporter: Reporter) -> Iterator[Store]:
    """The store of the output folder `out`, locked within the block; a second run waits for the first."""
    check_output_path(out, "--out", ROOM)
    check_output_folder(out)
    store, was_there = Store(out / "store", force=force), os.path.lexists(out)
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
