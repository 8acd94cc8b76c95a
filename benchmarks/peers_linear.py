"""The linear part beside others: `python benchmarks/peers_linear.py` from the project folder.

Ten natural frequencies of the default blade, clamped at its root and free at its shroud, on one mesh: by this program
with CHOLMOD, by this program with SciPy alone (SuperLU), and by CalculiX (`ccx`, where it is installed), one thread
each. Writes linear.csv and linear.md into out/bench/linear.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from machine import hardware, load, today
from markdown_table import markdown_table
from results import write_results

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import Material

HOUSE = Path(__file__).resolve().parents[1]
COUNT = 10


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    parser = argparse.ArgumentParser(description="Natural frequencies beside SciPy alone and CalculiX.")
    parser.add_argument("--sizes", type=float, nargs="+", default=[6.0, 4.0, 2.8], help="mesh sizes, mm")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "dummy.toml", help="whose blade to use")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "linear", help="output folder")
    options = parser.parse_args(arguments)
    rows = [row for size in options.sizes for row in measure(options.scene, size)]
    table = markdown_table(tuple(rows[0]), [tuple(row.values()) for row in rows])
    where = f"{today()}, {hardware()}, load of the machine {load():.1f} at the end, one thread each."
    what = (
        "Seconds from the mesh to ten natural frequencies; largest relative difference from the first row of a size."
    )
    text = f"# The linear part beside others\n\n{where} {what}\n\n{table}\n"
    write_results(options.out, "linear", rows, text)
    return 0


def measure(scene_file: Path, size: float) -> list[dict[str, Any]]:
    """A row for each program on the mesh of a size in mm."""
    from geometry import build_sector
    from pipeline.scene.consistency import geometry_parameters
    from pipeline.scene.reading import read_scene
    from rom import Material

    blade = read_scene(scene_file).first
    assert blade.mesh is not None
    assert blade.material is not None
    blade = blade.model_copy(update={"mesh": blade.mesh.model_copy(update={"size": 1e-3 * size})})
    sector = build_sector(*geometry_parameters(blade))
    material = Material(**blade.material.model_dump())
    answers = {
        "this program, CHOLMOD": own_frequencies(sector, material, "cholmod"),
        "this program, SciPy alone": own_frequencies(sector, material, "superlu"),
        "CalculiX": calculix_frequencies(sector, material),
    }
    first = next(iter(answers.values()))
    assert first is not None
    rows = []
    for name, found in answers.items():
        if found is not None:
            seconds, dofs, hertz = found
            off = float(np.abs(np.asarray(hertz) / first[2] - 1.0).max())
            shown = {"seconds": round(seconds, 2), "times slower": round(seconds / first[0], 1), "off": f"{off:.1e}"}
            rows.append({"mm": size, "dofs": dofs, "program": name, **shown})
            print(f"{size:g} mm, {name}: {seconds:.1f} s", file=sys.stderr)
    return rows


def own_frequencies(sector: SectorMesh, material: Material, backend: str) -> tuple[float, int, Sequence[float]]:
    """Seconds, dofs and frequencies (Hz) of this program: assembly, factor, shift-invert Lanczos."""
    from threadpoolctl import threadpool_limits

    from rom import assemble
    from rom.linear_algebra.factorisation import factorise
    from rom.reduction.fixed_interface_modes import lowest_modes

    with threadpool_limits(limits=1):
        start = time.perf_counter()
        full = assemble(sector, material)
        moves = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
        stiffness, mass = (matrix[moves][:, moves] for matrix in (full.stiffness, full.mass))
        angular = lowest_modes(mass, factorise(stiffness, backend), COUNT).omega
        return time.perf_counter() - start, full.n_dofs, angular / (2.0 * np.pi)


def calculix_frequencies(sector: SectorMesh, material: Material) -> tuple[float, int, Sequence[float]] | None:
    """The same of CalculiX on the same mesh; None where it is not installed."""
    sys.path.insert(0, str(HOUSE / "tests" / "rom"))
    import calculix

    if calculix.PROGRAM is None:
        return None
    os.environ["OMP_NUM_THREADS"] = "1"
    mesh = calculix.quadratic_mesh(sector)
    text = calculix.deck(mesh, material, COUNT)
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        found = calculix.run(Path(folder), text)
        return time.perf_counter() - start, 3 * len(mesh.points), found


if __name__ == "__main__":
    sys.exit(main())
