"""Input files of a scene: hashed when it is read; what is read later is what was hashed, or is refused.

A reader gets private copies, made and hashed in one pass. Files that a file includes stand beside its copy as they
stand beside the file; what is not among them cannot be read. Devices, and links out of the folder of a file that
includes, are refused before they are opened.
"""

from __future__ import annotations

import csv
import difflib
import hashlib
import io
import os
import re
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO

from pipeline.errors import InputError, input_error, system_reason

MOST_INCLUDED = 1000  # as in the readers
LARGEST_HOLES = 1_000_000_000  # bytes that a file may claim beyond what the disk holds of it
_WITH_INCLUDES = (".inp", ".bdf", ".dat", ".nas")
_WITH_DOFS = (".sti", ".mas")  # of CalculiX, with a file .dof beside them
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eEdD][+-]?\d+)?")
_PIECE = 2**20
ONCE = "a file that stays as it is while it is used: run again"

Contents = Mapping[str, str]  # hashes of input files by their full paths
_Take = Callable[[Path, Path], Path | None]


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """A regular file, or a link to one, open for reading; nothing else is opened, nothing is waited for."""
    _check_regular(os.stat(path))
    number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0))
    try:
        _check_regular(os.fstat(number))  # of what has been opened, whatever the name stands for now
        return os.fdopen(number, "rb")
    except BaseException:
        os.close(number)
        raise


def _check_regular(status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        raise OSError(None, "not a file")
    held = 512 * getattr(status, "st_blocks", status.st_size)
    if status.st_size > LARGEST_HOLES + 100 * held:
        raise OSError(None, f"claims {status.st_size} bytes, the disk holds {held} of them")


def read_bytes(file: str, contents: Contents) -> bytes:
    """The content of a file that includes none, as it was when the scene was read."""
    with open_regular(file) as opened:
        data = b"".join(_pieces(opened))
    if contents.get(file, content := _combined([hashlib.sha256(data).hexdigest()])) != content:
        raise _changed(file)
    return data


def file_problem(file: Path, allowed: str, suffixes: tuple[str, ...] = ("",)) -> str:
    """What is wrong with a file and what is allowed, or a name like that of one that is not there; else empty."""
    try:
        if not file.exists():
            names = os.listdir(file.parent) if file.parent.is_dir() else []
            names = [name for name in names if name.lower().endswith(suffixes)]
            near = difflib.get_close_matches(file.name, names, n=1, cutoff=0.5)
            return "no such file" + (f", did you mean {near[0]}?" if near else "")
        if not file.is_file():
            return f"not a file, allowed: {allowed}"
        with file.open("rb"):
            return ""
    except (OSError, ValueError) as error:  # a name that is too long, or with a zero byte
        reason = system_reason(error) if isinstance(error, OSError) else error
        return f"cannot be read: {reason}, allowed: {allowed}"


def csv_rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Rows of a CSV file with the numbers of their lines: with commas, semicolons or tabs, whatever ends its lines.

    Raises csv.Error.
    """
    head = next((line for line in io.StringIO(text, newline=None) if line.strip()), "")
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=max(",;\t", key=head.count), strict=True)
    for row in reader:
        yield reader.line_num, row


def decimal_point(cell: str) -> str:
    """A number with a decimal comma as one with a point; any other text as it is."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell.strip()) else cell


def file_parts(file: str) -> tuple[Path, ...]:
    """A file and those that it includes, directly or not, in their order, as they are named."""
    return tuple(place for place, _ in _walk(file, lambda source, place: source if source.is_file() else None))


def file_size(file: str) -> int:
    """Bytes of a file and of those that it includes; 0 where it is not there."""
    parts = file_parts(file) if os.path.isfile(file) else ()
    return sum(part.stat().st_size for part in parts if os.path.isfile(part))


def content_hash(file: str) -> str:
    """SHA-256 of the content of a file and of those that it includes, whatever their names."""
    main, *others = [source for _, source in _walk(file, _if_there) if source is not None]
    return _combined([_hash(main), *(_hash(source) for source in others if os.path.isfile(source))])


def with_hashes(files: Sequence[str], known: dict[str, str]) -> None:
    """Add the hashes of files that are not known; those that cannot be read are left to who uses them."""
    for file in files:
        if file not in known:
            with suppress(OSError, ValueError):  # no such name
                known[file] = content_hash(file)


@contextmanager
def copies(files: Sequence[str], contents: Contents) -> Iterator[Callable[[str], str]]:
    """Within the block private copies of files, with what they include: a function from a file to its copy.

    Exceptions name the files, not the copies.
    """
    with tempfile.TemporaryDirectory(prefix="shroud-") as folder:
        root = os.path.realpath(folder)
        given = {file: f"{root}{os.path.abspath(file)}" for file in files}
        for file in dict.fromkeys(files):
            content = _copied(file, root)
            if content is not None and contents.get(file, content) != content:
                raise _changed(file)
        try:
            yield lambda file: given[file]
        except Exception as error:
            raise _named(error, {copy: file for file, copy in given.items()} | {root: ""}) from None


def _copied(file: str, root: str) -> str | None:
    """Copy a file and what it includes below a folder; the hash of what was copied."""
    hashes: list[str] = []

    def take(source: Path, place: Path) -> Path | None:
        target = Path(f"{root}{place}")
        if hashes and not source.is_file():  # included: its reader says that there is no such file
            return None
        try:
            with open_regular(source) as opened:
                target.parent.mkdir(parents=True, exist_ok=True)
                hashes.append(_copy(opened, target))
        except FileNotFoundError:
            return None
        except OSError as error:
            raise input_error(source, "", f"cannot be read: {system_reason(error)}", "a file") from None
        return target

    for place, source in _walk(file, take):
        if source is None and place.is_file():
            _stand_in(root, place)
    return _combined(hashes) if hashes else None


def _stand_in(root: str, place: Path) -> None:
    """An empty file for one outside the folder, and the link to it: a reader says that it does not follow there."""
    here, there = (Path(f"{root}{path}") for path in (place, os.path.realpath(place)))
    for path in (here, there):
        path.parent.mkdir(parents=True, exist_ok=True)
    there.touch()
    if here != there and not here.exists():
        here.symlink_to(there)


def _copy(opened: BinaryIO, target: Path) -> str:
    digest = hashlib.sha256()
    with target.open("wb") as copy:
        for piece in _pieces(opened):
            copy.write(piece)
            digest.update(piece)
    return digest.hexdigest()


def _pieces(opened: BinaryIO) -> Iterator[bytes]:
    """The content, as long as the file was when opened: some files of the system never end."""
    left = os.fstat(opened.fileno()).st_size
    while left > 0 and (piece := opened.read(min(_PIECE, left))):
        yield piece
        left -= len(piece)


def _walk(file: str, take: _Take) -> list[tuple[Path, Path | None]]:
    """A file and those that it includes: where they are by their names, and where they really are.

    That is None outside the folder of the file, also by a link: readers do not follow there. `take` gets both places
    and returns the file in which names of included files are looked for, or None.
    """
    main, suffix = Path(os.path.abspath(file)), Path(file).suffix.lower()
    folder = os.path.realpath(main.parent)
    found: dict[Path, Path | None] = {}
    waiting: list[tuple[Path, Path | None]] = [(main, main)]
    while waiting and len(found) < MOST_INCLUDED:
        place, source = waiting.pop(0)
        if place in found:
            continue
        found[place] = source
        text = None if source is None else take(source, place)
        if text is None or source is None:
            continue
        names = _included(text, suffix, *_state(text))
        if place == main and suffix in _WITH_DOFS:
            names = (main.with_suffix(".dof").name,)
        for name in names:
            # as the readers look for it
            beside = source.parent if os.path.isfile(source.parent / name) else main.parent
            target = os.path.realpath(beside / name)
            inside = os.path.commonpath([folder, target]) == folder
            near = place.parent if beside == source.parent else beside
            waiting.append((Path(os.path.normpath(near / name)), Path(target) if inside else None))
    return list(found.items())


def _if_there(source: Path, place: Path) -> Path | None:
    return source if os.path.isfile(source) else None


def _state(path: Path) -> tuple[int, ...]:
    """While this is the same, the content is."""
    status = path.stat()
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


@lru_cache(maxsize=64)
def _included(path: Path, suffix: str, *state: int) -> tuple[str, ...]:
    if suffix not in _WITH_INCLUDES:
        return ()
    with open_regular(path) as opened:
        text = b"".join(_pieces(opened)).lower()
    if b"inc" not in text and b"inp" not in text:  # statements of Abaqus may be abbreviated
        return ()
    from geometry.errors import MeshFileError
    from geometry.mesh_files.read import included_names

    try:
        return included_names(path, suffix)
    except MeshFileError:  # no text: its reader says so
        return ()


def _hash(path: Path) -> str:
    digest = hashlib.sha256()
    with open_regular(path) as opened:
        for piece in _pieces(opened):
            digest.update(piece)
    return digest.hexdigest()


def _combined(hashes: list[str]) -> str:
    return hashlib.sha256("".join(hashes).encode()).hexdigest()


def _changed(file: str) -> InputError:
    return input_error(file, "", "changed since the scene was read", ONCE)


def _named(error: Exception, names: Mapping[str, str]) -> Exception:
    """The exception with the names of files in place of those of copies."""

    def named(value: Any) -> Any:
        if isinstance(value, str):
            for copy, file in names.items():
                value = value.replace(copy, file)
        return value

    error.args = tuple(named(value) for value in error.args)
    for name, value in vars(error).items():
        setattr(error, name, named(value))
    return error
