"""Solution of one response curve: reduced model and scene in, curve file out."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.process.progress import seconds_since
from pipeline.stages.curve.curve_file import CURVE, read_curve, used_parameters, write_curve, write_searched
from pipeline.stages.curve.curve_summary import keep_summary
from pipeline.stages.scene_to_solver import face_area, nonlinear_problem, resolved_contact

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene


Progress = Callable[[float, int], None]


def solve_curve(
    folder: Path,
    rom: Path,
    scene: Scene,
    parameters: Mapping[str, Any],
    progress: Progress | None = None,
    base: Path | None = None,
) -> None:
    """Solve one curve on one BLAS thread and write `curve.h5`, with its summary in `curve.json`.

    `base`: file of the curve with a shorter search for the worst motion; only that goes on.
    """
    import h5py

    from nonlinear import find_worst_motion, forced_response
    from rom import one_blas_thread, read_reduced_model

    start = time.perf_counter()
    with one_blas_thread():
        model = read_reduced_model(rom, with_basis=False)
        used = used_parameters(scene, resolved_contact(scene, face_area(model)), parameters)
        problem = nonlinear_problem(scene, model)
        if base is None:
            write_curve(folder / CURVE, forced_response(*problem, progress), used)
        else:
            before = read_curve(base)
            with h5py.File(base, "r") as file:
                standard = file.attrs["response.search"] == "standard"
            worst = find_worst_motion(problem, before, before.worst if standard else None)
            seconds = before.seconds + seconds_since(start)
            write_searched(folder / CURVE, base, replace(before, worst=worst, seconds=seconds), used)
    keep_summary(folder / CURVE)
