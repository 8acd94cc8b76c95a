"""Files of a reduced model and sets of its mesh by their names: what several stages look for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from rom.cyclic.mode_families import ModeFamilies


FAMILIES = "families.h5"


def read_families(rom: Path) -> ModeFamilies | None:
    """The rows beside the file of a reduced model; None for a model from elsewhere."""
    from rom.cyclic.mode_families import ModeFamilies
    from rom.files.hdf5 import opened, stored_array

    path = rom.parent / FAMILIES
    if not path.is_file():
        return None
    with opened(path) as file:
        return ModeFamilies(stored_array(file["airfoil"]), stored_array(file["disk"]))


REDUCED_MODEL = "rom.h5"
CUTS = ("cyclic_right", "cyclic_left")  # sets of the nodes of the cut faces


def is_joined(sector: SectorMesh) -> bool:
    """Whether a mesh is the sector of a bladed disk, and not a blade clamped at its root."""
    return all(len(sector.node_sets.get(name, ())) for name in CUTS)
