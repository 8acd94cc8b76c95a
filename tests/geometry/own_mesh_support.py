"""Meshes as another program would write them, made of sectors of the mesher."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from geometry import (
    BladeParameters,
    ElementBlock,
    ImportedMesh,
    MeshParameters,
    SectorMesh,
    ShroudParameters,
    build_sector,
)

NAMES = {"root": "ROOT", "contact_right": "PS_FACE", "contact_left": "SS_FACE"}
N_BLADES = 72


@cache
def dummy(angle: float = 180.0, gap: float = 0.0) -> SectorMesh:
    """A small blade of the mesher."""
    blade = BladeParameters(N_BLADES, 0.3, 0.08, chord=0.036, thickness=0.009, twist=25.0, section="lens")
    shroud = ShroudParameters(angle, thickness=0.005, axial_width=0.04, contact_length=0.012, gap=gap)
    return build_sector(blade, shroud, MeshParameters(size=0.018, grading=1.0))


def imported(sector: SectorMesh, metres: float = 1.0, turn: np.ndarray | None = None) -> ImportedMesh:
    """The mesh in a unit of some metres, turned, with the names that another program gave."""
    points = sector.points / metres @ (np.eye(3) if turn is None else turn).T
    sets = {
        "ROOT": sector.node_sets["root"],
        "PS_FACE": sector.node_sets["face_right"],
        "SS_FACE": sector.node_sets["face_left"],
        "TIP": sector.node_sets["tip_surface"],
    }
    sets = {name: np.sort(nodes) for name, nodes in sets.items()}
    labels = tuple(np.arange(1, len(block) + 1) for block in sector.blocks)
    return ImportedMesh("blade.inp", points, np.arange(1, len(points) + 1), sector.blocks, labels, sets)


def with_sets(mesh: ImportedMesh, **sets: object) -> ImportedMesh:
    """The mesh with other node sets, arrays of rows."""
    return replace(mesh, node_sets={**mesh.node_sets, **{name: np.asarray(rows) for name, rows in sets.items()}})


@dataclass(frozen=True)
class Form:
    """Shape of a sector between radius 0.3 and 0.32 m, 0.03 m wide, with contact faces on its whole +y and -y sides.

    `bulge` (m) curves the faces by a parabola along x, `skew` shears them along x, `taper` narrows them outward.
    """

    n_blades: int = 40
    bulge: float = 0.0
    skew: float = 0.0
    taper: float = 0.0

    def points(self, cube: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the unit cube in place."""
        x, y, r = cube.T
        radius = 0.3 + 0.02 * r
        axial = 0.03 * ((x - 0.5) * (1.0 - self.taper * r) + self.skew * (r - 0.5))
        turn = (y - 0.5) * 2.0 * np.pi / self.n_blades + self.bulge * (1.0 - (2.0 * x - 1.0) ** 2) / 0.31
        return np.stack([axial, radius * np.sin(turn), radius * np.cos(turn)], axis=-1)


def wedge(form: Form = Form(), divisions: tuple[int, int, int] = (3, 2, 4), jitter: float = 0.0) -> ImportedMesh:
    """The form in bricks; `jitter`: the nodes of the left face moved in it by up to this part of a step."""
    cube = np.stack(np.meshgrid(*(np.linspace(0.0, 1.0, n + 1) for n in divisions), indexing="ij"), axis=-1)
    moved = np.random.default_rng(3).uniform(-jitter, jitter, cube.shape) / divisions
    inside = (cube > 0.0) & (cube < 1.0) & (cube[..., 1:2] == 0.0)
    index = np.arange(cube[..., 0].size).reshape(cube.shape[:3])
    n = divisions
    shifts = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = [index[i : i + n[0], j : j + n[1], k : k + n[2]].ravel() for i, j, k in shifts]
    sets = {"ROOT": index[:, :, 0].ravel(), "PS_FACE": index[:, -1].ravel(), "SS_FACE": index[:, 0].ravel()}
    points = form.points((cube + moved * inside).reshape(-1, 3))
    block = ElementBlock("hex8", np.stack(cells, axis=1))
    return ImportedMesh("wedge.inp", points, np.arange(len(points)), (block,), (), sets)


def five_tets(mesh: ImportedMesh, divisions: tuple[int, int, int] = (3, 2, 4)) -> ImportedMesh:
    """A wedge of bricks with each brick cut into five tetrahedra; with an odd number of bricks from the left to the
    right face the triangles of the two share their nodes only."""
    cells = mesh.blocks[0].nodes
    odd = np.stack(np.meshgrid(*map(range, divisions), indexing="ij")).sum(axis=0).ravel() % 2 == 1
    even_cuts = ((0, 1, 3, 4), (1, 2, 3, 6), (1, 6, 4, 5), (3, 4, 6, 7), (1, 3, 4, 6))
    odd_cuts = ((0, 1, 2, 5), (0, 2, 3, 7), (0, 5, 7, 4), (2, 7, 5, 6), (0, 2, 7, 5))
    cuts = [cells[rows][:, np.array(four)] for rows, five in ((~odd, even_cuts), (odd, odd_cuts)) for four in five]
    nodes = np.concatenate(cuts)
    corner = mesh.points[nodes]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1])
    nodes[volume < 0.0] = nodes[volume < 0.0][:, [0, 2, 1, 3]]
    return replace(mesh, blocks=(ElementBlock("tet4", nodes),))


def tet_wedge(
    form: Form = Form(), right: tuple[int, int] = (3, 4), left: tuple[int, int] = (4, 5), order: int = 2
) -> ImportedMesh:
    """The form in tetrahedra, with other divisions (x, r) on the left face: no nodes match."""
    import gmsh

    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("wedge")
    try:
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1.0 / max(*right, *left))
        for face, y, counts in (("right", 1.0, right), ("left", 0.0, left)):
            del face
            small = 1e-6
            inside = (-small, y - small, -small, 1 + small, y + small, 1 + small)
            for _, curve in gmsh.model.getEntitiesInBoundingBox(*inside, 1):
                low, high = np.split(np.array(gmsh.model.getBoundingBox(1, curve)), 2)
                gmsh.model.mesh.setTransfiniteCurve(curve, counts[0 if high[0] - low[0] > 0.5 else 1] + 1)
            gmsh.model.mesh.setTransfiniteSurface(gmsh.model.getEntitiesInBoundingBox(*inside, 2)[0][1])
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        tags, cube, _ = gmsh.model.mesh.getNodes()
        kind = gmsh.model.mesh.getElementType("Tetrahedron", order)
        _, cells = gmsh.model.mesh.getElementsByType(kind)
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()
    place = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    place[tags.astype(np.int64)] = np.arange(len(tags))
    nodes = place[cells.astype(np.int64)].reshape(-1, 4 if order == 1 else 10)
    if order == 2:
        nodes = nodes[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]  # gmsh exchanges the last two mid-side nodes
    cube = cube.reshape(-1, 3)
    on = {"ROOT": cube[:, 2] < 1e-9, "PS_FACE": cube[:, 1] > 1 - 1e-9, "SS_FACE": cube[:, 1] < 1e-9}
    sets = {name: np.flatnonzero(rows) for name, rows in on.items()}
    block = ElementBlock("tet4" if order == 1 else "tet10", nodes)
    return ImportedMesh("wedge.inp", form.points(cube), np.arange(len(cube)), (block,), (), sets)
