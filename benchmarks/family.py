"""Time of a family of curves: `python benchmarks/family.py` from the project folder.

The sweep of `scenes/figure5.toml` and one interference more: 11 curves, one harmonic, one thread, kernels compiled
beforehand. The curves alone, and with all that the response does by default (Floquet exponents, detached branches,
the estimate of the harmonics left out). Writes family.csv and family.md into out/bench/family.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from machine import hardware, load, today
from markdown_table import markdown_table
from results import write_results

HOUSE = Path(__file__).resolve().parents[1]
INTERFERENCES = (-30e-6, -8e-6, -2e-6, 0.0, 1e-6, 2e-6, 3e-6, 5e-6, 15e-6, 100e-6, 400e-6)  # m
VARIANTS: dict[str, dict[str, Any]] = {
    "the curves alone": {"stability": "folds", "detached": False, "truncation": False},
    "as `shroud run` does": {"stability": "floquet", "detached": True, "truncation": True},
}


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    parser = argparse.ArgumentParser(description="Time of a family of curves.")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "figure5.toml")
    parser.add_argument("--interferences", type=float, nargs="+", default=list(INTERFERENCES), help="m")
    parser.add_argument("--repeats", type=int, default=5, help="of the whole family, the median counts")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "family", help="output folder")
    options = parser.parse_args(arguments)
    rows = measure(options.scene, options.interferences, options.repeats, options.out.parent / "store")
    table = markdown_table(tuple(rows[0]), [tuple(row.values()) for row in rows])
    where = f"{today()}, {hardware()}, one thread, load of the machine {load():.1f} at the end. {options.scene.name}."
    text = f"# A family of curves\n\n{where}\n\n{table}\n"
    write_results(options.out, "family", rows, text)
    return 0


def measure(scene_file: Path, interferences: list[float], repeats: int, store: Path) -> list[dict[str, Any]]:
    """A row for each variant; seconds are medians of the whole family, milliseconds of all its curves."""
    from work_precision.stages import kept_model, with_values

    from pipeline.scene.reading import read_scene

    scenes = [with_values(read_scene(scene_file).first, {"contact.interference": value}) for value in interferences]
    file = kept_model(store, scenes[0])
    rows = []
    for name, changes in VARIANTS.items():
        runs = [_family(file, scenes, changes) for _ in range(repeats + 1)][1:]  # the first compiles
        whole = [sum(seconds for _, seconds in run) for run in runs]
        points = sum(curve.points for curve, _ in runs[0])
        a_point = [1e3 * seconds / curve.points for run in runs for curve, seconds in run]
        rows.append(
            {
                "what": name,
                "curves": len(scenes),
                "complete": sum(curve.termination.complete for curve, _ in runs[0]),
                "points": points,
                "seconds": round(statistics.median(whole), 3),
                "least": round(min(whole), 3),
                "ms a point, median": round(statistics.median(a_point), 3),
            }
        )
    return rows


def _family(file: Path, scenes: list[Any], changes: dict[str, Any]) -> list[tuple[Any, float]]:
    """Each curve and its seconds."""
    from work_precision.curves import problem_on

    solved = []
    for scene in scenes:
        problem = problem_on(file, scene)
        problem = replace(problem, options=replace(problem.options, **changes))
        start = time.perf_counter()
        curve = problem.solve()
        solved.append((curve, time.perf_counter() - start))
    return solved


if __name__ == "__main__":
    sys.exit(main())
