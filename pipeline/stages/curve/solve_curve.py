"""Solution of one response curve: reduced model and scene in, curve file out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.stages.curve.curve_file import CURVE, used_parameters, write_curve
from pipeline.stages.curve.curve_summary import keep_summary
from pipeline.stages.scene_to_solver import face_area, nonlinear_problem, resolved_contact

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene


Progress = Callable[[float, int], None]


def solve_curve(
    folder: Path, rom: Path, scene: Scene, parameters: Mapping[str, Any], progress: Progress | None = None
) -> None:
    """Solve one curve on one BLAS thread and write `curve.h5`, with its summary in `curve.json`."""
    from nonlinear import forced_response
    from rom import one_blas_thread, read_reduced_model

    with one_blas_thread():
        model = read_reduced_model(rom, with_basis=False)
        contact = resolved_contact(scene, face_area(model))
        response = forced_response(*nonlinear_problem(scene, model), progress)
    write_curve(folder / CURVE, response, used_parameters(scene, contact, parameters))
    keep_summary(folder / CURVE)
