"""The result of the study `map`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.studies.worst_motion_map.basin import Basin, cell_areas, find_basin
from pipeline.studies.worst_motion_map.lattice import Indices, triangulated
from pipeline.studies.worst_motion_map.map_grid import MapGrid
from pipeline.studies.worst_motion_map.map_point import MapPoint


@dataclass(frozen=True)
class WorstMotionMap:
    """Worst motion over two keys."""

    grid: MapGrid  # values of both keys
    points: tuple[MapPoint, ...]  # A point for each curve: those of the grid, then those of the refined cells
    basin: Basin | None  # the lowest worst motion with its neighbourhood; None where no worst motion is known
    shares: Mapping[str, float]  # part of the map's area by contact state at the worst motion

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
    )
