"""From a scene to what a benchmark measures: models, timed as `shroud run` makes them, and response curves."""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline import read_scene
from pipeline.scene.geometry_parameters import geometry_parameters
from pipeline.scene.schema import Scene
from pipeline.stages.cache_keys import model_keys
from pipeline.stages.curve.curve_file import CURVE
from pipeline.stages.curve.curve_summary import CurveSummary, read_summary
from pipeline.stages.curve.solve_curve import solve_curve
from pipeline.stages.model.build_full_model import FULL_MODEL, make_full_model
from pipeline.stages.model.build_mesh import SECTOR, make_mesh
from pipeline.stages.model.build_reduced_model import FACTS, make_reduced_model
from pipeline.stages.model.model_files import REDUCED_MODEL
from pipeline.stages.scene_to_solver import contact_on_model, excitation, scene_modes
from pipeline.store.content_store import Store

if TYPE_CHECKING:
    from geometry import SectorMesh
    from nonlinear import ContactParameters, Excitation, ResponseCurve, SolverOptions
    from rom import FullModel, Material, ModalModel, ReducedModel


def scene_with(scene: Scene | Path | str, values: Mapping[str, Any]) -> Scene:
    """A scene, or the first of a file's sweep, with other values of dotted keys, which are taken as they are.

    Raises
    ------
    InputError
        The file cannot be read or is no scene.
    """
    if not isinstance(scene, Scene):
        scene = read_scene(scene).first
    for key, value in values.items():
        section, name = key.split(".")
        changed = getattr(scene, section).model_copy(update={name: value})
        scene = scene.model_copy(update={section: changed})
    return scene


def mesh_of(scene: Scene) -> SectorMesh:
    """The mesh of a scene's blade."""
    from geometry import build_sector

    return build_sector(**geometry_parameters(scene))


def material_of(scene: Scene) -> Material:
    """The material of a scene's blade."""
    from rom import Material

    assert scene.material is not None
    return Material(**scene.material.model_dump())


def full_model_of(scene: Scene, sector: SectorMesh) -> FullModel:
    """Mass and stiffness matrices on the mesh."""
    from rom import assemble

    assert scene.mesh is not None
    return assemble(sector, material_of(scene), scene.mesh.element)


def clamped_modes(full: FullModel, count: int, backend: str = "auto") -> tuple[np.ndarray, np.ndarray]:
    """Lowest modes of the blade clamped at its root: omega (m,) in rad/s, shapes (N, m); one BLAS thread."""
    from rom.linear_algebra.factorisation import factorise
    from rom.linear_algebra.threads import one_blas_thread
    from rom.reduction.fixed_interface_modes import lowest_modes

    moving = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    stiffness, mass = (matrix[moving][:, moving] for matrix in (full.stiffness, full.mass))
    with one_blas_thread():
        found = lowest_modes(mass, factorise(stiffness, backend), count)
    shapes = np.zeros((full.n_dofs, len(found)))
    shapes[moving] = found.shapes
    return found.omega, shapes


@dataclass(frozen=True)
class BuiltMesh:
    """Mesh and full model in a folder, and the seconds of meshing and assembling, files included."""

    folder: Path
    scene: Scene
    seconds: float

    def sector(self) -> SectorMesh:
        """The mesh."""
        from rom.files.sector_file import load_sector

        return load_sector(self.folder / SECTOR)

    def full_model(self) -> FullModel:
        """The assembled matrices."""
        from rom.files.full_model_file import load_full_model

        return load_full_model(self.folder / FULL_MODEL)

    def reduced(self, values: Mapping[str, Any] | None = None) -> BuiltModel:
        """The reduced model with other values of dotted keys."""
        scene = scene_with(self.scene, values or {})
        start = time.perf_counter()
        files = (self.folder / name for name in (SECTOR, FULL_MODEL))
        make_reduced_model(self.folder, *files, scene)
        seconds = time.perf_counter() - start
        facts = json.loads((self.folder / FACTS).read_text(encoding="utf-8"))
        return BuiltModel(self.folder / REDUCED_MODEL, scene, seconds, facts)


@dataclass(frozen=True)
class BuiltModel:
    """A reduced model in a file (until the next one in the same folder), seconds of its reduction, and its sizes."""

    file: Path
    scene: Scene
    seconds: float
    facts: Mapping[str, Any]

    def model(self) -> ReducedModel:
        """The reduced model, without its basis."""
        from rom import read_reduced_model

        return read_reduced_model(self.file, with_basis=False)


@contextmanager
def built_mesh(scene: Scene) -> Iterator[BuiltMesh]:
    """Mesh and full model of a scene in a temporary folder."""
    with tempfile.TemporaryDirectory(prefix="shroud-bench-") as name:
        folder = Path(name)
        start = time.perf_counter()
        make_mesh(folder, scene)
        make_full_model(folder, folder / SECTOR, scene)
        yield BuiltMesh(folder, scene, time.perf_counter() - start)


def cached_model(store: Path, scene: Scene) -> Path:
    """File of a scene's reduced model without its basis, built where `store` does not hold it; not timed."""
    from rom import write_reduced_model

    def build(folder: Path) -> None:
        with built_mesh(scene) as mesh:
            made = mesh.reduced()
            write_reduced_model(folder / REDUCED_MODEL, made.model())
            shutil.copyfile(mesh.folder / FACTS, folder / FACTS)

    key = model_keys(scene).reduce
    return Store(store).get("reference", key, build).file(REDUCED_MODEL)


def models_by_angle(scene: Path, angles: Iterable[float], store: Path) -> dict[float, Path]:
    """Shroud angle, degrees -> file of the reduced model of the scene's blade with that angle."""
    return {angle: cached_model(store, scene_with(scene, {"shroud.angle": angle})) for angle in sorted(set(angles))}


@dataclass(frozen=True)
class CurveProblem:
    """What `forced_response` takes. The options give the curve alone: no Floquet exponents, detached branches or
    truncation error."""

    modal: ModalModel
    contact: ContactParameters
    excitation: Excitation
    options: SolverOptions

    def solve(self, **changes: Any) -> ResponseCurve:
        """The curve with other solver options."""
        from nonlinear import forced_response

        return forced_response(self.modal, self.contact, self.excitation, replace(self.options, **changes))


def curve_problem(model_file: Path, scene: Scene) -> CurveProblem:
    """The response curve of a scene on a given reduced model."""
    from nonlinear import SolverOptions
    from rom import read_reduced_model

    model = read_reduced_model(model_file, with_basis=False)
    modal = scene_modes(scene, model)
    options = SolverOptions(scene.response.frequency, stability="folds", detached=False, truncation=False)
    return CurveProblem(modal, contact_on_model(scene, model), excitation(scene), options)


def curve_of_run(model_file: Path, scene: Scene) -> tuple[CurveSummary, float]:
    """The summary of a curve as `shroud run` solves and writes it, and its seconds."""
    import h5py

    with tempfile.TemporaryDirectory(prefix="shroud-bench-") as name:
        start = time.perf_counter()
        solve_curve(Path(name), model_file, scene, {})
        seconds = time.perf_counter() - start
        with h5py.File(Path(name) / CURVE, "r") as file:
            return read_summary(file), seconds
