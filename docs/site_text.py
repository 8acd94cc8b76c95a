"""Text for the site from the program itself: docstrings, signatures, commands.

Docstrings are plain text with `code` in single backticks and, at most, sections of the form

    Attributes
    ----------
    stiffness, mass : (N, N) CSR, symmetric,
        N/m and kg.

which become lists. Everything else that reStructuredText would read as markup is escaped.
"""

from __future__ import annotations

import re
import subprocess
import sys

_ENTRY = re.compile(r"(?:^|(?<=\. ))([A-Za-z_][\w.]*(?:, [A-Za-z_][\w.]*)*) : ")
_ARRAY = re.compile(r"(?:ndarray\[tuple\[(?:Any|int), \.\.\.\], dtype\[(\w+)\]\]|NDArray\[(?:np\.)?(\w+)\])")
_NAMES = {
    "float64": "Array",
    "complex128": "ComplexArray",
    "int64": "IntArray",
    "bool": "BoolArray",
    "bool_": "BoolArray",
    "Any": "Array",
    "intp": "IntArray",
}


def docstring_lines(lines: list[str]) -> list[str]:
    """A docstring of the house, line by line, as reStructuredText."""
    result: list[str] = []
    index = 0
    while index < len(lines):
        if index + 1 < len(lines) and re.fullmatch(r"-{3,}", lines[index + 1].strip()) and lines[index].strip():
            end = index + 2
            while (
                end < len(lines) and not _begins_section(lines, end) and (lines[end].strip() or _goes_on(lines, end))
            ):
                end += 1
            result += ["", f"**{lines[index].strip()}**", "", *_entries(lines[index + 2 : end]), ""]
            index = end
        else:
            result.append(_plain(lines[index]))
            index += 1
    return result


def _begins_section(lines: list[str], index: int) -> bool:
    return index + 1 < len(lines) and re.fullmatch(r"-{3,}", lines[index + 1].strip()) is not None


def _goes_on(lines: list[str], index: int) -> bool:
    """Whether a section goes on after an empty line: with an indented line, that is."""
    return index + 1 < len(lines) and lines[index + 1].startswith(" ")


def _entries(lines: list[str]) -> list[str]:
    """Entries `names : text`, several on a line where a sentence ends between them, as a list."""
    entries: list[str] = []
    for line in lines:
        if line.startswith(" ") and entries:
            entries[-1] += " " + line.strip()
        elif line.strip():
            entries.append(line.strip())
    result = []
    for entry in entries:
        parts = _ENTRY.split(entry)
        for names, text in zip(parts[1::2], parts[2::2], strict=True):
            named = ", ".join(f"``{name}``" for name in names.split(", "))
            result.append(f"* {named}: {_plain(text.strip())}")
    return result


def _plain(line: str) -> str:
    """Text in which nothing is markup but `code`."""
    pieces = re.split(r"(``?[^`]+``?)", line)
    return "".join(
        f"``{piece.strip('`')}``" if piece.startswith("`") else re.sub(r"([\\*|]|_(?=\W|$))", r"\\\1", piece)
        for piece in pieces
    )


def short_signature(text: str | None) -> str | None:
    """A signature with `Array` for a NumPy array of floats, and names without their modules."""
    if text is None:
        return None
    text = re.sub(r"~?\b(?:numpy|typing|collections\.abc)\.", "", text.replace("~", ""))
    text = _ARRAY.sub(lambda match: _NAMES.get(match[1] or match[2], "Array"), text)
    return re.sub(r"\b(?:\w+\.)+(?=[A-Z])", "", text)


def commands_text() -> str:
    """Every command with its arguments and options, in Markdown, as typer describes them."""
    asked = [sys.executable, "-m", "typer", "pipeline.cli", "utils", "docs", "--name", "shroud"]
    text = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    outside = re.split(r"(`[^`]*`)", text[text.index("## `shroud run`") :])
    return "".join(piece if piece.startswith("`") else piece.replace("<", "&lt;") for piece in outside)
