"""Wings of the airfoil, a part-span snubber and a platform: hexahedra from its sides to the neighbours.

A side of the airfoil is a grid of nodes, columns along the chord times levels along the span. From some of these
columns, between two levels, layers of hexahedra lead along the circumference to the ends of the wing, where the nodes
are a regular grid. In between they lie at equal steps in the cylindrical coordinates x, theta and r.

The flanks of a platform are planes along x. Across it, with eta along the circumference and zeta along the radius
midway between two blades, the right one runs from eta = -(gap / 2 + L) to -gap / 2, and zeta rises with the slope
tan(flank_angle). The left one of the next blade is its mirror image.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import ceil, cos, floor, isfinite, pi, radians, sin, sqrt, tan
from typing import Any

import numpy as np

from geometry.blade.layouts import contact_fractions, equal_steps, grid_fractions
from geometry.blade.parameters import BladeParameters, MeshParameters, PlatformParameters, SnubberParameters
from geometry.blade.remedies import rounded
from geometry.blade.solid import bend
from geometry.elements import ElementBlock
from geometry.errors import GeometryError
from geometry.frames import contact_faces
from geometry.quality import hexahedron_scaled_jacobian
from geometry.sector import ContactFace, FacePair, FloatArray, IntArray, SectorMesh

LEAST_QUALITY = 0.1  # scaled Jacobian
ANGLE_STEP = 5.0  # degrees, of angles that are tried in place of one that gives folded elements
SMALLER = (
    0.9,
    0.8,
    0.7,
    0.6,
    0.5,
    0.4,
    0.3,
    0.2,
)  # of a length that gives folded elements: tried for one that does not
Wing = SnubberParameters | PlatformParameters
TABLES = {SnubberParameters: "snubber", PlatformParameters: "platform"}
STEEPEST = 105.0  # degrees, contact angle of a snubber; 180 - STEEPEST for those below 90
STEEPEST_FLANK = 75.0  # degrees
MOST_CUT = 0.9  # of the thickness of a platform, by its flank


@dataclass(frozen=True)
class Flanks:
    """Nodes of the two sides of the airfoil by level and by column along +x."""

    # `right`, `left`: (levels, columns), rows of the points
    right: IntArray
    left: IntArray
    radius: FloatArray  # (levels,), m


def wing_radii(wing: Wing, mesh: MeshParameters) -> FloatArray:
    """Radii (m,) of the levels in a wing, m: on those of a snubber lie the contact nodes."""
    low, high = wing.radii
    if isinstance(wing, SnubberParameters):
        return low + wing.thickness * contact_fractions(mesh.contact_grid[1], wing.thickness, mesh.size)
    return low + (high - low) * equal_steps(max(1, ceil(wing.thickness / mesh.size - 1e-6)))


def column_fractions(nodes: int, columns: int) -> FloatArray:
    """Places (columns + 1,) on [0, 1], symmetric about 1/2, with the centres of `nodes` equal parts among them.

    The number of columns is even and more than that of nodes.
    """
    knots = np.concatenate([[0.0], grid_fractions(nodes), [1.0]])
    parts = np.ones(nodes + 1, dtype=int)
    if nodes % 2 == 0:
        parts[nodes // 2] += 1
    while parts.sum() < columns:
        longest = int(np.argmax(np.round(np.diff(knots) / parts, 9)))
        parts[longest] += 1
        parts[nodes - longest] += 1
    pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(knots[:-1], knots[1:], parts, strict=True)]
    fractions = np.concatenate([*pieces, [1.0]])
    return np.asarray((fractions + (1 - fractions[::-1])) / 2)


def add_wings(
    sector: SectorMesh, flanks: Flanks, blade: BladeParameters, mesh: MeshParameters, wings: Mapping[str, Wing]
) -> SectorMesh:
    """The sector with wings, elements of its first block, and their faces as further pairs.

    The node set of the name of a wing holds its nodes off the airfoil.
    Raises GeometryError for a parameter of a wing that gives folded elements, with one that does not.
    """
    for name, wing in wings.items():
        made = _made(sector.points, flanks, blade, mesh, wing)
        if not made.quality > LEAST_QUALITY:
            raise _folded(sector.points, flanks, blade, mesh, wing, made.quality)
        first, *others = sector.blocks
        block = replace(first, nodes=np.vstack([first.nodes, made.hexahedra]))
        surfaces = {
            key: replace(sides, block=sides.block[open_], element=sides.element[open_], side=sides.side[open_])
            for key, sides in sector.surfaces.items()
            for open_ in [~_covered(sector.blocks, sides.block, sides.element, sides.side, made.base)]
        }
        sector = replace(
            sector,
            points=made.points,
            blocks=(block, *others),
            surfaces=surfaces,
            pairs={**sector.pairs, name: made.pair},
            node_sets={**sector.node_sets, name: np.arange(len(sector.points), len(made.points))},
        )
    return sector


def _covered(
    blocks: tuple[ElementBlock, ...], block: IntArray, element: IntArray, side: IntArray, base: IntArray
) -> np.ndarray:
    """Which sides (s,) of hexahedra of the first block lie under a wing, whose nodes on the airfoil are `base`."""
    sides = np.array(blocks[0].topology.sides)
    return np.asarray((block == 0) & np.isin(blocks[0].nodes[element[:, None], sides[side]], base).all(axis=1))


@dataclass(frozen=True)
class _Made:
    """A wing on both sides of the airfoil."""

    points: FloatArray  # (N, 3), of the sector with the wing
    hexahedra: IntArray  # (E, 8), of the wing
    base: IntArray  # (b,), its nodes on the airfoil
    pair: FacePair

    @property
    def quality(self) -> float:
        """Worst scaled Jacobian."""
        return float(hexahedron_scaled_jacobian(self.points, self.hexahedra).min())


def _made(points: FloatArray, flanks: Flanks, blade: BladeParameters, mesh: MeshParameters, wing: Wing) -> _Made:
    """The elements and faces of a wing, folded or not."""
    first, last = (int(np.argmin(np.abs(flanks.radius - radius))) for radius in wing.radii)
    chosen, extent = slice(first, last + 1), _axial_extent(blade, flanks, wing)
    columns = _columns(flanks.right.shape[1] - 1, extent, mesh, wing)
    bases = [side[chosen, columns] for side in (flanks.right, flanks.left)]
    width = extent if wing.width is None else wing.width
    place, radius = column_fractions(mesh.contact_grid[0], bases[0].shape[1] - 1), flanks.radius[chosen]
    found, tables, hexahedra = points, [], []
    for base, sign in zip(bases, (1.0, -1.0), strict=True):
        x = width * (place - 0.5)
        if isinstance(wing, PlatformParameters):
            ends = _platform_ends(wing, blade, mesh, sign, x, radius)
        else:
            ends = _snubber_ends(wing, blade, sign, x, radius)
        layers = _layers(points[base], ends, mesh.size)
        numbers = len(found) + np.arange(layers[..., 0].size).reshape(layers.shape[:3])
        tables.append(np.concatenate([base[None], numbers]))
        hexahedra.append(_hexahedra(tables[-1], sign))
        found = np.vstack([found, bend(*np.moveaxis(layers.reshape(-1, 3), -1, 0))])
    if isinstance(wing, PlatformParameters):  # nodes by height up the flank, and column
        fractions = _flank_fractions(wing, mesh)
        faces = [table[-len(fractions) :, 0] for table in tables]
    else:
        fractions = contact_fractions(mesh.contact_grid[1], wing.thickness, mesh.size)
        faces = [table[-1] for table in tables]
    along, up = (_nearest(each, count) for each, count in zip((place, fractions), mesh.contact_grid, strict=True))
    right, left = (face[np.ix_(up, along)].ravel() for face in faces)
    if isinstance(wing, PlatformParameters):
        pair = _flank_faces(found, right, left, wing, blade, width)
    else:
        area = wing.contact_length * wing.thickness
        pair = contact_faces(found, right, left, wing.angle, area, blade.n_blades)
    whole = (np.sort(faces[0].ravel()), np.sort(faces[1].ravel()))
    base = np.concatenate([each.ravel() for each in bases])
    return _Made(found, np.vstack(hexahedra), base, FacePair(*pair, *whole))


def _nearest(fractions: FloatArray, count: int) -> list[int]:
    """Places of the centres of `count` equal parts among fractions of a length."""
    return [int(np.argmin(np.abs(fractions - f))) for f in grid_fractions(count)]


def _axial_extent(blade: BladeParameters, flanks: Flanks, wing: Wing) -> float:
    """Extent of the airfoil along x at the mid radius of a wing, m."""
    if blade.sections is not None:
        return float(np.ptp(blade.sections.curves(wing.radius).outline[:, 0]))
    low, high = float(flanks.radius[0]), float(flanks.radius[-1])
    stagger = blade.root_stagger + blade.twist * (wing.radius - low) / (high - low)
    return float(blade.chord * cos(radians(stagger)))


def _columns(count: int, extent: float, mesh: MeshParameters, wing: Wing) -> slice:
    """The columns of nodes at which a wing stands, of those between `count` elements along the chord."""
    nodes = mesh.contact_grid[0]
    least = nodes + 1 + (nodes + 1) % 2
    if least > count:
        table = TABLES[type(wing)]
        has = f"the airfoil has {count} elements along the chord, and the {table} needs {least} with this grid"
        raise GeometryError("mesh", "size", mesh.size, f"must be smaller, or mesh.contact_grid coarser: {has}")
    chosen = count
    if isinstance(wing, SnubberParameters):
        chosen = min(max(2 * round(count * wing.width / extent / 2), least), count)
    first = (count - chosen) // 2
    return slice(first, first + chosen + 1)


def _layers(base: FloatArray, ends: FloatArray, size: float) -> FloatArray:
    """Nodes (l, levels, columns, 3) in x, theta, r of the layers beyond `base` (levels, columns, 3), in x, y, z.

    `ends` (k, levels, columns, 3), in x, theta, r, are the last of them.
    """
    x, y, z = np.moveaxis(base, -1, 0)
    start = np.stack([x, np.arctan2(y, z), np.hypot(y, z)], axis=-1)
    distance = float(np.mean(np.abs(ends[0, ..., 1] - start[..., 1]) * start[..., 2]))
    share = equal_steps(max(1, ceil(distance / size - 1e-6)))[1:, None, None, None]
    return np.concatenate([start + share * (ends[0] - start), ends[1:]])


def _hexahedra(table: IntArray, sign: float) -> IntArray:
    """Hexahedra (E, 8) between nodes (layers, levels, columns); the layers lead to +y where `sign` is above 0."""
    near, far = table[:-1], table[1:]
    first, last = (near, far) if sign > 0.0 else (far, near)  # along y
    corners = [first[:, :, :-1], first[:, :, 1:], last[:, :, 1:], last[:, :, :-1]]
    lower, upper = ([corner[:, rows] for corner in corners] for rows in (slice(None, -1), slice(1, None)))
    return np.stack([*lower, *upper], axis=-1).reshape(-1, 8).astype(np.int64)


def _snubber_ends(
    snubber: SnubberParameters,
    blade: BladeParameters,
    sign: float,
    x: FloatArray,
    radius: FloatArray,
) -> FloatArray:
    """Nodes (1, levels, columns, 3) in x, theta, r of a contact face: the left one is the right one turned back."""
    slope = 0.0 if snubber.angle == 180.0 else tan(radians(snubber.angle))
    pitch = 2 * pi / blade.n_blades - snubber.gap / snubber.radius
    theta = slope * x / snubber.radius + sign * pitch / 2
    return np.stack(np.broadcast_arrays(x[None], theta[None], radius[:, None]), axis=-1)[None]


def _flank_fractions(platform: PlatformParameters, mesh: MeshParameters) -> FloatArray:
    """Places of the nodes along a flank; the contact nodes are among them."""
    return contact_fractions(mesh.contact_grid[1], platform.length_of_flank, mesh.size)


def _platform_ends(
    platform: PlatformParameters,
    blade: BladeParameters,
    mesh: MeshParameters,
    sign: float,
    x: FloatArray,
    radius: FloatArray,
) -> FloatArray:
    """Nodes (k, levels, columns, 3) in x, theta, r above a flank, from its start to the end of the platform."""
    (low, high), length = platform.radii, platform.length_of_flank
    at, start = _flank_fractions(platform, mesh), platform.gap_between(blade.n_blades) / 2 + length
    eta = length * at - start
    zeta = sqrt(low**2 - start**2) + length * at * tan(radians(platform.flank_angle))
    theta, under = pi / blade.n_blades + np.arctan2(eta, zeta), np.hypot(eta, zeta)
    r = under[:, None] + (high - under[:, None]) * (radius - low) / (high - low)
    parts = np.broadcast_arrays(x[None, None], sign * theta[:, None, None], r[:, :, None])
    return np.stack(parts, axis=-1)


def _flank_faces(
    points: FloatArray,
    right: IntArray,
    left: IntArray,
    platform: PlatformParameters,
    blade: BladeParameters,
    width: float,
) -> tuple[ContactFace, ContactFace]:
    """The two flanks of a platform from their contact nodes in order.

    Both have t1 = +x and n out of the platform, towards the hub and the neighbour. t2 is the radial direction
    projected in the flank, outward, as in `contact_frames`: it leads up the flank, towards the neighbour. The left
    flank is no turned image of the right one but a mirrored one, and so is its frame: where t1 x n = t2 on the right,
    t1 x n = -t2 on the left.
    """
    middle, tilt = pi / blade.n_blades, radians(platform.flank_angle)
    eta, zeta = np.array([0.0, cos(middle), -sin(middle)]), np.array([0.0, sin(middle), cos(middle)])
    t1, t2, n = np.eye(3)[0], cos(tilt) * eta + sin(tilt) * zeta, sin(tilt) * eta - cos(tilt) * zeta
    frame = np.tile(np.stack([t1, t2, n]), (len(right), 1, 1))
    share = np.full(len(right), width * platform.length_of_flank / cos(tilt) / len(right))
    mirrored = frame * [1.0, -1.0, 1.0]
    return (
        ContactFace(right, points[right], frame, share),
        ContactFace(left, points[left], mirrored, share.copy()),
    )


def _folded(
    points: FloatArray, flanks: Flanks, blade: BladeParameters, mesh: MeshParameters, wing: Wing, quality: float
) -> GeometryError:
    """What to say of a wing with folded elements: the first parameter of which another value gives none."""
    table = TABLES[type(wing)]
    for name, value in _other_values(wing):
        change: dict[str, Any] = {name: value}
        other: Wing = replace(wing, **change)
        if _made(points, flanks, blade, mesh, other).quality > LEAST_QUALITY:
            told = f"gives folded elements (worst scaled Jacobian {quality:.2g}); {table}.{name} = {value:g} does not"
            given = getattr(wing, "length_of_flank" if name == "flank_length" else name)
            return GeometryError(table, name, given, told)
    told = (
        f"leaves no room for the {table} between neighbours (worst scaled Jacobian {quality:.2g}); try fewer blades"
    )
    return GeometryError("blade", "n_blades", blade.n_blades, told)


def _other_values(wing: Wing) -> Iterator[tuple[str, float]]:
    """Other values of the parameters of a wing, the nearest first."""
    if isinstance(wing, SnubberParameters):
        angles = [angle for angle in np.arange(5.0, 181.0, ANGLE_STEP) if steep_enough(angle)]
        yield from (("angle", float(angle)) for angle in sorted(angles, key=lambda angle: abs(angle - wing.angle)))
        yield from (("width", rounded(share * wing.width, 3, floor)) for share in SMALLER)
        return
    yield from (("flank_length", rounded(share * wing.length_of_flank, 3, floor)) for share in SMALLER)
    if wing.width is not None:
        yield from (("width", rounded(share * wing.width, 3, floor)) for share in SMALLER)


def check_wings(blade: BladeParameters, fillets: tuple[float, float], end: float, wings: Mapping[str, Wing]) -> None:
    """Check wings of an airfoil that ends at the radius `end` (m), with fillets of these radii (m) at root and end.

    Raises GeometryError for the first parameter that is wrong.
    """
    low, high, below = blade.hub_radius + fillets[0], end - fillets[1], "root"
    for name, wing in sorted(wings.items(), key=lambda item: item[1].radius):
        for key in ("radius", "thickness", "width", "gap", "flank_length"):
            value = getattr(wing, key, None)
            if value is not None:
                good = isfinite(value) and (value > 0.0 or (key == "gap" and value == 0.0))
                _require(good, name, key, value, "must be a positive number")
        half = wing.thickness / 2
        room = f"must lie between {low + half:.6g} and {high - half:.6g} m, above the {below}, for this thickness"
        _require(low < wing.radii[0] and wing.radii[1] < high, name, "radius", wing.radius, room)
        low, below = wing.radii[1], name
        pitch = 2 * pi * wing.radius / blade.n_blades
        gap = wing.gap_between(blade.n_blades) if isinstance(wing, PlatformParameters) else wing.gap
        _require(gap <= pitch / 2, name, "gap", gap, f"must be at most half the pitch there ({pitch / 2:.6g} m)")
        wide = wing.width is None or wing.width <= blade.chord
        _require(wide, name, "width", wing.width, f"must be at most the chord ({blade.chord:g} m)")
        if isinstance(wing, SnubberParameters):
            allowed = f"must lie above 0 and at most {180 - STEEPEST:g} or from {STEEPEST:g} to 180 degrees"
            _require(steep_enough(wing.angle), name, "angle", wing.angle, allowed)
        else:
            _check_flank(wing)


def steep_enough(angle: float) -> bool:
    """Whether a contact angle (degrees) is near enough to the engine axis for a wing."""
    return 0.0 < angle <= 180.0 - STEEPEST or STEEPEST <= angle <= 180.0


def _check_flank(platform: PlatformParameters) -> None:
    angle, length = platform.flank_angle, platform.length_of_flank
    allowed = f"must lie between 0 and {STEEPEST_FLANK:g} degrees"
    _require(0.0 <= angle <= STEEPEST_FLANK, "platform", "flank_angle", angle, allowed)
    most = rounded(MOST_CUT * platform.thickness / max(tan(radians(angle)), 1e-9), 3, floor)
    allowed = f"must be at most {most:g} m at this angle: a tenth of the thickness is left at the end of the platform"
    _require(length <= most, "platform", "flank_length", length, allowed)


def _require(condition: bool, table: str, parameter: str, value: object, allowed: str) -> None:
    if not condition:
        raise GeometryError(table, parameter, value, allowed)
