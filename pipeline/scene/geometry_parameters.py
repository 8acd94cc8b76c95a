"""Blade, mesh and what a blade made here has besides, as the parameters that the package `geometry` takes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError
from pipeline.scene.fields import values_for
from pipeline.scene.profile_file import profile_stack_of

SECTIONS_KEY = "blade.sections"

if TYPE_CHECKING:
    from geometry.blade.parameters import BladeParameters
    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene


def geometry_parameters(scene: Scene) -> dict[str, Any]:
    """Parameters of a scene that describes a blade, by argument of `geometry.build_sector`; metres and degrees."""
    from geometry.blade import parameters as geometry

    kinds = {
        "shroud": geometry.ShroudParameters,
        "mesh": geometry.MeshParameters,
        "disk": geometry.DiskParameters,
        "snubber": geometry.SnubberParameters,
        "platform": geometry.PlatformParameters,
    }
    sections = {name: getattr(scene, name) for name in kinds}
    return {"blade": airfoil_of(scene)} | {
        name: None if section is None else kinds[name](**values_for(kinds[name], section))
        for name, section in sections.items()
    }


def airfoil_of(scene: Scene) -> BladeParameters:
    """The parameters of the blade; of one with sections as points those that are nearest to it. Raises InputError."""
    from geometry.blade.parameters import BladeParameters
    from geometry.errors import GeometryError

    assert scene.blade is not None
    blade = scene.blade
    if blade.sections is None:
        return BladeParameters(**values_for(BladeParameters, blade))
    from geometry.blade.profiles import blade_of_sections

    thickness = 0.0 if scene.shroud is None else scene.shroud.thickness
    try:
        stack = profile_stack_of(blade.sections, blade.hub_radius, scene.contents)
        return blade_of_sections(blade.n_blades, blade.hub_radius, blade.length, stack, thickness)
    except (GeometryError, InputError) as error:
        found = InputError(f"{blade.sections}: {error.allowed}" if isinstance(error, GeometryError) else str(error))
        found.key = SECTIONS_KEY  # by which it is known as one error
        raise found from None


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
