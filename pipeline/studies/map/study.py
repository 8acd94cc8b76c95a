"""The study `map`: curves over a grid of two keys, and over cells of it.

Cells are halved where the map changes, as a quadtree.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nonlinear.options import NO_PEAK, TRUNCATION_TOLERATED
from pipeline.results.best_design import OPEN_OVER, compares_designs, condition_keys, values_label
from pipeline.results.worst import motion_said, share, truncation_mark
from pipeline.scene.labels import value_label
from pipeline.studies.map.grid import MapAxis, MapGrid, MapPoint, Place, even_in_logarithm, map_point, spaced
from pipeline.studies.map.result import WorstMotionMap, continue_each_other, lowest_point, worst_motion_map

if TYPE_CHECKING:
    from pipeline.studies.map.section import Map
    from pipeline.studies.study import StudyContext


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


PLACE = "map.over"


class MapStudy:
    """Worst motion over two keys of the scene."""

    name = "map"
    result = WorstMotionMap

    def key(self, context: StudyContext) -> Mapping[str, Any]:
        """Nothing but the section and the curve with the base values."""
        return {}

    def compute(self, context: StudyContext) -> WorstMotionMap:
        """Curves of the grid, then of its refined cells."""
        from pipeline.studies.study import StudyError

        section = context.scene.map
        assert section is not None
        grid, cells = grid_of(section), None
        places = grid.places()
        points = _points(context, grid, places)
        for number in range(section.refine):
            cells = refined(base_cells(grid) if cells is None else cells, points, section.tolerance)
            further = missing_places(cells, points)
            if not further:
                break
            context.progress(f"map, refinement {number + 1}: {len(further)} further curves")
            places = [*places, *further]
            points = _points(context, grid, places)
        if not any(point.is_known for point in points):
            raise StudyError(f"none of the {len(points)} curves has a solution: {points[0].may_be_higher}")
        return worst_motion_map(grid, points)

    def lines(self, result: WorstMotionMap) -> Sequence[str]:
        """Where the lowest worst motion lies, and how wide its neighbourhood is."""
        return conclusion(result)


def grid_of(section: Map) -> MapGrid:
    """The grid of a section [map]."""
    counts = section.values if isinstance(section.values, tuple) else (section.values,) * 2
    axes = []
    for (key, given), count in zip(section.over.items(), counts, strict=True):
        logarithmic = key in section.logarithmic
        values = given
        if len(given) == 2:
            values = spaced(given[0], given[1], count, logarithmic)
        axes.append(MapAxis(key, values, logarithmic or (len(given) > 2 and even_in_logarithm(values))))
    return MapGrid((axes[0], axes[1]))


def conclusion(result: WorstMotionMap) -> list[str]:
    """What the map says, in sentences."""
    basin, lowest = result.basin, result.lowest
    ends, lacking = (
        [point for point in result.points if point.at_end],
        [point for point in result.points if point.truncation_error > TRUNCATION_TOLERATED],
    )
    if basin is None or lowest is None or lowest.frequency_hz is None:
        return [*_ends_said(ends, result), "the worst motion is not known anywhere on the map"]
    at = ", ".join(value_label(key, value) for key, value in zip(result.keys, lowest.values, strict=True))
    said = [
        *best_said(result),
        f"lowest worst motion of {len(result.points)} curves: {motion_said(lowest.height, lowest.frequency_hz, 6)}"
        f"{truncation_mark(lowest.truncation_error)}, {lowest.state}, with {at}",
    ]
    ranges = " and ".join(
        f"{value_label(each.key, each.together[0])} to {value_label(each.key, each.together[1])}"
        + _edge(each.at_edge)
        for each in basin.ranges
    )
    said.append(f"at most 10 % higher: {100 * basin.share:.2g} % of the map, within {ranges}")
    if basin.borders_detached:
        said.append("beside it, or in it, the worst motion lies on a detached branch, above the main one")
    elif basin.borders_jump:
        said.append("beside it the worst motion jumps, or changes too fast for the grid")
    if lowest.may_be_higher:
        said.append(f"it is not settled: {lowest.may_be_higher}")
    said += _ends_said(ends, result)
    if lacking:
        most = max(point.truncation_error for point in lacking)
        said.append(
            f"too few harmonics on {len(lacking)} of {len(result.points)} curves: truncation error up to "
            f"{share(most)}; raise response.harmonics"
        )
    return said


def best_said(result: WorstMotionMap) -> list[str]:
    """The best design of a map over a condition, or that none is known; nothing where designs alone are mapped."""
    if not (compares_designs(result.keys) and condition_keys(result.keys)):
        return [] if compares_designs(result.keys) else ["both keys are conditions: no design is compared"]
    if result.best is None:
        return [f"best design: {OPEN_OVER}"]
    point = result.points[result.best]
    values = dict(zip(result.keys, point.values, strict=True))
    assert point.frequency_hz is not None
    return [
        f"best design: {values_label(values, design=True)}, at most "
        f"{motion_said(point.height, point.frequency_hz, 6)}{truncation_mark(point.truncation_error)} "
        f"({values_label(values, design=False)})"
    ]


def _ends_said(ends: Sequence[MapPoint], result: WorstMotionMap) -> list[str]:
    """That some points are no candidates for the lowest worst motion, as their range ends too early."""
    if not ends:
        return []
    return [
        f"at {len(ends)} of {len(result.points)} points {NO_PEAK}: they are no candidates; widen response.frequency"
    ]


def _edge(at_edge: tuple[bool, bool]) -> str:
    return " (edge of the map)" if any(at_edge) else ""


def _points(context: StudyContext, grid: MapGrid, places: Sequence[Place]) -> list[MapPoint]:
    """The points at these places. Curves of earlier rounds come from the store, with branches of new neighbours."""
    keys = [axis.key for axis in grid.axes]
    values = [grid.values_at(place) for place in places]
    members = [context.member(dict(zip(keys, pair, strict=True)), PLACE) for pair in values]
    curves = context.curves(members)
    return [map_point(*each) for each in zip(curves, places, values, strict=True)]
