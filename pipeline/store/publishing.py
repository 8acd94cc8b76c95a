"""Pictures from the store to the output folder, where people look for them."""

from __future__ import annotations

import filecmp
import shutil
from collections.abc import Sequence
from pathlib import Path

from pipeline.store.content_store import MANIFEST, Store


def publish(store: Store, source: Path, target: Path) -> list[Path]:
    """Copy the pictures of a store entry to the folder `target`, each in one step; returns where they are."""
    files = [file for file in sorted(source.iterdir()) if file.name != MANIFEST]
    for file in files:
        if not _same(file, target / file.name):
            with store.replacing(target / file.name) as (path,):
                shutil.copyfile(file, path)
    return [target / file.name for file in files]


def retire(target: Path, patterns: Sequence[str], current: Sequence[Path]) -> None:
    """Remove pictures that an earlier scene left in `target`: those that fit a pattern and are not current."""
    for pattern in patterns:
        for old in target.glob(pattern):
            if old not in current:
                old.unlink(missing_ok=True)


def _same(file: Path, other: Path) -> bool:
    try:
        return filecmp.cmp(file, other, shallow=False)
    except OSError:
        return False
