"""The linear part beside others: `python benchmarks/peers_linear.py` from the project folder.

Ten natural frequencies of the default blade, clamped at its root and free at its shroud, on one mesh: by this program
with CHOLMOD, by this program with SciPy alone (SuperLU), and by CalculiX (`ccx`, where it is installed), one thread
each. Writes linear.csv and linear.md into out/bench/linear.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from problems import clamped_modes, full_model_of, material_of, mesh_of, scene_with
from tables import ROOT, machine_line, options_of, table_of, write_results

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import Material

COUNT = 10
Found = tuple[float, int, Sequence[float]]  # seconds, dofs, Hz


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, "linear")
    parser.add_argument("--sizes", type=float, nargs="+", default=[6.0, 4.0, 2.8], help="mesh sizes, mm")
    options = parser.parse_args(arguments)
    rows = [row for size in options.sizes for row in measure(options.scene, size)]
    text = (
        f"# The linear part beside others\n\n{machine_line()}, one thread each. Seconds from the mesh to ten natural "
        f"frequencies; largest relative difference from the first row of a size.\n\n{table_of(rows)}\n"
    )
    write_results(options.out, "linear", rows, text)
    return 0


def measure(scene_file: Path, size: float) -> list[dict[str, Any]]:
    """A row for each program on the mesh of a size in mm."""
    scene = scene_with(scene_file, {"mesh.size": 1e-3 * size})
    sector = mesh_of(scene)

    def own(backend: str) -> Found:
        start = time.perf_counter()
        full = full_model_of(scene, sector)
        omega, _ = clamped_modes(full, COUNT, backend)
        return time.perf_counter() - start, full.n_dofs, omega / (2.0 * np.pi)

    first = own("cholmod")
    found: dict[str, Found | None] = {
        "this program, CHOLMOD": first,
        "this program, SciPy alone": own("superlu"),
        "CalculiX": calculix_frequencies(sector, material_of(scene)),
    }
    rows = []
    for name, answer in found.items():
        if answer is not None:
            seconds, dofs, hertz = answer
            off = float(np.abs(np.asarray(hertz) / first[2] - 1.0).max())
            shown = {"seconds": round(seconds, 2), "times slower": round(seconds / first[0], 1), "off": f"{off:.1e}"}
            rows.append({"mm": size, "dofs": dofs, "program": name, **shown})
            print(f"{size:g} mm, {name}: {seconds:.1f} s", file=sys.stderr)
    return rows


def calculix_frequencies(sector: SectorMesh, material: Material) -> Found | None:
    """The same of CalculiX on the same mesh; None where it is not installed."""
    sys.path.insert(0, str(ROOT / "tests" / "rom"))
    import calculix

    if calculix.PROGRAM is None:
        return None
    os.environ["OMP_NUM_THREADS"] = "1"
    mesh = calculix.quadratic_mesh(sector)
    text = calculix.deck(mesh, material, COUNT)
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        hertz = calculix.run(Path(folder), text)
        return time.perf_counter() - start, 3 * len(mesh.points), hertz


if __name__ == "__main__":
    sys.exit(main())
