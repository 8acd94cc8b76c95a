"""Reading of response.h5 piece by piece: the file stays open, whatever a run puts in its place."""

from __future__ import annotations

import errno
import hashlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import h5py

COMPARED_WHOLE = 64_000_000  # bytes of a file whose hash is compared too
TABLE_HASH = "table_hash"  # attribute of response.h5, and key in summary.json


class PointReader:
    """An open response.h5 that belongs to a summary."""

    def __init__(self, path: Path, table_hash: str, sha256: str) -> None:
        self._path, self._table_hash, self._sha256 = path, table_hash, sha256
        if not path.is_file():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        self._raw = path.open("rb")
        self._file: h5py.File | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self._path, "table_hash": self._table_hash, "sha256": self._sha256}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state)  # type: ignore[misc]  # a process that gets it opens the file itself

    @property
    def file(self) -> h5py.File:
        """The open file."""
        if self._file is None:
            import h5py

            large = self._path.stat().st_size > COMPARED_WHOLE
            if not large and hashlib.file_digest(self._raw, "sha256").hexdigest() != self._sha256:
                raise ValueError(f"summary.json and {self._path.name} are not of one run")
            file = h5py.File(self._raw, "r")
            if file.attrs.get(TABLE_HASH) != self._table_hash:
                raise ValueError(f"summary.json and {self._path.name} are not of one run")
            self._file = file
        return self._file

    def curve(self, number: int) -> h5py.Group | None:
        """The group of a curve; None where it has no points."""
        found: h5py.Group | None = self.file["curve"].get(str(number))
        return found
