"""The store of an output folder, ready to work in: it can be written, nobody else is at it, nothing dead is left."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from pipeline.errors import InputError, input_error, reason_of
from pipeline.process.progress import Reporter
from pipeline.store.content_store import Store
from pipeline.store.disk_errors import StorageError, storage_error
from pipeline.store.folder_lock import locked

LOCK = "lock"
_FILES = ("response.h5", "response.csv", "summary.json", "report.html")
_FOLDERS = ("figures", "renders")
_PROBE = bytes(8192)  # a full disk may still have room for a name


@contextmanager
def working_store(out: Path, force: bool, reporter: Reporter) -> Iterator[Store]:
    """The store of the output folder `out` for one run alone; a run that comes second waits for the first.

    Raises
    ------
    InputError : the folder cannot be written, or something is in the way in it.
    StorageError : there is no room.
    """
    store, was_there = Store(out / "store", force=force), os.path.lexists(out)
    with ExitStack() as stack:
        try:
            alone = stack.enter_context(locked(store.root / LOCK, lambda holder: _say_waiting(reporter, out, holder)))
            with store.temporary() as folder:
                (folder / "probe").write_bytes(_PROBE)
        except (StorageError, OSError, ValueError) as error:
            raise _unusable(out, error) from None
        _check_names(out)
        store.sweep_up(everything=alone)
        try:
            yield store
        except BaseException:
            store.sweep_up(everything=alone)  # of workers that were ended, and where Ctrl-C came amid a clean-up
            if not was_there:
                _remove_where_empty(store, out)
            raise


def relative_path(path: Path, out: Path) -> str:
    """A path as the output files name it: relative to the output folder."""
    return Path(os.path.relpath(path, out)).as_posix()


def _remove_where_empty(store: Store, out: Path) -> None:
    """Take an output folder away again in which nothing was made."""
    with suppress(OSError):
        if {path.name for path in store.root.iterdir()} <= {LOCK, "tmp"}:
            (store.root / LOCK).unlink(missing_ok=True)
            for folder in (store.root / "tmp", store.root, out):
                if folder.exists():
                    folder.rmdir()


def _check_names(out: Path) -> None:
    """Refuse before long work what would fail after it."""
    if not os.access(out, os.W_OK | os.X_OK):
        raise _unusable(out, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))
    for name in _FILES:
        if (out / name).is_dir():
            raise input_error("--out", str(out / name), "is a folder", "a file, or nothing, of this name")
    for name in _FOLDERS:
        if (out / name).exists() and not (out / name).is_dir():
            raise input_error("--out", str(out / name), "is a file", "a folder, or nothing, of this name")


def _unusable(out: Path, error: StorageError | OSError | ValueError) -> InputError | StorageError:
    """What to tell: no room is not the fault of who named the folder."""
    told = storage_error(error, out)
    if told is not None and told.full:
        return told
    cause = error.__cause__ if isinstance(error, StorageError) else error
    reason = (cause.strerror if isinstance(cause, OSError) else None) or reason_of(error)
    if os.path.islink(out) and not os.path.exists(out):
        reason = f"a symbolic link to {os.readlink(out)}, which is not there"
    return input_error("--out", str(out), f"cannot be written: {reason}", "a folder that can be written")


def _say_waiting(reporter: Reporter, out: Path, holder: str) -> None:
    process = f" (process {holder})" if holder.isdigit() else ""
    reporter.line(f"{out}: another run{process} is at work there; waiting for its end")
