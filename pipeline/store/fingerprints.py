"""Hashes of what a result depends on: scene values, upstream results, files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
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


def file_fingerprint(path: Path) -> str:
    """Hash of a file's content, of the length of the other fingerprints."""
    return file_sha256(path)[:LENGTH]
