"""A section of an airfoil given by points of its outline: cut into two sides and two edges, resampled.

An edge is the shortest part of the outline that turns by `EDGE_TURN` near one of the two points that are farthest
apart: the round nose, or the straight end between two corners. A sharp edge has no room for hexahedra; it is cut
where the section is `LEAST_EDGE` of its largest thickness thick.
"""

from dataclasses import dataclass

import numpy as np

from geometry.sector import FloatArray

LEAST_POINTS = 4
SIDE_POINTS, EDGE_POINTS = 129, 17  # odd: the middle is one of them
EDGE_TURN = np.radians(120.0)
EDGE_REACH = 0.6  # distance of an edge from the farthest points, over that between them
LEAST_EDGE = 0.05
SAME_POINT = 1e-9  # distance over the extent of the outline
LEAST_AREA = 1e-4  # over the square of the extent


class LoopError(ValueError):
    """An outline that is no section of an airfoil; the message says why and what is allowed."""


@dataclass(frozen=True)
class SectionCurves:
    """The four parts of an outline, each an array of points (..., k)."""

    # upper and lower side from the edge at -x to that at +x
    upper: FloatArray
    lower: FloatArray
    # edges from the lower to the upper side
    leading: FloatArray
    trailing: FloatArray

    @property
    def outline(self) -> FloatArray:
        """All points, counterclockwise; those where two parts meet come once."""
        return np.vstack([self.lower, self.trailing[1:-1], self.upper[::-1], self.leading[-2:0:-1]])


def section_curves(points: FloatArray) -> SectionCurves:
    """The parts of a closed outline `points` (n, 2 or more), of which the first two columns are x and arc length.

    Raises LoopError.
    """
    loop = _counterclockwise(_distinct(points))
    _check_simple(loop)
    low, high = _ends(loop)
    (first, last), (below, above) = _edge(loop, low), _edge(loop, high)
    if len({first, below}) < 2 or _cyclic(loop, first, last, below, above):
        raise LoopError("leading and trailing edge cannot be told apart: points along both sides are needed")
    upper, lower = _between(loop, above, first)[::-1], _between(loop, last, below)
    leading, trailing = _between(loop, first, last)[::-1], _between(loop, below, above)
    sides = [_resampled(side, SIDE_POINTS) for side in (upper, lower)]
    least = LEAST_EDGE * float(np.linalg.norm((sides[0] - sides[1])[:, :2], axis=1).max())
    edges = []
    for number, edge in ((0, leading), (-1, trailing)):
        if np.linalg.norm((sides[0] - sides[1])[number, :2]) < least:
            sides = _cut(sides, least, number == 0)
            edge = np.stack([sides[1][number], sides[0][number]])
        edges.append(edge)
    return SectionCurves(*sides, *(_resampled(edge, EDGE_POINTS, smooth=False) for edge in edges))


def _distinct(points: FloatArray) -> FloatArray:
    """The points without those that repeat the one before, or at the end the first."""
    extent = float(np.ptp(points[:, :2], axis=0).max())
    step = np.linalg.norm((points - np.roll(points, 1, axis=0))[:, :2], axis=1)
    kept = points[step > SAME_POINT * extent] if extent else points[:1]
    if len(kept) < LEAST_POINTS:
        raise LoopError(f"{len(kept)} different points, at least {LEAST_POINTS} are needed, some 50 are usual")
    return kept


def _counterclockwise(loop: FloatArray) -> FloatArray:
    """The outline counterclockwise seen from outside."""
    twice = area_moments(loop)[0] * 2.0
    if abs(twice) < LEAST_AREA * float(np.ptp(loop[:, :2], axis=0).max()) ** 2:
        raise LoopError("the points enclose no area: a closed outline is needed, once round")
    return loop if twice > 0 else loop[::-1]


def area_moments(loop: FloatArray) -> tuple[float, FloatArray]:
    """Area of a polygon, counterclockwise, and its centroid (2,)."""
    a, b = loop[:, :2], np.roll(loop[:, :2], -1, axis=0)
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = float(cross.sum()) / 2
    return area, np.asarray(((a + b) * cross[:, None]).sum(axis=0) / (6 * area)) if area else a.mean(axis=0)


def _check_simple(loop: FloatArray) -> None:
    """Refuse an outline that crosses itself."""
    a, b = loop[:, :2], np.roll(loop[:, :2], -1, axis=0)

    def side(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
        u, v = q - p, r - p
        return np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    c, d = a[:, None], b[:, None]
    parted = side(c, d, a[None]) * side(c, d, b[None]) < 0  # the ends of one piece by the line through the other
    crossing = parted & parted.T
    if round(float(_turns(loop).sum()) / (2 * np.pi)) > 1:
        raise LoopError("the points go round more than once")
    if crossing.any():
        i, j = np.argwhere(crossing)[0]
        x, y = (loop[k, :2] for k in (i, j))
        raise LoopError(
            f"the outline crosses itself near ({x[0]:.6g}, {x[1]:.6g}) and ({y[0]:.6g}, {y[1]:.6g}): "
            "suction and pressure side cross, or points are out of order (once round, "
            'or a column "side")'
        )


def _ends(loop: FloatArray) -> tuple[int, int]:
    """The two points farthest apart, that with the smaller x first."""
    xy = loop[:, :2]
    distance = np.linalg.norm(xy[:, None] - xy[None], axis=-1)
    i, j = (int(k) for k in np.unravel_index(int(np.argmax(distance)), distance.shape))
    return (i, j) if xy[i, 0] <= xy[j, 0] else (j, i)


def _edge(loop: FloatArray, end: int) -> tuple[int, int]:
    """First and last point, counterclockwise, of the shortest part near `end` that turns enough."""
    xy, n, turn = loop[:, :2], len(loop), _turns(loop)
    length = np.linalg.norm(np.roll(xy, -1, axis=0) - xy, axis=1)
    reach = EDGE_REACH * float(np.linalg.norm(xy - xy[end], axis=1).max())
    near = np.linalg.norm(xy - xy[end], axis=1) < reach
    best, found = np.inf, None
    for first in np.flatnonzero(near):
        total, path = 0.0, 0.0
        for offset in range(n):
            last = (first + offset) % n
            if not near[last] or path >= best:
                break
            total += turn[last]
            if total >= EDGE_TURN:
                best, found = path, (int(first), int(last))
                break
            path += length[last]
    if found is None:
        raise LoopError("no leading and trailing edge: a section must be longer than some 1.5 times its thickness")
    return found


def _turns(loop: FloatArray) -> FloatArray:
    """Change of direction at each point, rad, -pi to pi."""
    step = np.roll(loop[:, :2], -1, axis=0) - loop[:, :2]
    angle = np.arctan2(step[:, 1], step[:, 0])
    return np.asarray((angle - np.roll(angle, 1) + np.pi) % (2 * np.pi) - np.pi)


def _cyclic(loop: FloatArray, *numbers: int) -> bool:
    """Whether points do not follow each other round the outline."""
    ahead = [(k - numbers[0]) % len(loop) for k in numbers]
    return ahead != sorted(ahead)


def _between(loop: FloatArray, first: int, last: int) -> FloatArray:
    """The points from one to another, counterclockwise, both included."""
    count = (last - first) % len(loop)
    return loop[(first + np.arange(count + 1)) % len(loop)]


def _resampled(line: FloatArray, count: int, smooth: bool = True) -> FloatArray:
    """A line at so many equal steps of its length, by a cubic spline through its points; else straight between."""
    from scipy.interpolate import CubicSpline

    if len(line) == 1:
        return np.repeat(line, count, axis=0)
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1))])
    places = np.linspace(0.0, at[-1], count)
    if smooth and len(line) > 3:
        return np.asarray(CubicSpline(at, line)(places))
    return np.stack([np.interp(places, at, column) for column in line.T], axis=1)


def _cut(sides: list[FloatArray], least: float, leading: bool) -> list[FloatArray]:
    """The two sides up to where they are `least` apart, at one end."""
    upper, lower = (side if leading else side[::-1] for side in sides)
    apart = np.linalg.norm((upper - lower)[:, :2], axis=1)
    first = int(np.argmax(apart >= least))
    share = (least - apart[first - 1]) / (apart[first] - apart[first - 1])
    kept = []
    for side in (upper, lower):
        start = side[first - 1] + share * (side[first] - side[first - 1])
        shorter = _resampled(np.vstack([start, side[first:]]), SIDE_POINTS)
        kept.append(shorter if leading else shorter[::-1])
    return kept
