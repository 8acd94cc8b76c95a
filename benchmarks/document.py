"""docs/developers/performance.md: blocks of the benchmarks between its markers, everything else written by people."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from work_precision.figure import save_figure
from work_precision.study import markdown, read_csv

WITH_TABLE = ("whole",)  # of the other studies the page shows the picture
ON_PAGE = ("run_times",)  # the other reports are files of benchmarks/measured
SECTIONS = {"scaling": ("Where it stops being practical, and what to do then",)}  # of a long report
_BLOCK = re.compile(r"(<!-- bench: (?P<name>\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def update_document(target: Path, tables: Path, studies: Sequence[str], reports: Sequence[str]) -> list[Path]:
    """Replace the blocks of the document by what `tables` holds; returns the files written.

    A study NAME has NAME.csv, which is kept in benchmarks/measured, another benchmark NAME/page.md or NAME/NAME.md,
    which is kept there too, or is on the page with its headings a level lower. What was not measured keeps its block;
    what has no block yet gets one at the end.
    """
    text = target.read_text(encoding="utf-8") if target.exists() else "# Performance\n"
    docs = target.parent.parent
    images, kept = docs / "images", docs.parent / "benchmarks" / "measured"
    written = [target]
    for name in studies:
        if (tables / f"{name}.csv").exists():
            study = read_csv(tables / f"{name}.csv")
            for folder in (images, kept):
                folder.mkdir(parents=True, exist_ok=True)
            picture = images / f"bench_{name}.png"
            save_figure(study, picture)
            shutil.copyfile(tables / f"{name}.csv", kept / f"{name}.csv")
            written += [picture, kept / f"{name}.csv"]
            head = f"## {study.title}\n\n![{study.title}](../images/{picture.name})"
            numbers = f"What was measured, against what, and the numbers: `benchmarks/measured/{name}.csv`."
            said = markdown(study) if name in WITH_TABLE else numbers
            text = with_block(text, name, f"{head}\n\n{said}\n")
    for name in reports:
        found = [path for path in (tables / name / "page.md", tables / name / f"{name}.md") if path.exists()]
        if found:
            report = _shortened(found[0].read_text(encoding="utf-8"), SECTIONS.get(name))
            if name in ON_PAGE:
                text = with_block(text, name, re.sub(r"^#", "##", report, flags=re.MULTILINE))
            else:
                kept.mkdir(parents=True, exist_ok=True)
                (kept / f"{name}.md").write_text(report, encoding="utf-8")
                written.append(kept / f"{name}.md")
    target.write_text(text, encoding="utf-8")
    return written


def _shortened(report: str, sections: Sequence[str] | None) -> str:
    """The head of a report and these of its sections; None: the whole."""
    if sections is None:
        return report
    head, *parts = report.split("\n## ")
    return "\n## ".join([head, *(part for part in parts if part.partition("\n")[0] in sections)]).rstrip() + "\n"


def with_block(text: str, name: str, content: str) -> str:
    """The document with the content of the block `name` replaced, or with that block at its end."""
    if any(found["name"] == name for found in _BLOCK.finditer(text)):
        return _BLOCK.sub(lambda found: found[1] + content + found[3] if found["name"] == name else found[0], text)
    return f"{text.rstrip()}\n\n<!-- bench: {name} -->\n{content}<!-- end -->\n"
