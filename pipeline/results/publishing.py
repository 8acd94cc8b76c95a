"""Files of a stage: computed once into the store, copied to the output folder."""

from __future__ import annotations

import filecmp
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.store.content_store import Store
from pipeline.store.manifest import MANIFEST

if TYPE_CHECKING:
    from pipeline.stages.request import Run


def published(run: Run, stage: str, key: str, doing: str, build: Callable[[Path], None], target: Path) -> list[Path]:
    """Files of a stage in the output folder.

    Parameters
    ----------
    run : Run
        The run; its log notes whether the files were computed or reused.
    stage : str
        Name of the stage.
    key : str
        Hash of the inputs.
    doing : str
        What progress says while the files are computed.
    build : callable
        Writes the files into the folder that it is given.
    target : Path
        Folder to copy them to, each in one step.
    """
    entry = run.store.find(stage, key)
    if entry is None:
        with run.reporter.working(doing):
            entry = run.store.get(stage, key, build)
    run.log.note(stage, entry.ran, entry.seconds)
    return _copied(run.store, entry.folder, target)


def remove_outdated(target: Path, patterns: Sequence[str], current: Sequence[Path]) -> None:
    """Remove pictures of earlier scenes from `target`: those that fit a pattern and are not current."""
    for pattern in patterns:
        for old in target.glob(pattern):
            if old not in current:
                old.unlink(missing_ok=True)


def _copied(store: Store, source: Path, target: Path) -> list[Path]:
    files = [file for file in sorted(source.iterdir()) if file.is_file() and file.name != MANIFEST]
    for file in files:
        if not _same(file, target / file.name):
            with store.replacing(target / file.name) as (path,):
                shutil.copyfile(file, path)
    return [target / file.name for file in files]


def _same(file: Path, other: Path) -> bool:
    try:
        return filecmp.cmp(file, other, shallow=False)
    except OSError:
        return False
