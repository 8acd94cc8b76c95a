"""Mesh error of graded meshes, and of the kinds of contact dofs: benchmarks/measured/mesh_error.md, contact_dofs.md.

    python benchmarks/mesh_error.py grading --sizes 8 6 4 3 --reference 1.6
    python benchmarks/mesh_error.py compliance --sizes 6 4 3 2 1.5      # 2 GB at 2 mm, 6 GB at 1.5 mm

grading: free blade; relative errors of its first ten natural frequencies and of the heights of the tip's resonances
under 1 N at the tip, against a finer mesh with the largest of the gradings.
compliance: compliance of a contact dof in the relative static flexibility (mean over the nodes of the diagonal, along
the normal and along t1), the same with all other contact dofs held (local), and natural frequencies with the scene's
contact stiffness, with the punch stiffness of the face and with rigid springs. Every mesh has a process of its own.
Writes NAME.csv and NAME.md into out/bench/NAME.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from problems import clamped_modes, full_model_of, mesh_of, scene_with
from tables import OUT, in_a_process, markdown_table, options_of, today, write_results

GRADINGS = (1.0, 2.0, 4.0, 8.0)
MODES = 10
SEEN = 0.01  # of the highest resonance of the tip: lower ones are not looked at
KINDS = ("nodal", "patch", "mortar")
RIGID = 1e3  # times the punch stiffness of the face: the springs themselves no longer count
FIXED_INTERFACE_MODES = 40
SPRINGS = ("free", "scene", "punch", "rigid")


def main(arguments: list[str] | None = None) -> int:
    """Measure and write one of the tables; the exit status."""
    parser = options_of(__doc__, "NAME")
    parser.add_argument("table", choices=("grading", "compliance"))
    parser.add_argument("--sizes", type=float, nargs="+", default=[6.0, 4.0, 3.0], help="mesh sizes, mm")
    parser.add_argument("--gradings", type=float, nargs="+", default=list(GRADINGS), help="mesh.grading")
    parser.add_argument("--reference", type=float, default=2.0, help="mesh size of the reference of grading, mm")
    parser.add_argument("--grid", type=int, nargs=2, help="contact nodes along the segment and the radius")
    options = parser.parse_args(arguments)
    if options.table == "grading":
        rows, text = grading(options.scene, options.sizes, options.gradings, options.reference)
    else:
        rows = [
            row for size in options.sizes for row in in_a_process("mesh_error", options.scene, size, options.grid)
        ]
        text = compliance_report(rows)
    out = OUT / options.table if options.out.name == "NAME" else options.out
    write_results(out, options.table, rows, text)
    return 0


def grading(scene: Path, sizes: Sequence[float], gradings: Sequence[float], reference: float) -> tuple[Any, str]:
    """Rows and Markdown of the errors of each size and grading."""
    _, _, exact, exact_height = free_blade(scene, reference, max(gradings))
    seen = exact_height > SEEN * exact_height.max()
    rows, lines = [], []
    for ratio in gradings:
        for size in sizes:
            dofs, seconds, hertz, height = free_blade(scene, size, ratio)
            error = hertz / exact - 1.0
            errors = {
                "first": float(error[0]),
                "rms": float(np.sqrt(np.mean(error**2))),
                "largest": float(np.abs(error).max()),
                "tip": float(np.abs(height[seen] / exact_height[seen] - 1.0).max()),
            }
            rows.append({"size_mm": size, "grading": ratio, "dofs": dofs, "seconds": round(seconds, 2), **errors})
            shown = (f"{100.0 * each:.3f} %" for each in errors.values())
            lines.append((f"{ratio:g}", f"{size:g}", dofs, *shown, f"{seconds:.1f}"))
    heads = ("grading", "mm", "dofs", "first frequency", "ten, rms", "ten, largest", "resonances of the tip", "s")
    where = f"{today()}, errors against {reference:g} mm with grading {max(gradings):g}."
    return rows, f"# Graded meshes\n\n{where}\n\n{markdown_table(heads, lines)}\n"


def free_blade(scene_file: Path, size: float, ratio: float) -> tuple[int, float, np.ndarray, np.ndarray]:
    """Dofs, seconds, natural frequencies (10,) in Hz and heights (10,) of the tip's resonances without the damping.

    Height of resonance m at the same damping ratio: (displacement of the tip in mode m / omega_m)^2.
    """
    scene = scene_with(scene_file, {"mesh.size": 1e-3 * size, "mesh.grading": ratio})
    start = time.perf_counter()
    sector = mesh_of(scene)
    full = full_model_of(scene, sector)
    omega, shapes = clamped_modes(full, MODES)
    tip = 3 * full.vertex_node[sector.node_sets["tip"][0]] + np.arange(3)
    displacement = np.asarray(scene.excitation.unit_direction) @ shapes[tip]
    return full.n_dofs, time.perf_counter() - start, omega / (2.0 * np.pi), (displacement / omega) ** 2


def measure(scene_file: str, size: float, grid: Sequence[int] | None) -> list[dict[str, Any]]:
    """One row for each kind of contact dofs on a mesh of a size in mm: m/N, Hz of the first three modes."""
    from nonlinear.contact.parameters import punch_stiffness
    from rom import BoundaryChoice, ReductionOptions, inter_blade_phase, reduce_sector

    changes = {"mesh.size": 1e-3 * size} | ({"mesh.contact_grid": tuple(grid)} if grid else {})
    scene = scene_with(scene_file, changes)
    assert scene.material is not None
    sector = mesh_of(scene)
    full = full_model_of(scene, sector)
    area = float(sector.right.area.sum())
    punch = punch_stiffness(scene.material.young_modulus, scene.material.poisson_ratio, area)
    own = (float(scene.contact.normal_stiffness), float(scene.contact.tangential_stiffness))
    springs = {"free": (0.0, 0.0), "scene": own, "punch": punch, "rigid": (RIGID * punch[0], RIGID * punch[1])}
    phase = inter_blade_phase(scene.excitation.engine_order, sector.n_blades)
    rows = []
    for kind in KINDS:
        options = ReductionOptions(FIXED_INTERFACE_MODES, store_basis=False)
        model = reduce_sector(full, sector, options, BoundaryChoice(contact_dofs=kind)).model
        row = {"size_mm": size, "dofs": full.n_dofs, "contact_dofs": kind, "n_contacts": model.n_contacts}
        rows.append(row | _compliance(model, phase) | _frequencies(model, phase, springs))
    return rows


def _compliance(model: Any, phase: float) -> dict[str, float]:
    """Means over the contact nodes, m/N: `whole_*` of the relative flexibility, `local_*` with all others held."""
    from rom.cyclic.cyclic_symmetry import relative_contact_motion

    motion = relative_contact_motion(model.contact_right, model.contact_left, phase)
    flexibility = motion @ np.linalg.solve(model.stiffness, motion.conj().T)
    alone = 1.0 / np.real(np.diag(np.linalg.inv(flexibility)))
    values = {}
    for name, row in (("normal", 2), ("tangential", 0)):
        values[f"whole_{name}"] = float(np.real(np.diag(flexibility))[row::3].mean())
        values[f"local_{name}"] = float(alone[row::3].mean())
    return values


def _frequencies(model: Any, phase: float, springs: dict[str, tuple[float, float]]) -> dict[str, float]:
    """The first three natural frequencies, Hz, with springs (normal, tangential) of the whole face, N/m."""
    from rom import natural_frequencies

    values = {}
    for name in SPRINGS:
        share = model.contact_area / model.contact_area.sum()
        normal, tangential = (stiffness * share for stiffness in springs[name])
        found = natural_frequencies(model, phase, normal=normal, tangential=tangential, count=3)
        values |= {f"{name}_{k + 1}_hz": float(f) for k, f in enumerate(found)}
    return values


def compliance_report(rows: list[dict[str, Any]]) -> str:
    """Two tables in Markdown: compliances in nm/N, and frequencies in Hz."""
    compliances = [f"{part}_{name}" for part in ("local", "whole") for name in ("normal", "tangential")]
    frequencies = [f"{name}_{k}_hz" for name in SPRINGS for k in (1, 2)]
    tables = []
    for columns, shown in ((compliances, lambda x: f"{1e9 * x:.4g}"), (frequencies, lambda x: f"{x:.3f}")):
        heads = ["mm", "dofs", "contact", *(column.removesuffix("_hz").replace("_", " ") for column in columns)]
        lines = [
            (f"{row['size_mm']:g}", row["dofs"], kind, *(shown(row[column]) for column in columns))
            for kind in KINDS
            for row in rows
            if row["contact_dofs"] == kind
        ]
        tables.append(markdown_table(heads, lines))
    parts = [
        "# Compliance under contact dofs",
        f"{today()}, {rows[0]['n_contacts']} contact nodes a face. Compliance of a contact dof, nm/N: "
        "all others held (local), free (whole).",
        tables[0],
        "Natural frequencies, Hz: free, stuck with the scene's, the punch's and rigid springs.",
        tables[1],
    ]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    sys.exit(main())
