"""Curves of a sweep in worker processes: `python benchmarks/parallel.py` from the project folder.

    python benchmarks/parallel.py                       # 8 and 32 curves of the default blade, 1 and 2 processes
    python benchmarks/parallel.py --curves 64 --jobs 1 2 4

Each run starts from the reduced model and solves all its curves. Seconds are those of the stage respond, start of the
processes and their imports included. Writes parallel.csv and parallel.md into out/bench/parallel.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from machine import hardware, load, today
from markdown_table import markdown_table
from results import write_results
from skipping import call, to_toml

HOUSE = Path(__file__).resolve().parents[1]
LOWEST, HIGHEST = -20e-6, 60e-6  # interferences, m: lift-off and slip


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    parser = argparse.ArgumentParser(description="Curves of a sweep in worker processes.")
    parser.add_argument("--curves", type=int, nargs="+", default=[8, 32])
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "dummy.toml")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "parallel", help="output folder")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        rows = measure(options.scene, options.curves, options.jobs, Path(folder))
    write_results(options.out, "parallel", rows, report(rows))
    return 0


def measure(scene_file: Path, curves: Sequence[int], jobs: Sequence[int], folder: Path) -> list[dict[str, Any]]:
    """A row for each number of curves and of processes; the speed-up is relative to the first number of processes."""
    scene = tomllib.loads(scene_file.read_text(encoding="utf-8"))
    scene.pop("render", None)
    rows: list[dict[str, Any]] = []
    for count in curves:
        scene["sweep"] = {"contact.interference": np.linspace(LOWEST, HIGHEST, count).round(12).tolist()}
        file = folder / f"{count}.toml"
        file.write_text(to_toml(scene), encoding="utf-8")
        model = folder / f"{count}"
        call(["-m", "pipeline", "run", str(file), "--out", str(model), "--until", "reduce", "--quiet"])
        for number in jobs:
            seconds, complete = _solved(file, model, folder / "run", number)
            first = rows[-1]["first"] if rows and rows[-1]["curves"] == count else seconds
            rows.append(
                {
                    "curves": count,
                    "processes": number,
                    "seconds": round(seconds, 2),
                    "a curve": round(seconds / count, 3),
                    "speed-up": round(first / seconds, 2),
                    "complete": complete,
                    "first": first,
                }
            )
            print(f"{count} curves, {number} processes: {seconds:.1f} s", file=sys.stderr)
    return [{name: value for name, value in row.items() if name != "first"} for row in rows]


def _solved(scene: Path, model: Path, out: Path, jobs: int) -> tuple[float, int]:
    """Seconds of the stage respond from a folder that holds the reduced model only, and complete curves."""
    shutil.copytree(model, out)
    call(
        ["-m", "pipeline", "run", str(scene), "--out", str(out), "--until", "respond", "--jobs", str(jobs), "--quiet"]
    )
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    shutil.rmtree(out)
    return summary["stages"]["respond"]["seconds"], sum(curve["complete"] for curve in summary["curves"])


def report(rows: Sequence[dict[str, Any]]) -> str:
    """The table in Markdown, with the machine."""
    table = markdown_table(tuple(rows[0]), [tuple(row.values()) for row in rows])
    where = f"{today()}, {hardware()}, load of the machine {load():.1f} at the end. Seconds of the stage respond."
    return f"# Curves of a sweep in worker processes\n\n{where}\n\n{table}\n"


if __name__ == "__main__":
    sys.exit(main())
