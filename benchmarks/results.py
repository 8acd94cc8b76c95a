"""What a benchmark leaves: its rows as CSV, its table as Markdown."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def write_rows(file: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows of equal keys as CSV."""
    with file.open("w", newline="", encoding="utf-8") as target:
        writer = csv.DictWriter(target, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def write_results(out: Path, name: str, rows: Sequence[Mapping[str, Any]], text: str) -> None:
    """Write `name`.csv and `name`.md into the folder `out`, and print the Markdown."""
    out.mkdir(parents=True, exist_ok=True)
    write_rows(out / f"{name}.csv", rows)
    (out / f"{name}.md").write_text(text, encoding="utf-8")
    print(text)
