"""Mesh size and element: error of linear results over seconds from the blade to its reduced model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from problems import built_mesh, cached_model, mesh_of, scene_with

from pipeline.scene.schema import Scene
from pipeline.stages.scene_to_solver import linear_operation
from work_precision.study import Measured, Study, announced, median_of, relative_error

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import ReducedModel

ORDER = 1.0  # asymptotic order of convergence at re-entrant corners
REFERENCE, REFERENCE_MODES, REFERENCE_GRADING = (4.0, 2.8, 2.0, 1.6), 60, 8.0
FREE, STUCK = "natural frequencies, free", "natural frequencies, stuck"
RECEPTANCE = "tip receptance at its peak, free"


@dataclass(frozen=True)
class MeshSettings:
    """Element sizes (mm) of each element and of hex20 without grading; sizes of the reference; modes of each."""

    sizes: Mapping[str, Sequence[float]]
    ungraded: Sequence[float] = ()
    reference: Sequence[float] = REFERENCE
    modes: int = 40
    reference_modes: int = REFERENCE_MODES


DEFAULT = MeshSettings(
    {"hex8": (8.0, 6.0, 4.0, 2.8, 2.0), "hex20": (8.0, 6.0, 5.0, 4.0, 3.2, 2.8, 2.4), "hex27": (8.0, 6.0, 4.0, 2.8)},
    (8.0, 6.0, 4.0, 2.8),
)


def mesh_study(scene_file: Path, settings: MeshSettings, store: Path) -> Study:
    """Errors of the natural frequencies in the range, or the first above it, and of the highest tip receptance."""
    scene = scene_with(scene_file, {"rom.modes": settings.modes})
    truth, uncertainty = _reference(scene, settings, store)
    series = [(element, {"mesh.element": element}, sizes) for element, sizes in settings.sizes.items()]
    series.append(("hex20, ungraded", {"mesh.element": "hex20", "mesh.grading": 1.0}, settings.ungraded))
    rows = [
        announced(_measure(scene_with(scene, {**values, "mesh.size": 1e-3 * size}), name, size, truth))
        for name, values, sizes in series
        for size in sizes
    ]
    return Study(
        "mesh",
        "Mesh size and element",
        f"Seconds of meshing, assembling and reducing with {settings.modes} fixed-interface modes, files included; "
        "errors of the first natural frequency in the frequency range (or above it) and of the highest "
        "receptance of the tip.",
        reference_text(settings.reference, settings.reference_modes),
        uncertainty,
        tuple(rows),
    )


def reference_text(sizes: Sequence[float], modes: int) -> str:
    """What the reference is, in a sentence or two."""
    shown = ", ".join(f"{size:g}" for size in sizes)
    return (
        f"Reference: hex20 of {shown} mm, grading {REFERENCE_GRADING:g}, with {modes} modes, extrapolated to size 0 "
        f"by least squares with order {ORDER:g}; its uncertainty is the largest change when one size is left out."
    )


def reference_scene(scene: Scene, size: float, modes: int) -> Scene:
    """The scene on hex20 of a size in mm, with so many modes and strongly graded layers at the corners."""
    mesh = {"mesh.size": round(1e-3 * size, 9), "mesh.element": "hex20", "mesh.grading": REFERENCE_GRADING}
    return scene_with(scene, {**mesh, "rom.modes": modes})


def extrapolated(sizes: Sequence[float], values: Sequence[float], order: float = ORDER) -> tuple[float, float]:
    """Limit for vanishing element size and its relative uncertainty, from three sizes or more.

    Least squares of limit + c size^order. Not Richardson's extrapolation of two neighbours: the number of elements
    changes in steps with the size. The uncertainty is the largest change of the limit when one size is left out.
    """
    terms = np.column_stack([np.ones(len(sizes)), np.asarray(sizes, dtype=float) ** order])
    found = np.asarray(values, dtype=float)

    def limit(rows: list[int]) -> float:
        return float(np.linalg.lstsq(terms[rows], found[rows])[0][0])

    every = list(range(len(sizes)))
    best = limit(every)
    return best, max(abs(limit([row for row in every if row != omitted]) / best - 1.0) for omitted in every)


def _reference(scene: Scene, settings: MeshSettings, store: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Quantity -> value at size 0, and its relative uncertainty."""
    from rom import read_reduced_model

    values: list[dict[str, float]] = []
    for size in settings.reference:
        finer = reference_scene(scene, size, settings.reference_modes)
        model = read_reduced_model(cached_model(store, finer), with_basis=False)
        values.append(_linear_values(model, finer, mesh_of(finer)))
    limits = {name: extrapolated(settings.reference, [each[name] for each in values]) for name in values[0]}
    return {name: limit for name, (limit, _) in limits.items()}, {
        name: unsure for name, (_, unsure) in limits.items()
    }


def _linear_values(model: ReducedModel, scene: Scene, sector: SectorMesh) -> dict[str, float]:
    """First natural frequency in the range or above it, Hz, free and stuck; highest tip receptance free, m/N."""
    from rom.reduction.model_comparison import linear_responses

    responses = {
        response.condition: response for response in linear_responses(model, linear_operation(scene, sector))
    }
    free = responses["free"]
    stuck = responses.get("stuck", free)
    highest = float(np.max(np.abs(free.output)))
    return {FREE: float(free.natural_hz[0]), STUCK: float(stuck.natural_hz[0]), RECEPTANCE: highest}


def _measure(scene: Scene, series: str, size: float, truth: Mapping[str, float]) -> Measured:
    def make() -> tuple[tuple[dict[str, float], int], float]:
        with built_mesh(scene) as mesh:
            made = mesh.reduced()
            values = _linear_values(made.model(), scene, mesh.sector())
            return (values, int(made.facts["dofs"])), mesh.seconds + made.seconds

    (values, dofs), seconds = median_of(make)
    errors = {name: relative_error(value, truth[name]) for name, value in values.items()}
    return Measured(series, f"{size:g} mm", seconds, errors, {"dofs": dofs})
