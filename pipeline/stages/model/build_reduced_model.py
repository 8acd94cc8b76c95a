"""Reduced model of the blade at its speed, written as the files of one store entry.

A sector with cut faces adds their motions, the stiffness of the blade and the names of the modes.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.stages.model.model_files import CUTS, FAMILIES, REDUCED_MODEL, is_joined
from pipeline.stages.model.scene_loads import scene_loads, with_modal_excitation, with_static_loads
from pipeline.stages.model.scene_materials import scene_materials
from pipeline.stages.scene_to_solver import PLATFORM, interface_facts, linear_operation, touching, touching_sector

if TYPE_CHECKING:
    from geometry import SectorMesh
    from pipeline.scene.schema import Scene
    from rom import BoundaryChoice, FullModel, Material, ReducedModel, Reduction, RigidBody


def with_interface(full: FullModel, sector: SectorMesh, scene: Scene, boundary: BoundaryChoice) -> BoundaryChoice:
    """The boundary dofs with those of the cut faces."""
    from rom import InterfaceOptions, cyclic_faces, interface_motion

    faces = cyclic_faces(full, sector)
    return interface_motion(full, sector, faces, boundary, InterfaceOptions(scene.rom.nodal_diameters))


def with_blade_stiffness(
    full: FullModel, sector: SectorMesh, materials: Material | dict[str, Material], model: ReducedModel
) -> ReducedModel:
    """A reduced model with its basis and the stiffness of its blade, which mistuning changes."""
    from rom import blade_stiffness

    assert model.basis is not None
    return replace(model, blade_stiffness=blade_stiffness(full, sector, materials, model.basis, _rim_radius(sector)))


def write_families(
    folder: Path,
    full: FullModel | None,
    sector: SectorMesh,
    materials: Material | dict[str, Material],
    model: ReducedModel,
) -> None:
    """Write the rows of a reduced model with its basis that name its modes. `full` is that of a sector of a disk."""
    from rom import blade_families, mode_families, new_hdf5

    assert model.basis is not None
    if full is None:
        families = blade_families(sector, model.basis)
    else:
        families = mode_families(full, sector, materials, model.basis, _rim_radius(sector))
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
    """Reduce the blade to `rom.h5`, at its speed, and write its sizes into `facts.json`.

    Notes
    -----
    In `facts.json`, `modes` is the number of fixed-interface modes and `highest_mode_hz` the frequency up to which
    they are known. Of the sector of a disk `cut_face_motions` is the number of motions kept of a cut face, and
    `wave_error` the largest relative error of its six lowest frequencies with free contacts against the whole mesh,
    in waves of the nodal diameters `wave_error_at`.
    """
    from rom import (
        ReductionOptions,
        load_full_model,
        load_sector,
        reduce_sector,
        reduce_to_tolerance,
        write_reduced_model,
    )

    whole, materials = load_sector(sector_file), scene_materials(scene, sector_file)
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
    model = with_damper_of(scene, sector, with_modal_excitation(scene, made.model))
    if joined is not None:
        model = with_blade_stiffness(joined, sector, materials, model)
    write_families(folder, joined, sector, materials, model)
    model = model if store_basis else replace(model, basis=None)
    write_reduced_model(folder / REDUCED_MODEL, touching(scene, model))
    if made.augmented is not None:
        augmented = with_damper_of(scene, sector, with_modal_excitation(scene, made.augmented))
        write_reduced_model(folder / AUGMENTED_MODEL, touching(scene, augmented))
    (folder / FACTS).write_text(json.dumps(_facts(scene, made, boundary, whole, model)))


def _facts(
    scene: Scene, made: Reduction, boundary: BoundaryChoice, sector: SectorMesh, model: ReducedModel
) -> dict[str, Any]:
    """Sizes of a reduced model; of the sector of a disk also the error of its waves."""
    from rom import wave_errors

    facts: dict[str, Any] = {"dofs": made.dofs, "reduced_dofs": model.size}
    facts |= {**interface_facts(scene, model, sector), "modes": made.modes, "highest_mode_hz": made.highest_mode_hz}
    if model.cyclic_right is not None:
        waves = wave_errors(made.model, boundary.interface, FREQUENCIES)
        facts |= {MOTIONS: len(model.cyclic_right), "wave_error": waves.largest}
        facts["wave_error_at"] = list(waves.nodal_diameters)
    return facts


def with_damper_of(scene: Scene, sector: SectorMesh, model: ReducedModel) -> ReducedModel:
    """The model with the damper of a scene between the flanks of its platforms; the same where none touches."""
    if scene.damper is None or PLATFORM not in model.interfaces:
        return model
    from rom import with_damper

    assert scene.mesh is not None
    return with_damper(
        model,
        sector,
        _body(scene, sector),
        element=scene.mesh.element,
        contact_dofs=scene.rom.contact_dofs,
        line=scene.damper.form == "cylinder",
    )


def _body(scene: Scene, sector: SectorMesh) -> RigidBody:
    """The damper: by default a wedge that fills the roof of the flanks, or a cylinder on their middle lines.

    The flanks rise towards the plane midway between two blades, where the ridge of the roof would be. The section of
    the wedge is the triangle below it, of base b and height h; its centre lies h / 3 above the base.
    """
    import numpy as np

    from rom import RigidBody

    damper, platform = scene.damper, scene.platform
    assert damper is not None  # the checks see to both
    assert platform is not None
    view, middle = sector.seen_from(PLATFORM), np.pi / sector.n_blades
    across = np.array([0.0, -np.cos(middle), np.sin(middle)])  # from the plane midway towards the blade
    upward = np.array([0.0, np.sin(middle), np.cos(middle)])
    points = sector.points[view.node_sets["face_right"]]
    length, slope = float(np.ptp(points[:, 0])), np.tan(np.deg2rad(platform.flank_angle))
    half, outer = float((points @ across).max()), float((points @ upward).min())
    if damper.form == "wedge":
        b, h = 2.0 * half, half * slope
        radius = outer + h / 3.0
        inertia = [h**2 / 18.0 + b**2 / 24.0, length**2 / 12.0 + h**2 / 18.0, length**2 / 12.0 + b**2 / 24.0]
    else:
        line = view.right.position.mean(axis=0)
        a = float(line @ across) / np.sin(np.arctan(slope))
        radius = float(line @ upward) - a * np.cos(np.arctan(slope))
        inertia = [a**2 / 2.0, *[(3.0 * a**2 + length**2) / 12.0] * 2]
    centre = (radius if damper.radius is None else damper.radius) * upward
    centre[0] = points[:, 0].mean()
    moments = damper.mass * np.array(inertia) if damper.inertia is None else damper.inertia
    return RigidBody(damper.mass, centre, moments, [damper.axial_stiffness, 0.0, 0.0, 0.0, 0.0, 0.0])


def boundary_choice(scene: Scene, sector: SectorMesh, materials: Material | dict[str, Material]) -> BoundaryChoice:
    """Excitation, contact dofs, loads and outputs of a scene."""
    from rom import BoundaryChoice

    loads = scene_loads(scene, sector, materials)
    return BoundaryChoice(scene.excitation.unit_direction, scene.excitation.at, scene.rom.contact_dofs, loads=loads)


def at_speed(
    full: FullModel, sector: SectorMesh, scene: Scene, materials: Material | dict[str, Material]
) -> FullModel:
    """The full model at the scene's speed of rotation, about its static equilibrium under gas loads too."""
    from rom import cyclic_faces, static_motion, stiffen_by_rotation

    load = scene.load
    if load.speed_rpm == 0.0:
        return full
    loaded = with_static_loads(scene, sector, materials, full)
    motion = static_motion(full, cyclic_faces(full, sector)) if is_joined(sector) else None
    return stiffen_by_rotation(loaded, sector, materials, load.speed_rpm, load.equilibrium, motion)
