"""The text of a scene file: reading of TOML with bounds, errors in plain words, the lines on which keys stand."""

from __future__ import annotations

import re
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import Any

from pipeline.errors import InputError, input_error, one_line, reason_of, system_reason

LARGEST_FILE = 1_000_000  # bytes
MOST_PARTS = 50  # of a dotted key: tomllib takes the square of them
ALLOWED = "TOML 1.0"
_LONGEST_LINE = 60
PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DOTTED = re.compile(rf"(?<![A-Za-z0-9_.\"'-]){PART}(?:[ \t]*+\.[ \t]*+{PART}){{{MOST_PARTS},}}+")
_PLACE = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
# a number with a decimal comma: behind "=", or in a list with a zero behind the comma, which TOML takes for no number
_DECIMAL_COMMA = re.compile(r"(?:=[ \t]*|[\[,{ \t])([+-]?\d+),(0\d+)|=[ \t]*([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)")
_TWICE = "this key or table is given twice, or as a value and as a table"
# how the messages of tomllib begin, and what they mean
_MEANINGS = {
    "Cannot overwrite a value": _TWICE,
    "Cannot declare": _TWICE,
    "Cannot redefine namespace": _TWICE,
    "Cannot mutate immutable namespace": _TWICE,
    "Duplicate inline table key": _TWICE,
    "Expected ']": "a table heading without its closing bracket",
    "Expected '='": "a key without = and a value",
    "Expected newline": "more than one key with its value, or a value that TOML does not have",
    "Invalid statement": "neither a key nor a table nor a comment",
    "Invalid initial character for a key": "neither a key nor a table nor a comment",
    "Invalid value": "no value that TOML has (text needs quotes, a number digits on both sides of its point)",
    "Unclosed array": "a list without its closing bracket",
    "Unclosed inline table": "a table without its closing brace",
    "Unterminated string": "text without its closing quotes",
    "Expected": "text without its closing quotes",
    "Unescaped '\\' in a string": "a backslash in text, which is written twice or in single quotes",
    "Invalid hex value": "a backslash in text, which is written twice or in single quotes",
    "Escaped character": "a character that Unicode does not have",
    "Illegal character": "a character that text may not hold; quotes that are not closed have the same effect",
    "Found invalid character": "a character that a comment may not hold",
    "Invalid date or datetime": "a date or time that there is not",
}


def _meant(path: Path) -> str:
    """A question about the file that may be meant, where it exists."""
    with suppress(OSError, ValueError):  # of names that no file has
        return f", did you mean {path}?" if path.is_file() else ""
    return ""


def load_tables(path: Path) -> tuple[dict[str, Any], str]:
    """The tables of the file, and its text."""
    allowed = "a readable scene file in TOML"
    try:
        if path.exists() and not path.is_file():
            raise input_error(path, "", "not a file" + _meant(path / "scene.toml"), allowed)
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)  # some files do not tell their size
        if len(content) > LARGEST_FILE:
            raise input_error(path, "", f"larger than {LARGEST_FILE} bytes", allowed)
        text = content.decode("utf-8-sig")  # editors on Windows put a byte order mark in front
    except FileNotFoundError:
        raise input_error(path, "", "no such file" + _meant(Path(f"{path}.toml"))) from None
    except UnicodeDecodeError as error:
        raise input_error(path, "", f"not UTF-8 text (byte {error.start})", "TOML in UTF-8") from None
    except (OSError, ValueError) as error:
        reason = system_reason(error) if isinstance(error, OSError) else reason_of(error)
        raise input_error(path, "", f"cannot be read: {reason}", allowed) from None
    return parsed(path, text), text


def parsed(path: Path, text: str) -> dict[str, Any]:
    """The tables of a TOML text."""
    longest = _DOTTED.search(text)
    if longest is not None:
        raise _error(path, text, text.count("\n", 0, longest.start()) + 1, f"a key of more than {MOST_PARTS} parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise input_error(path, "", "not valid TOML: nested too deep", ALLOWED) from None
    except tomllib.TOMLDecodeError as error:
        message = str(error)
    except ValueError:
        raise input_error(path, "", "not valid TOML: a number of thousands of digits", ALLOWED) from None
    place = _PLACE.search(message)
    meaning = next((said for start, said in _MEANINGS.items() if message.startswith(start)), "")
    line = int(place[1]) if place and place[1] else text.count("\n") + (not text.endswith("\n"))
    raise _error(path, text, line, meaning)


def _error(path: Path, text: str, number: int, meaning: str) -> InputError:
    """The error with the number of the line and its text."""
    lines = text.split("\n")
    line = one_line(lines[number - 1]) if 0 < number <= len(lines) else ""
    if len(line) > _LONGEST_LINE:
        line = line[: _LONGEST_LINE - 3] + "..."
    if comma := _DECIMAL_COMMA.search(line.partition("#")[0]):
        whole, part = (group for group in comma.groups() if group is not None)
        meaning = f"write {whole}.{part}, TOML has decimal points"
    quoted = f" ({line})" if line else ""
    said = f": {meaning}" if meaning else ""
    return input_error(path, f"line {number}{quoted}", f"not valid TOML{said}", ALLOWED)


_DOTTED_KEY = rf"{PART}(?:[ \t]*\.[ \t]*{PART})*"
_HEADING = re.compile(rf"[ \t]*\[\[?[ \t]*({_DOTTED_KEY})[ \t]*\]")
_KEY = re.compile(rf"[ \t]*({_DOTTED_KEY})[ \t]*=")
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
    return ".".join(part.strip("\"'") for part in re.findall(PART, _INDEX.sub("", key)))


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
