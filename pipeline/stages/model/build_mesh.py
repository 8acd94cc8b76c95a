"""Mesh of the sector, written as the files of one store entry.

A mesh file of another program is read in isolation, turned to our axes, and what was found in it is kept.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError, input_error, reason_of
from pipeline.process.isolated_reading import read_apart
from pipeline.scene.dotted_keys import NO_INTERFACE
from pipeline.scene.fields import values_for
from pipeline.scene.geometry_parameters import sector_of
from pipeline.scene.input_files import Contents, copies, file_size
from pipeline.scene.size_limits import LARGEST_MODEL, LARGEST_STRAIN, MARGIN, allowed_speed, centrifugal_strain
from pipeline.stages.model.scene_materials import (
    FINDINGS,
    check_materials,
    elements_by_kind,
    extent,
    own_findings,
)

if TYPE_CHECKING:
    from geometry.imported_mesh import ImportedMesh
    from geometry.own_mesh.own_sector import OwnSector
    from geometry.own_mesh.sector_choice import SectorChoice
    from geometry.sector import SectorMesh
    from pipeline.scene.mesh_section import Mesh
    from pipeline.scene.schema import Scene


READER = "the reader of mesh files"
ALLOWED = "a mesh file with solid elements"
MEMORY, MEMORY_PER_BYTE = 2 * 1024**3, 100  # that reading may take: bytes, and bytes for each of the file


def read_own_sector(scene: Scene) -> OwnSector:
    """The sector in the mesh file of a scene."""
    from geometry.own_mesh.own_sector import sector_from_mesh

    assert scene.mesh is not None
    mesh = with_materials(read_mesh_file(scene.mesh.file or "", scene.contents), frozenset(scene.materials))
    return sector_from_mesh(mesh, sector_choice(scene.mesh))


def read_mesh_file(file: str, contents: Contents | None = None) -> ImportedMesh:
    """A mesh file, read in isolation."""
    from geometry.errors import MeshFileError
    from geometry.mesh_files.read import read_mesh

    try:
        memory = MEMORY + MEMORY_PER_BYTE * file_size(file)
        with copies([file], contents or {}) as copy:
            mesh = read_apart(Path(file), ALLOWED, partial(read_mesh, copy(file)), READER, memory)
    except MeshFileError as error:
        raise InputError(reason_of(error)) from None
    mesh = replace(mesh, path=file)  # messages name the file, not its copy
    if mesh.n_elements > LARGEST_MODEL:
        raise input_error(file, "", f"{mesh.n_elements} elements", f"{LARGEST_MODEL} at most")
    return mesh


def sector_choice(mesh: Mesh) -> SectorChoice:
    """What [mesh] says about its file."""
    from geometry.own_mesh.sector_choice import InterfaceChoice, SectorChoice

    assert mesh.n_blades is not None
    sets = {role: name for role, name in mesh.sets.model_dump().items() if name is not None}
    interfaces = {name: InterfaceChoice(**each.model_dump()) for name, each in mesh.interface.items()}
    return SectorChoice(**values_for(SectorChoice, mesh) | {"sets": sets, "interfaces": interfaces})


def with_materials(mesh: ImportedMesh, names: frozenset[str]) -> ImportedMesh:
    """The mesh with the elements of the sets that are named as materials in blocks of their own, of that material."""
    import numpy as np

    from geometry.elements import ElementBlock

    known = {name.lower() for name in (*mesh.materials, *(block.material for block in mesh.blocks))}
    for name in sorted(name for name in names if name.lower() not in known):
        members = next((rows for key, rows in mesh.element_sets.items() if key.lower() == name.lower()), None)
        if members is None:
            continue
        blocks, labels, sources = [], [], []
        for index, block in enumerate(mesh.blocks):
            inside = np.zeros(len(block), dtype=bool)
            inside[members[members[:, 0] == index, 1]] = True
            for chosen, material in ((~inside, block.material), (inside, name)):
                rows = np.flatnonzero(chosen)
                if len(rows):
                    blocks.append(ElementBlock(block.kind, block.nodes[rows], material))
                    labels.append(mesh.element_labels[index][rows])
                    sources.append((index, rows))
        mesh = _renumbered(replace(mesh, blocks=tuple(blocks), element_labels=tuple(labels)), mesh, sources)
    return mesh


def _renumbered(mesh: ImportedMesh, before: ImportedMesh, sources: list[tuple[int, Any]]) -> ImportedMesh:
    """Element sets and surfaces by the new blocks; `sources`: block and rows before of each new block."""
    import numpy as np

    from geometry.elements import ElementSides

    place = [np.zeros((len(block), 2), dtype=np.int64) for block in before.blocks]
    for new, (old, rows) in enumerate(sources):
        place[old][rows, 0] = new
        place[old][rows, 1] = np.arange(len(rows))
    first = np.concatenate([[0], np.cumsum([len(block) for block in before.blocks])])
    table = np.concatenate(place)
    sets = {name: table[first[rows[:, 0]] + rows[:, 1]] for name, rows in before.element_sets.items()}
    surfaces = {}
    for name, sides in before.surfaces.items():
        moved = table[first[sides.block] + sides.element]
        surfaces[name] = ElementSides(moved[:, 0], moved[:, 1], sides.side)
    return replace(mesh, element_sets=sets, surfaces=surfaces)


def write_findings(folder: Path, own: OwnSector) -> None:
    """What was found in the file, for report, summary and the stages that need materials."""
    (folder / FINDINGS).write_text(json.dumps(findings_of(own)), encoding="utf-8")


def findings_of(own: OwnSector) -> dict[str, Any]:
    """What was found in the file, as plain values."""
    from rom.finite_elements.discretisation import element_warnings

    sector = own.sector
    return {
        "n_blades": sector.n_blades,
        "elements": elements_by_kind(sector),
        "points": len(sector.points),
        "touches": sector.main != NO_INTERFACE,
        "materials": {name: dict(numbers) for name, numbers in own.materials.items()},
        "used": sorted({block.material for block in sector.blocks}),
        "material_notes": {name: list(lines) for name, lines in own.material_notes.items()},
        "unread_materials": dict(own.unread_materials),
        "units": list(own.units),
        "findings": [*own.findings.lines, *element_warnings(sector)],
        **extent(sector),
    }


def check_contact_given(scene: Scene, found: dict[str, Any]) -> None:
    """Refuse a mesh from a file with contact faces in a scene without [contact]."""
    from geometry.errors import ParameterError

    if found.get("touches", True) and not scene.contact.model_fields_set:
        allowed = "a table [contact] with normal_stiffness, tangential_stiffness, friction: the mesh has such faces"
        raise ParameterError("contact", "", "missing", allowed)


def check_on_mesh(scene: Scene, folder: Path, force: bool) -> list[str]:
    """Refuse materials, a loaded point and a speed that do not fit a mesh from a file; warnings."""
    from geometry.errors import ParameterError

    found, at = own_findings(folder), scene.excitation.at
    check_contact_given(scene, found)
    warnings = check_materials(scene, found, force)
    radii = found["hub_radius"], found["tip_radius"]
    margin = MARGIN * (radii[1] - radii[0])
    if not isinstance(at, str):
        places = (at[0], "x_low", "x_high"), (at[1], "y_low", "y_high"), (at[2], "z_low", "z_high")
        if any(not found[low] - margin <= value <= found[high] + margin for value, low, high in places):
            ends = ", ".join(f"{axis} {found[f'{axis}_low']:.4g} to {found[f'{axis}_high']:.4g}" for axis in "xyz")
            allowed = f"a point of the blade, turned to the axes of the program: {ends}, m"
            raise ParameterError("excitation", "at", list(at), allowed)
    strain = centrifugal_strain(scene, radii)
    if strain > LARGEST_STRAIN:
        speed = scene.load.speed_rpm
        raise ParameterError("load", "speed_rpm", speed, allowed_speed(speed, strain))
    return warnings


SECTOR = "sector.h5"
MESH_FILES = ("mesh.vtu", "mesh.msh")


def make_mesh(folder: Path, scene: Scene) -> None:
    """Mesh the sector: `sector.h5` for the next stage, mesh.vtu and mesh.msh for people and other programs.

    Of a mesh from a file also what was found in it.
    """
    from geometry.exchange import export_sector
    from rom.files.sector_file import save_sector

    sector = sector_of(scene) if scene.mesh_file is None else _from_file(folder, scene)
    save_sector(folder / SECTOR, sector)
    for name in MESH_FILES:
        try:
            export_sector(folder / name, sector)
        except ImportError:  # a library for 15-node wedges, which may be installed: pip install 'shroud[meshes]'
            export_sector(folder / name, without_mid_sides(sector))


def without_mid_sides(sector: SectorMesh) -> SectorMesh:
    """The mesh by the corners of its 15-node wedges; its points stay."""
    blocks = [
        replace(block, kind="wedge6", nodes=block.nodes[:, :6]) if block.kind == "wedge15" else block
        for block in sector.blocks
    ]
    return replace(sector, blocks=tuple(blocks))


def _from_file(folder: Path, scene: Scene) -> SectorMesh:
    own = read_own_sector(scene)
    write_findings(folder, own)
    return own.sector
