"""Time and memory from the file of a mesh of tet10 to the reduced model: `python benchmarks/own_mesh.py`.

    python benchmarks/own_mesh.py                       # 100 000 dofs, a minute
    python benchmarks/own_mesh.py --full                # 500 000 dofs too, some minutes
    python benchmarks/own_mesh.py --sizes 4.5 3.3 --modes 20

The hexahedra of the blade are cut into tetrahedra with mid-side nodes and written as an Abaqus input file; that
file is read, taken for a sector, assembled and reduced. Beside it stands the mesh of the program itself, hex20 of
the size that has about as many dofs. Each case runs in a process of its own, so that its largest memory is its own.
Writes own_mesh.csv and own_mesh.md into out/bench/own_mesh.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from problems import full_model_of, material_of, mesh_of, scene_with
from reduction import PHASES, measured
from tables import in_a_process, machine_line, markdown_table, options_of, write_results
from tetrahedra import SETS, write_tetrahedra

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import FullModel

SIZES, LARGEST = (3.4,), 1.9  # mm, of the hexahedra that are cut
# Edge of the hex20 with as many dofs, over that of the hexahedra that are cut into tetrahedra.
FINER = 0.616
COLUMNS = ("read s", "sector s", *(name for name in PHASES if name != "mesh s"))


def main(arguments: list[str] | None = None) -> int:
    """Measure and write the table; the exit status."""
    parser = options_of(__doc__, "own_mesh")
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES), help="hexahedra that are cut, mm")
    parser.add_argument("--modes", type=int, default=40, help="fixed-interface modes")
    parser.add_argument("--full", action="store_true", help=f"with {LARGEST:g} mm")
    options = parser.parse_args(arguments)
    rows = []
    for size in [*options.sizes, *([LARGEST] if options.full else [])]:
        for row in compared(str(options.scene), size, options.modes):
            rows.append(row)
            print(f"{row['elements']}: {row['total s']:.1f} s, {row['memory_gb']:.1f} GB", file=sys.stderr)
    write_results(options.out, "own_mesh", rows, report(rows))
    return 0


def compared(scene_file: str, size: float, modes: int) -> Iterator[dict[str, Any]]:
    """The row of the file of tetrahedra and that of the program's own mesh."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "blade.inp"
        scene = scene_with(scene_file, {"mesh.size": 1e-3 * size})
        write_tetrahedra(file, mesh_of(scene), material_of(scene))
        yield in_a_process("own_mesh", "tet10", scene_file, size, modes, str(file))
    yield in_a_process("own_mesh", "hex20", scene_file, FINER * size, modes, "")


def measure(what: str, scene_file: str, size: float, modes: int, file: str) -> dict[str, Any]:
    """Seconds from the file of tetrahedra ("tet10") or from the scene ("hex20") to the reduced model."""
    scene = scene_with(scene_file, {"mesh.size": 1e-3 * size})
    seconds = {"read s": 0.0, "sector s": 0.0}
    start = time.process_time()
    if what == "tet10":
        row = measured(lambda: _sector(file, scene, seconds), _assembled(scene), modes, "auto")
    else:
        row = measured(lambda: mesh_of(scene), lambda sector: full_model_of(scene, sector), modes, "auto")
        seconds["sector s"] = row["mesh s"]
    row = {name: value for name, value in row.items() if name != "mesh s"}
    row["cpu s"] = round(time.process_time() - start, 1)
    return {"elements": what, "file_mb": round(Path(file).stat().st_size / 1e6, 1) if file else 0.0, **seconds, **row}


def _sector(file: str, scene: Any, seconds: dict[str, float]) -> SectorMesh:
    """Read the file and take it for a sector."""
    from geometry import read_mesh
    from geometry.own_mesh.own_sector import sector_from_mesh
    from geometry.own_mesh.sector_choice import SectorChoice

    start = time.perf_counter()
    mesh = read_mesh(file)
    seconds["read s"] = round(time.perf_counter() - start, 3)
    names = {"root": SETS["root"], "contact_right": SETS["face_right"], "contact_left": SETS["face_left"]}
    choice = SectorChoice(
        scene.blade.n_blades, sets={**names, "tip": SETS["tip_surface"]}, contact_grid=scene.mesh.contact_grid
    )
    start = time.perf_counter()
    sector = sector_from_mesh(mesh, choice).sector
    seconds["sector s"] = round(time.perf_counter() - start, 3)
    return sector


def _assembled(scene: Any) -> Any:
    def of(sector: SectorMesh) -> FullModel:
        from rom import assemble

        material = material_of(scene)
        return assemble(sector, {block.material: material for block in sector.blocks}, None)

    return of


def report(rows: list[dict[str, Any]]) -> str:
    """The table in Markdown, with the machine."""
    heads = ("elements", "dofs", "file MB", *COLUMNS, "total s", "CPU s", "GB", "solver")
    lines = []
    for row in rows:
        phases = [f"{row[phase]:.2f}" for phase in COLUMNS]
        sizes = (row["elements"], row["dofs"], f"{row['file_mb']:.0f}" if row["file_mb"] else "-")
        lines.append(
            (*sizes, *phases, f"{row['total s']:.1f}", row["cpu s"], f"{row['memory_gb']:.2f}", row["backend"])
        )
    text = (
        "tet10: the blade of the default scene from an Abaqus input file; hex20: the mesh of the program itself, "
        "whose `sector s` is the time of the mesher. CPU s: of all threads."
    )
    head = f"# From the file of a mesh to the reduced model\n\n{machine_line()}. {text}"
    return f"{head}\n\n{markdown_table(heads, lines)}\n"


if __name__ == "__main__":
    sys.exit(main())
