"""Curves of a sweep in worker processes: `python benchmarks/parallel.py` from the project folder.

    python benchmarks/parallel.py                       # 8 and 16 curves of the default blade, 1 and 2 processes
    python benchmarks/parallel.py --curves 64 --jobs 1 2 4

Each run starts from the reduced model and solves all its curves. Seconds are those of the stage respond, start of the
processes and their imports included. Writes parallel.csv and parallel.md into out/bench/parallel.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from problems import scene_with
from tables import in_a_process, machine_line, options_of, table_of, write_results

from pipeline import Member, read_scene, run_scene

LOWEST, HIGHEST = -20e-6, 60e-6  # interferences, m: lift-off and slip


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, "parallel")
    parser.add_argument("--curves", type=int, nargs="+", default=[8, 16])
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    options = parser.parse_args(arguments)
    rows: list[dict[str, Any]] = []
    for count in options.curves:
        with tempfile.TemporaryDirectory() as folder:
            first: float | None = None  # seconds with the first number of processes
            for number in options.jobs:
                row = in_a_process("parallel", options.scene, count, number, folder)
                first = first or row["seconds"]
                rows.append(
                    {**row, "seconds": round(row["seconds"], 2), "speed-up": round(first / row["seconds"], 2)}
                )
                print(f"{count} curves, {number} processes: {row['seconds']:.1f} s", file=sys.stderr)
    title, where = "Curves of a sweep in worker processes", f"{machine_line()}. Seconds of the stage respond."
    write_results(options.out, "parallel", rows, f"# {title}\n\n{where}\n\n{table_of(rows)}\n")
    return 0


def measure(scene_file: str, count: int, jobs: int, folder: str) -> dict[str, Any]:
    """Seconds of the stage respond for so many curves and processes, from the reduced model that `folder` holds."""
    file = read_scene(scene_file)
    key = "contact.interference"
    swept = [{key: value} for value in np.linspace(LOWEST, HIGHEST, count)]
    members = tuple(Member(number, scene_with(file.first, values), values) for number, values in enumerate(swept))
    sweep = replace(file, members=members, swept=(key,))
    run_scene(sweep, Path(folder) / "model", until="reduce")
    out = Path(folder) / f"{jobs}"
    shutil.copytree(Path(folder) / "model", out)
    results = run_scene(sweep, out, until="respond", jobs=jobs)
    seconds = json.loads((out / "summary.json").read_text(encoding="utf-8"))["stages"]["respond"]["seconds"]
    complete = sum(curve.complete for curve in results.curves)
    row = {"curves": count, "processes": jobs, "seconds": seconds, "seconds a curve": round(seconds / count, 3)}
    return row | {"speed-up": 1.0, "complete": complete}


if __name__ == "__main__":
    sys.exit(main())
