"""Text for the site from the program itself: short signatures, and the commands as typer describes them."""

from __future__ import annotations

import re
import subprocess
import sys

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
    text = re.sub(r"^Examples:\n((?:  .*\n)+)", _console, text, flags=re.MULTILINE)
    outside = re.split(r"(`[^`]*`)", text[text.index("## `shroud run`") :])
    return "".join(piece if piece.startswith("`") else piece.replace("<", "&lt;") for piece in outside)


def _console(found: re.Match[str]) -> str:
    """Examples as a block of commands."""
    lines = "".join(f"$ {line.strip()}\n" for line in found[1].splitlines())
    return f"```console\n{lines}```\n"
