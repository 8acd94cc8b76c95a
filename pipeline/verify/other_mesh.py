"""The mesh that the scene's mesh is compared with: finer, or coarser where a finer one would be too large.

A mesh from a file has no coarser one, and its elements are cut into eight each.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pipeline.scene.geometry_parameters import disk_parameters, geometry_parameters
from pipeline.scene.schema import Scene
from pipeline.stages.joined_sectors import is_joined
from pipeline.stages.mesh_findings import elements_by_kind, mean_size

if TYPE_CHECKING:
    from geometry import SectorMesh

_STEP = 0.7  # from one element size to the next
_MOST_STEPS = 4
_LEAST_GAIN = 1.5  # in elements: different sizes may give the same mesh
_MOST_POINTS = 60_000  # of a finer mesh of a file
_MOST_OF_THIRD = 150_000  # of one whose free natural frequencies alone are computed
_MOST_ELEMENTS = 6_000  # some 90 000 dofs, so that verifying takes about as long as the run itself
_OF_DISK = 0.5  # of these numbers with a disk: its waves are complex


def other_sector(scene: Scene, elements: int) -> tuple[float, str, SectorMesh]:
    """Element size [m], element and mesh to compare the scene's mesh of `elements` elements with."""
    from geometry import build_sector

    blade, shroud, mesh = geometry_parameters(scene)
    disk = disk_parameters(scene)
    assert scene.mesh is not None
    element = scene.mesh.element
    most = _MOST_ELEMENTS if disk is None else _OF_DISK * _MOST_ELEMENTS
    for steps in range(1, _MOST_STEPS + 1):
        size = mesh.size * _STEP**steps
        sector = build_sector(blade, shroud, replace(mesh, size=size), disk)
        if sector.n_elements > most:
            break
        if sector.n_elements >= _LEAST_GAIN * elements:
            # Compared with linear hexahedra, quadratic ones of nearly the same size are as good as exact.
            return size, "hex20" if element == "hex8" else element, sector
    for steps in range(1, _MOST_STEPS + 1):
        size = mesh.size / _STEP**steps
        sector = build_sector(blade, shroud, replace(mesh, size=size), disk)
        if _LEAST_GAIN * sector.n_elements <= elements:
            return size, element, sector
    raise RuntimeError("element sizes nearby give the same mesh")


def finer_sector(own: SectorMesh, parts: int = 2) -> tuple[float, str, SectorMesh]:
    """Mean edge [m], kinds of elements and mesh with 8 or 27 elements in place of each of a mesh from a file."""
    from geometry import subdivided

    growth, most = parts**3 * len(own.points), _MOST_POINTS if parts == 2 else _MOST_OF_THIRD
    if is_joined(own):
        most = round(_OF_DISK * most)
    if growth > most:
        part = "half" if parts == 2 else "a third of"
        raise RuntimeError(f"one with {part} the element size would have some {growth} nodes, {most} at most")
    finer = subdivided(own, parts)
    return mean_size(finer), kinds_of(finer), finer


def mesh_of(scene: Scene, sector: SectorMesh) -> tuple[float, str]:
    """Element size, m, and element of the mesh of a scene; of a file the mean edge and the kinds of elements."""
    assert scene.mesh is not None
    if scene.mesh.size is not None:
        return scene.mesh.size, scene.mesh.element
    return mean_size(sector), kinds_of(sector)


def kinds_of(sector: SectorMesh) -> str:
    """The kinds of elements of a mesh: "tet10", "wedge15, hex20"."""
    return ", ".join(elements_by_kind(sector))
