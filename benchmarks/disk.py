"""Time and memory of a sector of a bladed disk against its size: condensation, modes, cut faces, reduction.

    python benchmarks/disk.py [MESH SIZE in m ...]

Each size runs in a process of its own. A row for docs/developers/performance.md is printed for each.
"""

from __future__ import annotations

import multiprocessing
import resource
import sys
import time

SIZES = (0.008, 0.006, 0.0042, 0.0032, 0.0024)
COUNT = 10
HEAD = (
    "| dofs | dofs of a face | condensed, s | ten modes at one nodal diameter, s | motions of the faces, s | "
    "reduction, s | error of ten frequencies | memory, GB |"
)


def row(size: float) -> str:
    """One row of the table: processor seconds, with one BLAS thread."""
    from geometry import BladeParameters, DiskParameters, MeshParameters, ShroudParameters, build_sector
    from rom import Material, ReductionOptions, assemble, reduce_sector
    from rom.cyclic_sector.condensed_sector import CondensedSector
    from rom.cyclic_sector.cyclic_faces import cyclic_faces
    from rom.cyclic_sector.cyclic_modes import WaveProblem
    from rom.cyclic_sector.interface_motion import interface_motion
    from rom.cyclic_sector.wave_reference import wave_errors
    from rom.linear_algebra.threads import one_blas_thread

    blade = BladeParameters(72, 0.3, 0.15, 0.036, 0.009, 0.006, 25.0, "lens")
    shroud, mesh = ShroudParameters(70.0, 0.005, 0.04, 0.012), MeshParameters(size=size)
    sector = build_sector(blade, shroud, mesh, DiskParameters(bore_radius=0.15, rim_width=0.046))
    steel = Material(2.1e11, 0.3, 7850.0)
    full = assemble(sector, {"": steel, "disk": steel}, "hex20")
    faces = cyclic_faces(full, sector)
    seconds = []

    def clock(work):
        start = time.process_time()
        found = work()
        seconds.append(time.process_time() - start)
        return found

    with one_blas_thread():
        wave = WaveProblem(CondensedSector(full, faces), 5)
        clock(lambda wave=wave: wave.sector.condensed)
        clock(lambda wave=wave: wave.modes(COUNT))
        del wave
        choice = clock(lambda: interface_motion(full, sector, faces))
        model = clock(
            lambda: reduce_sector(full, sector, ReductionOptions(modes=60, store_basis=False), choice)
        ).model
    error = wave_errors(model, choice.interface, COUNT).largest
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    times = " | ".join(f"{value:.1f}" for value in seconds)
    return f"| {full.n_dofs} | {3 * len(faces.left)} | {times} | {error:.1e} | {memory:.1f} |"


def main() -> None:
    """Print the table."""
    print(HEAD)
    print("| --- " * HEAD.count(" |") + "|")
    for size in [float(word) for word in sys.argv[1:]] or SIZES:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            print(pool.apply(row, (size,)), flush=True)


if __name__ == "__main__":
    main()
