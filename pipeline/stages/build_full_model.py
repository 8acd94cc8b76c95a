"""Finite element matrices of the sector, written as the file of one store entry."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from rom import FullModel

FULL_MODEL = "full.h5"


def make_full_model(folder: Path, sector_file: Path, scene: Scene) -> FullModel:
    """Assemble stiffness, mass and centrifugal load of the sector into `full.h5`; returns them too."""
    from rom import Material, assemble, load_sector, save_full_model

    assert scene.material is not None  # a scene that describes a blade has both
    assert scene.mesh is not None
    material = Material(**scene.material.model_dump())
    full = assemble(load_sector(sector_file), material, scene.mesh.element)
    save_full_model(folder / FULL_MODEL, full)
    return full
