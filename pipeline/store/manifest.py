"""List of an entry of the store: what the entry is, and which files belong to it."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from pipeline.store.fingerprints import file_sha256

MANIFEST = "entry.json"


@dataclass(frozen=True)
class Manifest:
    """List of an entry.

    Attributes
    ----------
    kind, key : str
        Kind of result, and hash of its inputs.
    run : str
        Name of the run that computed it.
    seconds : float
        Time that it took.
    files : dict
        By their names in the entry: `size` in bytes and `sha256` of each file.
    """

    kind: str
    key: str
    run: str
    seconds: float
    files: dict[str, dict[str, Any]]

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
            found = cls(**json.loads(path.read_bytes())) if path.is_file() else None
        except (OSError, ValueError, TypeError, RecursionError):
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
    return path.stat().st_size == expected["size"] and (not thorough or file_sha256(path) == expected["sha256"])
