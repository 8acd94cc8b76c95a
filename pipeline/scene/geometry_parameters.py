"""Blade, mesh and what a blade made here has besides, as the parameters that the package `geometry` takes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pipeline.scene.fields import values_for

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene


def geometry_parameters(scene: Scene) -> dict[str, Any]:
    """Parameters of a scene that describes a blade, by argument of `geometry.build_sector`; metres and degrees."""
    from geometry.blade import parameters as geometry

    kinds = {
        "blade": geometry.BladeParameters,
        "shroud": geometry.ShroudParameters,
        "mesh": geometry.MeshParameters,
        "disk": geometry.DiskParameters,
        "snubber": geometry.SnubberParameters,
        "platform": geometry.PlatformParameters,
    }
    sections = {name: getattr(scene, name) for name in kinds}
    return {
        name: None if section is None else kinds[name](**values_for(kinds[name], section))
        for name, section in sections.items()
    }


def sector_of(scene: Scene, **changes: Any) -> SectorMesh:
    """The mesh of a scene's blade; `changes` of the parameters of the mesh.

    The flanks of its platform are contact faces where a damper lies on them: platforms do not touch each other.
    """
    from geometry.blade.build import build_sector

    parameters = geometry_parameters(scene)
    sector = build_sector(**parameters | {"mesh": replace(parameters["mesh"], **changes)})
    if scene.has_damper:
        return sector
    return replace(sector, pairs={name: pair for name, pair in sector.pairs.items() if name != "platform"})
