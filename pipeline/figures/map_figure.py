"""The figure of a map: worst motion over two keys with contact states, jumps and the lowest point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.map_contours import MapShape, draw_contours, levels_of
from pipeline.figures.style import scale, subplots, write_heading
from pipeline.scene.labels import value_label
from pipeline.studies.worst_motion_map.basin import LEVEL
from pipeline.studies.worst_motion_map.map_point import FREE, SEPARATING, SLIPPING, STUCK, UNKNOWN, known_heights
from pipeline.studies.worst_motion_map.map_result import WorstMotionMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
NAMES = {FREE: "free", SEPARATING: "separating", SLIPPING: "slipping", STUCK: "stuck", UNKNOWN: "no result"}
LOWEST = "#D55E00"
STATE_LINE: dict[str, Any] = {"color": "black", "linewidth": 1.3, "linestyle": "solid"}
STATE_LINE |= {"label": "contact state changes"}
JUMP_LINE: dict[str, Any] = {"color": "white", "linewidth": 1.6, "linestyle": (0, (3, 2))}
JUMP_LINE |= {"label": "worst motion jumps, or changes too fast for the grid"}
BASIN_LINE: dict[str, Any] = {"color": LOWEST, "linewidth": 1.4, "linestyle": (0, (4, 2))}
BASIN_LINE |= {"label": f"within {100 * (LEVEL - 1):.0f} % of the lowest"}
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
        for axis, each in zip((axes.xaxis, axes.yaxis), shape.scales, strict=True):
            each.label(axis)
    panels[1].set_ylabel("")
    _name_regions(panels[0], shape)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(3, max(1, len(labels))), fontsize=9)
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
    _hatch(axes, shape, unsure, ("....", "may be higher"))
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
    result = shape.result
    basin, lowest = result.basin, result.lowest
    if basin is None or lowest is None:
        return
    place = shape.points[basin.lowest]
    at = ", ".join(value_label(key, value) for key, value in zip(result.keys, lowest.values, strict=True))
    factor, unit = scale([lowest.height], "m")
    look: dict[str, Any] = {
        "color": LOWEST,
        "markersize": 13,
        "markeredgecolor": "white",
        "clip_on": False,
        "zorder": 5,
    }
    label = f"lowest: {lowest.height * factor:.3g} {unit} at {at}"
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
