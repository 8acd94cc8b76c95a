"""The tables of an Ansys archive, checked before mapdl-archive reads them: on bad ones it crashes."""

from __future__ import annotations

import re

from geometry.errors import MeshFileError
from geometry.mesh_files.file_mesh import counted

NODES_FORMAT = re.compile(r"\(\s*\d+i(\d+)\s*,\s*\d+e(\d+)\.\d+(?:e\d+)?\s*\)$", re.IGNORECASE)
ELEMENTS_FORMAT = re.compile(r"\(\s*\d+i(\d+)\s*\)$", re.IGNORECASE)
HEAD, FIRST, COUNT = 11, 8, 8  # fields before the nodes, nodes on the first line, field with the number of nodes
MOST_NODES, WIDEST = 27, 40
_INTEGERS, _NUMBERS = frozenset(" 0123456789-"), frozenset(" 0123456789.+-EeDd")


def check_tables(path: object, lines: list[str]) -> dict[str, int]:
    """Number of rows that each of both tables announces; 0 where it says nothing.

    Parameters
    ----------
    path : path
        The archive.
    lines : list of str
        Its lines.

    Raises
    ------
    MeshFileError
        A table is missing, given twice or damaged.
    """
    found = {}
    for name, check in (("NBLOCK", _check_nodes), ("EBLOCK", _check_elements)):
        heads = [k for k, line in enumerate(lines) if line[: len(name)].upper() == name]
        if len(heads) != 1:
            what = counted(len(heads), f"{name} table")
            raise MeshFileError(path, f"holds {what}: must hold one, as CDWRITE,DB writes")
        fields = [field.strip() for field in lines[heads[0]].split(",")]
        if len(fields) < 3 or fields[2].upper() != "SOLID":
            raise MeshFileError(path, f"{lines[heads[0]].strip()!r}: must be {name} with the key SOLID")
        size = fields[4] if len(fields) > 4 else ""
        found[name] = int(size) if size.isdecimal() else 0
        rows = check(path, lines, heads[0] + 1)
        if found[name] not in (0, rows):
            raise MeshFileError(path, f"{name} says {size} rows and has {rows}: the file must be whole")
    for k, line in enumerate(lines):
        if line[:7].upper() == "CMBLOCK":
            _check_component(path, lines, k)
    return found


def _width(path: object, lines: list[str], start: int, pattern: re.Pattern[str]) -> int:
    text = lines[start].strip() if start < len(lines) else ""
    found = pattern.match(text)
    if found is None or not all(0 < int(width) <= WIDEST for width in found.groups()):
        raise MeshFileError(
            path, f"line {start + 1}: {text[:40]!r} must be a format such as (3i9,6e21.13e3) or (19i10)"
        )
    return int(found[1])


def _check_nodes(path: object, lines: list[str], start: int) -> int:
    width = _width(path, lines, start, NODES_FORMAT)
    for number, line in enumerate(lines[start + 1 :], start + 2):
        if line[:1] in ("N", "-", "n") or line.strip() == "-1":
            return number - start - 2
        if not _NUMBERS.issuperset(line) or not line[:width].strip().isdecimal():
            raise MeshFileError(path, f"line {number}: {line.strip()[:40]!r} must be a row of the NBLOCK table")
    raise MeshFileError(path, "the NBLOCK table has no end: the file must be whole")


def _check_elements(path: object, lines: list[str], start: int) -> int:
    width = _width(path, lines, start, ELEMENTS_FORMAT)
    place, rows = start + 1, 0
    while place < len(lines) and lines[place].strip() != "-1":
        first = lines[place].rstrip()
        field = first[COUNT * width : (COUNT + 1) * width].strip()
        count = int(field) if field.isdecimal() and len(field) < 9 else 0
        rest = lines[place + 1].rstrip() if count > FIRST and place + 1 < len(lines) else ""
        whole = len(first) == width * (HEAD + min(count, FIRST)) and len(rest) == width * max(count - FIRST, 0)
        if not (0 < count <= MOST_NODES and whole and _INTEGERS.issuperset(first) and _INTEGERS.issuperset(rest)):
            raise MeshFileError(
                path, f"line {place + 1}: {' '.join(first.split())[:40]!r} must be a row of the EBLOCK table"
            )
        place += 2 if count > FIRST else 1
        rows += 1
    if place >= len(lines):
        raise MeshFileError(path, "the EBLOCK table has no end: the file must be whole")
    return rows


def _check_component(path: object, lines: list[str], head: int) -> None:
    """A CMBLOCK: its number of items, its format and that many integers."""
    fields = [field.partition("!")[0].strip() for field in lines[head].split(",")]
    count = int(fields[3]) if len(fields) > 3 and fields[3].isdecimal() and len(fields[3]) < 10 else -1
    if count < 0 or fields[2].upper() not in ("NODE", "ELEM", "ELEMENT", "NODES"):
        raise MeshFileError(
            path, f"line {head + 1}: {lines[head].strip()[:40]!r} must be CMBLOCK, name, NODE or ELEM, count"
        )
    width = _width(path, lines, head + 1, ELEMENTS_FORMAT)
    place = head + 2
    while count > 0:
        line = lines[place].rstrip() if place < len(lines) else ""
        if not line or len(line) % width or not _INTEGERS.issuperset(line):
            raise MeshFileError(path, f"line {place + 1}: {line.strip()[:40]!r} must be a row of {fields[1]}")
        count -= len(line) // width
        place += 1
