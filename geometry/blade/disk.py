"""The sector of the disk under a blade, one pitch wide: the rim's quadrilaterals swept inwards to the bore.

The quadrilaterals of the rim are those of the shroud's planform: the airfoil has the same nodes at its root as at the
shroud. Around them the platform becomes that of the rim, one pitch wide and as wide as the disk along x; its two
sides are cuts through the disk, of any shape as long as one is the other turned by a pitch.

The moved mesh is untangled and smoothed.
"""

from dataclasses import replace
from itertools import pairwise
from math import ceil, floor, isfinite, pi, radians

import numpy as np

from geometry.blade.parameters import BladeParameters, DiskParameters, MeshParameters, ShroudParameters
from geometry.blade.planform import Planform
from geometry.blade.planform_mesh import PlanformMesh
from geometry.blade.remedies import rounded
from geometry.blade.smoothing import Movable, smoothed
from geometry.blade.solid import MIRRORED_CORNERS, airfoil_levels, bend, developed_section
from geometry.elements import ElementBlock
from geometry.errors import GeometryError
from geometry.quality import hexahedron_scaled_jacobian, quadrilateral_scaled_jacobian
from geometry.sector import FloatArray, IntArray, SectorMesh

LEAST_QUALITY = 0.1  # scaled Jacobian
COARSER = 3.0  # elements at the bore along the radius, relative to those of the blade
GROWTH = 1.3  # of neighbouring layers


def rim_points(
    plan: Planform, flat: PlanformMesh, root: FloatArray, width: float, pitch: float
) -> tuple[FloatArray, IntArray, IntArray]:
    """Points (n, 2) of the rim in the developed plane (x, s), m, and the nodes of its right and left cut, paired.

    `root` (f, 2) holds the points of the airfoil's root, in the order of its nodes; `width` is that of the rim along
    x, `pitch` that along s. Raises ValueError where the root does not fit between its neighbours.
    """
    foot, around = flat.foot, flat.quads[~flat.airfoil]
    right, left, ends = _sides(plan, flat)
    scale = np.array([width / plan.width, pitch / plan.pitch])
    points = flat.points * scale
    half_turned = np.array([0.0, pitch]) - points[right[::-1]]
    points[right] = (points[right] + half_turned) / 2  # with this shape, the left one is a pitch away from it
    points[left] = points[right] - [0.0, pitch]
    points[foot] = root
    free = np.ones(points.shape, dtype=bool)
    free[foot] = False
    free[ends, 0] = False
    leader, offset = np.arange(len(points)), np.zeros(points.shape)
    leader[left], offset[left, 1] = right, -pitch
    found = smoothed(points, around, Movable(free, leader, offset))
    if not float(quadrilateral_scaled_jacobian(found, around).min()) > LEAST_QUALITY:
        raise ValueError("the root of the airfoil does not fit on the rim")
    return found, right, left


def _sides(plan: Planform, flat: PlanformMesh) -> tuple[IntArray, IntArray, IntArray]:
    """Nodes of the right and of the left side along +x, and those of the axial ends."""
    edges = np.concatenate([flat.quads[:, [k, (k + 1) % 4]] for k in range(4)])
    count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    outer = {tuple(edge) for edge, number in zip(*count, strict=True) if number == 1}
    following = {int(a): int(b) for a, b in edges if (min(a, b), max(a, b)) in outer}  # counterclockwise
    right_ends = plan.right_profile()[[0, -1]]
    corners = np.vstack([right_ends, right_ends - [0.0, plan.pitch]])
    low, high, low_left, high_left = (int(np.argmin(np.hypot(*(flat.points - c).T))) for c in corners)
    loop = [high]
    while following[loop[-1]] != high:
        loop.append(following[loop[-1]])
    right = np.array(loop[: loop.index(low) + 1])[::-1]  # the loop runs along it from +x to -x
    left = np.array(loop[loop.index(low_left) : loop.index(high_left) + 1])
    if len(left) != len(right):
        raise ValueError("the sides of the platform have different numbers of nodes")
    on_end = np.abs(np.abs(flat.points[:, 0]) - plan.width / 2) < 1e-9 * plan.width
    return right, left, np.flatnonzero(on_end)


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
    foot = flat.foot
    try:
        root = developed_section(plan, flat, blade, hub, (0.0, float(airfoil_levels(blade, shroud, mesh)[1][0])))
        rim, right, left = rim_points(plan, flat, root, disk.rim_width, pitch)
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


def _root_extent(blade: BladeParameters) -> float:
    """Axial extent of the section at the root without camber, m; of points twice what it reaches from x = 0."""
    if blade.sections is not None:
        return float(2 * np.abs(blade.sections.curves(blade.hub_radius).outline[:, 0]).max())
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
