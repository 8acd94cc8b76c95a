"""The lowest worst motion of a map, and the region around it that is nearly as low."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pipeline.studies.worst_motion_map.continuity import continue_each_other
from pipeline.studies.worst_motion_map.lattice import Array, Indices, edges_of, nearest_parts
from pipeline.studies.worst_motion_map.map_point import MapPoint, known_heights

LEVEL = 1.1  # of the basin, relative to the lowest worst motion


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
        inside = (heights <= LEVEL * heights[lowest]) & ~np.array([point.at_end for point in points])
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
    limit = math.log(LEVEL * centre.height)
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
