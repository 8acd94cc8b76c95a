"""Sectors of a bladed disk: joined to their neighbours at two cut faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry import SectorMesh
    from pipeline.scene.schema import Scene
    from rom import BoundaryChoice, FullModel

CUTS = ("cyclic_right", "cyclic_left")  # sets of the nodes of the cut faces


def is_joined(sector: SectorMesh) -> bool:
    """Whether a mesh is the sector of a bladed disk, and not a blade clamped at its root."""
    return all(len(sector.node_sets.get(name, ())) for name in CUTS)


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
