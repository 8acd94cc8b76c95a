"""Time and memory from the blade to its reduced model, phase by phase: `python benchmarks/reduction.py`.

    python benchmarks/reduction.py                      # 24 000 to 160 000 dofs, a minute
    python benchmarks/reduction.py --full               # 485 000 dofs too, three minutes and 7 GB
    python benchmarks/reduction.py --sizes 4 2 --modes 20 40 80
    python benchmarks/reduction.py --backend superlu

Each mesh size is reduced in a process of its own, so that its largest memory is its own. Writes reduction.csv and
reduction.md into out/bench/reduction.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import machine
from markdown_table import markdown_table
from results import write_results

HOUSE = Path(__file__).resolve().parents[1]
SIZES, LARGEST = (4.0, 2.8, 1.9), 1.17  # mm
PHASES = ("mesh", "assembly", "ordering", "factorisation", "constraint modes", "fixed-interface modes", "projection")


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    options = _parser().parse_args(arguments)
    if options.measure is not None:
        print(json.dumps(measure(options.scene, *options.measure, options.backend)))
        return 0
    sizes = [*options.sizes, LARGEST] if options.full else options.sizes
    rows = []
    for size in sizes:
        for modes in options.modes:
            row = _in_a_process(options.scene, size, modes, options.backend)
            rows.append(row)
            print(f"{size:g} mm, {row['dofs']} dofs, {modes} modes: {row['total']:.1f} s, {row['memory_gb']:.1f} GB")
    write_results(options.out, "reduction", rows, report(rows))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Time and memory from the blade to its reduced model.")
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES), help="mesh sizes, mm")
    parser.add_argument("--modes", type=int, nargs="+", default=[40], help="fixed-interface modes kept")
    parser.add_argument("--backend", default="auto", choices=("auto", "cholmod", "superlu"), help="what factorises")
    parser.add_argument("--full", action="store_true", help=f"with {LARGEST:g} mm")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "dummy.toml", help="whose blade to use")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "reduction", help="output folder")
    parser.add_argument("--measure", type=float, nargs=2, help=argparse.SUPPRESS)
    return parser


def _in_a_process(scene: Path, size: float, modes: int, backend: str) -> dict[str, Any]:
    command = [sys.executable, str(Path(__file__)), "--scene", str(scene), "--backend", backend]
    command += ["--measure", str(size), str(modes)]
    done = subprocess.run(command, cwd=HOUSE, check=True, capture_output=True, text=True)
    row: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return row


def measure(scene: Path, size: float, modes: float, backend: str = "auto") -> dict[str, Any]:
    """Seconds of each phase, dofs and largest memory of this process, for a mesh size in mm."""
    import rom.reduction.substructure
    from geometry import build_sector
    from pipeline.scene.consistency import geometry_parameters
    from pipeline.scene.reading import read_scene
    from rom import BoundaryChoice, Material, assemble, one_blas_thread
    from rom.reduction.craig_bampton import craig_bampton_model
    from rom.reduction.fixed_interface_modes import lowest_modes

    blade = read_scene(scene).first
    assert blade.mesh is not None
    assert blade.material is not None
    blade = blade.model_copy(update={"mesh": blade.mesh.model_copy(update={"size": 1e-3 * size})})
    seconds: dict[str, float] = {}

    @contextmanager
    def timed(phase: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        seconds[phase] = time.perf_counter() - start

    analyse = rom.reduction.substructure.analyse

    class TimedAnalysis:
        def __init__(self, *arguments: Any) -> None:
            with timed("ordering"):
                self._analysis = analyse(*arguments)

        def factor(self) -> Any:
            with timed("factorisation"):
                return self._analysis.factor()

    rom.reduction.substructure.analyse = TimedAnalysis
    with timed("mesh"):
        sector = build_sector(*geometry_parameters(blade))
    with timed("assembly"):
        full = [assemble(sector, Material(**blade.material.model_dump()), blade.mesh.element)]
    boundary = BoundaryChoice(blade.excitation.unit_direction, blade.excitation.at)
    with one_blas_thread():
        with timed("constraint modes"):
            parts = rom.reduction.substructure.partition_at_boundary(full.pop, sector, boundary, backend)
        seconds["constraint modes"] -= seconds["ordering"] + seconds["factorisation"]
        with timed("fixed-interface modes"):
            found = lowest_modes(parts.interior_mass, parts.factor, int(modes))
        with timed("projection"):
            model = craig_bampton_model(parts, found, True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    row = {"size_mm": size, "dofs": parts.n_dofs, "modes": int(modes), "reduced": model.size}
    return {
        **row,
        **{phase: round(seconds[phase], 3) for phase in PHASES},
        "total": round(sum(seconds.values()), 3),
        "memory_gb": round(memory, 3),
        "backend": parts.factor.backend,
    }


def report(rows: list[dict[str, Any]]) -> str:
    """The table in Markdown, with the machine."""
    heads = ("mm", "dofs", "modes", *PHASES, "total s", "GB", "solver")
    lines = []
    for row in rows:
        phases = [f"{row[phase]:.2f}" for phase in PHASES]
        ends = [f"{row['total']:.1f}", f"{row['memory_gb']:.2f}", row["backend"]]
        lines.append([f"{row['size_mm']:g}", str(row["dofs"]), str(row["modes"]), *phases, *ends])
    where = f"{machine.today()}, {machine.hardware()}, load of the machine {machine.load():.1f} at the end. Seconds."
    return f"# From blade to reduced model\n\n{where}\n\n{markdown_table(heads, lines)}\n"


if __name__ == "__main__":
    sys.exit(main())
