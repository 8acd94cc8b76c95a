"""The sector of the disk under a blade, one pitch wide: the rim's quadrilaterals swept inwards to the bore."""

from dataclasses import replace
from itertools import pairwise
from math import ceil, floor, isfinite, pi, radians

import numpy as np

from geometry.elements import ElementBlock
from geometry.errors import GeometryError
from geometry.parameters import BladeParameters, DiskParameters, MeshParameters, ShroudParameters
from geometry.planform import Planform, section_at
from geometry.planform_mesh import PlanformMesh
from geometry.quality import hexahedron_scaled_jacobian
from geometry.remedies import rounded
from geometry.rim import rim_points
from geometry.sector import FloatArray, SectorMesh
from geometry.solid import MIRRORED_CORNERS, airfoil_levels, bend
from geometry.straight_edges import resized

COARSER = 3.0  # elements at the bore along the radius, relative to those of the blade
GROWTH = 1.3  # of neighbouring layers


def check_disk(disk: DiskParameters, blade: BladeParameters, mesh: MeshParameters) -> None:
    """Check a disk under a blade.

    Raises GeometryError for the first parameter that is wrong.
    """
    hub = blade.hub_radius
    below = f"must lie between 0 and the hub radius ({hub:g} m)"
    _require(0.0 < disk.bore_radius < hub, "bore_radius", disk.bore_radius, below)
    widths = {"rim_width": disk.rim_width, "bore_width": disk.bore_width}
    for name, value in widths.items():
        _require(value is None or (isfinite(value) and value > 0.0), name, value, "must be a positive number")
    ascending = [disk.bore_radius, *(radius for radius, _ in disk.profile), hub]
    good = all(low < high for low, high in pairwise(ascending))
    good = good and all(isfinite(width) and width > 0.0 for _, width in disk.profile)
    rows = f"must be rows [radius, width] with ascending radii between {disk.bore_radius:g} and {hub:g} m"
    _require(good, "profile", disk.profile, rows)
    _require(disk.bore in ("clamped", "free"), "bore", disk.bore, 'must be "clamped" or "free"')
    fits = disk.size is None or (isfinite(disk.size) and disk.size > 0.0)
    _require(fits, "size", disk.size, "must be a positive number")
    least = rounded(1.02 * _root_extent(blade), 3, ceil)
    _require(disk.rim_width >= least, "rim_width", disk.rim_width, f"must be at least {least:g} m to carry the root")
    if disk.size is not None:
        most = rounded(hub - disk.bore_radius, 3, floor)
        within = f"must lie between a tenth of mesh.size and {most:g} m"
        _require(mesh.size / 10.0 <= disk.size <= most, "size", disk.size, within)


def add_disk(
    sector: SectorMesh,
    planform: tuple[Planform, PlanformMesh],
    blade: BladeParameters,
    parts: tuple[ShroudParameters, MeshParameters, DiskParameters],
    *,
    mirrored: bool,
) -> SectorMesh:
    """The sector with a disk, the material of which is "disk".

    `planform`, its mesh and `blade` are those of the sector before it was mirrored, where it is.

    Its sets `cyclic_right` and `cyclic_left` are the cuts, `root` is the bore where it is clamped, and empty where
    it is free; `rim` holds the nodes of the airfoil's root.
    """
    (plan, flat), (shroud, mesh, disk) = planform, parts
    hub, n = blade.hub_radius, len(flat.points)
    pitch = 2.0 * pi * hub / blade.n_blades
    foot = np.unique(flat.quads[flat.airfoil])
    try:
        rim, right, left = rim_points(
            plan, flat, _root_points(plan, flat, blade, shroud, mesh), disk.rim_width, pitch
        )
    except ValueError:
        allowed = "leaves no room for the root of the airfoil between its neighbours on the rim; try fewer blades"
        raise GeometryError("blade", "n_blades", blade.n_blades, allowed) from None
    radii = _radii(disk, hub, mesh.size)
    first = len(sector.points)
    number = np.full((len(radii), n), -1)
    number[0, foot] = sector.node_sets["root"]
    others = np.setdiff1d(np.arange(n), foot)
    number[0, others] = first + np.arange(len(others))
    number[1:] = first + len(others) + np.arange((len(radii) - 1) * n).reshape(-1, n)
    added = [_layer(rim, hub, radius, disk) for radius in radii]
    added[0] = added[0][others]
    below = np.vstack(added)
    layers = [np.hstack([number[k + 1][flat.quads], number[k][flat.quads]]) for k in range(len(radii) - 1)]
    hexahedra = np.vstack(layers).astype(np.int64)
    if mirrored:
        below[:, 0], hexahedra = 0.0 - below[:, 0], hexahedra[:, MIRRORED_CORNERS]
    points = np.vstack([sector.points, below])
    worst = float(hexahedron_scaled_jacobian(points, hexahedra).min())
    if not worst > 0.0:
        reason = f"gives folded elements (worst scaled Jacobian {worst:.2g})"
        raise GeometryError("disk", "profile", disk.profile, reason)
    sets = sector.node_sets | {
        "root": number[-1] if disk.bore == "clamped" else number[-1][:0],
        "bore": number[-1],
        "rim": sector.node_sets["root"],
        "cyclic_right": number[:, right].ravel(),
        "cyclic_left": number[:, left].ravel(),
    }
    blocks = (*sector.blocks, ElementBlock("hex8", hexahedra, "disk"))
    return replace(sector, points=points, blocks=blocks, node_sets=sets)


def _root_points(
    plan: Planform, flat: PlanformMesh, blade: BladeParameters, shroud: ShroudParameters, mesh: MeshParameters
) -> FloatArray:
    """The airfoil's root in the developed plane of the hub, (f, 2): where the mesh of the airfoil has its nodes."""
    foot = np.unique(flat.quads[flat.airfoil])
    offset = float(airfoil_levels(blade, shroud, mesh)[1][0])
    section = replace(section_at(blade, 0.0), offset=offset)
    places = section.bent(resized(plan.unplace(flat.points[foot]), flat.flanks, plan.section, section))
    c, s = np.cos(radians(blade.root_stagger)), np.sin(radians(blade.root_stagger))
    along, across = places[:, 0], places[:, 1]
    return np.stack([along * c - across * s, along * s + across * c], axis=1)


def _root_extent(blade: BladeParameters) -> float:
    """Axial extent of the section at the root without camber, m."""
    turn = radians(blade.root_stagger)
    return float(blade.chord * np.cos(turn) + 0.25 * blade.thickness * abs(np.sin(turn)) + 2 * blade.fillet_radius)


def _radii(disk: DiskParameters, hub: float, size: float) -> FloatArray:
    """Radii of the layers of nodes from the rim to the bore; those of the profile are among them."""
    coarsest = COARSER * size if disk.size is None else disk.size
    knots, step = [hub, *(radius for radius, _ in disk.profile[::-1]), disk.bore_radius], min(size, coarsest)
    radii = [hub]
    for outer, inner in pairwise(knots):
        steps: list[float] = []
        while sum(steps) < outer - inner - 1e-9:
            steps.append(step)
            step = min(GROWTH * step, coarsest)
        places = np.cumsum(steps) * ((outer - inner) / sum(steps))
        radii += [float(outer - place) for place in places[:-1]] + [inner]
    return np.array(radii)


def _layer(rim: FloatArray, hub: float, radius: float, disk: DiskParameters) -> FloatArray:
    """Points (n, 3) of the rim moved to a radius: the same angles, as wide as the disk is there."""
    return bend(rim[:, 0] * (disk.width(radius, hub) / disk.rim_width), rim[:, 1] / hub, radius)


def _require(condition: bool, parameter: str, value: object, allowed: str) -> None:
    if not condition:
        raise GeometryError("disk", parameter, value, allowed)
