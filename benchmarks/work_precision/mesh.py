"""Mesh size and element: error of the linear answers over seconds from the blade to its reduced model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.scene.reading import read_scene
from pipeline.scene.schema import Scene
from pipeline.stages.linear_operation import linear_operation
from work_precision.stages import built_mesh, extrapolated, kept_model, with_values
from work_precision.study import Measured, Quantity, Study, relative_error, said
from work_precision.timing import median_of

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import ReducedModel

ORDER = 1.0  # re-entrant corners: no better in the long run
REFERENCE, REFERENCE_MODES, REFERENCE_GRADING = (4.0, 2.8, 2.0, 1.6), 60, 8.0
NAMES = {
    "free": "natural frequencies, free",
    "stuck": "natural frequencies, stuck",
    "receptance": "tip receptance at its peak, free",
}


@dataclass(frozen=True)
class MeshSettings:
    """Element sizes (mm) of each element, those of the reference (hex20), and modes kept in each.

    alike : sizes of hex20 with layers that are all alike (`mesh.grading` = 1).
    """

    sizes: Mapping[str, Sequence[float]]
    reference: Sequence[float]
    modes: int = 40
    reference_modes: int = REFERENCE_MODES
    alike: Sequence[float] = ()


USUAL = MeshSettings(
    {
        "hex8": (8.0, 6.0, 4.0, 2.8, 2.0),
        "hex20": (8.0, 6.0, 5.0, 4.0, 3.2, 2.8, 2.4),
        "hex27": (8.0, 6.0, 4.0, 2.8),
    },
    REFERENCE,
    alike=(8.0, 6.0, 4.0, 2.8),
)
FULL = MeshSettings(
    {
        "hex8": (12.0, 8.0, 6.0, 4.0, 2.8, 2.0, 1.4),
        "hex20": (8.0, 7.0, 6.0, 5.0, 4.0, 3.2, 2.8, 2.4, 2.0, 1.7),
        "hex27": (10.0, 8.0, 6.0, 4.0, 2.8, 2.4),
    },
    (*REFERENCE, 1.25),
    alike=(8.0, 6.0, 5.0, 4.0, 3.2, 2.8, 2.4, 2.0),
)


def mesh_study(scene_file: Path, settings: MeshSettings, store: Path) -> Study:
    """Errors of the natural frequencies in the range, or the first above it, and of the highest tip receptance.

    Raises
    ------
    InputError : the scene cannot be read. GeometryError, MeshingError : a size does not fit the blade.
    """
    scene = with_values(read_scene(scene_file).first, {"rom.modes": settings.modes})
    truth = _reference(scene, settings, store)
    values = {name: value for name, (value, _) in truth.items()}
    alike = with_values(scene, {"mesh.grading": 1.0})
    series = [(element, scene, element, sizes) for element, sizes in settings.sizes.items()]
    series.append(("hex20, layers alike", alike, "hex20", settings.alike))
    rows = [
        said(_measure(there, name, element, size, values)) for name, there, element, sizes in series for size in sizes
    ]
    return Study(
        "mesh",
        "Mesh size and element",
        f"Seconds of meshing, assembling and reducing with {settings.modes} fixed-interface modes, files included; "
        "errors of the first natural frequency in the frequency range (or above it) and of the highest "
        "receptance of the tip.",
        reference_text(settings.reference, settings.reference_modes),
        tuple(Quantity(NAMES[name], unsure) for name, (_, unsure) in truth.items()),
        tuple(rows),
        {},
    )


def reference_text(sizes: Sequence[float], modes: int) -> str:
    """What the reference is, in a sentence or two."""
    shown = ", ".join(f"{size:g}" for size in sizes)
    return (
        f"Reference: hex20 of {shown} mm, grading {REFERENCE_GRADING:g}, with {modes} modes, extrapolated to size 0 "
        f"by least squares with order {ORDER:g}; its uncertainty is the largest change by one of them left out."
    )


def linear_values(model: ReducedModel, scene: Scene, sector: SectorMesh) -> dict[str, float]:
    """First natural frequency in the range or above it, Hz, free and stuck; highest tip receptance free, m/N."""
    import numpy as np

    from rom import linear_responses

    answers = {answer.condition: answer for answer in linear_responses(model, linear_operation(scene, sector))}
    free = answers["free"]
    stuck = answers.get("stuck", free)
    return {
        "free": float(free.natural_hz[0]),
        "stuck": float(stuck.natural_hz[0]),
        "receptance": float(np.max(np.abs(free.output))),
    }


def _reference(scene: Scene, settings: MeshSettings, store: Path) -> dict[str, tuple[float, float]]:
    """Name -> value at size 0 and its relative uncertainty."""
    from geometry import build_sector
    from pipeline.scene.consistency import geometry_parameters
    from rom import read_reduced_model

    values: list[dict[str, float]] = []
    for size in settings.reference:
        finer = reference_scene(scene, size, settings.reference_modes)
        model = read_reduced_model(kept_model(store, finer), with_basis=False)
        values.append(linear_values(model, finer, build_sector(*geometry_parameters(finer))))
    sizes = settings.reference
    return {name: extrapolated(sizes, [each[name] for each in values], ORDER) for name in NAMES}


def reference_scene(scene: Scene, size: float, modes: int) -> Scene:
    """The scene on hex20 of a size in mm, with so many modes and thin layers where the corners are."""
    mesh = {"mesh.size": round(1e-3 * size, 9), "mesh.element": "hex20", "mesh.grading": REFERENCE_GRADING}
    return with_values(scene, {**mesh, "rom.modes": modes})


def _measure(scene: Scene, series: str, element: str, size: float, truth: Mapping[str, float]) -> Measured:
    there = with_values(scene, {"mesh.size": 1e-3 * size, "mesh.element": element})

    def make() -> tuple[tuple[dict[str, float], int], float]:
        with built_mesh(there) as mesh:
            made = mesh.reduced({})
            values = linear_values(made.model(), there, mesh.sector())
            return (values, int(made.facts["dofs"])), mesh.seconds + made.seconds

    (values, dofs), seconds = median_of(make)
    errors = {NAMES[name]: relative_error(values[name], truth[name]) for name in NAMES}
    return Measured(series, f"{size:g} mm", seconds, errors, {"dofs": dofs})
