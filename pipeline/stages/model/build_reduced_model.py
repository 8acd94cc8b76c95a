"""Reduced model of the blade at its speed, written as the files of one store entry.

A sector with cut faces adds their motions, the stiffness of the blade and the names of the modes.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.stages.model.model_files import CUTS, FAMILIES, REDUCED_MODEL, is_joined, read_families
from pipeline.stages.model.scene_loads import scene_loads, static_support, with_modal_excitation, with_static_loads
from pipeline.stages.model.scene_materials import scene_materials
from pipeline.stages.scene_to_solver import (
    PLATFORM,
    interface_facts,
    linear_operation,
    touching,
    touching_sector,
)

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene
    from rom.cyclic.mode_families import ModeFamilies
    from rom.cyclic.reduced_model import ReducedModel
    from rom.finite_elements.full_model import FullModel
    from rom.finite_elements.material import Materials
    from rom.reduction.boundary_dofs import BoundaryChoice
    from rom.reduction.craig_bampton import Reduction


def with_interface(full: FullModel, sector: SectorMesh, scene: Scene, boundary: BoundaryChoice) -> BoundaryChoice:
    """The boundary dofs with those of the cut faces."""
    from rom.cyclic_sector.cyclic_faces import cyclic_faces
    from rom.cyclic_sector.interface_motion import InterfaceOptions, interface_motion

    faces = cyclic_faces(full, sector)
    return interface_motion(full, sector, faces, boundary, InterfaceOptions(scene.rom.nodal_diameters))


def with_blade_stiffness(
    full: FullModel, sector: SectorMesh, materials: Materials, model: ReducedModel
) -> ReducedModel:
    """A reduced model with its basis and the stiffness of its blade, which mistuning changes."""
    from rom.cyclic_sector.part_stiffness import blade_stiffness

    assert model.basis is not None
    return replace(model, blade_stiffness=blade_stiffness(full, sector, materials, model.basis, _rim_radius(sector)))


def write_families(
    folder: Path,
    full: FullModel | None,
    sector: SectorMesh,
    materials: Materials,
    model: ReducedModel,
) -> None:
    """Write the rows of a reduced model with its basis that name its modes. `full` is that of a sector of a disk."""
    from rom.cyclic.mode_families import blade_families
    from rom.cyclic_sector.part_stiffness import mode_families

    assert model.basis is not None
    if full is None:
        _write_families(folder, blade_families(sector, model.basis))
    else:
        _write_families(folder, mode_families(full, sector, materials, model.basis, _rim_radius(sector)))


def _write_families(folder: Path, families: ModeFamilies) -> None:
    from rom.files.hdf5 import new_hdf5

    with new_hdf5(folder / FAMILIES) as file:
        file["airfoil"], file["disk"] = families.airfoil, families.disk


def _rim_radius(sector: SectorMesh) -> float:
    """Where the disk ends: at the largest radius of the cut faces."""
    import numpy as np

    cut = np.concatenate([sector.points[sector.node_sets[name]] for name in CUTS])
    return float(np.hypot(cut[:, 1], cut[:, 2]).max())


AUGMENTED_MODEL = "augmented.h5"
FACTS = "facts.json"
MOTIONS = "cut_face_motions"  # in the facts of the sector of a disk
FREQUENCIES = 6  # of each wave, compared with those of the whole mesh


def make_reduced_model(
    folder: Path,
    sector_file: Path,
    full_file: Path,
    scene: Scene,
    *,
    store_basis: bool = True,
    assembled: list[FullModel] | None = None,
) -> None:
    """Reduce the blade without its damper to `rom.h5`, at its speed, and write its sizes into `facts.json`.

    In `facts.json`, `modes` is the number of fixed-interface modes and `highest_mode_hz` the frequency up to which
    they are known. Of the sector of a disk `cut_face_motions` is the number of motions kept of a cut face, and
    `wave_error` the largest relative error of its six lowest frequencies with free contacts against the whole mesh,
    in waves of the nodal diameters `wave_error_at`.
    """
    from rom.files.full_model_file import load_full_model
    from rom.files.sector_file import load_sector
    from rom.reduction.craig_bampton import ReductionOptions, reduce_sector
    from rom.reduction.mode_selection import reduce_to_tolerance

    whole = load_sector(sector_file)
    materials = scene_materials(scene, sector_file, whole)
    sector = touching_sector(scene, whole)

    def full() -> FullModel:
        return at_speed(assembled.pop() if assembled else load_full_model(full_file), sector, scene, materials)

    modes, limit = scene.rom.fixed_interface_modes, scene.rom.frequency_limit
    boundary = boundary_choice(scene, sector, materials)
    joined = full() if is_joined(sector) else None
    if joined is not None:
        boundary = with_interface(joined, sector, scene, boundary)
    source = full if joined is None else joined
    if modes == "auto":
        operations = [linear_operation(scene, sector)]
        made = reduce_to_tolerance(source, sector, scene.rom.tolerance, operations, boundary)
    else:
        made = reduce_sector(source, sector, ReductionOptions(modes, limit), boundary, augment=True)
    model = with_modal_excitation(scene, made.model)
    if joined is not None:
        model = with_blade_stiffness(joined, sector, materials, model)
    write_families(folder, joined, sector, materials, model)
    model = model if store_basis else replace(model, basis=None)
    _write(folder / REDUCED_MODEL, scene, model)
    if made.augmented is not None:
        _write(folder / AUGMENTED_MODEL, scene, with_modal_excitation(scene, made.augmented))
    sizes = {} if scene.damper_touches else _sizes(scene, model, whole)
    (folder / FACTS).write_text(json.dumps(_facts(made, boundary, model) | sizes))


def _write(path: Path, scene: Scene, model: ReducedModel) -> None:
    """Write a model with the interfaces that touch; the flanks of a damper still to come are one of them."""
    from rom.files.reduced_model_file import write_reduced_model

    write_reduced_model(path, model if scene.damper_touches else touching(scene, model))


def _facts(made: Reduction, boundary: BoundaryChoice, model: ReducedModel) -> dict[str, Any]:
    """Sizes of a reduced model; of the sector of a disk also the error of its waves."""
    from rom.cyclic_sector.wave_reference import wave_errors

    facts: dict[str, Any] = {"dofs": made.dofs, "modes": made.modes, "highest_mode_hz": made.highest_mode_hz}
    if model.cyclic_right is not None:
        waves = wave_errors(made.model, boundary.interface, FREQUENCIES)
        facts |= {MOTIONS: len(model.cyclic_right), "wave_error": waves.largest}
        facts["wave_error_at"] = list(waves.nodal_diameters)
    return facts


def _sizes(scene: Scene, model: ReducedModel, sector: SectorMesh) -> dict[str, Any]:
    return {"reduced_dofs": model.size, **interface_facts(scene, model, sector)}


def add_damper(folder: Path, sector_file: Path, blade: Path, scene: Scene, *, store_basis: bool) -> None:
    """Write the files of the reduced blade in the folder `blade` with the damper of a scene between its platforms."""
    from rom.files.reduced_model_file import read_reduced_model, write_reduced_model
    from rom.files.sector_file import load_sector

    sector = load_sector(sector_file)
    files = {name: blade / name for name in (AUGMENTED_MODEL, REDUCED_MODEL) if (blade / name).is_file()}
    for name, path in files.items():
        found = read_reduced_model(path, with_basis=store_basis or name == AUGMENTED_MODEL)
        model = damped_model(scene, found, sector)
        write_reduced_model(folder / name, touching(scene, model))
    families = read_families(blade / REDUCED_MODEL)
    assert families is not None
    _write_families(folder, families.with_coordinates(model.size))
    facts = json.loads((blade / FACTS).read_text())
    (folder / FACTS).write_text(json.dumps(facts | _sizes(scene, model, sector)))


def damped_model(scene: Scene, blade: ReducedModel, sector: SectorMesh) -> ReducedModel:
    """The reduced blade with the damper of a scene, and with all interfaces."""
    from rom.reduction.rigid_body import platform_damper, with_damper

    assert scene.damper is not None
    body, line = platform_damper(sector, **scene.damper.model_dump(), pair=PLATFORM), scene.damper.form == "cylinder"
    return with_damper(blade, body, pair=PLATFORM, line=line)


def boundary_choice(scene: Scene, sector: SectorMesh, materials: Materials) -> BoundaryChoice:
    """Excitation, contact dofs, loads and outputs of a scene."""
    from rom.reduction.boundary_dofs import BoundaryChoice

    loads = scene_loads(scene, sector, materials)
    return BoundaryChoice(scene.excitation.unit_direction, scene.excitation.at, scene.rom.contact_dofs, loads=loads)


def at_speed(full: FullModel, sector: SectorMesh, scene: Scene, materials: Materials) -> FullModel:
    """The full model at the scene's speed of rotation, about its static equilibrium under gas loads too."""
    from rom.finite_elements.rotation import stiffen_by_rotation

    load = scene.load
    if load.speed_rpm == 0.0:
        return full
    loaded = with_static_loads(scene, sector, materials, full)
    held = static_support(scene, sector, full)
    return stiffen_by_rotation(loaded, sector, materials, load.speed_rpm, load.equilibrium, *held)
