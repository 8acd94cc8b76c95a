"""Mesh of the sector, written as the files of one store entry."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.scene.geometry_parameters import geometry_parameters

if TYPE_CHECKING:
    from pipeline.scene.schema import Scene

SECTOR = "sector.h5"
MESH_FILES = ("mesh.vtu", "mesh.msh")


def make_mesh(folder: Path, scene: Scene) -> None:
    """Mesh the sector: `sector.h5` for the next stage, mesh.vtu and mesh.msh for people and other programs."""
    from geometry import build_sector, export_sector
    from rom import save_sector

    sector = build_sector(*geometry_parameters(scene))
    save_sector(folder / SECTOR, sector)
    for name in MESH_FILES:
        export_sector(folder / name, sector)
