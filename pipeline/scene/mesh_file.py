"""The mesh file of a scene: whether it is there, its size, and a hash of its content, included files with it."""

from __future__ import annotations

import difflib
import hashlib
import os
import re
from functools import lru_cache
from pathlib import Path

from pipeline.errors import input_error, shown_file, system_reason
from pipeline.scene.reading import Member, key_in_file

SUFFIXES = (".inp", ".bdf", ".dat", ".nas", ".cdb", ".msh", ".vtu", ".med")
KEY = "mesh.file"
MOST_INCLUDED = 1000  # as in the readers
_WITH_INCLUDES = (".inp", ".bdf", ".dat", ".nas")


def check_mesh_file(path: Path, member: Member) -> None:
    """Refuse a mesh file that is not there or cannot be read, and files it includes that are not there.

    Raises
    ------
    InputError
        With `mesh.file`; a similar name of the folder where there is one.
    """
    file = member.scene.mesh_file
    assert file is not None
    key, allowed = key_in_file(member, KEY), f"a readable mesh file ({', '.join(SUFFIXES)})"
    place = Path(file)
    if not place.exists():
        near = _near(place)
        raise input_error(path, key, f"{shown_file(file)}: no such file{near and f', did you mean {near}?'}", allowed)
    if not place.is_file():
        raise input_error(path, key, f"{shown_file(file)}: not a file", allowed)
    try:
        parts = mesh_file_parts(file)
    except OSError as error:
        raise input_error(path, key, f"{shown_file(file)}: cannot be read: {system_reason(error)}", allowed) from None
    for part in parts[1:]:
        if not part.is_file():
            raise input_error(path, key, f"{shown_file(file)} includes {part}: no such file", "files that are there")


def mesh_file_size(file: str) -> int:
    """Bytes of a mesh file and of those that it includes; 0 where it is not there."""
    return sum(part.stat().st_size for part in mesh_file_parts(file) if part.is_file()) if Path(file).is_file() else 0


def mesh_file_hash(file: str) -> str:
    """SHA-256 of the content of a mesh file and of the files that it includes, whatever their names.

    Raises
    ------
    OSError
        A file cannot be read.
    """
    return hashlib.sha256("".join(_hash(part, *_state(part)) for part in mesh_file_parts(file)).encode()).hexdigest()


def mesh_file_parts(file: str) -> tuple[Path, ...]:
    """A mesh file and the files that it includes, directly or not, in their order.

    Raises
    ------
    OSError
        A file that is there cannot be read.
    """
    found: dict[Path, None] = {}
    waiting = [Path(file)]
    while waiting and len(found) < MOST_INCLUDED:
        part = waiting.pop(0)
        if part not in found:
            found[part] = None
            if part.is_file():
                waiting += [part.parent / name for name in _included(part, Path(file).suffix, *_state(part))]
    return tuple(found)


def _state(path: Path) -> tuple[int, int]:
    """Size and time: while they are the same, the content is."""
    status = path.stat()
    return status.st_size, status.st_mtime_ns


@lru_cache(maxsize=64)
def _included(path: Path, suffix: str, size: int, time: int) -> tuple[str, ...]:
    if suffix.lower() not in _WITH_INCLUDES or not re.search(rb"include|input", path.read_bytes(), re.IGNORECASE):
        return ()
    from geometry import MeshFileError, included_names

    try:
        return included_names(path, suffix)
    except MeshFileError:  # no text: its reader says so
        return ()


@lru_cache(maxsize=64)
def _hash(path: Path, size: int, time: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _near(place: Path) -> str:
    """The name of a mesh file in the same folder that is much like this one."""
    if not place.parent.is_dir():
        return ""
    names = [name for name in os.listdir(place.parent) if name.lower().endswith(SUFFIXES)]
    return next(iter(difflib.get_close_matches(place.name, names, n=1, cutoff=0.5)), "")
