"""Height and frequency of the worst motions and of the peaks of the main branches over the swept parameter.

Of many curves: quantiles of the amplitude over frequency, and worst motions against each swept key.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.curve_line import END_OF_RANGE, MARK_OF_END, draw_line, mark_peak
from pipeline.figures.data import Array, PlottedCurve, SweepKey, SweepPoint, sweep_keys
from pipeline.figures.linear_limits import Limit
from pipeline.figures.style import (
    BEHIND,
    DISTINCT,
    LIMIT_COLOUR,
    group_colours,
    scale,
    set_height_axis,
    subplots,
    write_heading,
)
from pipeline.scene.labels import value_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nonlinear.response_curve import ResponseCurve


WORST, MAIN, NOT_SETTLED = "worst motion", "peak of the main branch", "worst motion, not settled"
TO_PEAK = "up to an unstable peak"  # of the main branch, higher than any motion known to persist
MOST_LINES, MOST_MARKERS = 12, 40
SHAPES = "osD^vPX<>pdh"  # by the value of the other keys
_SYMLOG_FROM = 8.0  # ratio of the largest to the median value above which the axis is symmetric-logarithmic


def trend_figure(
    points: Sequence[SweepPoint], limits: Sequence[Limit], colours: Mapping[int, Any], title: str
) -> Figure | None:
    """Worst motions, and the peaks of the main branches as bars: amplitude above, frequency below, against the
    parameter with the most values. Nothing is drawn between the values: what a line would show is not computed.

    A marker has the colour of its curve; with several swept keys that of the combination of the others, which has a
    shape of its own. None with one curve, and where there would be too many combinations.
    """
    keys = sweep_keys(points)
    if not keys or not has_few_lines(points):
        return None
    key = keys[0]
    figure, (upper, lower) = subplots(2, 1, size=(6.4, 6.0), sharex=True)
    factor, unit = scale([height for point in points for height in (point.peak[1], point.worst[1])], "m")
    lines = lines_over(points, key)
    for (label, members), colour, shape in zip(lines.items(), group_colours(len(lines)), SHAPES, strict=False):
        x = [key.position(point.parameters[key.name]) for point in members]
        shades = [colour if len(lines) > 1 else colours[point.index] for point in members]
        small = len(members) > MOST_MARKERS
        for name, marker, size, heights in (
            (WORST, shape, 3 if small else 6, [(p.worst[1] * factor, p.worst[0]) for p in members]),
            (MAIN, "_", 6 if small else 12, [(p.peak[1] * factor, p.peak[0]) for p in members]),
        ):
            look: dict[str, Any] = {"marker": marker, "markersize": size, "linestyle": "none"}
            look["label"] = "_" + ", ".join(filter(None, (label, name)))
            for place, shade, (height, frequency) in zip(x, shades, heights, strict=True):
                upper.plot(place, height, color=shade, **look)
                lower.plot(place, frequency, color=shade, **look)
        worst = {"marker": shape, "color": colour if len(lines) > 1 else "0.35", "linestyle": "none"}
        upper.plot([], [], label=", ".join(filter(None, (label, WORST))), markersize=6, **worst)
        _mark_open(upper, x, members, factor, shades)
        _mark_ends(lower, upper, x, members, shades)
    upper.plot([], [], marker="_", markersize=12, color="0.35", linestyle="none", label=MAIN)
    _draw_limits(upper, lower, limits, factor)
    _set_axes(upper, lower, points, key)
    write_heading(figure, title)
    upper.set(ylabel=f"largest displacement [{unit}]")
    lower.set(xlabel=key.axis, ylabel="its frequency [Hz]")
    if len(lines) > 1:
        figure.legend(*upper.get_legend_handles_labels(), loc="outside right center", fontsize=9)
        figure.set_size_inches(9.0, 6.0)
    else:
        figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=9)
    return figure


def has_few_lines(points: Sequence[SweepPoint]) -> bool:
    """Whether a line for each combination of the other keys can be told apart."""
    keys = sweep_keys(points)
    if not keys:
        return True
    lines = len(lines_over(points, keys[0]))
    return lines <= MOST_LINES and len(points) > lines


def _mark_open(
    axes: Axes, x: Sequence[float], curves: Sequence[SweepPoint], factor: float, colours: Sequence[Any]
) -> None:
    """Open triangles around worst motions that may be higher, dotted up to a higher peak of the main branch."""
    triangle: dict[str, Any] = {"marker": "^", "markerfacecolor": "none", "markersize": 14, "linestyle": "none"}
    dots: dict[str, Any] = {"linestyle": ":", "linewidth": 1.0}
    for place, curve, colour in zip(x, curves, colours, strict=True):
        height, peak = curve.worst[1] * factor, curve.peak[1] * factor
        if not curve.worst_open or not math.isfinite(height):
            continue
        axes.plot(place, height, color=colour, zorder=4, label=f"_{NOT_SETTLED}", **triangle)
        _name_once(axes, NOT_SETTLED, triangle)
        if peak > height:
            axes.plot([place, place], [height, peak], color=colour, label=f"_{TO_PEAK}", **dots)
            _name_once(axes, TO_PEAK, dots)


def _name_once(axes: Axes, name: str, look: dict[str, Any]) -> None:
    """A grey entry of the legend, which stands for all curves."""
    if name not in axes.get_legend_handles_labels()[1]:
        axes.plot([], [], color="0.35", label=name, **look)


def _mark_ends(
    axes: Axes, named: Axes, x: Sequence[float], curves: Sequence[SweepPoint], colours: Sequence[Any]
) -> None:
    """Arrow heads at the frequencies of highest amplitudes that are no peaks: the range ends there.

    `named`: the axes whose names the legend has, outside of the data.
    """
    look: dict[str, Any] = {"marker": MARK_OF_END, "markerfacecolor": "none", "markersize": 9, "linestyle": "none"}
    for place, curve, colour in zip(x, curves, colours, strict=True):
        if curve.facts.peak_at_end:
            axes.plot(place, curve.peak[0], color=colour, zorder=4, label=f"_{END_OF_RANGE}", **look)
            _name_once(named, END_OF_RANGE, look)


def lines_over(points: Sequence[SweepPoint], key: SweepKey) -> dict[str, list[SweepPoint]]:
    """The curves of each combination of the other keys, by its label, in the order of the key."""
    lines: dict[str, list[SweepPoint]] = {}
    for point in sorted(points, key=lambda point: key.number(point.parameters[key.name])):
        others = (value_label(k, v) for k, v in point.parameters.items() if k != key.name)
        lines.setdefault(", ".join(others), []).append(point)
    return lines


def _draw_limits(upper: Axes, lower: Axes, limits: Sequence[Limit], factor: float) -> None:
    """Levels of the linear limits, where there is one of a kind."""
    for kind, style in (("free", (0, (1, 1))), ("stuck", (0, (6, 1.5, 1, 1.5)))):
        chosen = [limit for limit in limits if limit.kind == kind]
        if len(chosen) == 1:
            if chosen[0].resonance is None:
                continue
            frequency, amplitude = chosen[0].resonance
            look: dict[str, Any] = {"color": LIMIT_COLOUR, "linestyle": style, "linewidth": 1.6, "zorder": BEHIND}
            upper.axhline(amplitude * factor, label=f"linear, {kind}", **look)
            lower.axhline(frequency, **look)


def _set_axes(upper: Axes, lower: Axes, points: Sequence[SweepPoint], key: SweepKey) -> None:
    set_abscissa(lower, key)
    set_height_axis(upper, np.array([height for point in points for height in (point.peak[1], point.worst[1])]))


def set_abscissa(axes: Axes, key: SweepKey) -> None:
    """Names of values that are no numbers; a symmetric-logarithmic axis where few values are far away."""
    axes.margins(x=0.06)  # no mark on the frame
    if not key.numeric:
        axes.set_xticks(range(len(key.values)), [key.text(value) for value in key.values])
        return
    values = np.abs([key.position(value) for value in key.values])
    above = values[values > 0.0]
    if above.size and above.max() > _SYMLOG_FROM * np.median(above):
        axes.set_xscale("symlog", linthresh=float(np.median(above)), linscale=1.0)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")


LEVELS = (0.0, 0.1, 0.5, 0.9, 1.0)
BANDS = ((0, 4, 0.16, "all curves"), (1, 3, 0.34, "10 % to 90 %"))
BAND_COLOUR = DISTINCT[0]
ENDS = ("highest", "median", "lowest")
END_COLOURS = ("#D55E00", "0.25", "#009E73")
LONG = 64  # characters of a name that has a line of the legend to itself
FREQUENCIES = 500
MOST_READ = 300  # curves whose points are read for the quantiles over frequency
FEWEST_BINS, IN_BIN = 4, 12  # values in a bin
MOST_BINS, MOST_KEYS, MOST_DOTS = 16, 4, 3000


def curves_to_read(points: Sequence[SweepPoint]) -> list[int]:
    """Numbers of at most about `MOST_READ` curves, evenly spread, with the highest and the lowest worst motion."""
    places = np.unique(np.linspace(0, len(points) - 1, min(len(points), MOST_READ)).round().astype(int))
    return sorted({*(points[place].index for place in places), *(point.index for point in ends(points))})


def ends(points: Sequence[SweepPoint]) -> list[SweepPoint]:
    """The curves with the highest, the median and the lowest worst motion; of the last one nothing is open."""
    order = sorted((p for p in points if np.isfinite(p.facts.height)), key=lambda p: p.facts.height)
    if not order:
        return []
    closed = [point for point in order if not point.worst_open] or order
    found = {point.index: point for point in (order[-1], order[len(order) // 2], closed[0])}
    return list(found.values())


def band_figure(curves: Sequence[PlottedCurve], points: Sequence[SweepPoint], title: str) -> Figure:
    """Quantiles of the amplitude of the main branches at each frequency, and the curves with the highest, the median
    and the lowest worst motion."""
    figure, axes = subplots(size=(8.4, 4.8))
    factor, unit = scale(np.concatenate([curve.response.amplitude_m for curve in curves]), "m")
    low = min(curve.scene.response.frequency[0] for curve in curves)
    high = max(curve.scene.response.frequency[1] for curve in curves)
    frequency = np.linspace(low, high, FREQUENCIES)
    heights = np.array([highest_at(curve.response, frequency) for curve in curves]) * factor
    _draw_bands(axes, frequency, heights)
    by_index = {curve.index: curve for curve in curves}
    for point, name, colour in zip(ends(points), ENDS, END_COLOURS, strict=False):
        curve, look = by_index.get(point.index), {"color": colour, "linewidth": 1.3}
        if curve is not None:
            label = f"{name} worst motion: {curve.label}"
            draw_line(axes, curve.response, curve.response.amplitude_m * factor, label, **look)
            mark_peak(axes, curve.facts, factor, colour)
    axes.set_xlim(low, high)
    _set_heights(axes, heights)
    read = "" if len(curves) >= len(points) else f", bands from {len(curves)} of them"
    write_heading(axes, f"{title}: {len(points)} curves{read}")
    axes.set(xlabel="excitation frequency [Hz]", ylabel=f"largest displacement over a period [{unit}]")
    handles, names = axes.get_legend_handles_labels()
    long = max(map(len, names)) > LONG
    figure.legend(handles, names, loc="outside lower center", fontsize=9, ncols=1 if long else 2)
    if long:
        figure.set_size_inches(8.4, 5.6)
    return figure


def highest_at(curve: ResponseCurve, frequency: Array) -> Array:
    """The highest amplitude of the main branch at each frequency; nan where it has no point.

    Where a branch folds, several of its segments pass a frequency.
    """
    x, y = curve.frequency_hz, curve.amplitude_m
    found = np.full(len(frequency), np.nan)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(x))) != 0) + 1
    for part in np.split(np.arange(len(x)), turns):
        piece = part if part[-1] + 1 >= len(x) else np.append(part, part[-1] + 1)
        order = np.argsort(x[piece], kind="stable")
        found = np.fmax(found, np.interp(frequency, x[piece][order], y[piece][order], left=np.nan, right=np.nan))
    return found


def quantile_figure(points: Sequence[SweepPoint], title: str) -> Figure | None:
    """Quantiles of the worst motions and of their frequencies against each swept key; None where none is swept."""
    keys = [key for key in sweep_keys(points) if key.numeric or len(key.values) <= MOST_BINS][:MOST_KEYS]
    known = [point for point in points if np.isfinite(point.facts.height)]
    if not keys or not known:
        return None
    size = (1.4 + 3.6 * len(keys), 6.0)
    figure, rows = subplots(2, len(keys), size=size, sharex="col", sharey="row", squeeze=False)
    factor, unit = scale([point.facts.height for point in known], "m")
    heights = np.array([point.facts.height * factor for point in known])
    frequencies = np.array([point.worst[0] if np.isfinite(point.worst[1]) else point.peak[0] for point in known])
    for key, upper, lower in zip(keys, *rows, strict=True):
        x = np.array([key.position(point.parameters[key.name]) for point in known])
        for axes, values in ((upper, heights), (lower, frequencies)):
            _draw_quantiles(axes, x, values, key)
        lower.set_xlabel(key.axis)
        set_abscissa(lower, key)
    rows[0, 0].set_ylabel(f"worst motion [{unit}]")
    rows[1, 0].set_ylabel("its frequency [Hz]")
    _set_heights(rows[0, 0], heights)
    figure.legend(*rows[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=9)
    write_heading(figure, f"{title}: {len(points)} curves")
    return figure


def _draw_quantiles(axes: Axes, x: Array, values: Array, key: SweepKey) -> None:
    groups = bins(x)
    centre = np.array([x[group].mean() for group in groups])
    table = np.array([np.quantile(values[group], LEVELS) for group in groups])
    if len(x) <= MOST_DOTS:
        dots: dict[str, Any] = {
            "color": "0.55",
            "markersize": 2.0 if len(x) > 300 else 3.5,
            "markeredgewidth": 0.0,
            "zorder": 1.5,
        }
        axes.plot(x, values, "o", label="curve", rasterized=len(x) > 500, **dots)
    _fill(axes, centre, table.T)
    axes.plot(centre, table[:, 2], "o-", color=BAND_COLOUR, markersize=3 if len(groups) > 1 else 5, label="median")


def bins(x: Array) -> list[Any]:
    """Rows of equal values of `x`; where there are many, of neighbouring ones, about as many in each bin."""
    order = np.argsort(x, kind="stable")
    edges = np.flatnonzero(np.diff(x[order])) + 1
    most = int(np.clip(len(x) // IN_BIN, FEWEST_BINS, MOST_BINS))
    if len(edges) + 1 > most:
        wanted = np.linspace(0, len(x), most + 1)[1:-1]
        edges = np.unique(edges[np.abs(edges[None] - wanted[:, None]).argmin(axis=1)])
    return np.split(order, edges)


def _draw_bands(axes: Axes, frequency: Array, heights: Array) -> None:
    covered = np.isfinite(heights).any(axis=0)
    levels = np.nanquantile(heights[:, covered], LEVELS, axis=0)
    _fill(axes, frequency[covered], levels)
    axes.plot(frequency[covered], levels[2], color=BAND_COLOUR, linewidth=1.2, label="median at each frequency")


def _fill(axes: Axes, x: Array, levels: Array) -> None:
    for low, high, alpha, name in BANDS:
        look: dict[str, Any] = {"color": BAND_COLOUR, "alpha": alpha, "linewidth": 0.0}
        axes.fill_between(x, levels[low], levels[high], label=name, **look)


def _set_heights(axes: Axes, heights: Array) -> None:
    with np.errstate(all="ignore"):
        tops = np.nanmax(np.atleast_2d(heights), axis=-1) if heights.ndim > 1 else heights
    if set_height_axis(axes, tops) and heights.ndim > 1:
        lowest = float(tops[tops > 0.0].min())
        axes.set_ylim(bottom=max(0.15 * lowest, 0.7 * float(np.nanmin(heights[heights > 0.0]))))
