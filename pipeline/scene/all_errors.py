"""Every error of a scene at once, in the order of its lines: `shroud validate`."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pipeline.errors import InputError, input_error
from pipeline.scene.consistency import unfit_keys
from pipeline.scene.key_lines import key_lines, line_of, plain_key, with_line
from pipeline.scene.plausibility import hints_first
from pipeline.scene.presets import SIZE
from pipeline.scene.reading import SceneFile, load_tables, scene_of_tables
from pipeline.scene.schema import SECTIONS
from pipeline.scene.sweep import read_sweep
from pipeline.scene.validation_errors import MOST_ERRORS, allowed_values

OF_A_FILE = {"n_blades", "unit", "axis", "axis_point", "tolerance", "bore", "sets"}  # keys of [mesh] beside its file
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


def all_errors(path: Path, force: bool = False) -> tuple[SceneFile | None, list[str]]:
    """Read and check a scene that describes a blade, going on after errors."""
    tables, text = load_tables(path)
    found, file = _Found(), None
    try:
        sweep = _good_part(path, tables.get("sweep", {}), found)
        file = scene_of_tables(path, {**tables, "sweep": sweep}, text, broken=found.add_of_member)
        for error in unfit_keys(file, found.broken, force):
            found.add(error)
    except InputError as error:  # nothing to go on with
        found.errors.setdefault(error.key or str(error), error)
    except _EnoughError:
        pass
    if not found.errors:
        return file, []
    lines = key_lines(text)
    explained = _without_explained(path, found.errors.values(), tables)
    errors = sorted(explained, key=lambda error: line_of(error, lines))
    return None, [with_line(error, lines) for error in (errors if file is None else hints_first(file, errors))]


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


def _of_a_file(tables: Mapping[str, Any], meant: Collection[str]) -> bool:
    """Whether the mesh is that of a file, so that no blade and no shroud are missing, whatever is wrong in [mesh]."""
    mesh: Any = tables.get("mesh")
    of_file = isinstance(mesh, Mapping) and ("file" in mesh or not OF_A_FILE.isdisjoint(mesh))
    return of_file and ("file" in mesh or "mesh.file" in meant or "blade" not in tables)


def _without_explained(path: Path, found: Collection[InputError], tables: Mapping[str, Any]) -> list[InputError]:
    """The errors but those about a missing key that another error explains.

    That is one that an unknown key or table stands for, that a misspelt preset gives, or that a mesh from a file does
    without. Keys that are missing with their whole table are one error.
    """
    errors = list(found)
    meant = {each[1] for error in errors if (each := _MEANT.search(str(error)))}
    if any(error.key == "accuracy" for error in errors) or "accuracy" in meant:
        meant.add(SIZE)
    if any(error.key == "materials" for error in errors):  # for [material], or of several materials
        meant.add("material")
    if _of_a_file(tables, meant):
        meant |= {"blade", "shroud", "material", SIZE}
        if "file" not in tables["mesh"]:
            errors = [error for error in errors if error.key.removeprefix("mesh.") not in OF_A_FILE]
            errors += [] if "mesh.file" in meant else [_missing(path, "mesh.file", allowed_values("mesh.file"))]
    absent: dict[str, list[str]] = {}
    for error in errors:
        section, _, name = error.key.partition(".")
        if name and section not in tables and f"{error.key}: missing" in str(error):
            absent.setdefault(section, []).append(name)
    for section, names in absent.items():
        if len(names) > 1:
            errors = [error for error in errors if error.key.partition(".")[0] != section]
            errors.append(_missing(path, section, f"a table [{section}] with {', '.join(names)}"))
    return [error for error in errors if not _explained(error, meant)]


def _explained(error: InputError, meant: Collection[str]) -> bool:
    """Whether a key is missing that another error names, itself or its table."""
    return f"{error.key}: missing" in str(error) and not {error.key, error.key.partition(".")[0]}.isdisjoint(meant)


def _missing(path: Path, key: str, allowed: str) -> InputError:
    return input_error(path, key, "missing", allowed)


def _section(key: str) -> str:
    """The section of a key as it stands in a message, in its table or in [sweep]."""
    parts = plain_key(key).split(".")
    return next((part for part in parts if part in SECTIONS), parts[0])
