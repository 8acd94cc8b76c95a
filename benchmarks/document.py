"""docs/developers/performance.md: tables of the benchmarks between its markers, everything else written by people."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from work_precision.figure import save_figure
from work_precision.study import markdown, read_csv

_BLOCK = re.compile(r"(<!-- bench: (?P<name>\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def update_document(target: Path, tables: Path, studies: Sequence[str], reports: Sequence[str]) -> list[Path]:
    """Replace the blocks of the document by what `tables` holds; returns the files written.

    A study NAME has NAME.csv, another benchmark NAME/NAME.md, whose headings go a level lower. What was not measured
    keeps its block; what has no block yet gets one at the end.
    """
    text = target.read_text(encoding="utf-8") if target.exists() else "# Performance\n"
    written = [target]
    for name in studies:
        if (tables / f"{name}.csv").exists():
            study = read_csv(tables / f"{name}.csv")
            picture = target.parent.parent / "images" / f"bench_{name}.png"
            picture.parent.mkdir(parents=True, exist_ok=True)
            save_figure(study, picture)
            written.append(picture)
            head = f"## {study.title}\n\n![{study.title}](../images/{picture.name})"
            text = with_block(text, name, f"{head}\n\n{markdown(study)}\n")
    for name in reports:
        report = tables / name / f"{name}.md"
        if report.exists():
            text = with_block(text, name, re.sub(r"^#", "##", report.read_text(encoding="utf-8"), flags=re.MULTILINE))
    target.write_text(text, encoding="utf-8")
    return written


def with_block(text: str, name: str, content: str) -> str:
    """The document with the content of the block `name` replaced, or with that block at its end."""
    if any(found["name"] == name for found in _BLOCK.finditer(text)):
        return _BLOCK.sub(lambda found: found[1] + content + found[3] if found["name"] == name else found[0], text)
    return f"{text.rstrip()}\n\n<!-- bench: {name} -->\n{content}<!-- end -->\n"
