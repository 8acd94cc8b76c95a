"""Time and memory against contact nodes and harmonics, with fitted exponents: `python benchmarks/scaling.py`.

    python benchmarks/scaling.py                # 9 to 100 nodes a face, 1 to 15 harmonics, some minutes
    python benchmarks/scaling.py --full         # to 225 nodes and 31 harmonics
    python benchmarks/scaling.py --grids 3 5 --harmonics 1 3

A slipping contact of the default blade around its peak. Each row is measured in a process of its own, so that its
largest memory is its own. Writes scaling.csv and scaling.md into out/bench/scaling. The
fitted power laws also say where each size stops being practical, for dofs of the mesh and curves of a sweep too where
out/bench holds the tables of reduction.py and parallel.py.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from problems import built_mesh, curve_problem, scene_with
from tables import in_a_process, machine_facts, markdown_table, options_of, peak_memory_gb, table_of, write_results

GRIDS, MORE_GRIDS = (3, 4, 5, 7, 10), (12, 15)  # contact nodes along each side of a face
HARMONICS, MORE_HARMONICS = (1, 2, 3, 5, 7, 11, 15), (21, 31)
INTERFERENCE, RANGE = 5e-6, (400.0, 418.0)  # m, Hz: slip without lift-off, the peak of the default blade
NODES, H, MODEL, POINT, MEMORY = "contact nodes", "harmonics", "model s", "ms a point", "memory GB"
FITTED = {NODES: (MODEL, POINT, MEMORY), H: (POINT,)}  # size -> what depends on it
FLAT = 0.1  # exponents below it are noise
TEN_MINUTES, MEMORY_LIMIT = ("10 minutes", 600.0), ("24 GB", 24.0)
POINTS_A_MINUTE = ("100 points a minute", 600.0)  # ms a point
REMEDIES = {
    "dofs": "a coarser mesh: 20-node elements with `mesh.grading` are right to 0.05 % with 8000 dofs; "
    "`shroud verify` says it",
    NODES: "a coarser `mesh.contact_grid`",
    H: '`harmonics = "auto"` with the tolerance that is needed; a `tolerance` of 5 % rarely takes more than 9',
    "curves": "`--jobs` on a machine with more cores; in several evenings: the same command goes on where it was",
}
Rows = Sequence[dict[str, Any]]


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    parser = options_of(__doc__, "scaling")
    parser.add_argument("--grids", type=int, nargs="+", default=list(GRIDS), help="contact nodes along a side")
    parser.add_argument("--harmonics", type=int, nargs="+", default=list(HARMONICS), help="harmonics, first grid")
    parser.add_argument("--full", action="store_true", help=f"also grids {MORE_GRIDS} and harmonics {MORE_HARMONICS}")
    options = parser.parse_args(arguments)
    grids = [*options.grids, *(MORE_GRIDS if options.full else ())]
    harmonics = [*options.harmonics, *(MORE_HARMONICS if options.full else ())]
    cases = [*((grid, 1) for grid in grids), *((grids[0], number) for number in harmonics)]
    rows = []
    for grid, number in cases:
        rows.append(in_a_process("scaling", options.scene, grid, number))
        print(f"{grid * grid} nodes, H = {number}: {rows[-1][POINT]:.3g} ms a point", file=sys.stderr)
    by_nodes, by_harmonics = rows[: len(grids)], rows[len(grids) :]
    write_results(options.out, "scaling", rows, report(by_nodes, by_harmonics, options.out.parent))
    return 0


def measure(scene_file: str, grid: int, harmonics: int) -> dict[str, Any]:
    """Seconds to the reduced model, milliseconds a point, and largest memory (GB) of this process."""
    from rom.linear_algebra.threads import one_blas_thread

    scene = scene_with(scene_file, {"contact.interference": INTERFERENCE, "mesh.contact_grid": (grid, grid)})
    with one_blas_thread():
        with built_mesh(scene) as mesh:
            made = mesh.reduced()
            problem = curve_problem(made.file, scene)
        problem.solve(frequency_hz=(RANGE[0], RANGE[0] + 0.5))  # compiles the kernels
        start = time.perf_counter()
        curve = problem.solve(frequency_hz=RANGE, harmonics=harmonics)
        seconds = time.perf_counter() - start
    return {
        NODES: grid * grid,
        H: harmonics,
        "reduced dofs": int(made.facts["reduced_dofs"]),
        MODEL: round(mesh.seconds + made.seconds, 3),
        "points": curve.points,
        POINT: round(1e3 * seconds / max(curve.points, 1), 3),
        MEMORY: round(peak_memory_gb(), 3),
    }


def power_law(sizes: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Factor and exponent of values = factor size^exponent by least squares, over the larger half of the sizes."""
    import numpy as np

    first = (len(sizes) - 1) // 2 if len(sizes) > 2 else 0
    if len(sizes) - first < 2:
        return math.nan, math.nan
    exponent, logarithm = np.polyfit(np.log(sizes[first:]), np.log(values[first:]), 1)
    return float(np.exp(logarithm)), float(exponent)


def fitted(rows: Rows, size: str, column: str) -> tuple[float, float]:
    """Factor and exponent of a column of a table against another."""
    return power_law([float(row[size]) for row in rows], [float(row[column]) for row in rows])


def report(by_nodes: Rows, by_harmonics: Rows, bench: Path) -> str:
    """The tables in Markdown, with the exponents and the machine."""
    parts = ["# Time and memory against sizes"]
    parts.append("; ".join(f"{name}: {text}" for name, text in machine_facts().items()) + ".")
    for rows, size in ((by_nodes, NODES), (by_harmonics, H)):
        exponents = ", ".join(f"{name}: {fitted(rows, size, name)[1]:.2f}" for name in FITTED[size])
        parts += [f"## Against {size}", table_of(rows), f"Exponents over the larger half: {exponents}."]
    parts.append("## Where it stops being practical, and what to do then")
    parts.append(
        "By the fitted laws, for two cores and 24 GB. Beyond what was measured it is extrapolated "
        "(a grid has 225 nodes at most)."
    )
    head = ("growing", "what it costs", "measured to", "exponent", "practical", "reached at", "then")
    parts.append(markdown_table(head, limits(by_nodes, by_harmonics, bench)))
    return "\n\n".join(parts) + "\n"


def limits(by_nodes: Rows, by_harmonics: Rows, bench: Path) -> Iterator[tuple[str, ...]]:
    """Where each cost reaches what is practical; dofs and curves where their tables are in the folder `bench`."""
    dofs, curves = (_read(bench / name / f"{name}.csv") for name in ("reduction", "parallel"))
    jobs = max((int(row["processes"]) for row in curves), default=0)
    curves = [row for row in curves if int(row["processes"]) == jobs]
    for rows, size, column, cost, (practical, most) in (
        (dofs, "dofs", "total s", "seconds to the reduced model", TEN_MINUTES),
        (dofs, "dofs", "memory_gb", "memory, GB", MEMORY_LIMIT),
        (by_nodes, NODES, MODEL, "seconds to the reduced model", TEN_MINUTES),
        (by_nodes, NODES, MEMORY, "memory, GB", MEMORY_LIMIT),
        (by_nodes, NODES, POINT, "ms a point, H = 1", POINTS_A_MINUTE),
        (by_harmonics, H, POINT, f"ms a point, {by_harmonics[0][NODES]} nodes", POINTS_A_MINUTE),
        (curves, "curves", "seconds", f"seconds in {jobs} processes", TEN_MINUTES),
    ):
        if len(rows) < 2:
            continue
        factor, exponent = fitted(rows, size, column)
        reached = "not in sight"
        if exponent >= FLAT:
            rounded = float(f"{(most / factor) ** (1.0 / exponent):.2g}")
            reached = f"{rounded:,.0f} {size}".replace(",", " ")
        largest = f"{max(float(row[size]) for row in rows):.0f}"
        yield size, cost, largest, f"{exponent:.2f}", practical, reached, REMEDIES[size]


def _read(file: Path) -> list[dict[str, str]]:
    if not file.exists():
        return []
    with file.open(encoding="utf-8") as source:
        return list(csv.DictReader(source))


if __name__ == "__main__":
    sys.exit(main())
