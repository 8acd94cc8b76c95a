"""Blade, shroud, mesh, disk and wings of a scene as the parameters that the package `geometry` takes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geometry.blade.parameters import BladeParameters, DiskParameters, MeshParameters, ShroudParameters
    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene


def geometry_parameters(scene: Scene) -> tuple[BladeParameters, ShroudParameters | None, MeshParameters]:
    """Parameters of the blade, of its shroud where it has one, and of the mesh, metres and degrees."""
    from geometry.blade.parameters import BladeParameters, MeshParameters, ShroudParameters

    assert scene.blade is not None  # a scene that describes a blade has all of these
    assert scene.mesh is not None
    assert scene.mesh.size is not None
    return (
        BladeParameters(**scene.blade.model_dump()),
        None if scene.shroud is None else ShroudParameters(**scene.shroud.model_dump()),
        MeshParameters(scene.mesh.size, scene.mesh.contact_grid, scene.mesh.grading),
    )


def wing_parameters(scene: Scene) -> dict[str, Any]:
    """Parameters of snubber and platform, by argument of `geometry.build_sector`; without those a scene lacks."""
    from geometry.blade.parameters import PlatformParameters, SnubberParameters

    found: dict[str, Any] = {}
    if scene.snubber is not None:
        found["snubber"] = SnubberParameters(**scene.snubber.model_dump())
    if scene.platform is not None:
        found["platform"] = PlatformParameters(**scene.platform.model_dump())
    return found


def sector_of(scene: Scene, **changes: Any) -> SectorMesh:
    """The mesh of a scene's blade; `changes` of the parameters of the mesh.

    The flanks of its platform are contact faces where a damper lies on them: platforms do not touch each other.
    """
    from geometry.blade.build import build_sector

    blade, shroud, mesh = geometry_parameters(scene)
    sector = build_sector(blade, shroud, replace(mesh, **changes), disk_parameters(scene), **wing_parameters(scene))
    if scene.has_damper:
        return sector
    return replace(sector, pairs={name: pair for name, pair in sector.pairs.items() if name != "platform"})


def disk_parameters(scene: Scene) -> DiskParameters | None:
    """Parameters of the disk, metres; None where the blades are clamped at their roots."""
    if scene.disk is None:
        return None
    from geometry.blade.parameters import DiskParameters

    return DiskParameters(**scene.disk.model_dump())
