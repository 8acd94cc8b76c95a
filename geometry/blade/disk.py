"""The sector of the disk under a blade, one pitch wide: the rim's quadrilaterals swept inwards to the bore.

The quadrilaterals of the rim are those of the shroud's planform: the airfoil has the same nodes at its root as at the
shroud. Around them the platform becomes that of the rim, one pitch wide and as wide as the disk along x; its two
sides are cuts through the disk, of any shape as long as one is the other turned by a pitch.

The moved mesh is untangled and smoothed by the shape of its quadrilaterals. The corner with the edges a and b has the
inverse mean ratio (|a|^2 + |b|^2) / (2 a x b), 1 for a square; the sum of its squares over all corners is minimised.
Folded corners have a x b <= 0; in place of it stands

    h = (a x b + sqrt((a x b)^2 + 4 delta^2)) / 2 > 0,

with delta from large to small.

References
----------
J. M. Escobar, E. Rodriguez, R. Montenegro, G. Montero, J. M. Gonzalez-Yuste, Simultaneous untangling and smoothing of
tetrahedral meshes, Computer Methods in Applied Mechanics and Engineering 192 (2003) 2775-2787.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, floor, isfinite, pi, radians

import numpy as np
from numpy.typing import NDArray

from geometry.blade.parameters import BladeParameters, DiskParameters, MeshParameters, ShroudParameters
from geometry.blade.planform import Planform, section_at
from geometry.blade.planform_mesh import PlanformMesh
from geometry.blade.remedies import rounded
from geometry.blade.section import resized
from geometry.blade.solid import MIRRORED_CORNERS, airfoil_levels, bend
from geometry.elements import ElementBlock
from geometry.errors import GeometryError
from geometry.quality import hexahedron_scaled_jacobian, quadrilateral_scaled_jacobian
from geometry.sector import FloatArray, IntArray, SectorMesh

DELTAS = (0.1, 0.01, 0.001)  # of the mean area of a quadrilateral
ITERATIONS = 400  # for each of them
_CORNERS = ((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2))  # a corner of a quadrilateral, and its neighbours
LEAST_QUALITY = 0.1  # scaled Jacobian
COARSER = 3.0  # elements at the bore along the radius, relative to those of the blade
GROWTH = 1.3  # of neighbouring layers


@dataclass(frozen=True)
class Movable:
    """Which coordinates of n points may move, and which points follow others."""

    free: NDArray[np.bool_]  # (n, 2), coordinates that may move; of followers those of their leaders count
    leader: IntArray  # (n,), the point that each point follows, itself for most
    offset: FloatArray  # (n, 2), what a follower is ahead of its leader, m

    def numbers(self) -> IntArray:
        """Number of the unknown of each coordinate, -1 for none, (n, 2)."""
        own = self.free & (self.leader == np.arange(len(self.leader)))[:, None]
        numbers = np.full(self.free.shape, -1)
        numbers[own] = np.arange(np.count_nonzero(own))
        return np.asarray(numbers[self.leader])


def smoothed(points: FloatArray, quads: IntArray, movable: Movable) -> FloatArray:
    """Points (n, 2) of a mesh of quadrilaterals (q, 4), counterclockwise, with corners as square as they can be."""
    from scipy.optimize import minimize

    numbers = movable.numbers()
    moving, size = numbers >= 0, int(numbers.max(initial=-1)) + 1
    corners = quads[:, np.array(_CORNERS)].reshape(-1, 3)
    spread = np.ptp(points[quads], axis=1)
    area = float(np.prod(spread, axis=1).mean())
    length = float(np.sqrt(area))
    unknowns = np.zeros(size)
    leads = moving & (movable.leader == np.arange(len(points)))[:, None]
    unknowns[numbers[leads]] = points[leads] / length

    def placed(z: FloatArray) -> FloatArray:
        found = points.copy()
        found[moving] = length * z[numbers[moving]] + movable.offset[moving]
        return found

    def objective(delta: float) -> Callable[[FloatArray], tuple[float, FloatArray]]:
        def value(z: FloatArray) -> tuple[float, FloatArray]:
            total, slope = _distortion(placed(z), corners, delta)
            return total, np.bincount(numbers[moving], length * slope[moving], size).astype(float)

        return value

    for share in DELTAS:
        options = {"maxiter": ITERATIONS}
        unknowns = minimize(objective(share * area), unknowns, jac=True, method="L-BFGS-B", options=options).x
    return placed(unknowns)


def _distortion(points: FloatArray, corners: IntArray, delta: float) -> tuple[float, FloatArray]:
    """Sum of squares of the inverse mean ratios of corners (c, 3), times 4, and its derivatives (n, 2)."""
    a, b = points[corners[:, 1]] - points[corners[:, 0]], points[corners[:, 2]] - points[corners[:, 0]]
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    root = np.sqrt(cross**2 + 4.0 * delta**2)
    height = 0.5 * (cross + root)
    edges = (a**2).sum(axis=1) + (b**2).sum(axis=1)
    by_edges = (4.0 * edges / height**2)[:, None]
    by_cross = (-(edges**2) / height**3 * (1.0 + cross / root))[:, None]
    slope_a = by_edges * a + by_cross * np.stack([b[:, 1], -b[:, 0]], axis=1)
    slope_b = by_edges * b + by_cross * np.stack([-a[:, 1], a[:, 0]], axis=1)
    slopes = np.zeros_like(points)
    for column, slope in ((1, slope_a), (2, slope_b), (0, -slope_a - slope_b)):
        np.add.at(slopes, corners[:, column], slope)
    return float(np.sum((edges / height) ** 2)), slopes


def rim_points(
    plan: Planform, flat: PlanformMesh, root: FloatArray, width: float, pitch: float
) -> tuple[FloatArray, IntArray, IntArray]:
    """Points (n, 2) of the rim in the developed plane (x, s), m, and the nodes of its right and left cut, paired.

    `root` (f, 2) holds the points of the airfoil's root, in the order of its nodes; `width` is that of the rim along
    x, `pitch` that along s. Raises ValueError where the root does not fit between its neighbours.
    """
    foot, around = np.unique(flat.quads[flat.airfoil]), flat.quads[~flat.airfoil]
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
