"""The study `map`: curves over a grid of two keys, and over cells of it that are halved where they change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nonlinear import NO_PEAK, TRUNCATION_TOLERATED
from pipeline.results.worst import share, truncation_mark
from pipeline.scene.labels import prefixed, value_label
from pipeline.studies.worst_motion_map.map_grid import MapAxis, MapGrid, Place, even_in_logarithm, spaced
from pipeline.studies.worst_motion_map.map_point import MapPoint, map_point
from pipeline.studies.worst_motion_map.map_result import WorstMotionMap, worst_motion_map
from pipeline.studies.worst_motion_map.refinement import base_cells, missing_places, refined

if TYPE_CHECKING:
    from pipeline.scene.map_section import Map
    from pipeline.studies.study import StudyContext

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
    if basin is None or lowest is None:
        return [*_ends_said(ends, result), "the worst motion is not known anywhere on the map"]
    factor, unit = prefixed(lowest.height, "m")
    at = ", ".join(value_label(key, value) for key, value in zip(result.keys, lowest.values, strict=True))
    said = [
        f"lowest worst motion of {len(result.points)} curves: {lowest.height * factor:.4g} {unit} at "
        f"{lowest.frequency_hz:.6g} Hz{truncation_mark(lowest.truncation_error)}, {lowest.state}, with {at}"
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
        said.append(f"it may be higher: {lowest.may_be_higher}")
    said += _ends_said(ends, result)
    if lacking:
        most = max(point.truncation_error for point in lacking)
        said.append(
            f"H too small on {len(lacking)} of {len(result.points)} curves: truncation error up to {share(most)}; "
            "raise response.harmonics"
        )
    return said


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
