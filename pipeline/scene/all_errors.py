"""Every error of a scene at once, in the order of its lines: `shroud validate`."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pipeline.errors import InputError
from pipeline.scene.consistency import unfit_keys
from pipeline.scene.key_lines import key_lines, line_of, plain_key, with_line
from pipeline.scene.presets import SIZE
from pipeline.scene.reading import SceneFile, load_tables, scene_of_tables
from pipeline.scene.schema import SECTIONS
from pipeline.scene.sweep import read_sweep
from pipeline.scene.validation_errors import MOST_ERRORS

_MEANT = re.compile(r"did you mean (\S+)\?")


class _EnoughError(Exception):
    """As many errors as are shown."""


class _Found:
    """The first error of each key."""

    def __init__(self) -> None:
        self.errors: dict[str, InputError] = {}
        self.broken: dict[int, set[str]] = {}

    def add(self, error: InputError) -> None:
        self.errors.setdefault(error.key or str(error), error)
        if len(self.errors) >= MOST_ERRORS:
            raise _EnoughError

    def add_of_member(self, index: int, errors: list[InputError]) -> None:
        self.broken[index] = {_section(error.key) for error in errors}
        for error in errors:
            self.add(error)


def all_errors(path: Path) -> tuple[SceneFile | None, list[str]]:
    """Read and check a scene that describes a blade, going on after errors.

    Parameters
    ----------
    path : Path
        The scene file.

    Returns
    -------
    file : SceneFile or None
        The scene; None where it has errors.
    errors : list of str
        One line for every error, with the line of the file, at most `MOST_ERRORS`.

    Raises
    ------
    InputError
        The file cannot be read, or is not TOML: there is nothing to go on with.
    """
    tables, text = load_tables(path)
    found, file = _Found(), None
    try:
        sweep = _good_part(path, tables.get("sweep", {}), found)
        file = scene_of_tables(path, {**tables, "sweep": sweep}, text, broken=found.add_of_member)
        for error in unfit_keys(file, found.broken):
            found.add(error)
    except InputError as error:  # nothing to go on with
        found.errors.setdefault(error.key or str(error), error)
    except _EnoughError:
        pass
    if not found.errors:
        return file, []
    lines = key_lines(text)
    explained = _without_explained(found.errors.values(), _of_a_file(tables))
    errors = sorted(explained, key=lambda error: line_of(error, lines))
    return None, [with_line(error, lines) for error in errors]


def _good_part(path: Path, sweep: Any, found: _Found) -> Any:
    """The keys of [sweep] that are right; errors of the others are added."""
    try:
        read_sweep(path, sweep)
    except InputError as error:
        if not isinstance(sweep, Mapping):
            found.add(error)
            return {}
        before, good = len(found.errors), {}
        for key, values in sweep.items():
            try:
                read_sweep(path, {key: values})
                good[key] = values
            except InputError as own:
                found.add(own)
        if len(found.errors) == before:  # none is wrong by itself
            found.add(error)
            return {}
        return good
    return sweep


def _of_a_file(tables: Mapping[str, Any]) -> bool:
    """Whether the mesh is that of a file, so that no blade and no shroud are missing, whatever is wrong in [mesh]."""
    mesh = tables.get("mesh")
    return isinstance(mesh, Mapping) and "file" in mesh


def _without_explained(errors: Collection[InputError], of_a_file: bool) -> list[InputError]:
    """The errors but those about a missing key that another error explains.

    That is one that an unknown key stands for, that a misspelt preset gives, or that a mesh from a file does without.
    """
    meant = {each[1] for error in errors if (each := _MEANT.search(str(error)))}
    if any(error.key == "accuracy" for error in errors) or "accuracy" in meant:
        meant.add(SIZE)
    if of_a_file:
        meant |= {"blade", "shroud"}
    return [error for error in errors if not (error.key in meant and f"{error.key}: missing" in str(error))]


def _section(key: str) -> str:
    """The section of a key as it stands in a message, in its table or in [sweep]."""
    parts = plain_key(key).split(".")
    return next((part for part in parts if part in SECTIONS), parts[0])
