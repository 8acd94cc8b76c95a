"""Lines of a TOML text on which its keys stand, for messages. The text is known to be valid TOML."""

from __future__ import annotations

import re
from pathlib import Path

from pipeline.errors import InputError

_PART = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')"""
_DOTTED = rf"{_PART}(?:[ \t]*\.[ \t]*{_PART})*"
_HEADING = re.compile(rf"[ \t]*\[\[?[ \t]*({_DOTTED})[ \t]*\]")
_KEY = re.compile(rf"[ \t]*({_DOTTED})[ \t]*=")
# what a value is made of, as far as its end matters: text, comments, brackets
_TOKEN = re.compile(r"""\"{3}|'{3}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|#[^\n]*|[][{}]""")
_LONG_TEXT = re.compile(r"""\"{3}(?:[^\\]|\\.)*?"{3,5}|'{3}.*?'{3,5}""", re.DOTALL)
_INDEX = re.compile(r"\[\d+\]$")


def key_lines(text: str) -> dict[str, int]:
    """Number of the line of every table and key, from 1, by dotted names without quotes; not of keys inside `{}`."""
    lines: dict[str, int] = {}
    table, position, number = "", 0, 1
    for line in text.split("\n"):
        start, end = position, position + len(line)
        number, position = number + 1, end + 1
        if start < lines.get("", 0):  # still inside a value; "" holds where it ends
            continue
        if heading := _HEADING.match(line):
            table = plain_key(heading[1])
            lines.setdefault(table, number - 1)
        elif key := _KEY.match(line):
            dotted = plain_key(key[1])
            lines.setdefault(f"{table}.{dotted}" if table else dotted, number - 1)
            lines[""] = _end_of_value(text, start + key.end())
    lines.pop("", None)
    return lines


def plain_key(key: str) -> str:
    """A dotted key without quotes and spaces, and without the index of an element at its end."""
    return ".".join(part.strip("\"'") for part in re.findall(_PART, _INDEX.sub("", key)))


def line_of(error: InputError, lines: dict[str, int]) -> int:
    """Number of the line of the key that an error names, or of the table that lacks it; 0 where there is none."""
    key = plain_key(error.key)
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return lines.get(key, 0)


def with_line(error: InputError, lines: dict[str, int]) -> str:
    """The message with the number of the line after the file."""
    number = line_of(error, lines)
    return f"{error.source}:{number}{str(error)[len(error.source) :]}" if number else str(error)


def with_line_of_file(error: InputError) -> str:
    """`with_line` with the lines of the file that the message names; as it is where that is no scene with the key."""
    from pipeline.scene.reading import load_tables

    path = Path(error.source)
    if not error.key or path.suffix != ".toml":
        return str(error)
    try:
        return with_line(error, key_lines(load_tables(path)[1]))
    except InputError:  # no TOML: there are no keys
        return str(error)


def _end_of_value(text: str, start: int) -> int:
    """Place at which a value ends that begins at `start`: the end of its line, or of the line of its last bracket."""
    depth, place = 0, start
    while True:
        newline = text.find("\n", place)
        newline = len(text) if newline < 0 else newline
        found = _TOKEN.search(text, place, newline)
        if found is None and (depth == 0 or newline == len(text)):
            return newline
        if found is None:
            place = newline + 1
        elif found[0] in ('"' * 3, "'" * 3):
            whole = _LONG_TEXT.match(text, found.start())
            place = whole.end() if whole else len(text)
        else:
            depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(found[0], 0)
            place = found.end()
