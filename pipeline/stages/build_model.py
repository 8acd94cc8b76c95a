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
    from rom import FullModel

SECTOR = "sector.h5"
MESH_FILES = ("mesh.vtu", "mesh.msh")
FULL_MODEL = "full.h5"
REDUCED_MODEL = "rom.h5"
AUGMENTED_MODEL = "enriched.h5"
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

    `modes` there: fixed-interface modes kept; `highest_mode_hz`: how far such modes are known. `enriched.h5`: the model with
    what stands for the modes left out, where there are few enough contact nodes.
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
    dofs = scene.rom.contact_dofs
    load: dict[str, Any] = {
        "excitation_direction": scene.excitation.unit_direction,
        "excitation_at": scene.excitation.at,
    }
    if modes == "auto":
        operations = [linear_operation(scene, sector)]
        made = reduce_to_tolerance(
            full, sector, scene.rom.tolerance, operations, store_basis=store_basis, contact_dofs=dofs, **load
        )
    else:
        number = DEFAULT_MODES if modes is None and limit is None else modes
        options = ReductionOptions(number, limit, store_basis, contact_dofs=dofs)
        made = reduce_sector(full, sector, options, enrich=True, **load)
    model = made.model
    write_reduced_model(folder / REDUCED_MODEL, model)
    if made.enriched is not None:
        write_reduced_model(folder / AUGMENTED_MODEL, made.enriched)
    facts: dict[str, Any] = {"dofs": made.dofs, "reduced_dofs": model.size}
    facts |= {"n_contacts": model.n_contacts, "modes": made.modes, "highest_mode_hz": made.highest_mode_hz}
    (folder / FACTS).write_text(json.dumps(facts))


def at_speed(full: FullModel, sector: SectorMesh, scene: Scene) -> FullModel:
    """The full model at the scene's speed of rotation."""
    from rom import Material, spin

    if scene.load.speed_rpm == 0.0:
        return full
    assert scene.material is not None
    return spin(full, sector, Material(**scene.material.model_dump()), scene.load.speed_rpm)
