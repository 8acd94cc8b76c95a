"""Text of a mesh file, and of the files of its folder that it includes."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from geometry.errors import MeshFileError
from geometry.sector import FloatArray, IntArray

MOST_INCLUDED = 1000
LARGEST_LABEL = 2**31 - 1


def check_file(path: str | Path) -> None:
    """Refuse what is no file with something in it."""
    try:
        if not os.path.exists(path):
            raise MeshFileError(path, "no such file")
        if not os.path.isfile(path):
            raise MeshFileError(path, "is not a file: a folder or a device cannot be read")
        if os.path.getsize(path) == 0:
            raise MeshFileError(path, "is empty: a mesh is needed")
    except (OSError, ValueError) as error:
        raise MeshFileError(path, f"cannot be read: {error}") from None


def text_lines(path: str | Path) -> list[str]:
    """Lines of a text file."""
    check_file(path)
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise MeshFileError(path, f"cannot be read: {error.strerror}") from None
    if b"\0" in data:
        raise MeshFileError(path, "is a binary file: text is needed")
    return data.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n")


def included_file(main: str | Path, parent: str | Path, name: str, chain: tuple[str, ...]) -> str:
    """The file that an include statement names, if it stands in the folder of the main file."""
    folder = os.path.realpath(os.path.dirname(os.path.abspath(main)))
    target = os.path.realpath(included_place(main, parent, plain_name(name)))
    on_a_drive = plain_name(name)[1:2] == ":"  # of Windows
    if on_a_drive or os.path.commonpath([folder, target]) != folder:
        shared = os.path.commonpath([folder, os.path.dirname(target)])
        other = ""
        if os.path.isfile(target) and len(Path(shared).parts) > 1:
            start = os.path.relpath(os.path.abspath(main), shared)
            other = f", or give a file in {shared} that includes {start}"
        raise MeshFileError(
            main,
            f"includes {name}: only files in its own folder can be included; move the files into one folder{other}",
        )
    if target in chain:
        raise MeshFileError(
            main, f"includes {name}, which includes itself: each file can be included once in a chain"
        )
    if not os.path.isfile(target):
        raise MeshFileError(main, f"includes {name}: no such file")
    return target


def included_place(main: str | Path, parent: str | Path, name: str) -> str:
    """Where a file that is included stands: beside the file that includes it, or else beside the main file."""
    places = [os.path.join(os.path.dirname(os.path.abspath(file)), name) for file in (parent, main)]
    return next((place for place in places if os.path.isfile(place)), places[0])


def plain_name(name: str) -> str:
    """The name of an included file, with slashes where it was written on Windows."""
    return name.strip().replace("\\", "/")


def numbers(fields: list[str], refusal: object) -> FloatArray:
    """Fields as numbers; Fortran exponents (1.0D+3) are allowed."""
    try:
        return np.array(list(map(float, fields)), dtype=np.float64)
    except ValueError:
        return np.array([_number(field, refusal) for field in fields], dtype=np.float64)


def _number(field: str, refusal: object) -> float:
    try:
        return float(field.upper().replace("D", "E"))
    except ValueError:
        assert callable(refusal)
        raise refusal(field) from None


def labels_of(values: FloatArray | list[str], refusal: object) -> IntArray:
    """Numbers or fields as labels: integers that are not negative."""
    assert callable(refusal)
    if isinstance(values, np.ndarray):
        wrong = ~((values >= 0) & (values <= LARGEST_LABEL) & (values == np.floor(values)))
        if wrong.any():
            raise refusal(f"{values[wrong][0]:g}")
        return values.astype(np.int64)
    try:
        found = np.array(list(map(int, values)), dtype=np.int64)
    except (ValueError, OverflowError):
        raise refusal(next(field for field in values if not _is_label(field))) from None
    wrong = (found < 0) | (found > LARGEST_LABEL)
    if wrong.any():
        raise refusal(str(found[wrong][0]))
    return found


def _is_label(field: str) -> bool:
    try:
        return 0 <= int(field) <= LARGEST_LABEL
    except ValueError:
        return False
