"""List of an entry of the store, and JSON files that may have been altered: what an entry is, which files it has."""

from __future__ import annotations

import json
import math
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

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

    kind: str  # kind of result, and hash of its inputs
    key: str  # kind of result, and hash of its inputs
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
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    return names - {MANIFEST}


def _matches(path: Path, expected: dict[str, Any], thorough: bool) -> bool:
    """Whether a file is the one listed; a link to a file elsewhere is not."""
    same = path.lstat().st_size == expected["size"] and not path.is_symlink()
    return same and (not thorough or file_sha256(path) == expected["sha256"])
