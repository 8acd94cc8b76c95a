"""Mesh, full model and reduced model, each written as the files of one store entry."""

from __future__ import annotations

import json
from pathlib import Path

from pipeline.checks import geometry_parameters
from pipeline.scene import DEFAULT_MODES, Scene

SECTOR = "sector.h5"
MESH_FILES = ("mesh.vtu", "mesh.msh")
FULL_MODEL = "full.h5"
REDUCED_MODEL = "rom.h5"
FACTS = "facts.json"


def make_mesh(folder: Path, scene: Scene) -> None:
    """Mesh the sector: `sector.h5` for the next stage, mesh.vtu and mesh.msh for people and other programs."""
    from geometry import build_sector, export_sector, save_sector

    sector = build_sector(*geometry_parameters(scene))
    save_sector(folder / SECTOR, sector)
    for name in MESH_FILES:
        export_sector(folder / name, sector)


def make_full_model(folder: Path, sector_file: Path, scene: Scene) -> None:
    """Assemble stiffness, mass and centrifugal load of the sector into `full.h5`."""
    from geometry import load_sector
    from rom import Material, assemble, save_full_model

    assert scene.material is not None  # a scene that describes a blade has both
    assert scene.mesh is not None
    material = Material(**scene.material.model_dump())
    full = assemble(load_sector(sector_file), material, scene.mesh.element)
    save_full_model(folder / FULL_MODEL, full)


def make_reduced_model(folder: Path, sector_file: Path, full_file: Path, scene: Scene) -> None:
    """Reduce the blade to `rom.h5`, at its speed, and note its sizes in `facts.json`."""
    from geometry import load_sector
    from rom import Material, ReductionOptions, load_full_model, reduce, spin, write_reduced_model

    assert scene.material is not None
    sector, full = load_sector(sector_file), load_full_model(full_file)
    if scene.load.speed_rpm > 0.0:
        full = spin(full, sector, Material(**scene.material.model_dump()), scene.load.speed_rpm)
    modes, limit = scene.rom.modes, scene.rom.frequency_limit
    options = ReductionOptions(
        modes=DEFAULT_MODES if modes is None and limit is None else modes,
        frequency_limit=limit,
        store_basis=True,
    )
    model = reduce(
        full,
        sector,
        options,
        excitation_direction=scene.excitation.unit_direction,
        excitation_at=scene.excitation.at,
    )
    write_reduced_model(folder / REDUCED_MODEL, model)
    facts = {"dofs": int(full.stiffness.shape[0]), "reduced_dofs": model.size, "n_contacts": model.n_contacts}
    (folder / FACTS).write_text(json.dumps(facts))
