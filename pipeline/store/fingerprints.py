"""Hashes of what a result depends on: scene values, upstream results, models, pictures."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

LENGTH = 24  # hexadecimal digits of every fingerprint


def fingerprint(values: Mapping[str, Any]) -> str:
    """Hash of plain values (numbers, text, lists, mappings), equal for equal content whatever the order of keys."""
    text = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False, default=list)
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's content, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def content_fingerprint(content: bytes) -> str:
    """Hash of bytes, of the length of the other fingerprints."""
    return hashlib.sha256(content).hexdigest()[:LENGTH]


def arrays_fingerprint(values: Mapping[str, Any]) -> str:
    """Hash of arrays and plain values by their names, of mappings and dataclasses of such, to the last bit."""
    digest = hashlib.sha256()
    for name, value in sorted(values.items()):
        head = f"{name} {value.dtype.str} {value.shape}" if hasattr(value, "dtype") else name
        digest.update(f"{head}\0".encode())
        if hasattr(value, "dtype"):
            digest.update(value.tobytes())
        elif isinstance(value, Mapping):
            digest.update(arrays_fingerprint(value).encode())
        elif is_dataclass(value):
            digest.update(arrays_fingerprint(vars(value)).encode())
        else:
            digest.update(fingerprint({"value": value}).encode())
    return digest.hexdigest()[:LENGTH]
