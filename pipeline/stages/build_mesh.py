"""Mesh of the sector, written as the files of one store entry."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.scene.geometry_parameters import disk_parameters, geometry_parameters
from pipeline.stages.own_mesh import read_own_sector, write_findings

if TYPE_CHECKING:
    from geometry import SectorMesh
    from pipeline.scene.schema import Scene

SECTOR = "sector.h5"
MESH_FILES = ("mesh.vtu", "mesh.msh")


def make_mesh(folder: Path, scene: Scene) -> None:
    """Mesh the sector: `sector.h5` for the next stage, mesh.vtu and mesh.msh for people and other programs.

    Of a mesh from a file also what was found in it.
    """
    from geometry import export_sector
    from rom import save_sector

    sector = _made(scene) if scene.mesh_file is None else _from_file(folder, scene)
    save_sector(folder / SECTOR, sector)
    for name in MESH_FILES:
        try:
            export_sector(folder / name, sector)
        except ImportError:  # a library for 15-node wedges, which may be installed: pip install 'shroud[meshes]'
            export_sector(folder / name, without_mid_sides(sector))


def without_mid_sides(sector: SectorMesh) -> SectorMesh:
    """The mesh by the corners of its 15-node wedges; its points stay."""
    blocks = [
        replace(block, kind="wedge6", nodes=block.nodes[:, :6]) if block.kind == "wedge15" else block
        for block in sector.blocks
    ]
    return replace(sector, blocks=tuple(blocks))


def _made(scene: Scene) -> SectorMesh:
    from geometry import build_sector

    return build_sector(*geometry_parameters(scene), disk_parameters(scene))


def _from_file(folder: Path, scene: Scene) -> SectorMesh:
    own = read_own_sector(scene)
    write_findings(folder, own)
    return own.sector
