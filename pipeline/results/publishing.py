"""Files of a stage: computed once into the store, copied to the output folder."""

from __future__ import annotations

import filecmp
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from pipeline.errors import reason_of
from pipeline.store.content_store import MANIFEST, Store
from pipeline.store.disk_errors import storage_error

if TYPE_CHECKING:
    from pipeline.stages.request import Run

T = TypeVar("T")


class PicturesMissing(Exception):
    """Some pictures of a stage could not be made.

    `files`: those that could, in the output folder.
    `problems`: one line for each of the others.
    """

    def __init__(self, files: list[Path], problems: list[str]) -> None:
        super().__init__("; ".join(problems))
        self.files, self.problems = files, problems


@dataclass
class Attempts:
    """Pictures of which one may fail while the others are made; what the disk causes is raised."""

    folder: Path  # where they are written
    place: Path | None = None  # the folder that an error of the disk names, where that is another one
    problems: list[str] = field(default_factory=list)  # one line for each that failed

    def result(self, name: str, make: Callable[[], T]) -> T | None:
        """What `make` returns; None where it fails."""
        try:
            return make()
        except Exception as error:
            if cause := storage_error(error, self.place or self.folder):
                raise cause from error
            for path in self.folder.glob(f"{name}.*"):  # half a pair of files
                path.unlink()
            self.problems.append(f"{name}: {reason_of(error)}")
            return None


def published(
    run: Run, stage: str, key: str, doing: str, build: Callable[[Path], list[str] | None], target: Path
) -> list[Path]:
    """Files of a stage in the output folder."""
    entry = run.store.find(stage, key)
    if entry is None:
        with run.reporter.working(doing):
            entry = run.store.get(stage, key, lambda folder: _built(run, stage, build, folder, target))
    run.log.note(stage, entry.ran, entry.seconds)
    return copied(run.store, entry.folder, target)


def _built(run: Run, stage: str, build: Callable[[Path], list[str] | None], folder: Path, target: Path) -> None:
    """Write the files into the folder; where some are missing the others are copied at once and not kept."""
    problems = build(folder)
    if problems:
        run.log.note(stage, ran=True)
        raise PicturesMissing(copied(run.store, folder, target), problems)


def remove_outdated(target: Path, patterns: Sequence[str], current: Sequence[Path]) -> None:
    """Remove pictures of earlier scenes from `target`: those that fit a pattern and are not current."""
    for pattern in patterns:
        for old in target.glob(pattern):
            if old not in current:
                old.unlink(missing_ok=True)


def copied(store: Store, source: Path, target: Path) -> list[Path]:
    """The files of a folder in `target`, each copied in one step where it is not there already."""
    files = [file for file in sorted(source.iterdir()) if file.is_file() and file.name != MANIFEST]
    for file in files:
        if not same_file(file, target / file.name):
            with store.replacing(target / file.name) as (path,):
                shutil.copyfile(file, path)
    return [target / file.name for file in files]


def same_file(file: Path, other: Path) -> bool:
    """Whether both are there with the same content."""
    try:
        return filecmp.cmp(file, other, shallow=False)
    except OSError:
        return False
