"""Blade, shroud, mesh and disk of a scene as the parameters that the package `geometry` takes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geometry import BladeParameters, DiskParameters, MeshParameters, ShroudParameters
    from pipeline.scene.schema import Scene


def geometry_parameters(scene: Scene) -> tuple[BladeParameters, ShroudParameters, MeshParameters]:
    """Parameters of the blade, the shroud and the mesh, metres and degrees."""
    from geometry import BladeParameters, MeshParameters, ShroudParameters

    assert scene.blade is not None  # a scene that describes a blade has all of these
    assert scene.shroud is not None
    assert scene.mesh is not None
    assert scene.mesh.size is not None
    return (
        BladeParameters(**scene.blade.model_dump()),
        ShroudParameters(**scene.shroud.model_dump()),
        MeshParameters(scene.mesh.size, scene.mesh.contact_grid, scene.mesh.grading),
    )


def disk_parameters(scene: Scene) -> DiskParameters | None:
    """Parameters of the disk, metres; None where the blades are clamped at their roots."""
    if scene.disk is None:
        return None
    from geometry import DiskParameters

    return DiskParameters(**scene.disk.model_dump())
