"""Local compliance under the contact dofs against the mesh size, of nodes and of patches.

    python benchmarks/contact_compliance.py                          # 6, 4, 3 and 2.5 mm: a minute
    python benchmarks/contact_compliance.py --sizes 6 4 3 2 1.5      # 2 GB at 2 mm, 6 GB at 1.5 mm

For a scene's blade at its engine order: compliance of a contact dof in the relative static flexibility (mean over the
nodes of the diagonal, along the normal and along t1), the part of it that the other contact dofs do not share (all
others held), and natural frequencies with the scene's contact stiffness, with the punch stiffness of the face and
with rigid springs. Each mesh is reduced in a process of its own. Writes contact_compliance.csv and
contact_compliance.md into out/bench/contact_compliance.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from results import write_results

HOUSE = Path(__file__).resolve().parents[1]
SIZES = (6.0, 4.0, 3.0, 2.5)  # mm
KINDS = ("nodal", "patch")
RIGID = 1e3  # times the punch stiffness of the face: the springs themselves no longer count
MODES = 40
HERTZ = ("free", "scene", "punch", "rigid")


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the tables; the exit status."""
    options = _parser().parse_args(arguments)
    if options.measure is not None:
        print(json.dumps(measure(options.scene, options.measure, options.grid)))
        return 0
    rows: list[dict[str, Any]] = []
    for size in options.sizes:
        rows += _in_a_process(options.scene, size, options.grid)
        print(f"{size:g} mm: {rows[-1]['dofs']} dofs")
    write_results(options.out, "contact_compliance", rows, report(rows))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="Compliance under contact dofs and stuck frequencies.")
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES), help="mesh sizes, mm")
    parser.add_argument("--grid", type=int, nargs=2, help="contact nodes along the segment and the radius")
    parser.add_argument("--scene", type=Path, default=HOUSE / "scenes" / "dummy.toml", help="whose blade to use")
    parser.add_argument(
        "--out", type=Path, default=HOUSE / "out" / "bench" / "contact_compliance", help="output folder"
    )
    parser.add_argument("--measure", type=float, help=argparse.SUPPRESS)
    return parser


def _in_a_process(scene: Path, size: float, grid: list[int] | None) -> list[dict[str, Any]]:
    command = [sys.executable, str(Path(__file__)), "--scene", str(scene), "--measure", str(size)]
    command += ["--grid", *map(str, grid)] if grid else []
    done = subprocess.run(command, cwd=HOUSE, check=True, stdout=subprocess.PIPE, text=True)
    rows: list[dict[str, Any]] = json.loads(done.stdout.splitlines()[-1])
    return rows


def measure(scene: Path, size: float, grid: list[int] | None) -> list[dict[str, Any]]:
    """One row for each kind of contact dofs on a mesh of a size in mm: m/N, Hz of the first three modes."""
    from geometry import build_sector
    from nonlinear import punch_stiffness
    from pipeline.scene.consistency import geometry_parameters
    from pipeline.scene.reading import read_scene
    from rom import BoundaryChoice, Material, ReductionOptions, assemble, reduce_sector

    blade = read_scene(scene).first
    assert blade.mesh is not None
    assert blade.material is not None
    changes = {"size": 1e-3 * size} | ({"contact_grid": tuple(grid)} if grid else {})
    blade = blade.model_copy(update={"mesh": blade.mesh.model_copy(update=changes)})
    sector = build_sector(*geometry_parameters(blade))
    full = assemble(sector, Material(**blade.material.model_dump()), blade.mesh.element)
    area = float(sector.right.area.sum())
    punch = punch_stiffness(blade.material.young_modulus, blade.material.poisson_ratio, area)
    own = (float(blade.contact.normal_stiffness), float(blade.contact.tangential_stiffness))
    springs = {"scene": own, "punch": punch, "rigid": (RIGID * punch[0], RIGID * punch[1])}
    rows = []
    for kind in KINDS:
        model = reduce_sector(
            full,
            sector,
            ReductionOptions(modes=MODES, store_basis=False),
            BoundaryChoice(
                excitation_direction=blade.excitation.unit_direction,
                excitation_at=blade.excitation.at,
                contact_dofs=kind,
            ),
        ).model
        phase = 2.0 * 3.141592653589793 * blade.excitation.engine_order / sector.n_blades
        row = {"size_mm": size, "dofs": full.n_dofs, "contact_dofs": kind, "n_contacts": model.n_contacts}
        rows.append(row | _compliance(model, phase) | _frequencies(model, phase, springs))
    return rows


def _compliance(model: Any, phase: float) -> dict[str, float]:
    """Means over the contact nodes, m/N: `whole_*` of the relative flexibility, `local_*` with all others held."""
    import numpy as np

    from rom import relative_contact_motion

    motion = relative_contact_motion(model.contact_right, model.contact_left, phase)
    flexibility = motion @ np.linalg.solve(model.stiffness, motion.conj().T)
    alone = 1.0 / np.real(np.diag(np.linalg.inv(flexibility)))
    values = {}
    for name, row in (("normal", 2), ("tangential", 0)):
        values[f"whole_{name}"] = float(np.real(np.diag(flexibility))[row::3].mean())
        values[f"local_{name}"] = float(alone[row::3].mean())
    return values


def _frequencies(model: Any, phase: float, springs: dict[str, tuple[float, float]]) -> dict[str, float]:
    """The first three natural frequencies, Hz, free and with springs (normal, tangential) of the whole face, N/m."""
    from rom import natural_frequencies

    values = {}
    for name in HERTZ:
        normal, tangential = (k / model.n_contacts for k in springs.get(name, (0.0, 0.0)))
        found = natural_frequencies(model, phase, normal=normal, tangential=tangential, count=3)
        values |= {f"{name}_{k + 1}_hz": float(f) for k, f in enumerate(found)}
    return values


def report(rows: list[dict[str, Any]]) -> str:
    """Two tables in Markdown: compliances in nm/N, and frequencies in Hz."""
    compliance = [f"{part}_{name}" for part in ("local", "whole") for name in ("normal", "tangential")]
    hertz = [f"{name}_{k}_hz" for name in HERTZ for k in (1, 2)]
    first = _table(rows, compliance, lambda value: f"{1e9 * value:.4g}")
    second = _table(rows, hertz, lambda value: f"{value:.3f}")
    heading = f"{time.strftime('%Y-%m-%d')}, {rows[0]['n_contacts']} contact nodes a face"
    return (
        f"# Compliance under contact dofs\n\n{heading}. Compliance of a contact dof, nm/N: all others held (local), "
        f"free (whole).\n\n{first}\n\nNatural frequencies, Hz: free, stuck with the scene's, the punch's and rigid "
        f"springs.\n\n{second}\n"
    )


def _table(rows: list[dict[str, Any]], columns: list[str], shown: Any) -> str:
    heads = ["mm", "dofs", "contact", *(column.removesuffix("_hz").replace("_", " ") for column in columns)]
    lines = [heads, ["---"] * len(heads)]
    for kind in KINDS:
        for row in rows:
            if row["contact_dofs"] == kind:
                values = [shown(row[column]) for column in columns]
                lines.append([f"{row['size_mm']:g}", str(row["dofs"]), kind, *values])
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


if __name__ == "__main__":
    sys.exit(main())
