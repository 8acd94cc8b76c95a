"""A cache of results in the output folder, addressed by a hash of their inputs.

An entry is a folder `store/KIND/KEY` with the files of one result and `entry.json`, which names kind and key and
lists the files with sizes and hashes. It is built in `store/tmp` and moved into place by one rename, so it is whole
or absent. An entry that does not match its list, or stands under another kind or key, counts as absent: it is
replaced when its result is asked for. JSON files may have been altered: only what can be written again is read.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import stat
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

from pipeline.process.progress import seconds_since
from pipeline.store.disk_errors import storage_error
from pipeline.store.fingerprints import file_sha256

MANIFEST = "entry.json"
_LARGEST = 1 << 28  # bytes of a JSON file that is read
_DEEPEST = 50  # levels of lists and tables in it
_MOST_DIGITS = 300  # of a number in it


def read_json(path: Path) -> Any:
    """Content of a JSON file that may have been altered: only what can be written as JSON again."""
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise ValueError("is no regular file")
        if status.st_size > _LARGEST:
            raise ValueError(f"has {status.st_size} bytes, more than {_LARGEST}")
        text = file.read()
    with suppress(RecursionError):
        number, whole = _number(float), _number(int)
        found = json.loads(text, parse_constant=number, parse_float=number, parse_int=whole)
        if _is_flat(found, _DEEPEST):
            return found
    raise ValueError("is nested too deeply")


def _is_flat(value: Any, levels: int) -> bool:
    """Whether lists and tables are nested at most so many times."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return levels > 0 and all(_is_flat(item, levels - 1) for item in inner)


def _number(kind: type) -> Callable[[str], Any]:
    """What reads a number, which is finite."""

    def read(text: str) -> Any:
        if len(text) > _MOST_DIGITS or not math.isfinite(value := kind(text)):
            raise ValueError(f"holds the number {text[:20]}{'...' * (len(text) > 20)}")
        return value

    return read


@dataclass(frozen=True)
class Manifest:
    """List of an entry."""

    # `kind`, `key`: kind of result, and hash of its inputs
    kind: str
    key: str
    run: str  # name of the run that computed it
    seconds: float  # time that it took
    files: dict[str, dict[str, Any]]  # by their names in the entry: `size` in bytes and `sha256` of each file

    @classmethod
    def of_files(cls, folder: Path, kind: str, key: str, run: str, seconds: float) -> Self:
        """List of the files that are in a folder now."""
        paths = {name: folder / name for name in sorted(_names(folder))}
        files = {name: {"size": path.stat().st_size, "sha256": file_sha256(path)} for name, path in paths.items()}
        return cls(kind, key, run, seconds, files)

    @classmethod
    def read(cls, folder: Path) -> Self | None:
        """List in the folder of an entry; None where there is none that can be read."""
        path = folder / MANIFEST
        try:
            found = cls(**read_json(path))
        except (OSError, ValueError, TypeError):
            return None
        return found if found is not None and found._is_sound() else None

    def write(self, folder: Path) -> None:
        """Write the list into the folder."""
        (folder / MANIFEST).write_text(json.dumps(asdict(self), indent=1, sort_keys=True))

    def agrees_with(self, folder: Path, thorough: bool) -> bool:
        """Whether the folder holds these files and no others, by their sizes, and their hashes where `thorough`."""
        try:
            return _names(folder) == set(self.files) and all(
                _matches(folder / name, expected, thorough) for name, expected in self.files.items()
            )
        except (OSError, KeyError):
            return False

    def _is_sound(self) -> bool:
        """Whether the values have their types, and there is a file."""
        texts = all(isinstance(value, str) for value in (self.kind, self.key, self.run))
        time = isinstance(self.seconds, int | float) and math.isfinite(self.seconds) and self.seconds >= 0.0
        files = isinstance(self.files, dict) and all(isinstance(value, dict) for value in self.files.values())
        return texts and time and files and bool(self.files)


def _names(folder: Path) -> set[str]:
    """Names of the files of an entry, without its list."""
    return set(_files(str(folder), "")) - {MANIFEST}


def _files(folder: str, inside: str) -> Iterator[str]:
    """Files in a folder and in those within it, by their names from there, each with `inside` before it."""
    with os.scandir(folder) as found:
        for item in found:
            if item.is_dir(follow_symlinks=False):
                yield from _files(item.path, f"{inside}{item.name}/")
            elif item.is_file():
                yield f"{inside}{item.name}"


def _matches(path: Path, expected: dict[str, Any], thorough: bool) -> bool:
    """Whether a file is the one listed; a link to a file elsewhere is not."""
    status = path.lstat()
    same = status.st_size == expected["size"] and not stat.S_ISLNK(status.st_mode)
    return same and (not thorough or file_sha256(path) == expected["sha256"])


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
    recompute: bool = False  # whether entries of other runs count as absent

    @property
    def is_empty(self) -> bool:
        """Whether there is no result in it."""
        return not any(path.is_dir() and path.name != "tmp" for path in self.root.glob("*"))

    def lists(self, kind: str, key: str) -> bool:
        """Whether there is an entry, whole or not: the cheapest look, for what a wrong answer only makes slower."""
        return not self.recompute and (self.root / kind / key / MANIFEST).is_file()

    def find(self, kind: str, key: str, thorough: bool = True) -> Entry | None:
        """The entry where it is whole, otherwise None. Sizes are always compared, hashes only when `thorough`."""
        folder = self.root / kind / key
        manifest = Manifest.read(folder)
        if manifest is None or (manifest.kind, manifest.key) != (kind, key):
            return None
        if (self.recompute and manifest.run != self.run) or not manifest.agrees_with(folder, thorough):
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
