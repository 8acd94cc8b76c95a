"""The mesh file of a scene: whether it is there, with those that it includes."""

from __future__ import annotations

import difflib
import os
from pathlib import Path

from pipeline.errors import input_error, shown_file, system_reason
from pipeline.scene.input_files import file_parts
from pipeline.scene.reading import Member, key_in_file

SUFFIXES = (".inp", ".bdf", ".dat", ".nas", ".cdb", ".msh", ".vtu", ".med")
KEY = "mesh.file"


def check_mesh_file(path: Path, member: Member) -> None:
    """Refuse a mesh file that is not there or cannot be read, and files it includes that are not there."""
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
        parts = file_parts(file)
    except OSError as error:
        raise input_error(path, key, f"{shown_file(file)}: cannot be read: {system_reason(error)}", allowed) from None
    for part in parts[1:]:
        if not part.is_file():
            found = "not a file" if part.exists() else "no such file"
            raise input_error(path, key, f"{shown_file(file)} includes {part}: {found}", "files that are there")


def _near(place: Path) -> str:
    """The name of a mesh file in the same folder that is much like this one."""
    if not place.parent.is_dir():
        return ""
    names = [name for name in os.listdir(place.parent) if name.lower().endswith(SUFFIXES)]
    return next(iter(difflib.get_close_matches(place.name, names, n=1, cutoff=0.5)), "")
