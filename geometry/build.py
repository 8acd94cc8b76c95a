"""The mesh of a sector from its parameters."""

from dataclasses import replace
from math import floor

import numpy as np

from geometry.blade_surfaces import airfoil_surfaces
from geometry.checks import check_parameters
from geometry.contact import contact_faces
from geometry.disk import add_disk
from geometry.divisions import contact_fractions, grid_fractions
from geometry.elements import ElementBlock
from geometry.errors import GeometryError
from geometry.layout import MeshingError
from geometry.parameters import BladeParameters, DiskParameters, MeshParameters, ShroudParameters
from geometry.planform import is_mirrored
from geometry.planform_mesh import PlanformMesh
from geometry.remedies import rounded
from geometry.sector import FloatArray, IntArray, SectorMesh
from geometry.solid import swept_planform

OTHER_SIZES = (0.9, 0.8, 0.7, 0.5, 0.35)  # of a size that gives no mesh: tried for one that does


def build_sector(
    blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters, disk: DiskParameters | None = None
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
    shroud : ShroudParameters
        The shroud.
    mesh : MeshParameters
        The mesh density.
    disk : DiskParameters, optional
        The disk under the blade; None: the root of the blade is clamped.

    Returns
    -------
    SectorMesh
        The mesh with its node sets and contact faces. With a disk it has the sets `cyclic_right` and `cyclic_left` of
        the cuts between the sectors of the disk, `bore` and `rim`, and elements of the material "disk"; `root` is
        the clamped bore, empty where it is free.

    Raises
    ------
    GeometryError
        ``check_parameters`` refuses the parameters, or gmsh gives no valid mesh.

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
    check_parameters(blade, shroud, mesh, disk)
    return _built(blade, shroud, mesh, disk)


def _built(
    blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters, disk: DiskParameters | None
) -> SectorMesh:
    """As `build_sector`, of parameters that are checked."""
    mirrored = is_mirrored(shroud)
    upright = replace(blade, root_stagger=-blade.root_stagger, twist=-blade.twist) if mirrored else blade
    try:
        plan, flat, points, hexahedra = swept_planform(blade, shroud, mesh)
    except MeshingError as error:
        told = f"gives no valid mesh; {_size_that_meshes(blade, shroud, mesh)} ({error})"
        raise GeometryError("mesh", "size", mesh.size, told) from error
    sector = _with_faces(points, hexahedra, flat, blade, shroud, mesh)
    levels = np.arange(int(sector.node_sets["root"][0]), len(points), len(sector.node_sets["root"]))
    sector = replace(sector, surfaces=airfoil_surfaces(plan, flat, sector.blocks, levels, mirrored))
    return (
        sector if disk is None else add_disk(sector, (plan, flat), upright, (shroud, mesh, disk), mirrored=mirrored)
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
    foot = len(np.unique(flat.quads[flat.airfoil]))
    root = len(layers) * n + np.arange(foot)
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
