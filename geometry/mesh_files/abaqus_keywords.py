"""Keyword blocks of Abaqus and CalculiX input files."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from geometry.errors import MeshFileError
from geometry.mesh_files.text_files import MOST_INCLUDED, included_file, text_lines

_PARAMETER = re.compile(r'\s*([^,="]+?)\s*(?:=\s*("[^"]*"|[^,]*?)\s*)?(?:,|$)')


@dataclass(frozen=True)
class KeywordBlock:
    """A keyword line with the data lines that follow it.

    Attributes
    ----------
    keyword : str
        In upper case, single spaces.
    parameters : dict of str to str
        Names in upper case; "" for one without a value.
    data : list of str
        Data lines without comments and empty lines.
    line : int
        Line of the keyword, from 1.
    file : str
        File that holds it.
    """

    keyword: str
    parameters: dict[str, str]
    data: list[str]
    line: int
    file: str = field(default="")

    def refuse(self, found: str) -> MeshFileError:
        """An error that names file, line and keyword.

        Parameters
        ----------
        found : str
            What is wrong and what is allowed.
        """
        return MeshFileError(self.file, f"line {self.line}, *{self.keyword}: {found}")

    def needs(self, name: str) -> str:
        """Value of a parameter that must be given.

        Parameters
        ----------
        name : str
            In upper case.
        """
        if not self.parameters.get(name):
            raise self.refuse(f"{name}= is missing: must be given")
        return self.parameters[name]


def keyword_blocks(path: str | Path) -> list[KeywordBlock]:
    """All blocks of a file and of the files that it includes, in their order.

    Parameters
    ----------
    path : str or path
        The input file.

    Raises
    ------
    MeshFileError
        A file cannot be read or must not be included.
    """
    blocks: list[KeywordBlock] = []
    opened = [0]
    _collect(str(path), str(path), (os.path.realpath(path),), blocks, opened)
    return blocks


def _collect(main: str, path: str, chain: tuple[str, ...], blocks: list[KeywordBlock], opened: list[int]) -> None:
    opened[0] += 1
    if opened[0] > MOST_INCLUDED or len(chain) > 50:
        raise MeshFileError(main, f"includes more than {MOST_INCLUDED} files or 50 one within the other: too many")
    for block in _blocks_of(path):
        if block.keyword != "INCLUDE":
            blocks.append(block)
            continue
        target = included_file(main, path, block.needs("INPUT"), chain)
        _collect(main, target, (*chain, target), blocks, opened)


def _blocks_of(path: str) -> Iterator[KeywordBlock]:
    lines = text_lines(path)
    starts = _keyword_lines(lines)
    if not starts:
        raise MeshFileError(path, "holds no keyword such as *NODE: an Abaqus or CalculiX input file is needed")
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        text, first = _whole_line(lines, start, end)
        keyword, parameters = _head(text)
        data = [line for line in lines[first:end] if line.strip() and line.lstrip()[:2] != "**"]
        yield KeywordBlock(keyword, parameters, data, start + 1, path)


def included_names(lines: list[str]) -> list[str]:
    """Files that the `*INCLUDE`s of an input file name, as written.

    Parameters
    ----------
    lines : list of str
        Lines of the file.
    """
    starts = _keyword_lines(lines)
    heads = [
        _head(_whole_line(lines, start, end)[0])
        for start, end in zip(starts, [*starts, len(lines)][1:], strict=True)
        if "INCLUDE" in lines[start].upper()
    ]
    return [parameters["INPUT"] for keyword, parameters in heads if keyword == "INCLUDE" and parameters.get("INPUT")]


def _keyword_lines(lines: list[str]) -> list[int]:
    return [k for k, line in enumerate(lines) if line.lstrip()[:1] == "*" and line.lstrip()[:2] != "**"]


def _whole_line(lines: list[str], start: int, end: int) -> tuple[str, int]:
    """A keyword line with those that it goes on in, and the line after it."""
    text, first = lines[start].strip(), start + 1
    while text.endswith(",") and first < end:
        text, first = text + lines[first].strip(), first + 1
    return text, first


def _head(text: str) -> tuple[str, dict[str, str]]:
    name, _, rest = text[1:].partition(",")
    parameters = {
        found[1].upper(): (found[2] or "").strip('"') for found in _PARAMETER.finditer(rest) if found[1].strip()
    }
    return " ".join(name.upper().split()), parameters
