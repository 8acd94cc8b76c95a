"""Time of a family of curves: `python benchmarks/family.py` from the project folder.

The sweep of `scenes/figure5.toml` and one interference more: 11 curves, one harmonic, one thread, kernels compiled
beforehand. The curves alone, and as `shroud run` solves them (with Floquet exponents, detached branches and the
truncation error). Writes family.csv and family.md into out/bench/family.
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path
from typing import Any

from problems import cached_model, curve_problem, scene_with
from tables import machine_line, options_of, table_of, write_results

INTERFERENCES = (-30e-6, -8e-6, -2e-6, 0.0, 1e-6, 2e-6, 3e-6, 5e-6, 15e-6, 100e-6, 400e-6)  # m
VARIANTS: dict[str, dict[str, Any]] = {
    "the curves alone": {"stability": "folds", "detached": False, "truncation": False},
    "as `shroud run` does": {"stability": "ring", "detached": True, "truncation": True},
}


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, "family", "figure5.toml")
    parser.add_argument("--interferences", type=float, nargs="+", default=list(INTERFERENCES), help="m")
    parser.add_argument("--repeats", type=int, default=5, help="of the whole family, the median counts")
    options = parser.parse_args(arguments)
    rows = measure(options.scene, options.interferences, options.repeats, options.out.parent / "store")
    where = f"{machine_line()}, one thread. {options.scene.name}."
    write_results(options.out, "family", rows, f"# A family of curves\n\n{where}\n\n{table_of(rows)}\n")
    return 0


def measure(scene_file: Path, interferences: list[float], repeats: int, store: Path) -> list[dict[str, Any]]:
    """A row for each variant; seconds are medians of the whole family, milliseconds of all its curves."""
    scenes = [scene_with(scene_file, {"contact.interference": value}) for value in interferences]
    model = cached_model(store, scenes[0])
    problems = [curve_problem(model, scene) for scene in scenes]
    rows = []
    for name, changes in VARIANTS.items():
        runs: list[list[tuple[Any, float]]] = []
        for _ in range(repeats + 1):
            runs.append([])
            for problem in problems:
                start = time.perf_counter()
                curve = problem.solve(**changes)
                runs[-1].append((curve, time.perf_counter() - start))
        del runs[0]  # compiles the kernels
        family = [sum(seconds for _, seconds in run) for run in runs]
        a_point = [1e3 * seconds / curve.points for run in runs for curve, seconds in run]
        row = {
            "what": name,
            "curves": len(scenes),
            "complete": sum(curve.termination.complete for curve, _ in runs[0]),
            "points": sum(curve.points for curve, _ in runs[0]),
            "seconds": round(statistics.median(family), 3),
            "least seconds": round(min(family), 3),
            "ms a point, median": round(statistics.median(a_point), 3),
        }
        rows.append(row)
    return rows


if __name__ == "__main__":
    sys.exit(main())
