"""What the reduction of a sector with cut faces adds: their motions, and the rows that name its modes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.stages.joined_sectors import CUTS
from pipeline.stages.mode_families_file import FILE

if TYPE_CHECKING:
    from geometry import SectorMesh
    from pipeline.scene.schema import Scene
    from rom import BoundaryChoice, FullModel, Material, ReducedModel


def with_interface(full: FullModel, sector: SectorMesh, scene: Scene, boundary: BoundaryChoice) -> BoundaryChoice:
    """The boundary dofs with those of the cut faces.

    Raises
    ------
    RomParameterError
        The faces do not match under the pitch, or there is no such nodal diameter.
    """
    from rom import InterfaceOptions, cyclic_faces, interface_motion

    faces = cyclic_faces(full, sector)
    return interface_motion(full, sector, faces, boundary, InterfaceOptions(scene.rom.nodal_diameters))


def write_families(
    folder: Path, full: FullModel, sector: SectorMesh, materials: Material | dict[str, Material], model: ReducedModel
) -> None:
    """Write the rows of a reduced model with its basis; the disk ends at the largest radius of the cut faces."""
    import numpy as np

    from rom import mode_families, new_hdf5

    assert model.basis is not None
    cut = np.concatenate([sector.points[sector.node_sets[name]] for name in CUTS])
    rim = float(np.hypot(cut[:, 1], cut[:, 2]).max())
    families = mode_families(full, sector, materials, model.basis, rim)
    with new_hdf5(folder / FILE) as file:
        file["airfoil"], file["disk"] = families.airfoil, families.disk
