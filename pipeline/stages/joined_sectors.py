"""Sectors of a bladed disk: joined to their neighbours at two cut faces."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry import SectorMesh

CUTS = ("cyclic_right", "cyclic_left")  # sets of the nodes of the cut faces


def is_joined(sector: SectorMesh) -> bool:
    """Whether a mesh is the sector of a bladed disk, and not a blade clamped at its root."""
    return all(len(sector.node_sets.get(name, ())) for name in CUTS)
