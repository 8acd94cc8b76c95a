"""Time and memory against contact nodes and harmonics, with fitted exponents: `python benchmarks/scaling.py`.

    python benchmarks/scaling.py                # 9 to 100 nodes a face, 1 to 15 harmonics, some minutes
    python benchmarks/scaling.py --full         # to 225 nodes and 31 harmonics
    python benchmarks/scaling.py --grids 3 5 --harmonics 1 3

A slipping contact of the default blade around its peak. Each row is measured in a process of its own, so that its
largest memory is its own. Writes scaling.csv, scaling.md and the figure scaling into out/bench/scaling. With them
goes where each size stops being practical, dofs of the mesh and curves of a sweep too where reduction.py and
parallel.py have measured them before.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from results import write_results
from scaling_limits import measured_limits
from scaling_report import MS_A_POINT, NODES, H, draw, report

HOUSE = Path(__file__).resolve().parents[1]
GRIDS, MORE_GRIDS = (3, 4, 5, 7, 10), (12, 15)  # contact nodes along each side of a face
HARMONICS, MORE_HARMONICS = (1, 2, 3, 5, 7, 11, 15), (21, 31)
INTERFERENCE, RANGE = 5e-6, (400.0, 418.0)  # m, Hz: slip without lift-off, the peak of the default blade


def main(arguments: list[str] | None = None) -> int:
    """Measure and write tables and figure; the exit status."""
    options = _parser().parse_args(arguments)
    if options.measure is not None:
        print(json.dumps(measure(options.scene, *options.measure)))
        return 0
    grids = [*options.grids, *(MORE_GRIDS if options.full else ())]
    harmonics = [*options.harmonics, *(MORE_HARMONICS if options.full else ())]
    by_nodes = [_in_a_process(options.scene, grid, 1) for grid in grids]
    by_harmonics = [_in_a_process(options.scene, grids[0], number) for number in harmonics]
    limits = measured_limits(options.out.parent, by_nodes, by_harmonics)
    write_results(options.out, "scaling", [*by_nodes, *by_harmonics], report(by_nodes, by_harmonics, limits))
    draw(options.out, by_nodes, by_harmonics)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Time and memory against contact nodes and harmonics.")
    parser.add_argument(
        "--grids", type=int, nargs="+", default=list(GRIDS), help="contact nodes along a side of a face"
    )
    parser.add_argument("--harmonics", type=int, nargs="+", default=list(HARMONICS), help="harmonics, first grid")
    parser.add_argument("--full", action="store_true", help=f"also grids {MORE_GRIDS} and harmonics {MORE_HARMONICS}")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "dummy.toml", help="whose blade to use")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "scaling", help="output folder")
    parser.add_argument("--measure", type=int, nargs=2, help=argparse.SUPPRESS)
    return parser


def _in_a_process(scene: Path, grid: int, harmonics: int) -> dict[str, Any]:
    command = [sys.executable, str(Path(__file__)), "--scene", str(scene), "--measure", str(grid), str(harmonics)]
    done = subprocess.run(command, cwd=HOUSE, check=True, capture_output=True, text=True)
    row: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    print(f"{row[NODES]} nodes, H = {row[H]}: {row[MS_A_POINT]:.3g} ms a point", file=sys.stderr)
    return row


def measure(scene_file: Path, grid: int, harmonics: int) -> dict[str, Any]:
    """Seconds to the reduced model, milliseconds a point, and largest memory (GB) of this process."""
    from threadpoolctl import threadpool_limits
    from work_precision.curves import problem_on
    from work_precision.stages import built_mesh, with_values

    from pipeline.scene.reading import read_scene

    scene = read_scene(scene_file).first
    values = {"contact.interference": INTERFERENCE, "mesh.contact_grid": (grid, grid)}
    scene = with_values(scene, values)
    with threadpool_limits(limits=1):
        with built_mesh(scene) as mesh:
            made = mesh.reduced({})
            problem = problem_on(made.file, scene)
        problem.solve(frequency=(RANGE[0], RANGE[0] + 0.5))  # compiles the kernels
        start = time.perf_counter()
        curve = problem.solve(frequency=RANGE, harmonics=harmonics)
        seconds = time.perf_counter() - start
    return {
        NODES: grid * grid,
        H: harmonics,
        "reduced dofs": int(made.facts["reduced_dofs"]),
        "model s": round(mesh.seconds + made.seconds, 3),
        "points": curve.points,
        MS_A_POINT: round(1e3 * seconds / max(curve.points, 1), 3),
        "memory GB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 3),
    }


if __name__ == "__main__":
    sys.exit(main())
