"""A content-addressed store of results inside the output folder: found by key, written whole or not at all.

An entry is a folder `store/KIND/KEY` with the files of one result and `entry.json`, which lists their sizes and
hashes. It is built in `store/tmp` and moved into place by one rename; what does not match its list is made again.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from pipeline.process.clock import now, seconds_since
from pipeline.store.disk_errors import storage_error

MANIFEST = "entry.json"


@dataclass(frozen=True)
class Entry:
    """A result in the store. `ran`: it was made by this call; `seconds`: what making it took, then or now."""

    folder: Path
    ran: bool
    seconds: float

    def file(self, name: str) -> Path:
        """Path of one of the result's files."""
        return self.folder / name


@dataclass(frozen=True)
class Store:
    """The store under `root`, used by the run named `run`; with `force`, entries of other runs count as absent."""

    root: Path
    run: str = field(default_factory=lambda: uuid.uuid4().hex)
    force: bool = False

    def find(self, kind: str, key: str, thorough: bool = True) -> Entry | None:
        """A whole entry, or None. Sizes are always compared, hashes when `thorough`."""
        folder = self.root / kind / key
        try:
            manifest = json.loads((folder / MANIFEST).read_text())
            whole = all(_matches(folder / n, f, thorough) for n, f in manifest["files"].items())
            run, seconds = str(manifest["run"]), float(manifest["seconds"])
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return None
        return Entry(folder, False, seconds) if whole and (run == self.run or not self.force) else None

    def get(self, kind: str, key: str, build: Callable[[Path], None]) -> Entry:
        """The entry, made by `build(folder)` where it is absent, damaged or to be made again."""
        found = self.find(kind, key)
        if found is not None:
            return found
        start = now()
        with self.temporary() as folder:
            build(folder)
            seconds = seconds_since(start)
            manifest = {"files": _listing(folder), "seconds": seconds, "run": self.run}
            (folder / MANIFEST).write_text(json.dumps(manifest, indent=1, sort_keys=True))
            target = self.root / kind / key
            self._install(folder, target)
        return Entry(target, True, seconds)

    @contextmanager
    def temporary(self) -> Iterator[Path]:
        """A folder on the store's file system that is gone afterwards; named after the process that uses it.

        Raises StorageError in place of what the block raises where that came of the disk.
        """
        folder = self.root / "tmp" / f"{os.getpid()}-{uuid.uuid4().hex}"
        try:
            folder.mkdir(parents=True)
            yield folder
        except Exception as error:
            if told := storage_error(error, self.root.parent):
                raise told from error
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    @contextmanager
    def replacing(self, *paths: Path) -> Iterator[list[Path]]:
        """Temporary paths to write, in one folder; they become `paths` when the block ends without an exception.

        Each by one rename, one right after the other: nothing is replaced before everything has been written.
        """
        with self.temporary() as folder:
            for path in paths:
                path.parent.mkdir(parents=True, exist_ok=True)
            yield [folder / path.name for path in paths]
            for path in paths:
                os.replace(folder / path.name, path)

    def sweep_up(self, everything: bool = False) -> None:
        """Remove temporary folders of processes that are no more, or of all, where nobody else works here."""
        place = self.root / "tmp"
        for folder in place.iterdir() if place.is_dir() else ():
            if everything or not _alive(folder.name.partition("-")[0]):
                shutil.rmtree(folder, ignore_errors=True)

    def _install(self, folder: Path, target: Path) -> None:
        target.parent.mkdir(parents=True, exist_ok=True)
        for _ in range(3):  # another run on the same folder may install the same key in between
            if target.exists():
                with self.temporary() as away, suppress(FileNotFoundError):
                    os.replace(target, away / "old")
            try:
                os.replace(folder, target)
            except OSError:
                if not target.exists():
                    raise
            else:
                return
        if self.find(target.parent.name, target.name) is None:
            raise OSError(f"{target}: cannot be replaced")


def _listing(folder: Path) -> dict[str, dict[str, object]]:
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return {p.relative_to(folder).as_posix(): {"size": p.stat().st_size, "sha256": _hash(p)} for p in files}


def _matches(path: Path, expected: dict[str, object], thorough: bool) -> bool:
    return path.stat().st_size == expected["size"] and (not thorough or _hash(path) == expected["sha256"])


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _alive(pid: str) -> bool:
    if not pid.isdigit():
        return False
    try:
        os.kill(int(pid), 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True
