"""Places at which further curves are needed: cells of the map are halved where it changes, as a quadtree."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pipeline.studies.worst_motion_map.basin import lowest_point
from pipeline.studies.worst_motion_map.continuity import continue_each_other
from pipeline.studies.worst_motion_map.map_grid import MapGrid, Place
from pipeline.studies.worst_motion_map.map_point import MapPoint

Cell = tuple[float, float, float]  # column and row of its lowest corner, and its side


def base_cells(grid: MapGrid) -> set[Cell]:
    """The cells of the grid itself."""
    columns, rows = (len(axis.values) - 1 for axis in grid.axes)
    return {(float(column), float(row), 1.0) for column in range(columns) for row in range(rows)}


def refined(cells: set[Cell], points: Sequence[MapPoint], tolerance: float) -> set[Cell]:
    """The cells after one round: the smallest ones are divided into four where they are not resolved.

    A cell is not resolved where contact state or kind of motion differ between its corners, where the worst motion
    jumps along a side, where the estimated error of linear interpolation exceeds the tolerance, or where a corner
    is the lowest point. Sides of neighbouring cells stay within a factor of 2.
    """
    at = {point.place: point for point in points}
    curvature = curvatures(points)
    lowest = lowest_point(points)
    centre = None if lowest is None else points[lowest].place
    smallest = min(cell[2] for cell in cells)
    limit = 8.0 * math.log1p(tolerance) / smallest**2  # error of interpolation over a step s: s^2/8 of the curvature
    marked = set()
    for cell in cells:
        places = corners(cell)
        if cell[2] == smallest and (
            centre in places
            or _parted([at[place] for place in places])
            or any(curvature.get(place, 0.0) > limit for place in places)
        ):
            marked.add(cell)
    found = _divided(cells, marked)
    while uneven := _much_larger_than_neighbours(found):
        found = _divided(found, uneven)
    return found


def curvatures(points: Sequence[MapPoint]) -> dict[Place, float]:
    """Second derivative of ln a along columns and rows, the larger one, at the points with neighbours on both sides.

    The unit of length is the step of the grid.
    """
    found: dict[Place, float] = {}
    for axis in (0, 1):
        lines: dict[float, list[MapPoint]] = {}
        for point in points:
            if point.is_known:
                lines.setdefault(point.place[1 - axis], []).append(point)
        for line in lines.values():
            line.sort(key=lambda point: point.place[axis])
            for before, point, after in zip(line, line[1:], line[2:], strict=False):
                down, up = point.place[axis] - before.place[axis], after.place[axis] - point.place[axis]
                slopes = math.log(after.height / point.height) / up - math.log(point.height / before.height) / down
                found[point.place] = max(found.get(point.place, 0.0), abs(2.0 * slopes / (down + up)))
    return found


def missing_places(cells: set[Cell], points: Sequence[MapPoint]) -> list[Place]:
    """Corners of cells without a point, in ascending order."""
    known = {point.place for point in points}
    return sorted({place for cell in cells for place in corners(cell)} - known)


def corners(cell: Cell) -> tuple[Place, Place, Place, Place]:
    """Places of the corners, counterclockwise."""
    column, row, side = cell
    return (column, row), (column + side, row), (column + side, row + side), (column, row + side)


def _parted(found: Sequence[MapPoint]) -> bool:
    """Whether the corners of a cell, in their order, are of several kinds, or a side does not continue."""
    if not any(point.is_known for point in found):
        return False
    if len({(point.state, point.motion, point.is_known) for point in found}) > 1:
        return True
    return not all(continue_each_other(found[k], found[k - 1]) for k in range(4))


def _divided(cells: set[Cell], marked: set[Cell]) -> set[Cell]:
    """The cells, the marked ones divided into four."""
    quarters = {
        (column + across * side / 2, row + up * side / 2, side / 2)
        for column, row, side in marked
        for across in (0, 1)
        for up in (0, 1)
    }
    return (cells - marked) | quarters


def _much_larger_than_neighbours(cells: set[Cell]) -> set[Cell]:
    """Cells with a corner of another cell within a side, at neither its ends nor its middle."""
    places = {place for cell in cells for place in corners(cell)}
    found = set()
    for cell in cells:
        column, row, side = cell
        for part in (0.25 * side, 0.75 * side):
            along = {
                (column + part, row),
                (column + part, row + side),
                (column, row + part),
                (column + side, row + part),
            }
            if along & places:
                found.add(cell)
    return found
