"""A cache of results in the output folder, addressed by a hash of their inputs.

An entry is a folder `store/KIND/KEY` with the files of one result and `entry.json`, which names kind and key and
lists the files with sizes and hashes. It is built in `store/tmp` and moved into place by one rename, so it is whole
or absent. An entry that does not match its list, or stands under another kind or key, counts as absent: it is
replaced when its result is asked for.
"""

from __future__ import annotations

import os
import shutil
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from pipeline.process.clock import seconds_since
from pipeline.store.disk_errors import storage_error
from pipeline.store.manifest import MANIFEST, Manifest

__all__ = ["MANIFEST", "Entry", "Store"]


@dataclass(frozen=True)
class Entry:
    """A result in the store."""

    folder: Path  # folder of its files
    ran: bool  # whether this call computed it
    seconds: float  # time that computing it took, in this call or an earlier one

    def file(self, name: str) -> Path:
        """Path of one of the result's files."""
        return self.folder / name


@dataclass(frozen=True)
class Store:
    """The store of an output folder."""

    root: Path  # folder of the store
    run: str = field(default_factory=lambda: uuid.uuid4().hex)  # name of the run that uses it
    force: bool = False  # whether entries of other runs count as absent

    @property
    def is_empty(self) -> bool:
        """Whether there is no result in it."""
        return not any(path.is_dir() and path.name != "tmp" for path in self.root.glob("*"))

    def find(self, kind: str, key: str, thorough: bool = True) -> Entry | None:
        """The entry where it is whole, otherwise None. Sizes are always compared, hashes only when `thorough`."""
        folder = self.root / kind / key
        manifest = Manifest.read(folder)
        if manifest is None or (manifest.kind, manifest.key) != (kind, key):
            return None
        if (self.force and manifest.run != self.run) or not manifest.agrees_with(folder, thorough):
            return None
        return Entry(folder, False, float(manifest.seconds))

    def get(self, kind: str, key: str, build: Callable[[Path], None]) -> Entry:
        """The entry; `build(folder)` computes it where `find` has none."""
        found = self.find(kind, key)
        if found is not None:
            return found
        start = time.perf_counter()
        with self.temporary() as folder:
            build(folder)
            return self.keep(kind, key, folder, seconds_since(start))

    def keep(self, kind: str, key: str, folder: Path, seconds: float) -> Entry:
        """Make the files in a folder on the store's file system an entry; the folder is moved, or removed."""
        target = self.root / kind / key
        try:
            Manifest.of_files(folder, kind, key, self.run, seconds).write(folder)
            self._install(folder, target)
        except Exception as error:
            if cause := storage_error(error, self.root.parent):
                raise cause from error
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        return Entry(target, True, seconds)

    @contextmanager
    def temporary(self) -> Iterator[Path]:
        """A folder on the store's file system that is removed after the block.

        An exception of the block that the disk caused is raised as a StorageError.
        """
        folder = self.root / "tmp" / uuid.uuid4().hex
        try:
            folder.mkdir(parents=True)
            yield folder
        except Exception as error:
            if cause := storage_error(error, self.root.parent):
                raise cause from error
            raise
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    @contextmanager
    def replacing(self, *paths: Path) -> Iterator[list[Path]]:
        """Temporary paths to write to; each is renamed to its target in `paths` at the end of the block.

        Nothing is replaced before everything has been written, and nothing at all if the block raises.
        """
        with self.temporary() as folder:
            for path in paths:
                path.parent.mkdir(parents=True, exist_ok=True)
            yield [folder / path.name for path in paths]
            for path in paths:
                os.replace(folder / path.name, path)

    def remove_temporary(self) -> None:
        """Remove what killed processes left in `tmp`; only for the holder of the folder's lock."""
        shutil.rmtree(self.root / "tmp", ignore_errors=True)

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
