"""Mesh files of a scene checked before anything is computed, with what the reduction will need of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError
from pipeline.scene.reading import parameter_error
from pipeline.stages.model.build_mesh import check_contact_given, findings_of, read_own_sector
from pipeline.stages.model.build_reduced_model import boundary_choice
from pipeline.stages.model.scene_materials import check_materials, materials_of_file, materials_on
from pipeline.stages.scene_to_solver import touching_sector

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from pipeline.scene.reading import SceneFile
    from pipeline.scene.schema import Scene


def check_meshes(file: SceneFile, force: bool = False) -> tuple[list[str], list[str]]:
    """Read the mesh files of a scene; a line for each that makes no sector, and warnings about the others."""
    lines: dict[str, None] = {}
    warnings: dict[str, None] = {}
    known: set[object] = set()
    for member in file.members:
        scene = member.scene
        if scene.mesh in known:
            continue
        known.add(scene.mesh)
        try:
            own = read_own_sector(scene)
            warnings |= dict.fromkeys(own.findings.warnings)
            found = findings_of(own)
            warnings |= dict.fromkeys(check_materials(scene, found, force))
            check_reduction(scene, own.sector, found)
            warnings |= dict.fromkeys(_nothing_presses(scene, own.findings.notes))
        except InputError as error:
            lines[str(error)] = None
        except ValueError as error:
            lines[str(parameter_error(file.path, member, error))] = None
    return list(lines), list(warnings)


def _nothing_presses(scene: Scene, notes: Sequence[str]) -> list[str]:
    """Bodies that contacts alone hold in a scene at rest without interference or preload."""
    given = [(contact.interference, contact.preload) for contact in scene.contacts.values()]
    if scene.load.speed_rpm or any(each not in (0.0, None) for pair in given for each in pair):
        return []
    told = "; at rest, without contact.interference or preload, only loads may press them together"
    return [f"{note}{told}" for note in notes if note.endswith("held by contacts alone")]


def check_reduction(scene: Scene, sector: SectorMesh, found: dict[str, Any]) -> None:
    """Refuse what the reduction of a mesh from a file would refuse: contact dofs, loads, outputs, elements."""
    from rom.reduction.boundary_dofs import check_reducible

    check_contact_given(scene, found)
    given = {name: material.properties for name, material in materials_of_file(scene, found).items()}
    materials = materials_on(scene, given, sector)
    touched = touching_sector(scene, sector)
    check_reducible(touched, boundary_choice(scene, touched, materials))
