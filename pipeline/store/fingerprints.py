"""Hashes of what a result depends on: scene values, upstream results, source of the code that computes it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

_LENGTH = 24
_REPOSITORY = Path(__file__).resolve().parents[2]


def fingerprint(values: Mapping[str, Any]) -> str:
    """Hash of plain values (numbers, text, lists, mappings), equal for equal content whatever the order of keys."""
    text = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False, default=list)
    return hashlib.sha256(text.encode()).hexdigest()[:_LENGTH]


def source_fingerprint(parts: Iterable[str], libraries: Iterable[str] = ()) -> str:
    """Hash of the Python source of packages or modules, given as paths in the repository, and of library versions."""
    digest = hashlib.sha256()
    for part in parts:
        path = _REPOSITORY / part
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.relative_to(_REPOSITORY).as_posix().encode() + b"\0")
            digest.update(file.read_bytes() + b"\0")
    for library in libraries:
        digest.update(f"{library} {_version(library)}\n".encode())
    return digest.hexdigest()[:_LENGTH]


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's content, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def file_fingerprint(path: Path) -> str:
    """Hash of a file's content, of the length of the other fingerprints."""
    return file_sha256(path)[:_LENGTH]


def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "absent"
