"""docs/performance.md: what stands between its markers comes from the tables, what stands outside from people."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from work_precision.figure import save_picture
from work_precision.study import Study
from work_precision.tables import markdown, read_csv

NAME = "performance.md"
_BLOCK = re.compile(r"(<!-- bench: (?P<name>\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def update_document(
    docs: Path, tables: Path, names: Sequence[str], reports: Mapping[str, Path] = MappingProxyType({})
) -> list[Path]:
    """Put the tables and pictures of the studies into the document; a study without a block gets one at its end.

    reports : name -> Markdown of other benchmarks, taken over as it is, its headings a level lower. What was not
    measured keeps what stands there. Returns the files written.

    Raises
    ------
    OSError, ValueError, KeyError : a file cannot be read or is not what it should be.
    """
    target = docs / NAME
    text = target.read_text(encoding="utf-8") if target.exists() else _HEAD
    written = [target]
    for name in names:
        file = tables / f"{name}.csv"
        if not file.exists():
            continue
        picture = docs / "images" / f"bench_{name}.png"
        picture.parent.mkdir(parents=True, exist_ok=True)
        study = read_csv(file)
        save_picture(study, picture)
        written.append(picture)
        text = with_block(text, name, block(study, f"images/{picture.name}"))
    for name, file in reports.items():
        if file.exists():
            text = with_block(text, name, lowered(file.read_text(encoding="utf-8")))
    target.write_text(text, encoding="utf-8")
    return written


def lowered(report: str) -> str:
    """Markdown with its headings a level lower."""
    return re.sub(r"^#", "##", report, flags=re.MULTILINE)


def block(study: Study, picture: str) -> str:
    """Heading, text, picture and table of a study."""
    return f"## {study.title}\n\n![{study.title}]({picture})\n\n{markdown(study)}\n"


def with_block(text: str, name: str, content: str) -> str:
    """The document with the content of the block `name` replaced, or with that block at its end."""
    if any(found["name"] == name for found in _BLOCK.finditer(text)):
        return _BLOCK.sub(lambda found: found[1] + content + found[3] if found["name"] == name else found[0], text)
    return f"{text.rstrip()}\n\n<!-- bench: {name} -->\n{content}<!-- end -->\n"


_HEAD = "# Performance\n"
