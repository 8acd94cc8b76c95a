"""The mesh of a sector from its parameters: its points, node sets, contact faces and surfaces of the airfoil."""

from __future__ import annotations

from dataclasses import replace
from math import floor

import numpy as np

from geometry.blade.checks import check_parameters
from geometry.blade.disk import add_disk
from geometry.blade.layouts import MeshingError, contact_fractions, grid_fractions
from geometry.blade.parameters import (
    BladeParameters,
    DiskParameters,
    MeshParameters,
    PlatformParameters,
    ShroudParameters,
    SnubberParameters,
)
from geometry.blade.planform import is_mirrored, upright
from geometry.blade.planform_mesh import PlanformMesh
from geometry.blade.remedies import rounded
from geometry.blade.solid import swept_planform
from geometry.blade.unshrouded import with_scaffold, without_scaffold
from geometry.blade.wings import Flanks, Wing, add_wings, wing_radii
from geometry.elements import ElementBlock, ElementSides, sides_on
from geometry.errors import GeometryError
from geometry.frames import contact_faces
from geometry.sector import FloatArray, IntArray, SectorMesh

_ON_EDGE = 1e-6  # of half the length of the section
OTHER_SIZES = (0.9, 0.8, 0.7, 0.5, 0.35)  # of a size that gives no mesh: tried for one that does


def airfoil_outline(flat: PlanformMesh, mirrored: bool) -> dict[str, IntArray]:
    """The nodes of the four surfaces of the airfoil, as places among those of a section, along the chord to +x.

    The suction side is the one on the side of +y, to which a positive camber bulges; the leading edge is the end of
    the section at -x.
    """
    along, across = flat.strip.T
    outline = _outline(flat.quads[flat.airfoil], flat.foot)
    end = np.abs(np.abs(along) - np.abs(along).max()) < _ON_EDGE * np.abs(along).max()
    middle = across[outline].mean(axis=1)
    first = -1.0 if mirrored else 1.0
    at_end = end[outline].all(axis=1)
    chosen = {
        "suction_side": ~at_end & (middle > 0.0),
        "pressure_side": ~at_end & (middle < 0.0),
        "leading_edge": at_end & (first * along[outline].mean(axis=1) < 0.0),
        "trailing_edge": at_end & (first * along[outline].mean(axis=1) > 0.0),
    }
    found = {name: np.unique(outline[edges]) for name, edges in chosen.items()}
    return {name: local[np.argsort(first * along[local], kind="stable")] for name, local in found.items()}


def _airfoil_surfaces(
    blocks: tuple[ElementBlock, ...], outline: dict[str, IntArray], levels: IntArray
) -> dict[str, ElementSides]:
    """The four surfaces of the airfoil, whose sections have the first nodes `levels` (l, n)."""
    return {name: sides_on(blocks, levels[:, local].ravel()) for name, local in outline.items()}


def _outline(quads: IntArray, foot: IntArray) -> IntArray:
    """Edges (e, 2) of quadrilaterals that belong to one of them only, as places in `foot`."""
    edges = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return np.searchsorted(foot, edges[first[count == 1]])


def build_sector(
    blade: BladeParameters,
    shroud: ShroudParameters | None,
    mesh: MeshParameters,
    disk: DiskParameters | None = None,
    *,
    snubber: SnubberParameters | None = None,
    platform: PlatformParameters | None = None,
) -> SectorMesh:
    """Mesh one blade with its shroud: gmsh quadrilaterals of the planform, extruded, bent, tapered and twisted.

    The same parameters give the same mesh bit for bit. The mesh is symmetric under a half turn about the stacking
    axis (x, y -> -x, -y). The mesh of alpha > 90 is the exact mirror image (x -> -x) of the one at 180 - alpha with
    the opposite stagger and slant of the side edges. Left and right contact nodes match under rotation by one pitch
    less the gap.

    Parameters
    ----------
    blade : BladeParameters
        The airfoil.
    shroud : ShroudParameters or None
        The shroud; None: a blade without one, whose snubber, or else platform, has the faces `right` and `left`.
    mesh : MeshParameters
        The mesh density.
    disk : DiskParameters, optional
        The disk under the blade; None: the root of the blade is clamped.
    snubber : SnubberParameters, optional
        A part-span snubber.
    platform : PlatformParameters, optional
        A platform near the root, whose underside carries a damper.

    Returns
    -------
    SectorMesh
        The mesh with its node sets and contact faces. With a disk it has the sets `cyclic_right` and `cyclic_left` of
        the cuts between the sectors of the disk, `bore` and `rim`, and elements of the material "disk"; `root` is
        the clamped bore, empty where it is free.

    Raises
    ------
    GeometryError
        The parameters do not fit together, or gmsh gives no valid mesh.

    Notes
    -----
    gmsh has one state for the whole process: call this from any thread, but not from two at the same time.

    Examples
    --------
    The root lies on the hub:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> blade = BladeParameters(n_blades=40, hub_radius=0.3, length=0.1, chord=0.02, thickness=0.008)
    >>> shroud = ShroudParameters(angle=45.0, thickness=0.01, axial_width=0.04, contact_length=0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(3, 2)))
    >>> root = sector.points[sector.node_sets["root"]]
    >>> bool(np.allclose(np.hypot(root[:, 1], root[:, 2]), 0.3))
    True
    """
    wings: dict[str, Wing] = {}
    if snubber is not None:
        wings["snubber"] = snubber
    if platform is not None:
        wings["platform"] = platform
    check_parameters(blade, shroud, mesh, disk, snubber=snubber, platform=platform)
    if shroud is None:
        return _built(*with_scaffold(blade), mesh, disk, wings, scaffold=True)
    return _built(blade, shroud, mesh, disk, wings)


def _built(
    blade: BladeParameters,
    shroud: ShroudParameters,
    mesh: MeshParameters,
    disk: DiskParameters | None,
    wings: dict[str, Wing],
    *,
    scaffold: bool = False,
) -> SectorMesh:
    """As `build_sector`, of parameters that are checked; `scaffold`: the shroud is one, and left out."""
    try:
        bands = [wing_radii(wing, mesh) for wing in wings.values()]
        plan, flat, points, hexahedra = swept_planform(blade, shroud, mesh, bands)
    except MeshingError as error:
        told = f"gives no valid mesh; {_size_that_meshes(blade, shroud, mesh)} ({error})"
        raise GeometryError("mesh", "size", mesh.size, told) from error
    sector = _with_faces(points, hexahedra, flat, blade, shroud, mesh)
    foot, root = flat.foot, sector.node_sets["root"]
    levels = np.vstack([np.arange(int(root[0]), len(points)).reshape(-1, len(root)), foot])
    mirrored = is_mirrored(shroud)
    outline = airfoil_outline(flat, mirrored)
    sector = replace(sector, surfaces=_airfoil_surfaces(sector.blocks, outline, levels))
    if wings:
        right, left = (levels[:, outline[name]] for name in ("suction_side", "pressure_side"))
        flanks = Flanks(right, left, np.hypot(*points[levels[:, 0], 1:].T))
        sector = add_wings(sector, flanks, blade, mesh, wings)
    if scaffold:
        layers = len(contact_fractions(mesh.contact_grid[1], shroud.thickness, mesh.size)) - 1
        sector = without_scaffold(sector, flat, layers * len(flat.quads))
    return (
        sector
        if disk is None
        else add_disk(sector, (plan, flat), upright(blade, shroud), (shroud, mesh, disk), mirrored=mirrored)
    )


def _size_that_meshes(blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters) -> str:
    """A smaller element size that gives a mesh, in words: it is tried."""
    for factor in OTHER_SIZES:
        smaller = replace(mesh, size=rounded(factor * mesh.size, 3, floor))
        try:
            check_parameters(blade, shroud, smaller)
            swept_planform(blade, shroud, smaller)
        except (MeshingError, GeometryError):
            continue
        return f"mesh.size = {smaller.size:g} does"
    return f"nor do sizes down to {OTHER_SIZES[-1] * mesh.size:.3g}: change the section or the shroud"


def _with_faces(
    points: FloatArray,
    hexahedra: IntArray,
    flat: PlanformMesh,
    blade: BladeParameters,
    shroud: ShroudParameters,
    mesh: MeshParameters,
) -> SectorMesh:
    """Node sets and contact faces of the mesh; the layers of the shroud come first among the points."""
    layers = contact_fractions(mesh.contact_grid[1], shroud.thickness, mesh.size)
    grid = [int(np.argmin(np.abs(layers - f))) for f in grid_fractions(mesh.contact_grid[1])]
    n, order = len(flat.points), slice(None, None, -1 if is_mirrored(shroud) else 1)

    def on_layers(nodes: IntArray, chosen: list[int] | range) -> IntArray:
        return np.concatenate([k * n + nodes[order] for k in chosen])

    right, left = on_layers(flat.right, grid), on_layers(flat.left, grid)
    area = shroud.contact_length * shroud.thickness
    faces = contact_faces(points, right, left, shroud.angle, area, blade.n_blades)
    top = (len(layers) - 1) * n
    root = len(layers) * n + np.arange(len(flat.foot))
    node_sets = {
        "root": root,
        "tip": np.array([top + flat.origin]),
        "tip_surface": np.arange(top, top + n),
        "contact_right": right,
        "contact_left": left,
        "face_right": on_layers(flat.right_face, range(len(layers))),
        "face_left": on_layers(flat.left_face, range(len(layers))),
    }
    node_sets = {name: nodes.astype(np.int64) for name, nodes in node_sets.items()}
    return SectorMesh(points, (ElementBlock("hex8", hexahedra),), node_sets, *faces, blade.n_blades)
