"""A study of run time against error: settings with their seconds and errors, as CSV and as a table in Markdown."""

from __future__ import annotations

import csv
import json
import math
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from tables import markdown_table

REPEATS = 3
SHORT = 1.5  # seconds; work that takes longer is timed once
Result = TypeVar("Result")


@dataclass(frozen=True)
class Measured:
    """One setting.

    Attributes
    ----------
    series : str
        Line of the figure that the setting belongs to.
    setting : str
        What was set.
    seconds : float
        Median of the wall seconds.
    errors : mapping
        Name of a quantity -> relative error, inf where nothing was found.
    counts : mapping
        Column -> whole number that tells the size of the problem, such as degrees of freedom.
    note : str
        What went otherwise than asked for, empty where nothing did.
    """

    series: str
    setting: str
    seconds: float
    errors: Mapping[str, float]
    counts: Mapping[str, int] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class Study:
    """A finished study.

    Attributes
    ----------
    name, title : str
        Name of its files, and heading.
    about, reference : str
        What was varied and timed; what the errors are relative to, and how sure that is.
    uncertainty : mapping
        Quantity -> relative uncertainty of its reference; smaller errors cannot be resolved.
    rows : tuple of Measured
        The settings.
    facts : mapping
        Name -> text about the machine.
    """

    name: str
    title: str
    about: str
    reference: str
    uncertainty: Mapping[str, float]
    rows: tuple[Measured, ...]
    facts: Mapping[str, str] = field(default_factory=dict)

    def series(self) -> dict[str, list[Measured]]:
        """Rows by line of the figure, in their order."""
        lines: dict[str, list[Measured]] = {}
        for row in self.rows:
            lines.setdefault(row.series, []).append(row)
        return lines

    def count_columns(self) -> list[str]:
        """Names of the counts of any row, in the order of their first appearance."""
        return list(dict.fromkeys(name for row in self.rows for name in row.counts))


def announced(row: Measured) -> Measured:
    """The row, after a line about it on standard error: a study takes minutes."""
    print(f"  {row.series}, {row.setting}: {row.seconds:.3g} s", file=sys.stderr, flush=True)
    return row


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What `work` returned at first, and its median wall seconds. Kernels are compiled before."""

    def once() -> tuple[Result, float]:
        start = time.perf_counter()
        result = work()
        return result, time.perf_counter() - start

    return median_of(once)


def median_of(work: Callable[[], tuple[Result, float]]) -> tuple[Result, float]:
    """The same for work that returns its own seconds beside its result."""
    result, first = work()
    seconds = [first]
    while first < SHORT and len(seconds) < REPEATS:
        seconds.append(work()[1])
    return result, statistics.median(seconds)


def relative_error(found: float, reference: float) -> float:
    """abs(found / reference - 1); inf where nothing was found."""
    return abs(found / reference - 1.0) if math.isfinite(found) else math.inf


def pareto_front(rows: tuple[Measured, ...], quantity: str) -> list[Measured]:
    """The rows that no other beats in both seconds and error, from the fastest on."""
    front: list[Measured] = []
    for row in sorted(rows, key=lambda one: (one.seconds, one.errors[quantity])):
        error = row.errors[quantity]
        if math.isfinite(error) and (not front or error < front[-1].errors[quantity]):
            front.append(row)
    return front


def fastest_within(study: Study, quantity: str, tolerance: float) -> Measured | None:
    """The fastest row whose error and the uncertainty of the reference stay within `tolerance` together, or None."""
    within = [row for row in study.rows if row.errors[quantity] + study.uncertainty[quantity] <= tolerance]
    return min(within, key=lambda row: row.seconds, default=None)


def write_csv(path: Path, study: Study) -> None:
    """Columns series, setting, seconds, counts, `error: NAME`, note; before them lines `# key: value`."""
    counts = study.count_columns()
    head = {"name": study.name, "title": study.title, "about": study.about, "reference": study.reference}
    with path.open("w", newline="", encoding="utf-8") as file:
        for key, value in (head | {"uncertainty": study.uncertainty, "facts": study.facts}).items():
            file.write(f"# {key}: {json.dumps(value, ensure_ascii=False)}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            ["series", "setting", "seconds", *counts, *(f"error: {q}" for q in study.uncertainty), "note"]
        )
        for row in study.rows:
            sizes = [row.counts.get(name, "") for name in counts]
            errors = [repr(row.errors[quantity]) for quantity in study.uncertainty]
            writer.writerow([row.series, row.setting, f"{row.seconds:.6g}", *sizes, *errors, row.note])


def read_csv(path: Path) -> Study:
    """The study of a file of `write_csv`."""
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    head = {key: json.loads(value) for key, _, value in (line[2:].partition(": ") for line in comments)}
    rows = []
    for record in csv.DictReader(line for line in lines if not line.startswith("# ")):
        series, setting, seconds, note = (record.pop(name) for name in ("series", "setting", "seconds", "note"))
        errors = {quantity: float(record.pop(f"error: {quantity}")) for quantity in head["uncertainty"]}
        counts = {name: int(value) for name, value in record.items() if value}
        rows.append(Measured(series, setting, float(seconds), errors, counts, note))
    return Study(rows=tuple(rows), **head)


def markdown(study: Study) -> str:
    """What was measured, against what, and the table; without a heading."""
    counts, quantities = study.count_columns(), list(study.uncertainty)
    notes = ["note"] if any(row.note for row in study.rows) else []
    body = []
    for row in study.rows:
        sizes = [row.counts.get(name, "") for name in counts]
        errors = [shown_error(row.errors[quantity]) for quantity in quantities]
        body.append([row.series, row.setting, *sizes, f"{row.seconds:.3g}", *errors, *(row.note for _ in notes)])
    unsure = [shown_error(value) for value in study.uncertainty.values()]
    body.append(["", "*uncertainty of the reference*", *("" for _ in counts), "", *unsure, *("" for _ in notes)])
    table = markdown_table(["", "setting", *counts, "s", *quantities, *notes], body)
    where = "; ".join(f"{name}: {text}" for name, text in study.facts.items())
    return f"{study.about}\n\n{study.reference}\n\n{table}\n\n{where}."


def shown_error(error: float) -> str:
    """A relative error in per cent, or as a power of ten below 1e-5."""
    if not math.isfinite(error):
        return "-"
    return f"{100.0 * error:.2g} %" if error >= 1e-5 else f"{error:.0e}"
