"""Time and memory from the blade to its reduced model, phase by phase: `python benchmarks/reduction.py`.

    python benchmarks/reduction.py                      # 26 000 to 142 000 dofs, a minute
    python benchmarks/reduction.py --full               # 484 000 dofs too, three minutes and 7 GB
    python benchmarks/reduction.py --sizes 4 2 --modes 20 40 80
    python benchmarks/reduction.py --backend superlu

Each mesh size is reduced in a process of its own, so that its largest memory is its own. Writes reduction.csv and
reduction.md into out/bench/reduction.
"""

from __future__ import annotations

import functools
import sys
import time
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from problems import full_model_of, mesh_of, scene_with
from tables import in_a_process, machine_line, markdown_table, options_of, peak_memory_gb, write_results

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import FullModel

SIZES, LARGEST = (4.0, 2.8, 1.9), 1.17  # mm
# Functions that are timed, and the phases as sums of their seconds, with a minus taken off. Small models are worked
# on in two threads: there the phases take more than the total.
TIMED = (
    "rom.reduction.substructure:analyse",
    "rom.linear_algebra.factorisation:_CholmodAnalysis.factor",
    "rom.linear_algebra.factorisation:_SuperluAnalysis.factor",
    "rom.reduction.craig_bampton:hold_at_boundary",
    "rom.reduction.substructure:HeldSector.condensed",
    "rom.reduction.craig_bampton:lowest_modes",
    "rom.reduction.craig_bampton:craig_bampton_model",
)
PHASES = {
    "mesh s": ("mesh_of",),
    "assembly s": ("full_model_of",),
    "ordering s": ("analyse",),
    "factorisation s": ("factor",),
    "partition s": ("hold_at_boundary", "-full_model_of", "-analyse", "-factor"),
    "constraint modes s": ("condensed",),
    "fixed-interface modes s": ("lowest_modes",),
    "projection s": ("craig_bampton_model",),
}


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, "reduction")
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES), help="mesh sizes, mm")
    parser.add_argument("--modes", type=int, nargs="+", default=[40], help="fixed-interface modes")
    parser.add_argument("--backend", default="auto", choices=("auto", "cholmod", "superlu"), help="what factorises")
    parser.add_argument("--full", action="store_true", help=f"with {LARGEST:g} mm")
    options = parser.parse_args(arguments)
    rows = []
    for size in [*options.sizes, *([LARGEST] if options.full else [])]:
        for modes in options.modes:
            rows.append(in_a_process("reduction", options.scene, size, modes, options.backend))
            print(f"{size:g} mm: {rows[-1]['total s']:.1f} s, {rows[-1]['memory_gb']:.1f} GB", file=sys.stderr)
    write_results(options.out, "reduction", rows, report(rows))
    return 0


def measure(scene_file: str, size: float, modes: int, backend: str) -> dict[str, Any]:
    """Seconds of each phase, dofs and largest memory of this process, for a mesh size in mm."""
    scene = scene_with(scene_file, {"mesh.size": 1e-3 * size})
    row = measured(lambda: mesh_of(scene), lambda sector: full_model_of(scene, sector), modes, backend)
    return {"size_mm": size, **row}


def measured(
    sector_of: Callable[[], SectorMesh], assembled_of: Callable[[SectorMesh], FullModel], modes: int, backend: str
) -> dict[str, Any]:
    """Seconds of each phase, dofs and largest memory of this process, for a mesh and its assembly."""
    from rom import ReductionOptions, reduce_sector

    seconds: dict[str, float] = dict.fromkeys((place.rpartition(".")[2].rpartition(":")[2] for place in TIMED), 0.0)
    for place in TIMED:
        _time(place, seconds)
    start = begin = time.perf_counter()
    sector = sector_of()
    seconds["mesh_of"] = time.perf_counter() - start

    def assembled() -> FullModel:
        start = time.perf_counter()
        full = assembled_of(sector)
        seconds["full_model_of"] = time.perf_counter() - start
        return full

    reduction = reduce_sector(assembled, sector, ReductionOptions(modes, backend=backend))
    total = time.perf_counter() - begin
    row: dict[str, Any] = {"dofs": reduction.dofs, "modes": reduction.modes, "reduced": reduction.model.size}
    for phase, functions in PHASES.items():
        row[phase] = round(sum(-seconds[name[1:]] if name[0] == "-" else seconds[name] for name in functions), 3)
    solver = str(reduction.model.producer).rsplit(", ", maxsplit=1)[-1]
    return {
        **row,
        "total s": round(total, 3),
        "memory_gb": round(peak_memory_gb(), 3),
        "backend": solver,
    }


def _time(place: str, seconds: dict[str, float]) -> None:
    """Let the function at "module:name" or "module:class.name" add its time to `seconds` by its name."""
    module, _, path = place.partition(":")
    *holders, name = path.split(".")
    owner: Any = import_module(module)
    for holder in holders:
        owner = getattr(owner, holder)
    function = getattr(owner, name)

    @functools.wraps(function)
    def timed(*arguments: Any, **keywords: Any) -> Any:
        start = time.perf_counter()
        try:
            return function(*arguments, **keywords)
        finally:
            seconds[name] += time.perf_counter() - start

    setattr(owner, name, timed)


def report(rows: list[dict[str, Any]]) -> str:
    """The table in Markdown, with the machine."""
    heads = ("mm", "dofs", "modes", *PHASES, "total s", "GB", "solver")
    lines = []
    for row in rows:
        phases = [f"{row[phase]:.2f}" for phase in PHASES]
        sizes = (f"{row['size_mm']:g}", row["dofs"], row["modes"])
        lines.append((*sizes, *phases, f"{row['total s']:.1f}", f"{row['memory_gb']:.2f}", row["backend"]))
    return f"# From blade to reduced model\n\n{machine_line()}. Seconds.\n\n{markdown_table(heads, lines)}\n"


if __name__ == "__main__":
    sys.exit(main())
