"""A study as CSV, from which figures and documents are made again, and as Markdown for people."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

from markdown_table import markdown_table

from work_precision.study import Measured, Quantity, Study

_HEAD, _TAIL = ("series", "setting", "seconds"), "note"


def write_csv(path: Path, study: Study) -> None:
    """Columns series, setting, seconds, counts, `error: NAME`, note; before them lines `# key: value` about them."""
    counts = count_columns(study)
    quantities = {quantity.name: quantity.uncertainty for quantity in study.quantities}
    head = {"name": study.name, "title": study.title, "about": study.about, "reference": study.reference}
    with path.open("w", newline="", encoding="utf-8") as file:
        for key, value in (head | {"uncertainty": quantities, "facts": dict(study.facts)}).items():
            file.write(f"# {key}: {json.dumps(value, ensure_ascii=False)}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*_HEAD, *counts, *(f"error: {name}" for name in quantities), _TAIL])
        for row in study.rows:
            errors = [repr(row.errors[name]) for name in quantities]
            sizes = [row.counts.get(name, "") for name in counts]
            writer.writerow([row.series, row.setting, f"{row.seconds:.6g}", *sizes, *errors, row.note])


def read_csv(path: Path) -> Study:
    """The study of a file of `write_csv`.

    Raises
    ------
    OSError, ValueError, KeyError : it cannot be read, or is not such a file.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    head = {key: json.loads(value) for key, _, value in (line[2:].partition(": ") for line in comments)}
    rows = []
    for record in csv.DictReader(line for line in lines if not line.startswith("# ")):
        errors = {name: float(record[f"error: {name}"]) for name in head["uncertainty"]}
        known = {*_HEAD, _TAIL, *(f"error: {name}" for name in errors)}
        counts = {name: int(value) for name, value in record.items() if name not in known and value}
        rows.append(
            Measured(record["series"], record["setting"], float(record["seconds"]), errors, counts, record[_TAIL])
        )
    quantities = tuple(Quantity(name, value) for name, value in head["uncertainty"].items())
    words = (head[key] for key in ("name", "title", "about", "reference"))
    return Study(*words, quantities, tuple(rows), head["facts"])


def count_columns(study: Study) -> list[str]:
    """Names of the counts of any row, in the order of their first appearance."""
    return list(dict.fromkeys(name for row in study.rows for name in row.counts))


def markdown(study: Study) -> str:
    """What was measured, against what, and the table; without a heading."""
    counts = count_columns(study)
    notes = [_TAIL] if any(row.note for row in study.rows) else []
    header = ["", "setting", *counts, "s", *(quantity.name for quantity in study.quantities), *notes]
    body = []
    for row in study.rows:
        sizes = [row.counts.get(name, "") for name in counts]
        errors = [shown_error(row.errors[quantity.name]) for quantity in study.quantities]
        body.append([row.series, row.setting, *sizes, f"{row.seconds:.3g}", *errors, *([row.note] if notes else [])])
    unsure = ["", "*uncertainty of the reference*", *("" for _ in counts), ""]
    body.append(
        [*unsure, *(shown_error(quantity.uncertainty) for quantity in study.quantities), *("" for _ in notes)]
    )
    where = "; ".join(f"{name}: {text}" for name, text in study.facts.items())
    return f"{study.about}\n\n{study.reference}\n\n{markdown_table(header, body)}\n\n{where}."


def shown_error(error: float) -> str:
    """A relative error in per cent, or as a power of ten where that would be zeros only."""
    if not math.isfinite(error):
        return "-"
    return f"{100.0 * error:.2g} %" if error >= 1e-5 else f"{error:.0e}"
