"""What layers of elements that are thinner at the re-entrant corners buy: error against dofs.

    python benchmarks/grading.py                          # 6, 4 and 3 mm, half a minute with the reference
    python benchmarks/grading.py --sizes 6 4 3 2.5 --gradings 1 2 4 8 --reference 1.6

Free blade of a scene: relative errors of its first ten natural frequencies and of the heights of the resonances of
the tip under 1 N at the tip, against a much finer mesh with the largest of the gradings. Writes grading.csv and
grading.md into out/bench/grading.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from results import write_results

HOUSE = Path(__file__).resolve().parents[1]
SIZES, REFERENCE = (6.0, 4.0, 3.0), 2.0  # mm
GRADINGS = (1.0, 2.0, 4.0, 8.0)
MODES = 10
SEEN = 0.01  # of the highest resonance: what counts as one of the tip
Answers = tuple[int, float, Any, Any]


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    import numpy as np

    options = _parser().parse_args(arguments)
    _, _, exact, exact_height = answers(options.scene, options.reference, max(options.gradings))
    seen = exact_height > SEEN * exact_height.max()
    rows: list[dict[str, Any]] = []
    for grading in options.gradings:
        for size in options.sizes:
            dofs, seconds, hertz, height = answers(options.scene, size, grading)
            error = hertz / exact - 1.0
            row = {"size_mm": size, "grading": grading, "dofs": dofs, "seconds": round(seconds, 2)}
            row |= {"first": float(error[0]), "rms": float(np.sqrt(np.mean(error**2)))}
            row |= {"largest": float(np.max(np.abs(error)))}
            row |= {"tip": float(np.max(np.abs(height[seen] / exact_height[seen] - 1.0)))}
            rows.append(row | {f"mode_{k + 1}": float(each) for k, each in enumerate(error)})
            print(f"{size:g} mm, grading {grading:g}: {dofs} dofs, rms {100.0 * row['rms']:.3g} %")
    write_results(options.out, "grading", rows, report(rows, options.reference, max(options.gradings)))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Error against dofs of graded meshes.")
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES), help="mesh sizes, mm")
    parser.add_argument("--gradings", type=float, nargs="+", default=list(GRADINGS), help="mesh.grading")
    parser.add_argument("--reference", type=float, default=REFERENCE, help="mesh size of the reference, mm")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "dummy.toml", help="whose blade to use")
    parser.add_argument("--out", type=Path, default=HOUSE / "out" / "bench" / "grading", help="output folder")
    return parser


def answers(scene: Path, size: float, grading: float) -> Answers:
    """Dofs, seconds, natural frequencies (10,) in Hz and heights (10,) of the tip's resonances, all but the damping.

    Height of resonance m at the same damping ratio: (displacement of the tip in mode m / w_m)^2.
    """
    import numpy as np

    from geometry import build_sector
    from pipeline.scene.consistency import geometry_parameters
    from pipeline.scene.reading import read_scene
    from rom import Material, assemble, factorise, one_blas_thread
    from rom.reduction.fixed_interface_modes import lowest_modes

    blade = read_scene(scene).first
    assert blade.mesh is not None
    assert blade.material is not None
    changes = {"size": 1e-3 * size, "grading": grading}
    blade = blade.model_copy(update={"mesh": blade.mesh.model_copy(update=changes)})
    start = time.perf_counter()
    sector = build_sector(*geometry_parameters(blade))
    full = assemble(sector, Material(**blade.material.model_dump()), blade.mesh.element)
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    with one_blas_thread():
        stiffness, mass = full.stiffness[free][:, free], full.mass[free][:, free]
        modes = lowest_modes(mass, factorise(stiffness), MODES)
    tip = 3 * full.vertex_node[sector.node_sets["tip"][0]] + np.arange(3)
    moved = np.asarray(blade.excitation.unit_direction) @ modes.shapes[np.searchsorted(free, tip)]
    return full.n_dofs, time.perf_counter() - start, modes.omega / (2.0 * np.pi), (moved / modes.omega) ** 2


def report(rows: list[dict[str, Any]], reference: float, grading: float) -> str:
    """The table in Markdown."""
    heads = ["grading", "mm", "dofs", "first frequency", "ten, rms", "ten, largest", "resonances of the tip", "s"]
    lines = [heads, ["---"] * len(heads)]
    for row in rows:
        errors = [f"{100.0 * row[name]:.3f} %" for name in ("first", "rms", "largest", "tip")]
        lines.append(
            [f"{row['grading']:g}", f"{row['size_mm']:g}", str(row["dofs"]), *errors, f"{row['seconds']:.1f}"]
        )
    table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    against = f"against {reference:g} mm with grading {grading:g}"
    return f"# Graded meshes\n\n{time.strftime('%Y-%m-%d')}, errors {against}.\n\n{table}\n"


if __name__ == "__main__":
    sys.exit(main())
