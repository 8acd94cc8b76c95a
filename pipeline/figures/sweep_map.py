"""Maps over two swept keys: height and frequency of the worst motion.

Contours for a full grid of numbers, cells for a small one or for words, dots for other samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import Array, SweepKey, SweepPoint, is_grid, sweep_keys
from pipeline.figures.style import LOG_FROM, give_data, plain_log_labels, scale, subplots, write_heading
from pipeline.results.best_design import DesignPoint, best_design, compares_designs, condition_keys
from pipeline.scene.sweep import takes_fractions

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pipeline.stages.curve.respond import CurveResult
    from pipeline.studies.map.result import WorstMotionMap

FEWEST = 3  # values of the key with the most
FEWEST_FOR_CONTOURS = 4  # values of either key
MOST_NUMBERS = 80  # cells with a number in them
MOST_TICKS = 10


def sweep_map_figure(curves: Sequence[CurveResult], points: Sequence[SweepPoint], title: str) -> Figure | None:
    """Worst motion over two swept keys: contours where the curves are a grid of numbers, else `cell_figure`."""
    found = map_of_sweep(curves)
    if found is None:
        return cell_figure(points, title)
    from pipeline.studies.map.figure import map_figure

    return map_figure(found, title)


def map_of_sweep(curves: Sequence[CurveResult]) -> WorstMotionMap | None:
    """The map of the curves of a sweep; their files are read.

    None unless exactly two keys are swept, on a full grid of at least four by four numbers, between which there are
    others.
    """
    members = [curve.member for curve in curves]
    keys = sweep_keys(members)
    if len(keys) != 2 or len(keys[1].values) < FEWEST_FOR_CONTOURS or not is_grid(members, keys):
        return None
    if not all(key.numeric and takes_fractions(key.name) for key in keys):
        return None
    from pipeline.studies.map.grid import MapAxis, MapGrid, even_in_logarithm, map_point
    from pipeline.studies.map.result import worst_motion_map

    first, second = (MapAxis(key.name, tuple(map(float, key.values)), even_in_logarithm(key.values)) for key in keys)
    points = []
    for curve in curves:
        values = [curve.member.parameters[key.name] for key in keys]
        column, row = (float(key.number(value)) for key, value in zip(keys, values, strict=True))
        points.append(map_point(curve, (column, row), (float(values[0]), float(values[1]))))
    return worst_motion_map(MapGrid((first, second)), points)


def cell_figure(points: Sequence[SweepPoint], title: str) -> Figure | None:
    """Worst motion over two swept keys, amplitude beside frequency; None unless exactly two keys are swept.

    A full grid is a heat map with a cell for each curve; other samples are dots. The lowest worst
    motion has a frame, those not settled a dot in the corner of the cell.
    """
    keys = sweep_keys(points)
    if len(keys) != 2 or len(keys[0].values) < FEWEST:
        return None
    grid = is_grid(points, keys)
    if not grid and not all(key.numeric for key in keys):
        return None
    factor, unit = scale([point.facts.height for point in points], "m")
    heights = np.array([point.facts.height * factor for point in points])
    frequencies = np.array([point.worst[0] if np.isfinite(point.worst[1]) else point.peak[0] for point in points])
    figure, panels = subplots(1, 2, size=(11.0, 4.6))
    for axes, values, name in (
        (panels[0], heights, f"worst motion, largest displacement [{unit}]"),
        (panels[1], frequencies, "frequency of the worst motion [Hz]"),
    ):
        look: dict[str, Any] = {"cmap": "viridis", "norm": _norm(values) if values is heights else None}
        drawn = _cells(axes, points, keys, values, look) if grid else _dots(axes, points, keys, values, look)
        bar = figure.colorbar(drawn, ax=axes, label=name)
        if look["norm"] is not None:
            plain_log_labels(bar.ax.yaxis)
        axes.set(xlabel=keys[0].axis, ylabel=keys[1].axis)
        given: dict[str, Any] = {key.axis: _values(points, key) for key in keys}
        given[name] = values
        give_data(axes, given)
        axes.grid(visible=False)
    if grid:
        _mark_cells(panels[0], points, keys, heights)
    write_heading(figure, title)
    return figure


def _values(points: Sequence[SweepPoint], key: SweepKey) -> list[Any]:
    """The value of a key at each curve, in the unit of its axis."""
    given = [point.parameters[key.name] for point in points]
    return [key.position(value) if key.numeric else key.text(value) for value in given]


def _norm(values: Array) -> Any:
    from matplotlib.colors import LogNorm

    above = values[np.isfinite(values) & (values > 0.0)]
    return LogNorm(above.min(), above.max()) if above.size and above.max() > LOG_FROM * above.min() else None


def _cells(axes: Axes, points: Sequence[SweepPoint], keys: Sequence[SweepKey], values: Array, look: Any) -> Any:
    """One cell a curve, all of the same size: swept values are seldom evenly spaced."""
    table = np.full((len(keys[1].values), len(keys[0].values)), np.nan)
    at = _numbers(points, keys)
    table[at[:, 1], at[:, 0]] = values
    drawn = axes.pcolormesh(table, **look)
    for axis, key in ((axes.xaxis, keys[0]), (axes.yaxis, keys[1])):
        step = -(-len(key.values) // MOST_TICKS)
        shown = range(0, len(key.values), step)
        axis.set_ticks([number + 0.5 for number in shown], [key.text(key.values[number]) for number in shown])
    if len(points) <= MOST_NUMBERS:
        _write_numbers(axes, at, values, drawn)
    return drawn


def _write_numbers(axes: Axes, at: Any, values: Array, drawn: Any) -> None:
    for (column, row), value in zip(at, values, strict=True):
        if np.isfinite(value):
            red, green, blue, _ = drawn.cmap(drawn.norm(value))
            bright = 0.3 * red + 0.59 * green + 0.11 * blue > 0.5
            look: dict[str, Any] = {
                "ha": "center",
                "va": "center",
                "fontsize": 7.5,
                "color": "black" if bright else "white",
            }
            axes.text(column + 0.5, row + 0.5, f"{value:.3g}", **look)


def _dots(axes: Axes, points: Sequence[SweepPoint], keys: Sequence[SweepKey], values: Array, look: Any) -> Any:
    x, y = ([key.position(point.parameters[key.name]) for point in points] for key in keys)
    size = float(np.clip(6000.0 / len(points), 2.0, 60.0))
    return axes.scatter(x, y, c=values, s=size, linewidths=0.0, rasterized=len(points) > 500, **look)


def _mark_cells(axes: Axes, points: Sequence[SweepPoint], keys: Sequence[SweepKey], heights: Array) -> None:
    """A frame around the lowest worst motion, over conditions the highest of the best design; dots where it is not
    settled; both explained above the map.
    """
    from matplotlib.patches import Rectangle

    at = _numbers(points, keys)
    said = []
    is_open = np.array([point.worst_open for point in points])
    best = best_design(
        [
            DesignPoint(point.parameters, height, not left)
            for point, height, left in zip(points, heights.tolist(), is_open.tolist(), strict=True)
        ]
    )
    if not isinstance(best, str) and compares_designs(points[0].parameters):
        low = best.highest
        axes.add_patch(
            Rectangle(at[low], 1, 1, fill=False, edgecolor="#D55E00", linewidth=2.2, clip_on=False, zorder=5)
        )
        over = condition_keys(points[0].parameters)
        said.append(f"orange frame: {'highest of the best design' if over else 'lowest'}")
    if is_open.any():
        axes.plot(at[is_open, 0] + 0.88, at[is_open, 1] + 0.84, "o", color="#D55E00", markersize=2.5, zorder=5)
        said.append("dot: not settled")
    axes.set_title("; ".join(said), fontsize=9)


def _numbers(points: Sequence[SweepPoint], keys: Sequence[SweepKey]) -> Any:
    """Column and row of each curve, (n, 2)."""
    return np.array([[key.number(point.parameters[key.name]) for key in keys] for point in points])
