"""Height and frequency of the worst motions and of the peaks of the main branches over the swept parameter."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.curve_marks import END_OF_RANGE, MARK_OF_END
from pipeline.figures.data import SweepPoint
from pipeline.figures.linear_limits import Limit
from pipeline.figures.style import (
    LIMIT_COLOUR,
    LOG_FROM,
    ordered_colours,
    plain_log_labels,
    scale,
    subplots,
    write_heading,
)
from pipeline.figures.sweep_keys import SweepKey, sweep_keys
from pipeline.scene.labels import value_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORST, MAIN, AT_LEAST = "worst motion", "peak of the main branch", "worst motion, at least"
MAIN_LOOK = {"linewidth": 0.8, "linestyle": (0, (4, 2)), "markerfacecolor": "white", "markeredgewidth": 0.8}
MOST_LINES, MOST_MARKERS = 12, 40
_SYMLOG_FROM = 8.0  # ratio of the largest to the median value above which the axis is symmetric-logarithmic


def trend_figure(points: Sequence[SweepPoint], limits: Sequence[Limit], title: str) -> Figure | None:
    """Worst motions, and the peaks of the main branches as thin lines: amplitude above, frequency below, against the
    parameter with the most values; one line for each combination of the other swept parameters.

    None with one curve, and where there would be too many lines.
    """
    keys = sweep_keys(points)
    if not keys or not has_few_lines(points):
        return None
    key = keys[0]
    figure, (upper, lower) = subplots(2, 1, size=(6.4, 6.0), sharex=True)
    factor, unit = scale([height for point in points for height in (point.peak[1], point.worst[1])], "m")
    lines = _lines(points, key)
    for number, ((label, members), colour) in enumerate(zip(lines.items(), ordered_colours(len(lines)), strict=True)):
        x = [key.position(point.parameters[key.name]) for point in members]
        worst: dict[str, Any] = {"marker": "o", "markersize": 4 if len(members) <= MOST_MARKERS else 0}
        worst |= {"color": colour, "label": ", ".join(filter(None, (label, WORST)))}
        upper.plot(x, [point.worst[1] * factor for point in members], **worst)
        lower.plot(x, [point.worst[0] for point in members], **worst)
        _mark_open(upper, x, members, factor, colour)
        peaks: dict[str, Any] = {**worst, "markersize": 0.75 * worst["markersize"], **MAIN_LOOK}
        peaks["label"] = MAIN if number == 0 else None
        upper.plot(x, [point.peak[1] * factor for point in members], **peaks)
        lower.plot(x, [point.peak[0] for point in members], **peaks)
        _mark_ends(lower, x, members, colour)
    _draw_limits(upper, lower, limits, factor)
    _set_axes(upper, lower, points, key)
    write_heading(upper, title)
    upper.set(ylabel=f"largest displacement [{unit}]")
    lower.set(xlabel=key.axis, ylabel="its frequency [Hz]")
    if len(lines) > 1:
        figure.legend(*upper.get_legend_handles_labels(), loc="outside right center", fontsize=9)
        figure.set_size_inches(9.0, 6.0)
    else:
        upper.legend(fontsize=9)
    return figure


def has_few_lines(points: Sequence[SweepPoint]) -> bool:
    """Whether a line for each combination of the other keys can be told apart."""
    keys = sweep_keys(points)
    if not keys:
        return True
    lines = len(_lines(points, keys[0]))
    return lines <= MOST_LINES and len(points) > lines


def _mark_open(axes: Axes, x: Sequence[float], curves: Sequence[SweepPoint], factor: float, colour: str) -> None:
    """Open triangles around worst motions that may be higher, dotted up to a higher peak of the main branch."""
    label = None if AT_LEAST in axes.get_legend_handles_labels()[1] else AT_LEAST
    for place, curve in zip(x, curves, strict=True):
        height = curve.worst[1] * factor
        if not curve.worst_open or not math.isfinite(height):
            continue
        look: dict[str, Any] = {"color": colour, "markerfacecolor": "none", "markersize": 9, "zorder": 4}
        axes.plot(place, height, "^", label=label, **look)
        if curve.peak[1] > curve.worst[1]:
            axes.plot([place, place], [height, curve.peak[1] * factor], ":", color=colour, linewidth=1.0)
        label = None


def _mark_ends(axes: Axes, x: Sequence[float], curves: Sequence[SweepPoint], colour: str) -> None:
    """Arrow heads at the frequencies of highest amplitudes that are no peaks: the range ends there."""
    ends = [(place, curve.peak[0]) for place, curve in zip(x, curves, strict=True) if curve.peak_at_end]
    if ends:
        label = None if END_OF_RANGE in axes.get_legend_handles_labels()[1] else END_OF_RANGE
        look: dict[str, Any] = {"color": colour, "markerfacecolor": "none", "markersize": 9, "zorder": 4}
        axes.plot(*zip(*ends, strict=True), marker=MARK_OF_END, linestyle="none", label=label, **look)
        axes.legend(fontsize=9)


def _lines(points: Sequence[SweepPoint], key: SweepKey) -> dict[str, list[SweepPoint]]:
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
            look: dict[str, Any] = {"color": LIMIT_COLOUR, "linestyle": style, "linewidth": 1.0}
            upper.axhline(amplitude * factor, label=f"linear, {kind}", **look)
            lower.axhline(frequency, **look)


def _set_axes(upper: Axes, lower: Axes, points: Sequence[SweepPoint], key: SweepKey) -> None:
    set_abscissa(lower, key)
    heights = np.array([height for point in points for height in (point.peak[1], point.worst[1])])
    heights = heights[np.isfinite(heights) & (heights > 0.0)]
    if heights.size and heights.max() > LOG_FROM * heights.min():
        upper.set_yscale("log")
        plain_log_labels(upper.yaxis)
    else:
        upper.set_ylim(bottom=0.0)


def set_abscissa(axes: Axes, key: SweepKey) -> None:
    """Names of values that are no numbers; a symmetric-logarithmic axis where few values are far away."""
    if not key.numeric:
        axes.set_xticks(range(len(key.values)), [key.text(value) for value in key.values])
        return
    values = np.abs([key.position(value) for value in key.values])
    above = values[values > 0.0]
    if above.size and above.max() > _SYMLOG_FROM * np.median(above):
        axes.set_xscale("symlog", linthresh=float(np.median(above)), linscale=1.0)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
