"""Where results may be written: places that nobody means and paths that are too long are refused before any work."""

from __future__ import annotations

import os
from pathlib import Path

from pipeline.errors import InputError, input_error

PACKAGES = ("geometry", "rom", "nonlinear", "pipeline")
_LONGEST = 500  # characters of a path in a message
_FOLDER = "a folder of its own, such as out/blade"


def check_output_path(path: Path, option: str, room: int = 0) -> None:
    """Refuse a path that nobody means to write to: the root, the home folder, the program's own folders."""
    if path.parts and path.parts[0].startswith("~"):
        allowed = "a path without ~, which only a shell replaces by the home folder"
        raise input_error(option, str(path), f'begins with "{path.parts[0]}"', allowed)
    _check_length(path, option, room)
    try:
        real = Path(os.path.realpath(path))
    except ValueError:  # a zero byte
        raise input_error(option, str(path), "holds a zero byte", "a path that the system knows") from None
    if real == Path(real.anchor):
        raise input_error(option, str(path), "is the root of the file system", _FOLDER)
    if real == Path(os.path.realpath(os.path.expanduser("~"))):
        raise input_error(option, str(path), "is the home folder", _FOLDER)
    own = [Path(__file__).resolve().parents[1] / name for name in PACKAGES]
    if any(real.is_relative_to(folder) for folder in own):
        raise input_error(option, str(path), "is inside the program", _FOLDER)


def output_path(text: str | os.PathLike[str], option: str) -> Path:
    """The path that a user gave as an output, which is not to be empty: `Path("")` is the current folder."""
    given = os.fspath(text)
    if not given.strip():
        raise input_error(option, "", f'"{given}" is no path', "a path; . is the current folder")
    return Path(given)


def _check_length(path: Path, option: str, room: int) -> None:
    """Compare the path with the limits of the file system that it is on."""
    longest = _limit(path, "PC_NAME_MAX", 255)
    for part in path.parts:
        if len(os.fsencode(part)) > longest:
            raise _too_long(option, path, f"a name of {len(os.fsencode(part))} bytes", f"{longest} bytes at most")
    most = _limit(path, "PC_PATH_MAX", 4096) - 1 - room
    length = len(os.fsencode(os.path.abspath(path)))
    if length > most:
        inside = " (results need room for their names below it)" if room else ""
        raise _too_long(option, path, f"a path of {length} bytes", f"{most} bytes at most{inside}")


def _too_long(option: str, path: Path, found: str, allowed: str) -> InputError:
    text = str(path)
    return input_error(option, text if len(text) <= _LONGEST else f"{text[:_LONGEST]}...", found, allowed)


def _limit(path: Path, name: str, usual: int) -> int:
    """A limit of the file system at the nearest folder that exists."""
    for folder in [path, *path.parents]:
        try:
            return os.pathconf(folder, name)
        except (OSError, ValueError, AttributeError):  # not there, too long itself, or no such limit
            continue
    return usual
