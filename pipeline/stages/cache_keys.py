"""Keys of the store: hashes of what each stage's result depends on, and of nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.scene.input_files import content_hash
from pipeline.scene.schema import Scene
from pipeline.stages.code_fingerprint import code_fingerprint
from pipeline.store.fingerprints import fingerprint

# Modules that compute the result of a stage. What these import counts with them.
MESH_CODE = "pipeline.stages.model.build_mesh"
FULL_MODEL_CODE = "pipeline.stages.model.build_full_model"
REDUCED_MODEL_CODE = "pipeline.stages.model.build_reduced_model"
MATRICES_CODE = "pipeline.stages.model.build_from_matrices"
OPTIONAL_PARTS = ("shroud", "disk", "snubber", "platform")  # of a blade
CURVE_CODE = "pipeline.stages.curve.solve_curve"
EXTENSION_CODE = "pipeline.stages.curve.extend_curve"
CARRIED_CODE = "pipeline.stages.curve.carry_branches"


@dataclass(frozen=True)
class ModelKeys:
    """Keys of the mesh, the full model and the reduced models behind a curve."""

    mesh: str
    assemble: str
    blade: str  # reduced, without its damper
    reduce: str


def model_keys(scene: Scene) -> ModelKeys:
    """Keys of the three stages that make a reduced model of the scene's blade; with [model] there is no mesh."""
    if scene.model is not None:
        return _matrix_model_keys(scene)
    mesh = fingerprint({**_mesh_inputs(scene), "code": code_fingerprint(MESH_CODE)})
    assemble = fingerprint(
        {
            "mesh": mesh,
            **_material_inputs(scene),
            "code": code_fingerprint(FULL_MODEL_CODE),
        }
    )
    blade = fingerprint(
        {
            "assemble": assemble,
            "rom": _reduction_inputs(scene),
            **rotation_inputs(scene),
            "direction": scene.excitation.unit_direction,
            "at": scene.excitation.at,
            **load_inputs(scene),
            "code": code_fingerprint(REDUCED_MODEL_CODE),
        }
    )
    if scene.damper is None or not scene.damper_touches:
        return ModelKeys(mesh, assemble, blade, blade)
    return ModelKeys(mesh, assemble, blade, fingerprint({"blade": blade, "damper": scene.damper.model_dump()}))


def _matrix_model_keys(scene: Scene) -> ModelKeys:
    """Keys by the content of the files of [model], whatever their names."""
    assert scene.model is not None
    code = code_fingerprint(MATRICES_CODE)
    content = {name: (Path(file).suffix.lower(), _content(scene, file)) for name, file in scene.model.files.items()}
    said = scene.model.model_dump(exclude=set(scene.model.files))
    assemble = fingerprint({"files": content, "model": said, "code": code})
    excitation = {"direction": scene.excitation.unit_direction, "at": scene.excitation.at, **load_inputs(scene)}
    reduced = fingerprint({"assemble": assemble, "rom": _reduction_inputs(scene), **excitation, "code": code})
    return ModelKeys("", assemble, reduced, reduced)


def _mesh_inputs(scene: Scene) -> dict[str, Any]:
    """What the mesh of a scene depends on: blade and shroud, or the content of a mesh file and what is said of it."""
    assert scene.mesh is not None  # a scene that describes a blade has all of these
    if scene.mesh_file is not None:
        choice = scene.mesh.model_dump(exclude={"file", "size", "element", "grading"})
        return {"file": _content(scene, scene.mesh_file), "mesh": choice, "materials": sorted(scene.materials)}
    assert scene.blade is not None
    made_here, blade = {"size", "contact_grid", "grading"}, scene.blade.model_dump()
    if scene.blade.sections is not None:
        blade["sections"] = _content(scene, scene.blade.sections)
    return {
        "blade": blade,
        **{name: part.model_dump() for name in OPTIONAL_PARTS if (part := getattr(scene, name)) is not None},
        **({"damper": True} if scene.has_damper else {}),
        "mesh": scene.mesh.model_dump(include=made_here),
    }


def _material_inputs(scene: Scene) -> dict[str, Any]:
    """What the matrices of a mesh depend on: materials, finite element."""
    assert scene.mesh is not None
    material = None if scene.material is None else scene.material.model_dump()
    named = {name: m.model_dump() for name, m in scene.materials.items()}
    heat = _heat_inputs(scene) if scene.load.temperature is not None and _over_temperature(scene) else {}
    if scene.mesh_file is not None:
        return {"material": material, "materials": named, **heat}
    return {"material": material, "element": scene.mesh.element, **({"materials": named} if named else {}), **heat}


def _over_temperature(scene: Scene) -> bool:
    """Whether materials may depend on the temperature: those of the scene do, or a file may have such ones."""
    given = (scene.material, *scene.materials.values())
    return scene.mesh_file is not None or any(each is not None and each.at for each in given)


def _heat_inputs(scene: Scene) -> dict[str, Any]:
    """The temperature field, with the content of its file; None without one."""
    load = scene.load
    if load.temperature is None:
        return {"temperature": None}
    return {"temperature": [_without_file(scene, load.temperature), load.temperature_factor]}


def curve_key(scene: Scene, reduced: str) -> str:
    """Key of a response curve on the reduced model with the key `reduced`."""
    return fingerprint({"reduce": reduced, "code": code_fingerprint(CURVE_CODE), **_curve_inputs(scene)})


def extension_key(curve: str, neighbours: Sequence[tuple[str, str]]) -> str:
    """Key of a curve extended with the branches of its neighbours, of which the keys and labels are given."""
    code = code_fingerprint(EXTENSION_CODE)
    return fingerprint({"curve": curve, "neighbours": sorted(neighbours), "code": code})


def carried_key(curves: Sequence[str], steps: Sequence[tuple[str, str, str]]) -> str:
    """Key of the branches carried across a sweep: its curves, and for every step two curves and its label."""
    code = code_fingerprint(CARRIED_CODE)
    return fingerprint({"curves": sorted(curves), "steps": sorted(steps), "code": code})


def linear_operation_inputs(scene: Scene) -> dict[str, Any]:
    """The scene values that a linear operation depends on, besides those of the blade."""
    return {
        "engine_order": scene.excitation.engine_order,
        **stiffness_inputs(scene),
        "frequency": scene.response.frequency,
        "damping_ratio": scene.response.damping_ratio,
        "rayleigh": scene.response.rayleigh,
    }


def stiffness_inputs(scene: Scene) -> dict[str, Any]:
    """The contact stiffness of a scene: that of [contact], of interfaces with their own, and which of them touch."""
    contact, own = scene.contact, ("normal_stiffness", "tangential_stiffness")
    values: dict[str, Any] = {"normal": contact.normal_stiffness, "tangential": contact.tangential_stiffness}
    named = {name: table.model_dump(include=set(own)) for name, table in scene.interface.items()}
    return {**values, **({"interface": named} if named else {}), **_touching(scene)}


def contact_inputs(scene: Scene) -> dict[str, Any]:
    """All contact parameters of a scene."""
    named = {name: table.given for name, table in scene.interface.items()}
    return {"contact": scene.contact.model_dump(exclude={"interfaces"}), **({"interface": named} if named else {})}


def _touching(scene: Scene) -> dict[str, Any]:
    """Names of the interfaces that touch; nothing where it is all of them."""
    chosen = scene.contact.interfaces
    return {} if chosen is None else {"interfaces": sorted(chosen)}


def rotation_inputs(scene: Scene) -> dict[str, Any]:
    """What the stiffness at speed depends on, besides the blade; the equilibrium only where there is a speed."""
    speed = scene.load.speed_rpm
    return {"speed_rpm": speed, "equilibrium": scene.load.equilibrium if speed else None}


def rotation_of_response(scene: Scene) -> dict[str, Any]:
    """What a response depends on beside the blade: the speed, and Coriolis forces where they may act."""
    load = scene.load
    return {"speed_rpm": load.speed_rpm, **({"coriolis": True} if load.coriolis and load.speed_rpm else {})}


def modal_inputs(scene: Scene) -> dict[str, Any]:
    """What the modal model of a reduced model depends on: damping, speed, Coriolis forces and flow."""
    response = scene.response
    values = {"damping": [response.damping_ratio, response.rayleigh], "load": rotation_of_response(scene)}
    return values if scene.aero is None else {**values, "aero": scene.aero_inputs()}


def load_inputs(scene: Scene) -> dict[str, Any]:
    """Loads and outputs that a reduced model depends on, with the content of their files; none: nothing."""
    excitation, load = scene.excitation, scene.load
    outputs = [output.model_dump() for output in scene.output if not output.of_model]
    if not (excitation.load or load.force or load.pressure or load.temperature or outputs):
        return {}
    return {
        "loads": {
            "excitation": [_without_file(scene, item) for item in excitation.load],
            "force": [_without_file(scene, item) for item in load.force],
            "pressure": [item.model_dump() for item in load.pressure],
            **_heat_inputs(scene),
            "outputs": outputs,
        }
    }


def _without_file(scene: Scene, item: Any) -> dict[str, Any]:
    """A table with the content of its file in place of its name."""
    values: dict[str, Any] = item.model_dump()
    if values.get("file") is not None:
        values["file"] = _content(scene, values["file"])
    return values


def _content(scene: Scene, file: str) -> str:
    """Hash of an input file when the scene was read; where it is not known, of the file as it is now."""
    return scene.contents.get(file) or content_hash(file)


def _reduction_inputs(scene: Scene) -> dict[str, Any]:
    """What the reduction depends on; with modes = "auto" also the linear operation that the model is used for."""
    rom = scene.rom
    values: dict[str, Any] = {
        "modes": rom.fixed_interface_modes,
        "frequency_limit": rom.frequency_limit,
        "contact_dofs": rom.contact_dofs,
        **_touching(scene),
    }
    if rom.nodal_diameters is not None:
        values["nodal_diameters"] = rom.nodal_diameters
    if rom.modes == "auto":
        values |= {"tolerance": rom.tolerance, **linear_operation_inputs(scene)}
    return values


def _curve_inputs(scene: Scene) -> dict[str, Any]:
    """The scene values that a response curve depends on, besides those of the reduced model."""
    values: dict[str, Any] = {
        **contact_inputs(scene),
        "excitation": {"engine_order": scene.excitation.engine_order, "force": scene.excitation.force},
        "response": scene.response.model_dump(),
        "load": rotation_of_response(scene),
    }
    if scene.excitation.harmonic:
        values["harmonics"] = [item.model_dump() for item in scene.excitation.harmonic]
    if scene.output:
        values["outputs"] = [output.name for output in scene.output]
    if scene.aero is not None:
        values["aero"] = scene.aero_inputs()
    if scene.punch_key:
        values["material"] = scene.material.model_dump() if scene.material else None
    return values
