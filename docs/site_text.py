"""Text for the site from the program itself: short signatures, and the commands as typer describes them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
LONG, WORDS = 7, 1500  # sections, or words, of a page that has a list of its sections
_ARRAY = re.compile(r"(?:ndarray\[tuple\[(?:Any|int), \.\.\.\], dtype\[(\w+)\]\]|NDArray\[(?:np\.)?(\w+)\])")
# what autodoc makes of numpy.typing.ArrayLike
_ARRAY_LIKE = re.compile(r"(?:\w+\.)*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]")
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
    """A signature with `Array` for a NumPy array of floats, `ArrayLike`, and names without modules."""
    if text is None:
        return None
    text = re.sub(r"~?\b(?:numpy|typing|collections\.abc)\.", "", text.replace("~", ""))
    text = _ARRAY_LIKE.sub("ArrayLike", text).replace("<factory>", "...")
    text = re.sub(r"\b_(?=[A-Z]\w)", "", text)  # a protocol of our own, named as what obeys it
    text = _ARRAY.sub(lambda match: _NAMES.get(match[1] or match[2], "Array"), text)
    return re.sub(r"\b(?:\w+\.)+(?=[A-Z])", "", text)


def with_contents(page: str) -> str:
    """A page with a list of its sections below the title, where it has many; Furo's own needs a wide window."""
    title, _, rest = page.partition("\n")
    sections = re.findall(r"^## ", re.sub(r"^```.*?^```", "", rest, flags=re.DOTALL | re.MULTILINE), re.MULTILINE)
    if len(sections) < LONG and len(rest.split()) < WORDS:
        return page
    kept = "this-will-duplicate-information-and-it-is-still-useful-here"  # Furo's word for: yes, a list on the page
    return f"{title}\n\n```{{contents}}\n:local:\n:depth: 1\n:class: {kept}\n```\n{rest}"


def examples_text() -> str:
    """Every script of examples/ with its idea as heading and text, its code, and its picture if it draws one."""
    parts = []
    for script in sorted((DOCS.parent / "examples").glob("*.py")):
        said, _, code = script.read_text(encoding="utf-8").removeprefix('"""').partition('"""\n')
        title, _, text = said.partition("\n")
        parts.append(
            f"## {title.rstrip('.')}\n\n{text.strip()}\n\n`examples/{script.name}`\n\n```python\n{code.strip()}\n```"
        )
        if (DOCS / "images" / "examples" / f"{script.stem}.png").is_file():
            parts.append(f"![{title.rstrip('.')}](images/examples/{script.stem}.png)")
    return "\n\n".join(parts)


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
