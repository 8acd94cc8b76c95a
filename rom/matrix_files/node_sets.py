"""The nodes that a model from elsewhere is held, touched and loaded at, in metres and the axes of the ring.

x leads along the engine axis, z through the contact faces. Contact nodes of two faces without elements are paired
under the pitch; normals, areas and contact frames follow from their positions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry.frames import NAMED_AXES, axes_through, contact_frames, rotate_about_axis
from geometry.sector import ContactFace, SectorMesh
from geometry.units import UNIT_SYSTEMS
from rom.errors import MatrixFileError, RomParameterError
from rom.matrix_files.matrix_choice import SETS, MatrixChoice
from rom.matrix_files.node_table import NodeTable, read_nodes

_PLANE, _QUADRIC = 3, 6  # coefficients of the two fits
_STEEP = 0.05  # smallest circumferential part of a normal that says which way is outward
_NEIGHBOURS = 4  # nodes off the face, times those on it, that say where the material is
_LARGEST_MISMATCH = 0.25  # of the distance between contact nodes, by default
_ON_AXIS = 1e-9  # of the largest distance from the axis
_LISTED = 8


@dataclass(frozen=True)
class ContactPairs:
    """Both faces and what was found on the way."""

    # `right`, `left`: node k of one lies opposite node k of the other
    right: ContactFace
    left: ContactFace
    mismatch: float  # largest distance in the face between the nodes of a pair, m
    gap: float  # largest distance along the normal between them, m
    # `normals`, `areas`: where these are from
    normals: str
    areas: str


def contact_pairs(
    points: NDArray[np.float64],
    sets: tuple[NDArray[np.int64], NDArray[np.int64]],
    n_blades: int,
    tolerance: float | None = None,
    normals: NDArray[np.float64] | None = None,
    area: NDArray[np.float64] | None = None,
) -> ContactPairs:
    """Contact faces of a sector about the x axis.

    Shapes: `points` (n, 3), `sets` (k,), `normals` (n, 3), `area` (n,).
    """
    right, left = sets
    for name, nodes in (("contact_right", right), ("contact_left", left)):
        if not len(nodes):
            raise RomParameterError("model.sets", name, "no nodes", "must be a set with contact nodes")
    if len(right) != len(left):
        found = f"{len(left)} nodes"
        raise RomParameterError("model.sets", "contact_left", found, f"must have as many as the right: {len(right)}")
    if np.intersect1d(right, left).size:
        raise RomParameterError("model.sets", "contact_left", "nodes of contact_right", "must be other nodes")
    given = None if normals is None else normals[right]
    fitted = given is None or bool(np.isnan(given).any())
    normal = _fitted_normals(points, right) if fitted else np.asarray(given)
    known = None if area is None or np.isnan(area[right]).any() else area[right]
    pitch = 2.0 * np.pi / n_blades
    frames = contact_frames(points[right], normal)
    turned = rotate_about_axis(points[left], pitch)  # onto the right face
    partner, mismatch, gap = _partners(points[right], turned, frames)
    spacing = _spacing(points[right])
    allowed = tolerance if tolerance is not None else _LARGEST_MISMATCH * spacing if len(right) > 1 else np.inf
    worst = float(mismatch.max())
    if len(np.unique(partner)) < len(partner) or worst > allowed:
        _refuse(points, (right, left), n_blades, worst, allowed)
    share = _triangulated_areas(points[right], frames) if known is None else known
    return ContactPairs(
        ContactFace(right, points[right], frames, share),
        ContactFace(left[partner], points[left[partner]], rotate_about_axis(frames, -pitch), share),
        worst,
        float(np.abs(gap).max()),
        ("a quadric through the nodes" if len(right) > _QUADRIC else "a plane") if fitted else "the table",
        "a triangulation of the nodes, a third of each triangle to each corner" if known is None else "the table",
    )


def _partners(
    right: NDArray[np.float64], turned: NDArray[np.float64], frames: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """For each right node the nearest of the others (k, 3) in its tangent plane, that distance and the gap."""
    offset = np.einsum("kij,klj->kli", frames, turned[None] - right[:, None])
    distance = np.hypot(offset[..., 0], offset[..., 1])
    partner = np.argmin(distance, axis=1)
    every = np.arange(len(right))
    return partner.astype(np.int64), distance[every, partner], offset[every, partner, 2]


def _refuse(
    points: NDArray[np.float64],
    sets: tuple[NDArray[np.int64], NDArray[np.int64]],
    n_blades: int,
    worst: float,
    allowed: float,
) -> None:
    """Raise the error for faces whose nodes do not match, with the likely cause."""
    right, left = sets
    turned, back = (rotate_about_axis(points[left], sign * 2.0 * np.pi / n_blades) for sign in (1.0, -1.0))
    nearest = np.linalg.norm(points[right].mean(axis=0) - back.mean(axis=0))
    if nearest < 0.1 * np.linalg.norm(points[right].mean(axis=0) - turned.mean(axis=0)):
        allowed_text = "must be the face on the -y side: swap contact_right and contact_left"
        raise RomParameterError("model.sets", "contact_left", f"a face {worst:.3g} m away", allowed_text)
    found = f"a node {worst:.3g} m from the nearest right node turned by one pitch of {n_blades} blades"
    raise RomParameterError(
        "model.sets",
        "contact_left",
        found,
        f"must match the right nodes one by one within {allowed:.3g} m (tolerance)",
    )


def _spacing(points: NDArray[np.float64]) -> float:
    """Typical distance of a point to its nearest neighbour; infinite for one point."""
    if len(points) < 2:
        return np.inf
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    return float(np.median(distance.min(axis=1)))


def _fitted_normals(points: NDArray[np.float64], face: NDArray[np.int64]) -> NDArray[np.float64]:
    """Outward normals (k, 3) of the quadric, with few nodes the plane, that fits the nodes of a face best."""
    at = points[face]
    centre = at.mean(axis=0)
    _, sizes, axes = np.linalg.svd(at - centre, full_matrices=True)
    allowed = "must have three nodes or more that are not on a line, or columns nx, ny, nz"
    if len(face) < _PLANE or sizes[1] < 1e-6 * sizes[0]:
        raise RomParameterError("model.sets", "contact_right", f"{len(face)} nodes without normals", allowed)
    local = (at - centre) @ axes.T / sizes[0]
    u, v, w = local.T
    slope = np.zeros((len(face), 2))
    terms = np.column_stack([np.ones_like(u), u, v, u * u, u * v, v * v])
    if len(face) > _QUADRIC and np.linalg.matrix_rank(terms, tol=1e-8 * np.sqrt(len(face))) == _QUADRIC:
        c = np.linalg.lstsq(terms, w, rcond=None)[0]
        slope = np.column_stack([c[1] + 2.0 * c[3] * u + c[4] * v, c[2] + c[4] * u + 2.0 * c[5] * v])
    normal = np.column_stack([-slope, np.ones(len(face))]) @ axes
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return np.asarray(normal * _outward(points, face, normal.mean(axis=0)))


def _outward(points: NDArray[np.float64], face: NDArray[np.int64], normal: NDArray[np.float64]) -> float:
    """Sign that turns a normal away from the material, or without other nodes nearby towards +y."""
    centre = points[face].mean(axis=0)
    others = np.delete(points, face, axis=0) - centre
    near = others[np.argsort(np.linalg.norm(others, axis=1))[: _NEIGHBOURS * len(face)]]
    size = np.linalg.norm(points[face] - centre, axis=1).max()
    near = near[np.linalg.norm(near, axis=1) < 2.0 * size]
    depth = near @ normal
    if len(near) and abs(depth.sum()) > 0.5 * np.abs(depth).sum() > 0.0:
        return -float(np.sign(depth.sum()))
    towards = np.array([0.0, centre[2], -centre[1]]) / np.hypot(centre[1], centre[2])
    if abs(normal @ towards) < _STEEP:
        allowed = "must have columns nx, ny, nz: the nodes do not say which side the material is on"
        raise RomParameterError("model.sets", "contact_right", f"{len(face)} nodes without normals", allowed)
    return float(np.sign(normal @ towards))


def _triangulated_areas(position: NDArray[np.float64], frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """Areas (k,) in m^2: a third of each Delaunay triangle in the mean tangent plane to each of its corners.

    The area in the plane over n . n_mean is that on the face; slivers along a curved edge of the face have none.
    """
    from scipy.spatial import Delaunay, QhullError

    left, _, right = np.linalg.svd(frames.mean(axis=0))
    mean = left @ right
    plane = (position - position.mean(axis=0)) @ mean[:2].T
    try:
        corners = Delaunay(plane / np.abs(plane).max()).simplices
    except (QhullError, ValueError):
        allowed = "must have three nodes or more that are not on a line, or a column area"
        raise RomParameterError(
            "model.sets", "contact_right", f"{len(position)} nodes without areas", allowed
        ) from None
    (ax, ay), (bx, by) = (plane[corners[:, k]].T - plane[corners[:, 0]].T for k in (1, 2))
    triangle = 0.5 * np.abs(ax * by - ay * bx)
    flat = np.bincount(corners.ravel(), np.repeat(triangle / 3.0, 3), minlength=len(position))
    return np.asarray(flat / np.abs(frames[:, 2] @ mean[2]))


@dataclass(frozen=True)
class RingAxes:
    """Rows: x, y, z of the ring in the axes of the file; a point on the engine axis; the unit of length."""

    rows: NDArray[np.float64]  # (3, 3), directions, orthonormal and right-handed; x is the engine axis, z outward
    origin: NDArray[np.float64]  # (3,), point on the axis, in the unit of the file
    unit: str  # A name in `UNIT_SYSTEMS`: "mm" goes with N, t, "in" with lbf, lbf s^2/in

    @property
    def turned(self) -> bool:
        """Whether they are others than the axes of the file."""
        return not np.array_equal(self.rows, np.eye(3))

    def points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 3) of the file in metres and the axes of the ring."""
        moved = points - self.origin if np.any(self.origin) else points
        moved = moved @ self.rows.T if self.turned else moved
        return moved * UNIT_SYSTEMS[self.unit].length

    def directions(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Directions (..., 3) of the file in the axes of the ring."""
        return vectors @ self.rows.T if self.turned else vectors


def ring_axes(axis: str | ArrayLike, point: ArrayLike, unit: str, at: NDArray[np.float64]) -> RingAxes:
    """Axes of the ring: x along `axis` through `point`, z through the point `at` (3,), all in the axes of the file.

    Raises RomParameterError for an unknown axis or unit and a point on the axis.
    """
    if unit not in UNIT_SYSTEMS:
        raise RomParameterError("model", "unit", unit, f"must be one of {', '.join(UNIT_SYSTEMS)}")
    if isinstance(axis, str) and axis not in NAMED_AXES:
        raise RomParameterError("model", "axis", axis, f"must be one of {', '.join(NAMED_AXES)} or three numbers")
    x = np.asarray(NAMED_AXES[axis] if isinstance(axis, str) else axis, dtype=float)
    length = np.linalg.norm(x)
    if x.shape != (3,) or not np.isfinite(length) or length == 0.0:
        raise RomParameterError("model", "axis", axis, "must be three finite numbers, not all 0")
    x = x / length
    origin = np.asarray(point, dtype=float)
    arm = at - origin
    radius = np.linalg.norm(arm - (arm @ x) * x)
    if radius <= _ON_AXIS * np.linalg.norm(arm) or radius == 0.0:
        raise RomParameterError("model", "axis", axis, "must be an axis that the contact faces stand around")
    return RingAxes(axes_through(x, arm), origin, unit)


@dataclass(frozen=True)
class SectorNodes:
    """Nodes of a sector without elements."""

    table: NodeTable  # the nodes as the file has them
    axes: RingAxes  # how they were turned and scaled
    sector: SectorMesh  # points and faces, no elements
    pairs: ContactPairs  # what was found about the faces

    @property
    def notes(self) -> tuple[str, ...]:
        """What was found, one line each."""
        pairs, n = self.pairs, len(self.pairs.right.nodes)
        area = float(pairs.right.area.sum())
        return (
            f"contact: {n} pairs of nodes, {pairs.mismatch:.3g} m apart in the face at most, {pairs.gap:.3g} m along "
            f"the normal; normals from {pairs.normals}; areas from {pairs.areas}, {area:.4g} m^2 a face",
        )


def sector_nodes(choice: MatrixChoice) -> SectorNodes:
    """Nodes, sets and contact faces of a choice.

    Raises MatrixFileError for a damaged table or a set that is not in it, RomParameterError where faces do not match.
    """
    table = read_nodes(choice.nodes)
    sets = {name: _set(table, choice, name) for name in SETS}
    right, left = sets["contact_right"], sets["contact_left"]
    for name, found in (("contact_right", right), ("contact_left", left)):
        if not len(found):
            raise MatrixFileError(table.path, f"no node is in the set {choice.set_name(name)}", _sets_of(table))
    middle = 0.5 * (table.points[right].mean(axis=0) + table.points[left].mean(axis=0))
    axes = ring_axes(choice.axis, choice.axis_point, choice.unit, middle)
    points, metre = axes.points(table.points), UNIT_SYSTEMS[choice.unit].length
    pairs = contact_pairs(
        points,
        (right, left),
        choice.n_blades,
        None if choice.tolerance is None else choice.tolerance * metre,
        None if table.normals is None else axes.directions(table.normals),
        None if table.area is None else table.area * metre**2,
    )
    sets |= {"contact_right": pairs.right.nodes, "contact_left": pairs.left.nodes}
    sets |= {"face_right": np.sort(right), "face_left": np.sort(left)}
    if not len(sets["tip"]):
        sets["tip"] = _outermost(points)
    if len(sets["tip"]) > 1:
        raise MatrixFileError(table.path, f"{len(sets['tip'])} nodes in the set {choice.set_name('tip')}", "one node")
    named = {name: nodes for name, nodes in table.sets.items() if name not in sets}
    sector = SectorMesh(points, (), {**named, **sets}, pairs.right, pairs.left, choice.n_blades)
    return SectorNodes(table, axes, sector, pairs)


def _set(table: NodeTable, choice: MatrixChoice, name: str) -> NDArray[np.int64]:
    found = table.sets.get(choice.set_name(name))
    if found is None and name in choice.sets:
        raise MatrixFileError(table.path, f"no node is in the set {choice.sets[name]}", _sets_of(table))
    return np.zeros(0, dtype=np.int64) if found is None else found


def _sets_of(table: NodeTable) -> str:
    names = sorted(table.sets)
    return ", ".join(names[:_LISTED]) + ", ..." * (len(names) > _LISTED) if names else "names in the column sets"


def _outermost(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The node farthest from the engine axis, of several at that radius the one nearest to the plane y = 0."""
    radius = np.hypot(points[:, 1], points[:, 2])
    outer = np.flatnonzero(radius > (1.0 - 1e-6) * radius.max())
    return outer[[np.argmin(np.abs(points[outer, 1]))]]
