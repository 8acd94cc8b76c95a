"""Keyword blocks of Abaqus and CalculiX input files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from geometry.errors import MeshFileError
from geometry.mesh_files.text_files import MOST_INCLUDED, included_file, text_lines

_PARAMETER = re.compile(r'([^,=]*)(?:=\s*("[^"]*"|[^,]*)[^,]*)?(?:,|$)')  # matches anywhere: no backtracking
# parameters of the keywords that are read, as the manuals of Abaqus and CalculiX have them
PARAMETERS = {
    "NODE": ("NSET", "SYSTEM", "INPUT"),
    "ELEMENT": ("TYPE", "ELSET", "INPUT", "OFFSET", "SOLID ELEMENT NUMBERING"),
    "NSET": ("NSET", "ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"),
    "ELSET": ("ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"),
    "SURFACE": (
        *("NAME", "TYPE", "COMBINE", "CROP", "DEFINITION", "FILLET RADIUS", "INTERNAL", "MAX RATIO"),
        *("NO OFFSET", "NO THICK", "PROPERTY", "REGION TYPE", "SCALE THICK", "TRIM"),
    ),
    "SOLID SECTION": (
        *("ELSET", "MATERIAL", "COMPOSITE", "CONTROLS", "LAYUP", "ORDER", "ORIENTATION", "REF NODE"),
        *("STACK DIRECTION", "SYMMETRIC", "NLGEOM"),
    ),
    "PART": ("NAME",),
    "INSTANCE": ("NAME", "PART", "INSTANCE", "LIBRARY"),
    "INCLUDE": ("INPUT", "PASSWORD"),
}
WITH_INPUT = ("INCLUDE", "NODE", "ELEMENT")  # their INPUT= names a file
_LEAST = 3  # letters of an abbreviated parameter


@dataclass(frozen=True)
class KeywordBlock:
    """A keyword line with the data lines that follow it."""

    keyword: str  # in upper case, single spaces
    parameters: dict[str, str]  # names in upper case; "" for one without a value
    data: list[str]  # data lines without comments and empty lines
    line: int  # line of the keyword, from 1
    file: str = field(default="")  # file that holds it

    def refuse(self, found: str) -> MeshFileError:
        """An error that names file, line and keyword."""
        return MeshFileError(self.file, f"line {self.line}, *{self.keyword}: {found}")

    def needs(self, name: str) -> str:
        """Value of a parameter that must be given."""
        if not self.parameters.get(name):
            raise self.refuse(f"{name}= is missing: must be given")
        return self.parameters[name]


def keyword_blocks(path: str | Path) -> list[KeywordBlock]:
    """All blocks of a file and of the files that it includes, in their order."""
    blocks: list[KeywordBlock] = []
    opened = [0]
    _collect(str(path), str(path), (os.path.realpath(path),), blocks, opened)
    return blocks


def _collect(main: str, path: str, chain: tuple[str, ...], blocks: list[KeywordBlock], opened: list[int]) -> None:
    opened[0] += 1
    if opened[0] > MOST_INCLUDED or len(chain) > 50:
        raise MeshFileError(main, f"includes more than {MOST_INCLUDED} files or 50 one within the other: too many")
    for block in _blocks_of(path):
        if block.keyword == "INCLUDE":
            target = included_file(main, path, block.needs("INPUT"), chain)
            _collect(main, target, (*chain, target), blocks, opened)
            continue
        if block.keyword in WITH_INPUT and "INPUT" in block.parameters:
            target = included_file(main, path, block.needs("INPUT"), chain)
            block = replace(block, data=[*_data(text_lines(target)), *block.data])
        blocks.append(block)


def _data(lines: list[str]) -> list[str]:
    return [line for line in lines if line.strip() and line.lstrip()[:2] != "**"]


def _blocks_of(path: str) -> Iterator[KeywordBlock]:
    lines = text_lines(path)
    starts = _keyword_lines(lines)
    if not starts:
        raise MeshFileError(path, "holds no keyword such as *NODE: an Abaqus or CalculiX input file is needed")
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        text, first = _whole_line(lines, start, end)
        keyword, given = _head(text)
        block = KeywordBlock(keyword, given, _data(lines[first:end]), start + 1, path)
        unknown = [name for name in given if keyword in PARAMETERS and name not in PARAMETERS[keyword]]
        if unknown:
            allowed = ", ".join(PARAMETERS[keyword])
            raise block.refuse(f"parameter {unknown[0]} is not known: must be one of {allowed}")
        yield block


def _parameter(keyword: str, word: str) -> str | None:
    """The parameter of a keyword that is read which a word stands for, also abbreviated; None for none."""
    word = " ".join(word.upper().split())
    known = PARAMETERS.get(keyword, ())
    close = [name for name in known if name.startswith(word) and len(word) >= _LEAST]
    return word if word in known else close[0] if len(close) == 1 else None


def abaqus_includes(lines: list[str]) -> list[str]:
    """Files that an input file includes or takes data lines from, as written."""
    starts = _keyword_lines(lines)
    heads = [
        _head(_whole_line(lines, start, end)[0])
        for start, end in zip(starts, [*starts, len(lines)][1:], strict=True)
        if lines[start].lstrip()[1:].lstrip()[:4].upper() in ("INCL", "NODE", "ELEM")
    ]
    return [parameters["INPUT"] for keyword, parameters in heads if keyword in WITH_INPUT and parameters.get("INPUT")]


def _keyword_lines(lines: list[str]) -> list[int]:
    return [k for k, line in enumerate(lines) if line.lstrip()[:1] == "*" and line.lstrip()[:2] != "**"]


def _whole_line(lines: list[str], start: int, end: int) -> tuple[str, int]:
    """A keyword line with those that it goes on in, and the line after it.

    After a comma at its end it goes on where the next line has parameters. Else the comma ends the line, as
    CalculiX takes it, and data follow.
    """
    text, first = lines[start].strip(), start + 1
    keyword = _head(text)[0]
    while text.endswith(","):
        following = next((k for k in range(first, end) if _data(lines[k : k + 1])), end)
        parts = [] if following == end else [part for part in lines[following].split(",") if part.strip()]
        if not parts or not all("=" in part or _parameter(keyword, part) for part in parts):
            break
        text, first = text + lines[following].strip(), following + 1
    return text, first


def _head(text: str) -> tuple[str, dict[str, str]]:
    name, _, rest = text[1:].partition(",")
    keyword = " ".join(name.upper().split())
    words = [
        (found[1], (found[2] or "").strip().strip('"')) for found in _PARAMETER.finditer(rest) if found[1].strip()
    ]
    return keyword, {_parameter(keyword, word) or " ".join(word.upper().split()): value for word, value in words}
