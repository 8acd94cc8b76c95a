"""Models for the cases, made once by one state for both, and the time from a blade to its reduced model."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

SCENES = ("dummy", "figure5", "figure6", "figure7")
STRESS_ANGLES = (45.0, 70.0, 110.0, 150.0, 180.0)  # of the test matrix


def model_file(models: str, scene: str, **values: Any) -> Path:
    """File of the reduced model of a scene of the state, with other values of `section__key`; made where missing."""
    from problems import built_mesh, scene_with

    from rom import write_reduced_model

    changes = {key.replace("__", "."): value for key, value in values.items()}
    name = "-".join([scene, *(f"{key}={value}".replace(" ", "") for key, value in changes.items())])
    file = Path(models) / f"{name}.h5"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        with built_mesh(scene_with(scene_file(scene), changes)) as mesh:
            new = file.with_suffix(".new")
            write_reduced_model(new, mesh.reduced().model())
            new.replace(file)
    return file


def scene_file(scene: str) -> Path:
    """The scene of that name of the state that is measured."""
    import problems

    return Path(problems.__file__).parents[1] / "scenes" / f"{scene}.toml"


def prepare(models: str, scenes: list[str], grids: list[int], peers: bool) -> dict[str, Any]:
    """Make the models that are missing; nothing of it is measured."""
    for scene in scenes:
        model_file(models, scene)
    if "dummy" in scenes:
        model_file(models, "dummy", shroud__angle=180.0)
    for grid in grids:
        model_file(models, "dummy", mesh__contact_grid=(grid, grid))
    blade = Path(models) / "blade.npz"
    if peers and not blade.exists():
        from peers_blade import write_blade

        write_blade(blade, scene_file("dummy"), Path(models) / "store")
    return {}


def reduction(models: str, size_mm: float, modes: int = 40) -> dict[str, Any]:
    """Seconds from the default blade to its reduced model, on the clock and of the processors, in memory."""
    from problems import full_model_of, mesh_of, scene_with
    from tables import peak_memory_gb

    from rom import ReductionOptions, reduce_sector

    scene = scene_with(scene_file("dummy"), {"mesh.size": 1e-3 * size_mm})
    wall, cpu = time.perf_counter(), time.process_time()
    sector = mesh_of(scene)
    found = reduce_sector(lambda: full_model_of(scene, sector), sector, ReductionOptions(modes))
    times = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
    return times | {"dofs": found.dofs, "memory": peak_memory_gb(), "cores": os.cpu_count()}
