"""The two contact faces of a sector: checked, paired, with contact points, frames and areas.

The right face, turned back by one pitch, is compared with the left face: radius, axial position, pitch, area,
normals, mismatch, gap and overlap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.elements import IntArray
from geometry.errors import OwnMeshError
from geometry.frames import axes_through, contact_frames, distance_from_axis, rotate_about_axis
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.own_mesh.side_quadrature import (
    SidePoints,
    Triangulation,
    cell_centres,
    evened,
    normals_at,
    on_nodes,
    quadrature,
    triangulation,
    tributary_areas,
)
from geometry.sector import ContactFace, FloatArray

# Of nodes that are pairs, over the distance of a node to the next: largest scatter across the normal, and largest
# distance. A gap along the circumference moves all nodes of an oblique face across its normal by the same amount.
MATCHING, _SHIFT = 0.02, 0.25
_MANY = 500  # sides
_NEAREST = 12  # triangles looked at for each point
_FLAT = 1e-6  # cosine of the angle of a ray to a normal below which it misses the triangle
_EDGE = 1e-2  # a point this far outside a triangle, in its coordinates, is on it
_SAME_PLACE = 0.2  # largest difference of radius or axial position of the faces, over the size of a face
_AREAS = 0.1  # largest relative difference of the areas
_OPPOSITE = 20.0  # degrees, largest angle between a normal and the opposite one
_OBLIQUE = 0.05  # least part of the mean normal across the axis
_WHOLE = 1e-2  # a number of blades this near to a whole one, relatively
_CLOSED = 0.02  # of a gap: what may be left of it with the number of blades that closes it
_LIKE = 0.05  # of the size of a face: as near are the points of two faces that are alike
_GAP = 0.05  # largest gap, over the size of a face
_LEAST_OVERLAP = 0.9
# A mean gap counts from so many standard deviations, and from this part of the size of a face.
_SCATTER, _NO_GAP = 3.0, 1e-7


@dataclass(frozen=True)
class Surface:
    """A face of the sector: points of the mesh, its nodes and sides."""

    points: FloatArray  # (N, 3), nodes of the mesh, m
    nodes: IntArray  # (k,), nodes of the face
    tables: list[IntArray]  # (s, m), nodes of its sides, see `side_tables`

    @property
    def n_sides(self) -> int:
        """Number of sides."""
        return sum(len(table) for table in self.tables)

    def quadrature(self) -> SidePoints:
        """Its quadrature points; fewer of each side where there are many sides."""
        return quadrature(self.points, self.tables, 3 if self.n_sides <= _MANY else 2)

    def samples(self) -> SidePoints:
        """Few quadrature points, to look at its distance from another face."""
        return quadrature(self.points, self.tables, 2 if self.n_sides <= _MANY else 1)

    def triangles(self) -> Triangulation:
        """Its triangulation."""
        return triangulation(self.points, self.tables)


def partners(at: FloatArray, others: FloatArray, normal: FloatArray) -> tuple[IntArray | None, float]:
    """The row (k,) of `others` (m, 3) that each point (k, 3) falls on along the normals (k, 3), and the mismatch.

    The mismatch is the largest distance across the normal. None for the rows where the points are no pairs.
    """
    from scipy.spatial import cKDTree

    distance, row = cKDTree(others).query(at)
    offset = others[row] - at
    across = offset - np.sum(offset * normal, axis=1)[:, None] * normal
    mismatch = float(np.linalg.norm(across, axis=1).max())
    if len(at) != len(others) or len(np.unique(row)) != len(row) or len(at) < 2:
        return None, mismatch
    spacing = float(np.median(cKDTree(at).query(at, k=2)[0][:, 1]))
    scatter = float(np.linalg.norm(across - across.mean(axis=0), axis=1).max())
    paired = scatter < MATCHING * spacing and distance.max() < _SHIFT * spacing
    return (row if paired else None), mismatch


def gap_along(at: FloatArray, normal: FloatArray, surface: Triangulation, reach: float) -> FloatArray:
    """Distance (k,) along the normals (k, 3) from points (k, 3) to a surface; not a number beyond `reach`."""
    from scipy.spatial import cKDTree

    count = min(_NEAREST, len(surface.corners))
    near = cKDTree(surface.corners.mean(axis=1)).query(at, k=count)[1].reshape(len(at), count)
    corner = surface.corners[near]
    first, second = corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]
    ray = np.broadcast_to(-normal[:, None], first.shape)
    matrix = np.stack([first, second, ray], axis=-1)
    flat = np.abs(np.linalg.det(matrix)) <= _FLAT * np.linalg.norm(np.cross(first, second), axis=-1)
    matrix = np.where(flat[..., None, None], np.eye(3), matrix)
    u, v, distance = np.moveaxis(np.linalg.solve(matrix, (at[:, None] - corner[:, :, 0])[..., None])[..., 0], -1, 0)
    outside = flat | (u < -_EDGE) | (v < -_EDGE) | (u + v > 1.0 + _EDGE) | (np.abs(distance) > reach)
    rows = np.arange(len(at))
    best = np.argmin(np.where(outside, np.inf, np.abs(distance)), axis=1)
    u, v = u[rows, best], v[rows, best]
    # from the flat triangle to the curved side
    point = surface.on_surface(near[rows, best], np.stack([1.0 - u - v, u, v], axis=1))
    return np.where(outside[rows, best], np.nan, np.sum((point - at) * normal, axis=1))


def overlap(points: SidePoints, gap: FloatArray) -> float:
    """Share of the area of a face that has the other face opposite."""
    return float(points.area[np.isfinite(gap)].sum() / points.area.sum())


def lie_opposite(right: Surface, left: Surface, turn: float) -> bool:
    """Whether a face turned back lies on the other one."""
    at = right.samples(), left.samples()
    areas = [float(points.area.sum()) for points in at]
    size = float(np.sqrt(areas[0]))
    centre = rotate_about_axis(at[0].centroid, -turn)
    if abs(areas[1] / areas[0] - 1.0) > _AREAS or np.linalg.norm(centre - at[1].centroid) > size:
        return False
    back, normal = (rotate_about_axis(each, -turn) for each in (at[0].position, at[0].normal))
    return overlap(at[0], gap_along(back, normal, left.triangles(), _GAP * size)) > _LEAST_OVERLAP


def check_places(right: SidePoints, left: SidePoints, choice: SectorChoice) -> None:
    """Raise OwnMeshError where the faces are not at the same radius and axial position.

    The faces are in the axes of the file, in m, with the origin on the engine axis that the choice says.
    """
    direction, axis = choice.direction, choice.axis
    size = float(np.sqrt(right.area.sum()))
    faces = (right.centroid, left.centroid)
    radius = [float(distance_from_axis(direction, at)) for at in faces]
    axial = [float(at @ direction) for at in faces]
    if _on_axis(*faces, direction, size):
        told = "must be beside the contact faces; they lie on this axis or on opposite sides of it"
        fitting = _fitting_axis(*faces, size) or _fitting_point(right, left, choice)
        raise OwnMeshError("mesh.axis", axis, told + fitting)
    for what, pair in (("radius", radius), ("axial position", axial)):
        if abs(pair[0] - pair[1]) > _SAME_PLACE * size:
            told = f"the contact faces must be at the same {what}; right {pair[0]:.4g} m, left {pair[1]:.4g} m"
            fitting = _fitting_axis(*faces, size) or _fitting_point(right, left, choice)
            raise OwnMeshError("mesh.axis", axis, told + fitting)


def axis_between(right: SidePoints, left: SidePoints, direction: FloatArray) -> tuple[int, FloatArray] | None:
    """Number of blades and a point (3,) of the axis along a `direction` about which one face turns into the other.

    The mean normals tell the angle, the centroids the place; the angle is positive or negative. None where the faces
    are no images so.
    """
    from_left, to_right = (
        normal - (normal @ direction) * direction for normal in (left.mean_normal, -right.mean_normal)
    )
    chord, size = right.centroid - left.centroid, float(np.sqrt(right.area.sum()))
    turn = float(np.arctan2(direction @ np.cross(from_left, to_right), from_left @ to_right))
    if min(np.linalg.norm(from_left), np.linalg.norm(to_right)) < _OBLIQUE or not abs(turn) > 1e-3:
        return None
    number = round(2.0 * np.pi / abs(turn))
    if number < 3 or abs(2.0 * np.pi / abs(turn) - number) > _WHOLE * number:
        return None
    if abs(chord @ direction) > _LIKE * size:
        return None
    point = (right.centroid + left.centroid) / 2.0
    point = point + np.cross(direction, chord) / (2.0 * np.tan(np.sign(turn) * np.pi / number))
    return number, point - (point @ direction) * direction


def _fitting_point(right: SidePoints, left: SidePoints, choice: SectorChoice) -> str:
    """The axis that does not pass through the point that the choice says, in words; "" where there is none."""
    for direction, name in ((choice.direction, None), *zip(np.eye(3), "xyz", strict=True)):
        found = axis_between(right, left, direction)
        if found is not None:
            number, point = found
            place = point / choice.metres + np.asarray(choice.axis_point, dtype=float)
            there = ", ".join(f"{round(float(value), 6) + 0.0:.6g}" for value in place)
            axis = "" if name is None else f'mesh.axis = "{name}", '
            return f"; they are with {axis}mesh.axis_point = [{there}] and mesh.n_blades = {number}"
    return "; mesh.axis_point names a point of the axis that is not the origin of the file"


def check_inside(right: SidePoints, left: SidePoints, n_blades: int, reach: float, of: FaceNames) -> None:
    """Raise OwnMeshError where the faces are not at one place; one pitch apart they would touch the neighbour's."""
    distance = float(np.linalg.norm(right.centroid - left.centroid))
    if distance <= float(np.sqrt(right.area.sum())) + reach:
        return
    pitch = abs(abs(_apart(right, left)) - 2.0 * np.pi / n_blades) * float(np.hypot(*right.centroid[1:]))
    told = f"must lie on {of.right}; the faces are {1e3 * distance:.4g} mm apart"
    if pitch <= 2.0 * reach:
        told += f', a pitch: kind = "neighbours" would fit, not "inside" in {of.kind_key}'
    raise OwnMeshError(of.left_key, of.left, told)


def check_pitch(right: SidePoints, left: SidePoints, n_blades: int, tolerance: float, of: FaceNames) -> None:
    """Raise OwnMeshError where the faces are not one pitch apart, with the number of blades that fits."""
    apart = _apart(right, left)
    pitch = 2.0 * np.pi / n_blades
    radius = float(np.hypot(*right.centroid[1:]))
    if abs(apart - pitch) * radius <= tolerance:
        return
    if of.kind_key and abs(apart) * radius <= tolerance:
        told = f"must be a pitch of {np.degrees(pitch):.6g} degrees from {of.right}; the faces are at one place: "
        raise OwnMeshError(of.left_key, of.left, told + f'kind = "inside" would fit in {of.kind_key}')
    fit = 2.0 * np.pi / apart if apart > 0.0 else 0.0
    told = f"the contact faces are {np.degrees(apart):.6g} degrees apart, not {np.degrees(pitch):.6g}"
    if fit > 1.5 and abs(fit - round(fit)) < _WHOLE * fit:
        told += f"; n_blades = {round(fit)} would fit"
    else:
        told += "; an axis that does not pass through the origin of the file needs mesh.axis_point"
    raise OwnMeshError("mesh.n_blades", n_blades, told)


def closing_number(right: SidePoints, left: SidePoints, n_blades: int) -> int | None:
    """Another number of blades, with which the faces would touch; None where there is none, or they do touch."""
    apart = _apart(right, left)
    if apart <= 0.0:
        return None
    other = round(2.0 * np.pi / apart)
    away = abs(apart - 2.0 * np.pi / n_blades)
    return None if other == n_blades or abs(apart - 2.0 * np.pi / other) > _CLOSED * away else other


def check_alike(right: SidePoints, left: SidePoints, turn: float, of: FaceNames) -> float:
    """Largest angle, degrees, between a normal of the right face and the opposite one; or OwnMeshError."""
    from scipy.spatial import cKDTree

    areas = [float(face.area.sum()) for face in (right, left)]
    back, normal = rotate_about_axis(right.position, -turn), rotate_about_axis(right.normal, -turn)
    if _mirrored(right, left):
        told = f"is the mirror image of {of.right} (y to -y), not {of.turned(turn)}"
        raise OwnMeshError(of.left_key, of.left, told)
    if abs(areas[1] / areas[0] - 1.0) > _AREAS:
        told = f"must have the area of {of.right}, {areas[0]:.4g} m^2; it has {areas[1]:.4g} m^2"
        raise OwnMeshError(of.left_key, of.left, told)
    opposite = left.normal[cKDTree(left.position).query(back)[1]]
    angle = np.degrees(np.arccos(np.clip(-np.sum(normal * opposite, axis=1), -1.0, 1.0)))
    # the nearest point may lie beyond an edge of a curved face: all but a few must be opposite
    typical = float(np.quantile(angle, 0.9))
    if typical > _OPPOSITE:
        told = f"must face {of.turned(turn)}; the normals are {typical:.3g} degrees off"
        if typical > 180.0 - _OPPOSITE:
            told += ": they point the same way"
        raise OwnMeshError(of.left_key, of.left, told)
    return float(np.quantile(angle, 0.99))


def _apart(right: SidePoints, left: SidePoints) -> float:
    """Angle from the left face to the right one about the axis x, rad."""
    return float(np.arctan2(*right.centroid[1:]) - np.arctan2(*left.centroid[1:]))


def _mirrored(right: SidePoints, left: SidePoints) -> bool:
    """Whether the left face is the mirror image of the right one about the plane between them, and not its image.

    The image is turned back by the angle between the centroids: symmetric faces are both, whatever the gap.
    """
    from scipy.spatial import cKDTree

    size, tree = float(np.sqrt(right.area.sum())), cKDTree(left.position)
    middle = right.centroid * [0.0, 1.0, 1.0] + left.centroid * [0.0, 1.0, 1.0]
    frame = axes_through(np.array([1.0, 0.0, 0.0]), middle)
    image = right.position @ frame.T * [1.0, -1.0, 1.0] @ frame
    turned = rotate_about_axis(right.position, -_apart(right, left))
    as_turned, as_mirrored = (float(np.quantile(tree.query(each)[0], 0.95)) for each in (turned, image))
    return as_turned > _LIKE * size and as_mirrored < 0.5 * as_turned and as_mirrored < _LIKE * size


def _on_axis(right: FloatArray, left: FloatArray, direction: FloatArray, size: float) -> bool:
    """Whether an axis through the origin goes through a face or between the faces."""
    places = (right, left, (right + left) / 2.0)
    return min(float(distance_from_axis(direction, at)) for at in places) < _SAME_PLACE * size


def _fitting_axis(right: FloatArray, left: FloatArray, size: float) -> str:
    """Which axis of the file has the faces at the same place, in words."""
    found = []
    for direction, name in zip(np.eye(3), "xyz", strict=True):
        radii = [float(distance_from_axis(direction, at)) for at in (right, left)]
        same = abs(radii[0] - radii[1]) < _SAME_PLACE * size and abs((right - left) @ direction) < _SAME_PLACE * size
        if same and not _on_axis(right, left, direction, size):
            found.append(f'"{name}"')
    return f"; they are with {' or '.join(found)}" if found else ""


@dataclass(frozen=True)
class FaceNames:
    """What messages call a pair of faces."""

    right: str = "the right face"
    left_key: str = "mesh.sets.contact_left"  # dotted key of the left face
    left: str | None = None  # set of the file; None: not said
    kind_key: str = ""  # dotted key of the kind of contact

    def turned(self, turn: float) -> str:
        """The right face, where it touches the left one."""
        return f"{self.right} turned back by one pitch" if turn else self.right


@dataclass(frozen=True)
class FacePair:
    """Right and left surface of a sector in our axes, and the numbers that tell how they fit."""

    # `right`, `left`: the surfaces
    right: Surface
    left: Surface
    turn: float  # angle from the left face to where the right one touches it, rad
    # (k,), for each node of the right surface its partner, a row of the mesh; None where the nodes are no pairs
    partner: IntArray | None
    mismatch: float  # see `SectorFindings`
    gap: tuple[float, float]  # smallest and largest gap, m
    # mean of the gap, m; 0 where it is no more than the scatter that sides of elements on a curved face cause
    mean_gap: float
    overlap: float  # see `SectorFindings`
    areas: tuple[float, float]  # areas, m^2
    normal_angle: float  # see `SectorFindings`


def pair_faces(right: Surface, left: Surface, choice: SectorChoice, kind: str, of: FaceNames) -> FacePair:
    """The faces paired; OwnMeshError where one is not the other, turned by one pitch between neighbours."""
    at_right, at_left = right.quadrature(), left.quadrature()
    size = float(np.sqrt(at_right.area.sum()))
    reach = _GAP * size if choice.tolerance is None else choice.tolerance * choice.metres
    turn = 2.0 * np.pi / choice.n_blades if kind == "neighbours" else 0.0
    if turn:
        check_pitch(at_right, at_left, choice.n_blades, 2.0 * reach, of)
    else:
        check_inside(at_right, at_left, choice.n_blades, reach, of)
    angle = check_alike(at_right, at_left, turn, of)
    gap, share = _gap(right, left, turn, reach, of)
    mean = float(np.nanmean(gap))
    at = right.points[right.nodes]
    normal = rotate_about_axis(normals_at(at, at_right, right.n_sides), -turn)
    others = left.points[left.nodes]
    row, mismatch = partners(rotate_about_axis(at, -turn), others, normal)
    if row is not None:
        apart = np.sum((others[row] - rotate_about_axis(at, -turn)) * normal, axis=1)
        gap = apart
    areas = float(at_right.area.sum()), float(at_left.area.sum())
    return FacePair(
        right=right,
        left=left,
        turn=turn,
        partner=None if row is None else left.nodes[row],
        mismatch=mismatch,
        gap=(float(np.nanmin(gap)), float(np.nanmax(gap))),
        mean_gap=mean if abs(mean) > _SCATTER * float(np.nanstd(gap)) + _NO_GAP * size else 0.0,
        overlap=share,
        areas=areas,
        normal_angle=angle,
    )


def on_ground(right: Surface) -> FacePair:
    """A face paired with the ground, whose face is its own at rest."""
    area = float(right.quadrature().area.sum())
    return FacePair(right, right, 0.0, right.nodes, 0.0, (0.0, 0.0), 0.0, 1.0, (area, area), 0.0)


def contact_faces(pair: FacePair, grid: tuple[int, int] | None, clamped: IntArray) -> tuple[ContactFace, ContactFace]:
    """Contact points, frames and areas of both faces; the left ones are the right ones turned back by one pitch.

    Without a grid all corner nodes of the sides are contact nodes but those that are `clamped`.
    With matching nodes the contact points are nodes where the grid falls on nodes. Else the nodes of a contact face
    are those nearest to its contact points.
    """
    right, left = pair.right, pair.left
    points = right.quadrature()
    if grid is None:
        if pair.partner is None:
            told = "must be two numbers: the nodes of the contact faces are no pairs under the pitch"
            raise OwnMeshError("mesh.contact_grid", None, told)
        corners = np.unique(np.concatenate([table[:, : _corners(table)].ravel() for table in right.tables]))
        corners = np.setdiff1d(corners, clamped)
        row: IntArray | None = np.searchsorted(right.nodes, corners)
        centres = right.points[corners]
    else:
        centres = evened(cell_centres(points, grid), points)
        row = None if pair.partner is None else on_nodes(centres, right.points[right.nodes], points.area.sum())
    if row is not None and pair.partner is not None:
        at, nodes, others = right.points[right.nodes[row]], right.nodes[row], pair.partner[row]
        opposite = left.points[others]
    else:
        at = _on_surface(centres, points, right)
        opposite = rotate_about_axis(at, -pair.turn)
        normal = rotate_about_axis(normals_at(at, points, right.n_sides), -pair.turn)
        opposite = opposite + pair.mean_gap * normal
        nodes, others = _nearest(at, right), _nearest(opposite, left)
    frame = contact_frames(at, normals_at(at, points, right.n_sides))
    area = tributary_areas(at, points)
    if area.min() <= 0.0:
        raise OwnMeshError("mesh.contact_grid", grid, "is too fine for the shape of this face; take fewer points")
    back = rotate_about_axis(frame, -pair.turn)
    return ContactFace(nodes, at, frame, area), ContactFace(others, opposite, back, area.copy())


def _gap(right: Surface, left: Surface, turn: float, reach: float, of: FaceNames) -> tuple[FloatArray, float]:
    """The gap at points of the right face, m, and the smaller share of the area of a face with the other opposite."""
    at_right, at_left = right.samples(), left.samples()
    back, normal = (rotate_about_axis(each, -turn) for each in (at_right.position, at_right.normal))
    gap = gap_along(back, normal, left.triangles(), reach)
    turned = right.triangles().turned(rotate_about_axis(np.eye(3), -turn).T)
    shares = (overlap(at_right, gap), overlap(at_left, gap_along(at_left.position, at_left.normal, turned, reach)))
    share = min(shares)
    if share < _LEAST_OVERLAP:
        told = f"must lie opposite {of.turned(turn)}; only {100.0 * shares[0]:.3g} % of the "
        told += f"right and {100.0 * shares[1]:.3g} % of the left face have the other within {1e3 * reach:.3g} mm"
        raise OwnMeshError(of.left_key, of.left, told)
    return gap, share


def _on_surface(at: FloatArray, points: SidePoints, surface: Surface) -> FloatArray:
    """Points (k, 3) moved along the normal onto the surface."""
    normal = normals_at(at, points, surface.n_sides)
    move = gap_along(at, normal, surface.triangles(), float(np.sqrt(points.area.sum())))
    return at + np.nan_to_num(move)[:, None] * normal


def _nearest(at: FloatArray, surface: Surface) -> IntArray:
    from scipy.spatial import cKDTree

    return surface.nodes[cKDTree(surface.points[surface.nodes]).query(at)[1]]


def _corners(table: IntArray) -> int:
    return 3 if table.shape[1] in (3, 6) else 4
