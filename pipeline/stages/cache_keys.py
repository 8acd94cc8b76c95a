"""Keys of the store: what each stage's result depends on, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pipeline.scene.schema import Scene
from pipeline.stages.curve_file import nonlinear_values
from pipeline.stages.linear_operation import operation_values
from pipeline.store.fingerprints import fingerprint, source_fingerprint


@dataclass(frozen=True)
class Versions:
    """Fingerprints of the code behind each stage: packages of the house, the pipeline's own makers, and libraries."""

    mesh: str
    rom: str
    curve: str
    figures: str
    render: str

    @classmethod
    def current(cls) -> Versions:
        """Of the code as it is on disk now."""
        return cls(
            mesh=source_fingerprint(
                ["geometry", "pipeline/stages/build_model.py"], ["gmsh", "meshio", "numpy", "h5py"]
            ),
            rom=source_fingerprint(
                ["rom", "pipeline/stages/build_model.py", "pipeline/stages/linear_operation.py"],
                ["numpy", "scipy", "scikit-fem", "h5py"],
            ),
            curve=source_fingerprint(
                ["rom", "nonlinear", "pipeline/stages/curve_file.py", "pipeline/stages/scene_to_solver.py"],
                ["numpy", "scipy", "numba"],
            ),
            figures=source_fingerprint(["rom", "nonlinear", "pipeline/figures"], ["matplotlib", "numpy", "scipy"]),
            render=source_fingerprint(
                ["rom", "pipeline/render", "pipeline/stages/operating_shape.py"], ["pyvista", "vtk"]
            ),
        )


@dataclass(frozen=True)
class ModelKeys:
    """Keys of the mesh, the full model and the reduced model behind a curve."""

    mesh: str
    assemble: str
    reduce: str


def model_keys(scene: Scene, versions: Versions) -> ModelKeys:
    """Keys of the three stages that make a reduced model of the scene's blade."""
    assert scene.mesh is not None  # a scene that describes a blade has all of these
    assert scene.blade is not None
    assert scene.shroud is not None
    assert scene.material is not None
    mesh = fingerprint(
        {
            "blade": scene.blade.model_dump(),
            "shroud": scene.shroud.model_dump(),
            "mesh": scene.mesh.model_dump(exclude={"element"}),
            "code": versions.mesh,
        }
    )
    assemble = fingerprint(
        {
            "mesh": mesh,
            "material": scene.material.model_dump(),
            "element": scene.mesh.element,
            "code": versions.rom,
        }
    )
    reduced = fingerprint(
        {
            "assemble": assemble,
            "rom": _reduction_values(scene),
            "speed_rpm": scene.load.speed_rpm,
            "direction": scene.excitation.unit_direction,
            "at": scene.excitation.at,
        }
    )
    return ModelKeys(mesh, assemble, reduced)


def _reduction_values(scene: Scene) -> dict[str, Any]:
    """What the reduction depends on: with modes = "auto" also what the model is used for."""
    values: dict[str, Any] = scene.rom.model_dump(include={"modes", "frequency_limit", "contact_dofs"})
    if scene.rom.modes == "auto":
        values |= {"tolerance": scene.rom.tolerance, **operation_values(scene)}
    return values


def curve_key(scene: Scene, reduced: str, versions: Versions) -> str:
    """Key of a response curve on the reduced model with the key `reduced`."""
    return fingerprint({"reduce": reduced, "code": versions.curve, **nonlinear_values(scene)})
