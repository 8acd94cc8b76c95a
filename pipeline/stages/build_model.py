"""Mesh, full model and reduced model, each written as the files of one store entry."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.scene.consistency import geometry_parameters
from pipeline.scene.schema import DEFAULT_MODES, Scene
from pipeline.stages.linear_operation import linear_operation

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import BoundaryChoice, FullModel

SECTOR = "sector.h5"
MESH_FILES = ("mesh.vtu", "mesh.msh")
FULL_MODEL = "full.h5"
REDUCED_MODEL = "rom.h5"
AUGMENTED_MODEL = "augmented.h5"
FACTS = "facts.json"


def make_mesh(folder: Path, scene: Scene) -> None:
    """Mesh the sector: `sector.h5` for the next stage, mesh.vtu and mesh.msh for people and other programs."""
    from geometry import build_sector, export_sector
    from rom import save_sector

    sector = build_sector(*geometry_parameters(scene))
    save_sector(folder / SECTOR, sector)
    for name in MESH_FILES:
        export_sector(folder / name, sector)


def make_full_model(folder: Path, sector_file: Path, scene: Scene) -> None:
    """Assemble stiffness, mass and centrifugal load of the sector into `full.h5`."""
    from rom import Material, assemble, load_sector, save_full_model

    assert scene.material is not None  # a scene that describes a blade has both
    assert scene.mesh is not None
    material = Material(**scene.material.model_dump())
    full = assemble(load_sector(sector_file), material, scene.mesh.element)
    save_full_model(folder / FULL_MODEL, full)


def make_reduced_model(
    folder: Path, sector_file: Path, full_file: Path, scene: Scene, *, store_basis: bool = True
) -> None:
    """Reduce the blade to `rom.h5`, at its speed, and note its sizes in `facts.json`.

    store_basis: with what expands shapes to the mesh, which is many times the size of all the rest.

    `modes` there: fixed-interface modes of the model; `highest_mode_hz`: highest frequency of those computed.
    `augmented.h5`: the model augmented by residual modes, where there are few enough contact nodes.
    """
    from rom import (
        ReductionOptions,
        load_full_model,
        load_sector,
        reduce_sector,
        reduce_to_tolerance,
        write_reduced_model,
    )

    sector = load_sector(sector_file)

    def full() -> FullModel:
        return at_speed(load_full_model(full_file), sector, scene)

    modes, limit = scene.rom.modes, scene.rom.frequency_limit
    boundary = boundary_choice(scene)
    if modes == "auto":
        operations = [linear_operation(scene, sector)]
        made = reduce_to_tolerance(full, sector, scene.rom.tolerance, operations, boundary, store_basis=store_basis)
    else:
        number = DEFAULT_MODES if modes is None and limit is None else modes
        made = reduce_sector(full, sector, ReductionOptions(number, limit, store_basis), boundary, augment=True)
    model = made.model
    write_reduced_model(folder / REDUCED_MODEL, model)
    if made.augmented is not None:
        write_reduced_model(folder / AUGMENTED_MODEL, made.augmented)
    facts: dict[str, Any] = {"dofs": made.dofs, "reduced_dofs": model.size}
    facts |= {"n_contacts": model.n_contacts, "modes": made.modes, "highest_mode_hz": made.highest_mode_hz}
    (folder / FACTS).write_text(json.dumps(facts))


def boundary_choice(scene: Scene) -> BoundaryChoice:
    """Excitation and contact dofs of a scene."""
    from rom import BoundaryChoice

    return BoundaryChoice(scene.excitation.unit_direction, scene.excitation.at, scene.rom.contact_dofs)


def at_speed(full: FullModel, sector: SectorMesh, scene: Scene) -> FullModel:
    """The full model at the scene's speed of rotation."""
    from rom import Material, stiffen_by_rotation

    if scene.load.speed_rpm == 0.0:
        return full
    assert scene.material is not None
    return stiffen_by_rotation(full, sector, Material(**scene.material.model_dump()), scene.load.speed_rpm)
