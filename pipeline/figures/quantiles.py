"""Quantiles of sweeps with many curves: amplitude over frequency, and worst motions against each swept key."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.curve_line import draw_line
from pipeline.figures.curve_marks import mark_peak
from pipeline.figures.data import Array, PlottedCurve, SweepPoint
from pipeline.figures.style import DISTINCT, LOG_FROM, plain_log_labels, scale, subplots, write_heading
from pipeline.figures.sweep_keys import SweepKey, sweep_keys
from pipeline.figures.trend import set_abscissa

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEVELS = (0.0, 0.1, 0.5, 0.9, 1.0)
BANDS = ((0, 4, 0.16, "all curves"), (1, 3, 0.34, "10 % to 90 %"))
BAND_COLOUR = DISTINCT[0]
ENDS = ("highest", "median", "lowest")
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
    order = sorted((p for p in points if np.isfinite(p.height)), key=lambda p: p.height)
    if not order:
        return []
    closed = [point for point in order if not point.worst_open] or order
    found = {point.index: point for point in (order[-1], order[len(order) // 2], closed[0])}
    return list(found.values())


def band_figure(curves: Sequence[PlottedCurve], points: Sequence[SweepPoint], title: str) -> Figure:
    """Quantiles of the amplitude of the main branches at each frequency, and the curves with the highest, the median
    and the lowest worst motion."""
    figure, axes = subplots(size=(8.4, 4.8))
    factor, unit = scale(np.concatenate([curve.amplitude_m for curve in curves]), "m")
    low = min(curve.scene.response.frequency[0] for curve in curves)
    high = max(curve.scene.response.frequency[1] for curve in curves)
    frequency = np.linspace(low, high, FREQUENCIES)
    heights = np.array([highest_at(curve, frequency) for curve in curves]) * factor
    _draw_bands(axes, frequency, heights)
    by_index = {curve.index: curve for curve in curves}
    for point, name, colour in zip(ends(points), ENDS, ("#D55E00", "0.25", "#009E73"), strict=False):
        curve, look = by_index.get(point.index), {"color": colour, "linewidth": 1.3}
        if curve is not None:
            label = f"{name} worst motion: {curve.label}"
            draw_line(
                axes,
                curve.frequency_hz,
                curve.amplitude_m * factor,
                curve.stable,
                label,
                curve.nodal_diameter,
                **look,
            )
            mark_peak(axes, curve.peak[0], curve.peak[1] * factor, colour)
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


def highest_at(curve: PlottedCurve, frequency: Array) -> Array:
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
    known = [point for point in points if np.isfinite(point.height)]
    if not keys or not known:
        return None
    size = (1.4 + 3.6 * len(keys), 6.0)
    figure, rows = subplots(2, len(keys), size=size, sharex="col", sharey="row", squeeze=False)
    factor, unit = scale([point.height for point in known], "m")
    heights = np.array([point.height * factor for point in known])
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
    tops = tops[np.isfinite(tops) & (tops > 0.0)]
    if tops.size and tops.max() > LOG_FROM * tops.min():
        axes.set_yscale("log")
        plain_log_labels(axes.yaxis)
        if heights.ndim > 1:
            axes.set_ylim(bottom=max(0.15 * float(tops.min()), 0.7 * float(np.nanmin(heights[heights > 0.0]))))
    else:
        axes.set_ylim(bottom=0.0)
