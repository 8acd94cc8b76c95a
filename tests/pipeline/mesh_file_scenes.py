"""The small blade as files of other programs: in quadratic hexahedra, and filled with tetrahedra by gmsh."""

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pipeline_support import small_scene

from geometry import BladeParameters, ElementBlock, MeshParameters, SectorMesh, ShroudParameters, build_sector
from geometry.elements import ELEMENT_KINDS, sides_on

SURFACES = ("root", "face_right", "face_left", "tip_surface")


def small_sector(size: float = 0.009) -> SectorMesh:
    """The mesh of the small scene, 8-node hexahedra."""
    scene = small_scene()
    grid = tuple(scene["mesh"]["contact_grid"])
    return build_sector(
        BladeParameters(**scene["blade"]), ShroudParameters(**scene["shroud"]), MeshParameters(size, grid)
    )


def with_mid_sides(sector: SectorMesh, kind: str) -> SectorMesh:
    """The mesh with a node in the middle of each straight edge."""
    corners = sector.blocks[0].nodes
    pairs = np.stack([np.sort(corners[:, list(edge)], axis=1) for edge in ELEMENT_KINDS[kind].edges], axis=1)
    edges, place = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    nodes = np.hstack([corners, len(sector.points) + place.reshape(len(corners), -1)])
    points = np.vstack([sector.points, sector.points[edges].mean(axis=1)])
    finer = replace(sector, points=points, blocks=(ElementBlock(kind, nodes),))
    sets = {name: sides_on(finer.blocks, sector.node_sets[name]).nodes(finer.blocks) for name in SURFACES}
    return replace(finer, node_sets={**sector.node_sets, **sets})


def hexahedra_as(sector: SectorMesh, kind: str) -> SectorMesh:
    """Each hexahedron cut into two wedges, or these into three tetrahedra each; neighbours share diagonals."""
    corners = sector.blocks[0].nodes
    if kind == "hex8":
        return sector
    wedges = np.concatenate([corners[:, list(part)] for part in ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))])
    if kind == "tet4":
        return replace(sector, blocks=(ElementBlock(kind, _tetrahedra(wedges)),))
    return replace(sector, blocks=(ElementBlock(kind, wedges),))


def _tetrahedra(wedges: np.ndarray) -> np.ndarray:
    """Three tetrahedra of each wedge (Dompierre et al., 1999): diagonals of its sides start at the lowest number."""
    turns = np.array([[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4]])
    turns = np.vstack([turns, [[3, 5, 4, 0, 2, 1], [4, 3, 5, 1, 0, 2], [5, 4, 3, 2, 1, 0]]])
    turned = np.take_along_axis(wedges, turns[np.argmin(wedges, axis=1)], axis=1)
    first = np.minimum(turned[:, 1], turned[:, 5]) < np.minimum(turned[:, 2], turned[:, 4])
    parts = []
    for rows, cut in (
        (turned[first], ((0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3))),
        (turned[~first], ((0, 1, 2, 4), (0, 4, 2, 5), (0, 4, 5, 3))),
    ):
        parts += [rows[:, list(part)] for part in cut]
    return np.concatenate(parts)


def gmsh_tetrahedra(sector: SectorMesh, path: Path, size: float) -> None:
    """The body between the boundary of a mesh filled with 10-node tetrahedra by gmsh, its surfaces named."""
    import gmsh

    corners = sector.blocks[0].nodes
    sides = np.concatenate([corners[:, list(side)] for side in ELEMENT_KINDS["hex8"].sides])
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    quads = sides[first[count == 1]]
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    owner = np.zeros(len(triangles), dtype=int)
    names = ("rest", "root", "face_right", "face_left")
    for number, name in enumerate(names[1:], start=1):
        owner[np.isin(triangles, sector.node_sets[name]).all(axis=1)] = number
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        for number in range(len(names)):
            gmsh.model.addDiscreteEntity(2, number + 1)
        used = np.unique(triangles)
        gmsh.model.mesh.addNodes(2, 1, (used + 1).tolist(), sector.points[used].ravel().tolist())
        for number, name in enumerate(names):
            flat = (triangles[owner == number] + 1).ravel().tolist()
            gmsh.model.mesh.addElementsByType(number + 1, 2, [], flat)
            gmsh.model.addPhysicalGroup(2, [number + 1], name=name)
        loop = gmsh.model.geo.addSurfaceLoop([number + 1 for number in range(len(names))])
        volume = gmsh.model.geo.addVolume([loop])
        gmsh.model.geo.synchronize()
        gmsh.model.addPhysicalGroup(3, [volume], name="blade")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def scene_with_mesh(file: str, **changes: Any) -> dict[str, Any]:
    """The small scene with the mesh of a file in place of blade and shroud; `changes` as in `small_scene`."""
    scene = small_scene()
    blades = scene["blade"]["n_blades"]
    del scene["blade"], scene["shroud"]
    sets = {"root": "root", "contact_right": "face_right", "contact_left": "face_left"}
    scene["mesh"] = {"file": file, "n_blades": blades, "contact_grid": [2, 2], "sets": sets}
    scene = copy.deepcopy(scene)
    for dotted, value in changes.items():
        *sections, key = dotted.split("__")
        table = scene
        for section in sections:
            table = table.setdefault(section, {})
        if value is None:
            table.pop(key, None)
        else:
            table[key] = value
    return scene
