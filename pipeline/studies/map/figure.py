"""The figure of a map: worst motion over two keys with contact states, jumps and the lowest point.

Contours are never interpolated between points that do not continue each other. Axes are linear, logarithmic, or have
their values side by side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.options import NEARLY_LOWEST
from pipeline.figures.data import SweepKey
from pipeline.figures.style import LOG_FROM, give_data, legend_columns, scale, subplots, write_heading
from pipeline.results.best_design import condition_keys
from pipeline.results.worst import FREE, SEPARATING, SLIPPING, STUCK, UNKNOWN
from pipeline.scene.labels import quantity, value_label
from pipeline.studies.map.grid import MapAxis, known_heights
from pipeline.studies.map.result import (
    WorstMotionMap,
    continuing,
    differing,
    edge_numbers,
    edges_of,
    nearest_parts,
    separating_lines,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


Array = NDArray[np.float64]
FINEST = 60.0  # ratio of the whole range to the smallest step above which values stand side by side
MOST_TICKS = 10


@dataclass(frozen=True)
class MapScale:
    """The axis of one key of a map."""

    axis: MapAxis

    @cached_property
    def is_side_by_side(self) -> bool:
        """Whether the values of the grid are drawn at equal distances, because some would lie on each other."""
        if self.axis.logarithmic:
            return False
        steps = np.diff(self.axis.values)
        return bool(steps.sum() > FINEST * steps.min())

    @cached_property
    def of_values(self) -> Array:
        """Coordinates of the values of the grid."""
        values = np.array(self.axis.values) * quantity(self.axis.key).factor
        if self.is_side_by_side:
            return np.arange(len(values), dtype=float)
        return np.log10(values) if self.axis.logarithmic else values

    def coordinates(self, places: Array) -> Array:
        """Coordinates of columns or rows, which may be fractions."""
        return np.interp(places, np.arange(len(self.of_values)), self.of_values)

    def label(self, axis: Axis) -> None:
        """Ticks, their labels and the label of an axis."""
        key = SweepKey(self.axis.key, self.axis.values)
        axis.set_label_text(key.axis)
        if self.is_side_by_side:
            shown = range(0, len(key.values), -(-len(key.values) // MOST_TICKS))
            axis.set_ticks(list(shown), [key.text(key.values[number]) for number in shown])
        elif self.axis.logarithmic:
            ticks = plain_numbers(*(10.0 ** self.of_values[[0, -1]]))
            axis.set_ticks(np.log10(ticks).tolist(), [f"{tick:g}" for tick in ticks])


def plain_numbers(low: float, high: float, fewest: int = 4) -> list[float]:
    """Numbers such as 1, 2, 5, 10 within a range of positive numbers, few but at least `fewest` where there are."""
    ladder = ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), tuple(np.arange(10, 100) / 10.0))
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    found: list[float] = []
    for digits in ladder:
        steps = (float(f"{digit}e{decade}") for decade in decades for digit in digits)
        found = [step for step in steps if low * (1.0 - 1e-9) <= step <= high * (1.0 + 1e-9)]
        if len(found) >= fewest:
            break
    return found


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


NAMES = {FREE: "free", SEPARATING: "separating", SLIPPING: "slipping", STUCK: "stuck", UNKNOWN: "no result"}
LOWEST = "#D55E00"
STATE_LINE: dict[str, Any] = {"color": "black", "linewidth": 1.3, "linestyle": "solid"}
STATE_LINE |= {"label": "contact state changes"}
JUMP_LINE: dict[str, Any] = {"color": "white", "linewidth": 1.6, "linestyle": (0, (3, 2))}
JUMP_LINE |= {"label": "worst motion jumps, or changes too fast for the grid"}
BASIN_LINE: dict[str, Any] = {"color": LOWEST, "linewidth": 1.4, "linestyle": (0, (4, 2))}
BASIN_LINE |= {"label": f"within {100 * (NEARLY_LOWEST - 1):.0f} % of the lowest"}
MOST_DOTS = 2500
SMALLEST_NAMED = 0.02  # part of the map that a region covers whose name is written into it


def map_figure(result: WorstMotionMap, title: str) -> Figure:
    """Filled contours of the worst amplitude beside those of its frequency."""
    shape = MapShape(result)
    heights = known_heights(result.points)
    factor, unit = scale(heights, "m")
    frequencies = np.array([np.nan if p.frequency_hz is None else p.frequency_hz for p in result.points])
    figure, panels = subplots(1, 2, size=(11.0, 5.2), sharey="row")
    for axes, values, name, colours in (
        (panels[0], heights * factor, f"worst motion, largest displacement [{unit}]", "viridis"),
        (panels[1], frequencies, "frequency of the worst motion [Hz]", "cividis"),
    ):
        _field(figure, axes, shape, values, name, colours)
        _marks(axes, shape)
        given: dict[str, Any] = {
            SweepKey(key, ()).axis: [p.values[k] * quantity(key).factor for p in result.points]
            for k, key in enumerate(result.keys)
        }
        given[name] = values
        give_data(axes, given)
        for axis, each in zip((axes.xaxis, axes.yaxis), shape.scales, strict=True):
            each.label(axis)
    panels[1].set_ylabel("")
    _name_regions(panels[0], shape)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=legend_columns(figure, labels, 3), fontsize=9)
    write_heading(figure, title)
    return figure


def _field(figure: Figure, axes: Axes, shape: MapShape, values: Array, name: str, colours: str) -> None:
    """One quantity with its colour bar."""
    axes.grid(visible=False)
    axes.set_facecolor("0.92")
    low, high = shape.points.min(axis=0), shape.points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    if not np.isfinite(values).any():
        return
    levels = levels_of(values)
    drawn = draw_contours(axes, shape, values, levels, colours)
    ticks = levels.scaled(levels.ticks)
    bar = figure.colorbar(drawn, ax=axes, label=name, spacing="proportional")
    bar.set_ticks(ticks.tolist(), labels=[f"{tick:.6g}" for tick in levels.ticks])
    bar.ax.minorticks_off()


def _marks(axes: Axes, shape: MapShape) -> None:
    """Points, lines between contact states and where the worst motion jumps, hatched cells, the lowest point."""
    points = shape.result.points
    if len(points) <= MOST_DOTS:
        axes.plot(
            *shape.points.T, ".", color="0.25", markersize=1.5, alpha=0.6, label="curve computed", clip_on=False
        )
    _lines(axes, shape.between([point.state for point in points]), STATE_LINE)
    _lines(axes, shape.lines(shape.jumps & _both_known(shape)), JUMP_LINE)
    if shape.result.basin is not None:
        inside = set(shape.result.basin.points)
        _lines(axes, shape.between([number in inside for number in range(len(points))]), BASIN_LINE)
    detached = np.array([point.is_detached for point in points])
    unsure = np.array([point.is_known and bool(point.may_be_higher) for point in points])
    _hatch(axes, shape, detached, ("////", "on a detached branch, above the main one"))
    _hatch(axes, shape, unsure, ("....", "not settled"))
    _mark_lowest(axes, shape)


def _lines(axes: Axes, pieces: Array, look: Mapping[str, Any]) -> None:
    """Pieces of lines; a light line has a dark edge."""
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import withStroke

    if not len(pieces):
        return
    edge = [withStroke(linewidth=3.0, foreground="black")] if look["color"] == "white" else []
    given = {name: look[name] for name in ("color", "linewidth", "linestyle")}
    axes.add_collection(LineCollection(list(pieces), path_effects=edge, **given))
    axes.plot([], [], path_effects=edge, **look)  # for the legend


def _both_known(shape: MapShape) -> NDArray[np.bool_]:
    """Edges of triangles, (t, 3), between points with a worst motion."""
    known = np.array([point.is_known for point in shape.result.points])[shape.triangles]
    return np.asarray(known & np.roll(known, -1, axis=1))


def _hatch(axes: Axes, shape: MapShape, chosen: NDArray[np.bool_], look: tuple[str, str]) -> None:
    from matplotlib.collections import PolyCollection

    if chosen.any():
        pattern, label = look
        cells = PolyCollection(list(shape.cells(chosen)), facecolors="none", edgecolors="0.1", linewidths=0.0)
        cells.set_hatch(pattern)
        cells.set_label(label)
        axes.add_collection(cells)


def _mark_lowest(axes: Axes, shape: MapShape) -> None:
    """A star at the lowest point, or where a condition is mapped at the highest of the best design."""
    result = shape.result
    over = bool(condition_keys(result.keys))
    number = result.best if over else None if result.basin is None else result.basin.lowest
    if number is None:
        return
    place, point = shape.points[number], result.points[number]
    at = ", ".join(value_label(key, value) for key, value in zip(result.keys, point.values, strict=True))
    factor, unit = scale([point.height], "m")
    look: dict[str, Any] = {
        "color": LOWEST,
        "markersize": 13,
        "markeredgecolor": "white",
        "clip_on": False,
        "zorder": 5,
    }
    name = "highest of the best design" if over else "lowest"
    label = f"{name}: {point.height * factor:.3g} {unit} at {at}"
    axes.plot(*place, "*", linestyle="none", label=label, **look)


def _name_regions(axes: Axes, shape: MapShape) -> None:
    """Name of each contact state, at the point farthest from points of other states and from the edge."""
    from scipy.spatial import cKDTree

    result, places = shape.result, shape.result.places
    states = np.array([point.state for point in result.points])
    edge = 0.5 + np.minimum(places - places.min(axis=0), places.max(axis=0) - places).min(axis=1)
    for state, share in result.shares.items():
        if share < SMALLEST_NAMED:
            continue
        inside = states == state
        distance = edge.copy()
        if not inside.all():
            distance = np.minimum(edge, cKDTree(places[~inside]).query(places)[0])
        best = int(np.argmax(np.where(inside, distance, -1.0)))
        box = {"boxstyle": "round,pad=0.25", "facecolor": "white", "alpha": 0.75, "linewidth": 0.0}
        look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, "bbox": box, "zorder": 6}
        x, y = shape.points[best]
        axes.text(x, y, NAMES[state], **look)
