"""Rows that name the modes of a bladed disk, a file beside its reduced model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rom import ModeFamilies

FILE = "families.h5"


def read_families(rom: Path) -> ModeFamilies | None:
    """The rows beside the file of a reduced model; None for a blade alone and for a model from elsewhere."""
    from rom import ModeFamilies, opened, stored_array

    path = rom.parent / FILE
    if not path.is_file():
        return None
    with opened(path) as file:
        return ModeFamilies(stored_array(file["airfoil"]), stored_array(file["disk"]))
