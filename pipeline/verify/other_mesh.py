"""The mesh that the scene's mesh is compared with: finer, or coarser where a finer one would be too large."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pipeline.scene.geometry_parameters import geometry_parameters
from pipeline.scene.schema import Scene

if TYPE_CHECKING:
    from geometry import SectorMesh

_STEP = 0.7  # from one element size to the next
_MOST_STEPS = 4
_LEAST_GAIN = 1.5  # in elements: different sizes may give the same mesh
_MOST_ELEMENTS = 6_000  # some 90 000 dofs, so that verifying takes about as long as the run itself


def other_sector(scene: Scene, elements: int) -> tuple[float, str, SectorMesh]:
    """Element size [m], element and mesh to compare the scene's mesh of `elements` elements with.

    Raises
    ------
    RuntimeError
        Element sizes nearby give the same mesh.
    GeometryError, MeshingError
        A size gives no mesh.
    """
    from geometry import build_sector

    blade, shroud, mesh = geometry_parameters(scene)
    assert scene.mesh is not None
    element = scene.mesh.element
    for steps in range(1, _MOST_STEPS + 1):
        size = mesh.size * _STEP**steps
        sector = build_sector(blade, shroud, replace(mesh, size=size))
        if len(sector.hexahedra) > _MOST_ELEMENTS:
            break
        if len(sector.hexahedra) >= _LEAST_GAIN * elements:
            # Compared with linear hexahedra, quadratic ones of nearly the same size are as good as exact.
            return size, "hex20" if element == "hex8" else element, sector
    for steps in range(1, _MOST_STEPS + 1):
        size = mesh.size / _STEP**steps
        sector = build_sector(blade, shroud, replace(mesh, size=size))
        if _LEAST_GAIN * len(sector.hexahedra) <= elements:
            return size, element, sector
    raise RuntimeError("element sizes nearby give the same mesh")
