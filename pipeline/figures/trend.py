"""Height and frequency of the worst motions and of the peaks of the main branches over the swept parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import PlottedCurve
from pipeline.figures.linear_limits import Limit
from pipeline.figures.style import DISTINCT, LIMIT_COLOUR, LOG_FROM, plain_log_labels, scale, subplots, write_heading
from pipeline.scene.labels import quantity, value_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORST, MAIN, AT_LEAST = "worst motion", "peak of the main branch", "worst motion, at least"
MAIN_LOOK = {"linewidth": 0.8, "linestyle": (0, (4, 2)), "markerfacecolor": "white", "markeredgewidth": 0.8}
_SYMLOG_FROM = 8.0  # ratio of the largest to the median value above which the axis is symmetric-logarithmic


def trend_figure(curves: Sequence[PlottedCurve], limits: Sequence[Limit], title: str) -> Figure:
    """Worst motions, and the peaks of the main branches as thin lines: amplitude above, frequency below, against the
    parameter with the most values; one line for each combination of the other swept parameters."""
    figure, (upper, lower) = subplots(2, 1, size=(6.4, 6.0), sharex=True)
    key = _main_parameter(curves)
    factor, unit = scale([height for curve in curves for height in (curve.peak[1], curve.worst[1])], "m")
    names = _categories(curves, key)
    for number, (label, members) in enumerate(_lines(curves, key).items()):
        x = [_position(curve.parameters[key], key, names) for curve in members]
        colour = DISTINCT[number % len(DISTINCT)]
        worst: dict[str, Any] = {"marker": "o", "markersize": 5, "color": colour}
        worst["label"] = ", ".join(filter(None, (label, WORST)))
        upper.plot(x, [curve.worst[1] * factor for curve in members], **worst)
        lower.plot(x, [curve.worst[0] for curve in members], **worst)
        _mark_open(upper, x, members, factor, colour)
        peaks: dict[str, Any] = {"marker": "o", "markersize": 3, "color": colour, **MAIN_LOOK}
        peaks["label"] = MAIN if number == 0 else None
        upper.plot(x, [curve.peak[1] * factor for curve in members], **peaks)
        lower.plot(x, [curve.peak[0] for curve in members], **peaks)
    _draw_limits(upper, lower, limits, factor)
    _set_axes(upper, lower, curves, key, names)
    write_heading(upper, title)
    upper.set(ylabel=f"largest displacement [{unit}]")
    lower.set(xlabel=quantity(key).axis(), ylabel="its frequency [Hz]")
    if upper.get_legend_handles_labels()[0]:
        upper.legend(fontsize=9)
    return figure


def _mark_open(axes: Axes, x: Sequence[float], curves: Sequence[PlottedCurve], factor: float, colour: str) -> None:
    """White arrow heads over worst motions that may be higher, dotted up to a higher peak of the main branch."""
    label = None if AT_LEAST in axes.get_legend_handles_labels()[1] else AT_LEAST
    for place, curve in zip(x, curves, strict=True):
        height = curve.worst[1] * factor
        if not curve.worst_open or not math.isfinite(height):
            continue
        look: dict[str, Any] = {"color": colour, "markerfacecolor": "white", "markersize": 8, "zorder": 4}
        axes.plot(place, height, "^", label=label, **look)
        if curve.peak[1] > curve.worst[1]:
            axes.plot([place, place], [height, curve.peak[1] * factor], ":", color=colour, linewidth=1.0)
        label = None


def _main_parameter(curves: Sequence[PlottedCurve]) -> str:
    keys = curves[0].parameters
    return max(keys, key=lambda key: len({str(curve.parameters[key]) for curve in curves}))


def _lines(curves: Sequence[PlottedCurve], key: str) -> dict[str, list[PlottedCurve]]:
    lines: dict[str, list[PlottedCurve]] = {}
    for curve in curves:
        others = (value_label(k, v) for k, v in curve.parameters.items() if k != key)
        lines.setdefault(", ".join(others), []).append(curve)
    return lines


def _categories(curves: Sequence[PlottedCurve], key: str) -> list[str] | None:
    """Names along the axis where the swept values are not numbers."""
    values = [curve.parameters[key] for curve in curves]
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        return None
    return list(dict.fromkeys(quantity(key).value(v) for v in values))


def _position(value: Any, key: str, names: list[str] | None) -> float:
    if names is None:
        return float(value) * quantity(key).factor
    return float(names.index(quantity(key).value(value)))


def _draw_limits(upper: Axes, lower: Axes, limits: Sequence[Limit], factor: float) -> None:
    """Levels of the linear limits, where there is one of a kind."""
    for kind, style in (("free", (0, (1, 1))), ("stuck", (0, (6, 1.5, 1, 1.5)))):
        chosen = [limit for limit in limits if limit.kind == kind]
        if len(chosen) == 1:
            frequency, amplitude = chosen[0].peak
            look: dict[str, Any] = {"color": LIMIT_COLOUR, "linestyle": style, "linewidth": 1.0}
            upper.axhline(amplitude * factor, label=f"linear, {kind}", **look)
            lower.axhline(frequency, **look)


def _set_axes(upper: Axes, lower: Axes, curves: Sequence[PlottedCurve], key: str, names: list[str] | None) -> None:
    if names is not None:
        lower.set_xticks(range(len(names)), names)
    else:
        values = np.abs([curve.parameters[key] for curve in curves]).astype(float) * quantity(key).factor
        above = values[values > 0.0]
        if above.size and above.max() > _SYMLOG_FROM * np.median(above):
            threshold = float(np.median(above))
            lower.set_xscale("symlog", linthresh=threshold, linscale=1.0)
            lower.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    heights = np.array([height for curve in curves for height in (curve.peak[1], curve.worst[1])])
    heights = heights[np.isfinite(heights) & (heights > 0.0)]
    if heights.size and heights.max() > LOG_FROM * heights.min():
        upper.set_yscale("log")
        plain_log_labels(upper.yaxis)
    else:
        upper.set_ylim(bottom=0.0)
