"""Reading of TOML with bounds, and its errors in plain words with the line they are on."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from pipeline.errors import InputError, input_error, one_line

MOST_PARTS = 50  # of a dotted key: tomllib takes the square of them
ALLOWED = "TOML 1.0"
_LONGEST_LINE = 60
_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DOTTED = re.compile(rf"(?<![A-Za-z0-9_.\"'-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS},}}+")
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
        meaning = f"a decimal comma; a number has a decimal point: {whole}.{part}"
    quoted = f" ({line})" if line else ""
    said = f": {meaning}" if meaning else ""
    return input_error(path, f"line {number}{quoted}", f"not valid TOML{said}", ALLOWED)
