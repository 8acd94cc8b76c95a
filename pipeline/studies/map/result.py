"""The result of the study `map`: its points as a triangulation, where they continue each other, and its lowest point.

All is done in columns and rows of the grid, where neighbouring values are one apart: the axes of a map may be
logarithmic, and its values unevenly spaced. Where the worst motion jumps, nothing is interpolated. The basin is the
region around the lowest worst motion that is nearly as low.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from nonlinear.options import NEARLY_LOWEST
from pipeline.scene.schema import has_role
from pipeline.studies.map.grid import MapGrid, MapPoint, known_heights

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def triangulated(places: Array) -> Indices:
    """Delaunay triangles of the points of a map.

    Shapes: `places` (n, 2), returns (t, 3).
    """
    from scipy.spatial import Delaunay

    corners = np.asarray(Delaunay(places).simplices, dtype=np.int64)
    a, b, c = (places[corners[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    corners[area < 0.0] = corners[area < 0.0][:, [0, 2, 1]]
    return corners[np.abs(area) > 1e-12]


def edges_of(triangles: Indices) -> Indices:
    """Pairs of neighbouring points, (e, 2), each once, the smaller number first."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def edge_numbers(triangles: Indices, edges: Indices) -> Indices:
    """Numbers of the edges of each triangle, (t, 3): those from corner 0 to 1, 1 to 2 and 2 to 0."""
    count = int(triangles.max(initial=0)) + 1
    known = edges[:, 0] * count + edges[:, 1]
    pairs = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    return np.searchsorted(known, pairs[:, :, 0] * count + pairs[:, :, 1])


def circumcentres(places: Array, triangles: Indices) -> Array:
    """Circumcentre of each triangle, (t, 2); it lies in the triangle unless that is obtuse."""
    a, b, c = (places[triangles[:, k]] for k in range(3))
    ab, ac = b - a, c - a
    twice = 2.0 * (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    b2, c2 = (ab**2).sum(axis=1), (ac**2).sum(axis=1)
    offset = np.stack([ac[:, 1] * b2 - ab[:, 1] * c2, ab[:, 0] * c2 - ac[:, 0] * b2], axis=1)
    return np.asarray(a + offset / twice[:, None])


def nearest_parts(places: Array, triangles: Indices) -> Array:
    """The part of each triangle that is nearest to each of its corners.

    Parts of a point from all its triangles are its cell: on a full grid a rectangle that ends half-way to its
    neighbours.
    Shapes: returns (t, 3, 4, 2).
    """
    corners = places[triangles]
    after = 0.5 * (corners + np.roll(corners, -1, axis=1))
    before = np.roll(after, 1, axis=1)
    centre = np.broadcast_to(circumcentres(places, triangles)[:, None], corners.shape)
    return np.stack([corners, after, centre, before], axis=2)


def separating_lines(places: Array, triangles: Indices, parted: NDArray[np.bool_]) -> Array:
    """Lines half-way between neighbours, across the edges of triangles that are `parted` (t, 3).

    Shapes: returns (m, 2, 2).
    """
    pieces = np.asarray(nearest_parts(places, triangles)[:, :, 1:3][parted])
    return pieces[np.abs(pieces[:, 0] - pieces[:, 1]).max(axis=1) > 1e-12]


def differing(triangles: Indices, classes: Sequence[object]) -> NDArray[np.bool_]:
    """Edges of triangles, (t, 3), whose ends are of different classes."""
    number = {each: k for k, each in enumerate(dict.fromkeys(classes))}
    of_point = np.array([number[each] for each in classes])
    return np.asarray(of_point[triangles] != of_point[np.roll(triangles, -1, axis=1)])


LARGEST_STEP = 0.10  # relative change of the frequency between neighbours that is still interpolated
LARGEST_RATIO = 4.0  # the same of the amplitude, as a ratio
FREQUENCY_WEIGHT = 10.0  # from one value to the next a resonance changes much less in frequency than in height
SAME_PEAK = 0.1  # distance below which two peaks of a curve are not told apart


def continuing(points: list[MapPoint] | tuple[MapPoint, ...], edges: Indices) -> np.ndarray:
    """Whether the two points of each edge continue each other, (e,) bool."""
    return np.array([continue_each_other(points[a], points[b]) for a, b in edges.tolist()], dtype=bool)


def continue_each_other(here: MapPoint, there: MapPoint) -> bool:
    """Whether the worst motion changes continuously from one point to its neighbour, as far as the two curves tell.

    It does not where one is not known or of another kind (quasi-periodic), where the peak of the neighbour that
    is nearest to the worst motion here is not the neighbour's worst motion (the highest of two peaks has changed,
    or a detached branch ends in between), or where frequency or amplitude change so much that the grid does not
    resolve the change. Distances are |ln a'/a| + 10 |ln f'/f|.
    """
    if not (here.is_known and there.is_known) or here.motion != there.motion:
        return False
    step, ratio = _logarithms(_worst(here), _worst(there))
    if step > math.log1p(LARGEST_STEP) or ratio > math.log(LARGEST_RATIO):
        return False
    return _leads_to_worst(here, there) and _leads_to_worst(there, here)


def _leads_to_worst(start: MapPoint, end: MapPoint) -> bool:
    """Whether of all motions of `end` its worst one is nearest to the worst one of `start`."""
    worst = _worst(start)
    own = _distance(worst, _worst(end))
    others = (peak for peak in end.peaks if _distance(peak, _worst(end)) > SAME_PEAK)
    return all(own <= _distance(worst, peak) for peak in others if peak[1] > 0.0)


def _worst(point: MapPoint) -> tuple[float, float]:
    assert point.frequency_hz is not None
    assert point.amplitude_m is not None
    return point.frequency_hz, point.amplitude_m


def _distance(one: tuple[float, float], other: tuple[float, float]) -> float:
    frequency, amplitude = _logarithms(one, other)
    return FREQUENCY_WEIGHT * frequency + amplitude


def _logarithms(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """|ln| of the ratios of frequencies and of amplitudes."""
    return abs(math.log(other[0] / one[0])), abs(math.log(other[1] / one[1]))


@dataclass(frozen=True)
class BasinRange:
    """Values of one key around the lowest point."""

    key: str  # the dotted key
    value: float  # its value at the lowest point, in SI units
    # the neighbouring values on the map: between them the map does not tell where the lowest value is
    bracket: tuple[float, float]
    # values within the level where this key alone changes, interpolated between points that continue each other
    alone: tuple[float, float]
    together: tuple[float, float]  # lowest and highest value of all points of the basin
    at_edge: tuple[bool, bool]  # whether the basin reaches the lowest and the highest value of the map


@dataclass(frozen=True)
class Basin:
    """The lowest worst motion and the connected points whose worst motion is at most 10 % higher."""

    lowest: int  # number of the point with the lowest worst motion, not refined any further
    points: tuple[int, ...]  # all points of the basin
    ranges: tuple[BasinRange, BasinRange]  # (BasinRange, BasinRange), extent along both keys
    share: float  # part of the map's area that is nearest to a point of the basin
    borders_detached: bool  # whether a neighbour of the basin has its worst motion on a detached branch
    borders_jump: bool  # whether the worst motion jumps between the basin and a neighbour


def find_basin(points: Sequence[MapPoint], keys: tuple[str, str], triangles: Indices) -> Basin | None:
    """The basin of a map; None where no worst motion is known.

    The lowest point is sought among those that cannot be higher than stated, where there are any.
    Shapes: `triangles` (t, 3).
    """
    lowest = lowest_point(points)
    if lowest is None:
        return None
    heights, edges = known_heights(points), edges_of(triangles)
    with np.errstate(invalid="ignore"):
        inside = (heights <= NEARLY_LOWEST * heights[lowest]) & ~np.array([point.at_end for point in points])
    basin = _connected(lowest, inside, edges)
    border = edges[np.isin(edges, basin).sum(axis=1) == 1]
    outside = [points[k] for k in np.setdiff1d(border, basin)]
    places = np.array([point.place for point in points])
    areas = cell_areas(places, triangles)
    ranges = tuple(_range(points, keys[axis], axis, lowest, basin) for axis in (0, 1))
    return Basin(
        lowest,
        tuple(basin.tolist()),
        (ranges[0], ranges[1]),
        share=float(areas[basin].sum() / areas.sum()),
        borders_detached=any(point.is_detached for point in [*outside, *(points[k] for k in basin)]),
        borders_jump=any(not continue_each_other(points[a], points[b]) for a, b in border.tolist()),
    )


def lowest_point(points: Sequence[MapPoint]) -> int | None:
    """Number of the point with the lowest worst motion; the end of the frequency range is none."""
    known = [number for number, point in enumerate(points) if point.is_known and not point.at_end]
    certain = [number for number in known if not points[number].may_be_higher]
    return min(certain or known, key=lambda number: points[number].height, default=None)


def cell_areas(places: Array, triangles: Indices) -> Array:
    """Area of the cell of each point, (n,), in columns and rows of the grid."""
    corners = nearest_parts(places, triangles)
    following = np.roll(corners, -1, axis=2)
    twice = (corners[..., 0] * following[..., 1] - corners[..., 1] * following[..., 0]).sum(axis=2)
    return np.asarray(np.bincount(triangles.ravel(), 0.5 * twice.ravel(), minlength=len(places)), dtype=float)


def _connected(start: int, inside: np.ndarray, edges: Indices) -> Indices:
    """Numbers of the points that paths of edges inside lead to."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    kept = edges[inside[edges].all(axis=1)]
    graph = coo_array((np.ones(len(kept)), (kept[:, 0], kept[:, 1])), shape=(len(inside),) * 2)
    _, label = connected_components(graph, directed=False)
    return np.flatnonzero(label == label[start])


def _range(points: Sequence[MapPoint], key: str, axis: int, lowest: int, basin: Indices) -> BasinRange:
    centre = points[lowest]
    line = sorted(
        (point for point in points if point.place[1 - axis] == centre.place[1 - axis]),
        key=lambda point: point.place[axis],
    )
    at = line.index(centre)
    limit = math.log(NEARLY_LOWEST * centre.height)
    low, high = (_last_inside(side, axis, limit) for side in (line[at::-1], line[at:]))
    found = [points[k].values[axis] for k in basin]
    limits = [point.values[axis] for point in points]
    neighbours = line[max(at - 1, 0)], line[min(at + 1, len(line) - 1)]
    return BasinRange(
        key,
        centre.values[axis],
        (neighbours[0].values[axis], neighbours[1].values[axis]),
        (low, high),
        (min(found), max(found)),
        (min(found) == min(limits), max(found) == max(limits)),
    )


def _last_inside(line: Sequence[MapPoint], axis: int, limit: float) -> float:
    """Last value within the limit along a line from the lowest point, which is the first."""
    for here, there in pairwise(line):
        if there.is_known and math.log(there.height) <= limit:
            continue
        if not continue_each_other(here, there):
            return here.values[axis]
        part = (limit - math.log(here.height)) / (math.log(there.height) - math.log(here.height))
        return here.values[axis] + part * (there.values[axis] - here.values[axis])
    return line[-1].values[axis]


@dataclass(frozen=True)
class WorstMotionMap:
    """Worst motion over two keys."""

    grid: MapGrid  # values of both keys
    points: tuple[MapPoint, ...]  # A point for each curve: those of the grid, then those of the refined cells
    basin: Basin | None  # the lowest worst motion with its neighbourhood; None where no worst motion is known
    shares: Mapping[str, float]  # part of the map's area by contact state at the worst motion
    # where a design is mapped over a condition: the point of the best design that is highest over the conditions; its
    # highest motion is lowest of the designs with a curve at every value of the condition in the grid. None: none is
    # known, or no design or no condition is mapped
    best: int | None = None

    @property
    def keys(self) -> tuple[str, str]:
        """The two dotted keys."""
        return self.grid.axes[0].key, self.grid.axes[1].key

    @property
    def lowest(self) -> MapPoint | None:
        """The point with the lowest worst motion."""
        return None if self.basin is None else self.points[self.basin.lowest]

    @property
    def places(self) -> np.ndarray:
        """Columns and rows of the points, (n, 2)."""
        return np.array([point.place for point in self.points])

    @property
    def triangles(self) -> Indices:
        """Triangulation of the places, (t, 3)."""
        return triangulated(self.places)


def worst_motion_map(grid: MapGrid, points: Sequence[MapPoint]) -> WorstMotionMap:
    """The map of these points with its lowest point, basin and shares."""
    places = np.array([point.place for point in points])
    triangles = triangulated(places)
    areas = cell_areas(places, triangles)
    shares: Counter[str] = Counter()
    for point, area in zip(points, areas.tolist(), strict=True):
        shares[point.state] += area / areas.sum()
    keys = grid.axes[0].key, grid.axes[1].key
    return WorstMotionMap(
        grid,
        tuple(points),
        find_basin(points, keys, triangles),
        {state: float(share) for state, share in shares.items()},
        best_over_condition(grid, points),
    )


def best_over_condition(grid: MapGrid, points: Sequence[MapPoint]) -> int | None:
    """`WorstMotionMap.best`; of refined points those of a design that is on the grid count."""
    of_design = [has_role(axis.key, "design") for axis in grid.axes]
    if sum(of_design) != 1:
        return None
    design, condition = of_design.index(True), of_design.index(False)
    lines: dict[float, list[int]] = {}
    for number, point in enumerate(points):
        lines.setdefault(point.values[design], []).append(number)
    asked = set(grid.axes[condition].values)
    best: list[int] = []
    for line in lines.values():
        settled = all(points[k].is_known and not (points[k].at_end or points[k].may_be_higher) for k in line)
        if settled and asked <= {points[k].values[condition] for k in line}:
            best.append(max(line, key=lambda k: points[k].height))
    return min(best, key=lambda k: points[k].height, default=None)
