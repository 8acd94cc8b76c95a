"""What the reduction of a sector with cut faces adds: their motions, the blade's stiffness, names of modes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.stages.joined_sectors import CUTS
from pipeline.stages.mode_families_file import FILE

if TYPE_CHECKING:
    from geometry import SectorMesh
    from pipeline.scene.schema import Scene
    from rom import BoundaryChoice, FullModel, Material, ReducedModel


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
    folder: Path, full: FullModel, sector: SectorMesh, materials: Material | dict[str, Material], model: ReducedModel
) -> None:
    """Write the rows of a reduced model with its basis that name its modes."""
    from rom import mode_families, new_hdf5

    assert model.basis is not None
    families = mode_families(full, sector, materials, model.basis, _rim_radius(sector))
    with new_hdf5(folder / FILE) as file:
        file["airfoil"], file["disk"] = families.airfoil, families.disk


def _rim_radius(sector: SectorMesh) -> float:
    """Where the disk ends: at the largest radius of the cut faces."""
    import numpy as np

    cut = np.concatenate([sector.points[sector.node_sets[name]] for name in CUTS])
    return float(np.hypot(cut[:, 1], cut[:, 2]).max())
