"""A quantity over two keys as filled contours, never interpolated between points that do not continue each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.map_scales import MapScale, plain_numbers
from pipeline.figures.style import LOG_FROM
from pipeline.studies.worst_motion_map.continuity import continuing
from pipeline.studies.worst_motion_map.lattice import (
    differing,
    edge_numbers,
    edges_of,
    nearest_parts,
    separating_lines,
)
from pipeline.studies.worst_motion_map.map_result import WorstMotionMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
COLOURS = 14  # about
STEPS = (1.0, 1.1, 1.2, 1.3, 1.5, 1.7, 2.0, 2.3, 2.6, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 9.0)


@dataclass(frozen=True)
class MapShape:
    """A map in the coordinates of its axes."""

    result: WorstMotionMap

    @cached_property
    def scales(self) -> tuple[MapScale, MapScale]:
        """Its two axes."""
        first, second = self.result.grid.axes
        return MapScale(first), MapScale(second)

    @cached_property
    def triangles(self) -> NDArray[np.int64]:
        """Triangulation of its points, (t, 3)."""
        return self.result.triangles

    @cached_property
    def points(self) -> Array:
        """Coordinates of its points, (n, 2)."""
        return self.on_axes(self.result.places)

    @cached_property
    def parts(self) -> Array:
        """Of each triangle the part nearest to each corner, (t, 3, 4, 2)."""
        return self.on_axes(nearest_parts(self.result.places, self.triangles))

    @cached_property
    def jumps(self) -> NDArray[np.bool_]:
        """Edges of triangles, (t, 3), across which the worst motion jumps."""
        edges = edges_of(self.triangles)
        return np.asarray(~continuing(self.result.points, edges)[edge_numbers(self.triangles, edges)])

    def on_axes(self, places: Array) -> Array:
        """Columns and rows (..., 2) as coordinates."""
        return np.stack([scale.coordinates(places[..., k]) for k, scale in enumerate(self.scales)], axis=-1)

    def lines(self, parted: NDArray[np.bool_]) -> Array:
        """Lines half-way between the points of parted edges, (m, 2, 2)."""
        return self.on_axes(separating_lines(self.result.places, self.triangles, parted))

    def between(self, classes: list[Any]) -> Array:
        """Lines half-way between neighbouring points of different classes, (m, 2, 2)."""
        return self.lines(differing(self.triangles, classes))

    def cells(self, chosen: NDArray[np.bool_]) -> Array:
        """Parts of triangles, (m, 4, 2), that are nearest to the chosen points, (n,) bool."""
        return np.asarray(self.parts[chosen[self.triangles]])


@dataclass(frozen=True)
class MapLevels:
    """Limits of the colours of a quantity: `limits` in the scale of the colours, `ticks` as numbers."""

    limits: Array
    ticks: Array
    logarithmic: bool

    def scaled(self, values: Array) -> Array:
        """Values in the scale of the colours; nan where there is none."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.log10(values) if self.logarithmic else values


def levels_of(values: Array) -> MapLevels:
    """Limits of about 14 colours, plain numbers; logarithmic where the values span much."""
    from matplotlib.ticker import MaxNLocator

    known = values[np.isfinite(values)]
    low, high = float(known.min()), float(known.max())
    if low > 0.0 and high > LOG_FROM * low:
        decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
        ladder = np.array([float(f"{step}e{decade}") for decade in decades for step in STEPS])
        inside = ladder[(ladder > low) & (ladder < high)]
        inside = inside[:: max(1, round(len(inside) / COLOURS))]
        limits = np.unique(np.concatenate([[low], inside, [high]]))
        return MapLevels(np.log10(limits), np.array(plain_numbers(low, high)), True)
    if high - low < 1e-6 * abs(high):
        low, high = low - 1e-3 * abs(low), high + 1e-3 * abs(high)
    limits = np.asarray(MaxNLocator(COLOURS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    return MapLevels(limits, limits[:: max(1, len(limits) // 8)], False)


def draw_contours(axes: Axes, shape: MapShape, values: Array, levels: MapLevels, colours: str) -> Any:
    """Filled contours where neighbouring points continue each other, elsewhere the colour of the nearest point.

    Shapes: `values` (n,).
    """
    import matplotlib as mpl
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import BoundaryNorm
    from matplotlib.tri import Triangulation

    scaled = levels.scaled(values)
    chosen = mpl.colormaps[colours]
    norm = BoundaryNorm(levels.limits.tolist(), chosen.N)
    apart = shape.jumps.any(axis=1) | ~np.isfinite(scaled)[shape.triangles].all(axis=1)
    if not apart.all():
        mesh = Triangulation(shape.points[:, 0], shape.points[:, 1], shape.triangles, mask=apart)
        low, high = levels.limits[[0, -1]]
        filled = np.clip(
            np.nan_to_num(scaled, nan=low), low, high - 1e-9 * (high - low)
        )  # else a plateau stays empty
        axes.tricontourf(mesh, filled, levels=levels.limits, cmap=chosen, norm=norm)
    corner = shape.triangles[apart].ravel()
    known = np.isfinite(scaled[corner])
    polygons = shape.parts[apart].reshape(-1, 4, 2)[known]
    look = {"facecolors": chosen(norm(scaled[corner][known])), "linewidths": 0.0, "antialiaseds": False}
    axes.add_collection(PolyCollection(list(polygons), **look))
    return ScalarMappable(norm, chosen)
