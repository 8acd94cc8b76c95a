"""Finite element matrices of the sector, written as the file of one store entry."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.stages.model.scene_materials import scene_materials

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene
    from rom.finite_elements.full_model import FullModel


FULL_MODEL = "full.h5"


def make_full_model(folder: Path, sector_file: Path, scene: Scene) -> FullModel:
    """Assemble stiffness, mass and centrifugal load of the sector into `full.h5`; returns them too."""
    from rom.files.full_model_file import save_full_model
    from rom.files.sector_file import load_sector
    from rom.finite_elements.full_model import assemble

    sector = load_sector(sector_file)
    full = assemble(sector, scene_materials(scene, sector_file, sector), finite_element(scene))
    save_full_model(folder / FULL_MODEL, full)
    return full


def finite_element(scene: Scene) -> str | None:
    """The finite element that the mesh of a scene is promoted to; None: its elements as they are."""
    assert scene.mesh is not None  # a scene that describes a blade has one
    return None if scene.mesh_file is not None else scene.mesh.element
