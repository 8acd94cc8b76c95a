"""Rows that name the modes of a bladed disk, a file beside its reduced model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.stages.joined_sectors import CUTS

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom import FullModel, Material, ModeFamilies, ReducedModel

FILE = "families.h5"


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


def read_families(rom: Path) -> ModeFamilies | None:
    """The rows beside the file of a reduced model; None for a blade alone and for a model from elsewhere."""
    from rom import ModeFamilies, opened, stored_array

    path = rom.parent / FILE
    if not path.is_file():
        return None
    with opened(path) as file:
        return ModeFamilies(stored_array(file["airfoil"]), stored_array(file["disk"]))
