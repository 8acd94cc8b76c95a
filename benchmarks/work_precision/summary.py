"""What the README says of speed and accuracy, from the tables of the benchmarks."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from markdown_table import markdown_table

from work_precision.curves import FREQUENCY, PEAK
from work_precision.figure import PRESET_LINE
from work_precision.tables import read_csv, shown_error

Line = tuple[str, str, str]
PROBLEMS = {
    "A": "the peers' problem with constant normal load",
    "V": "the peers' problem with variable normal load",
    "S": "a blade with nine contact nodes, 81 dofs",
}


def summary(tables: Path) -> str:
    """A table of what, command and figure, from what was measured into `tables`; what was not is left out."""
    makers = (_presets, _skipping, _commands, _family, _peers, _reduction, _parallel)
    lines = [line for maker in makers for line in maker(tables)]
    return markdown_table(("what", "command", "measured"), lines) + "\n"


def _rows(file: Path) -> list[dict[str, str]]:
    if not file.exists():
        return []
    with file.open(encoding="utf-8") as text:
        return list(csv.DictReader(text))


def _presets(tables: Path) -> Iterator[Line]:
    file = tables / "whole.csv"
    for row in read_csv(file).rows if file.exists() else ():
        if row.series == PRESET_LINE:
            amplitude, frequency = (shown_error(row.errors[name]) for name in (PEAK, FREQUENCY))
            what = f"four curves of the default blade from its geometry, `accuracy = {row.setting}`"
            yield what, "`make bench`", f"{row.seconds:.2g} s; error {amplitude}, of the frequency {frequency}"


def _skipping(tables: Path) -> Iterator[Line]:
    named = {
        "nothing": "the same again, nothing changed",
        "interference of one curve": "the same with another interference of one curve",
        "shroud angle": "the same with another shroud angle",
    }
    for row in _rows(tables / "skipping" / "skipping.csv"):
        name = row["change"]
        if name.startswith("nothing there yet"):
            name = "`shroud run` of the default scene, eight curves, from nothing (kernels compiled)"
        elif name not in named:
            continue
        yield named.get(name, name), "`python benchmarks/skipping.py`", f"{float(row['seconds']):.2g} s"


def _commands(tables: Path) -> Iterator[Line]:
    for row in _rows(tables / "skipping" / "commands.csv"):
        if row["command"] == "shroud --help":
            yield f"`{row['command']}`", "the same", f"{float(row['seconds']):.2g} s"


def _family(tables: Path) -> Iterator[Line]:
    for row in _rows(tables / "family" / "family.csv"):
        what = f"the {row['curves']} curves of figure 5, one thread, {row['points']} points: {row['what']}"
        figure = f"{float(row['seconds']):.2g} s; {float(row['ms a point, median']):.2g} ms a point"
        yield what, "`python benchmarks/family.py`", figure


def _peers(tables: Path) -> Iterator[Line]:
    file = tables / "peers" / "peers.json"
    if not file.exists():
        return
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    for row in found["rows"]:
        if row["program"] == "shroud" and row["variant"] == "exact" and row.get("faster"):
            what = f"a point of {PROBLEMS[row['case'][0]]}, H = {row['case'][1:]}"
            figure = f"{row['ms_a_point'][1]:.2g} ms, {row['faster'][1]:.0f} times faster than pyHarm"
            yield what, "`python benchmarks/peers.py`", figure


def _reduction(tables: Path) -> Iterator[Line]:
    for row in _rows(tables / "reduction" / "reduction.csv"):
        what = f"blade to reduced model with {row['modes']} modes, {row['dofs']} dofs"
        figure = f"{float(row['total']):.3g} s, {float(row['memory_gb']):.2g} GB"
        yield what, "`python benchmarks/reduction.py --full`", figure


def _parallel(tables: Path) -> Iterator[Line]:
    rows = [row for row in _rows(tables / "parallel" / "parallel.csv") if int(row["processes"]) > 1]
    for row in rows[-1:]:
        what = f"{row['curves']} curves in {row['processes']} processes on 2 cores"
        yield what, "`python benchmarks/parallel.py`", f"{float(row['speed-up']):.2g} times as fast as in one"
