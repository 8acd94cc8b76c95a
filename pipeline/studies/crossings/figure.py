"""Campbell diagram with the worst motion of every crossing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.campbell import draw_list, list_height
from pipeline.figures.style import TO_POINT, keep_apart, plain_log_labels, scale, subplots, write_heading
from pipeline.results.worst import height_mark, with_unit
from pipeline.studies.crossings.meetings import at_speed
from pipeline.studies.crossings.result import Crossing, CrossingsResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

COLOURS = "plasma_r"
LOG_FROM = 20.0  # ratio of the highest to the lowest worst motion from which their colours are logarithmic
HEADROOM = 1.12  # above the highest crossing
POINTS = 60  # of a line


def crossings_figure(result: CrossingsResult, title: str) -> Figure | None:
    """Modes, engine orders and crossings; None without a crossing."""
    if not result.rows:
        return None
    figure, axes = subplots(size=(8.6, 5.2 + list_height(len(result.rows))))
    ends = float(result.speeds[0]), float(result.speeds[-1])
    top = HEADROOM * max(row.engine_order * row.speed_rpm / 60.0 for row in result.rows)
    axes.axvspan(*result.speed_rpm, color="0.95", zorder=0)
    for steady in result.steady_rpm if result.steady_rpm != result.speed_rpm else ():
        axes.axvline(steady, color="0.4", linewidth=0.8, linestyle=(0, (4, 2)), label="_steady speed")
    _draw_modes(axes, result, top)
    _draw_orders(axes, result, ends, top)
    labels = _draw_crossings(axes, result.rows)
    write_heading(figure, title)
    axes.set(xlabel="speed [rev/min]", ylabel="frequency [Hz]", xlim=ends, ylim=(0.0, top))
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, 1.0), fontsize=8.5)
    draw_list(axes, "Crossings", [_said(row) for row in result.rows])
    keep_apart(axes, labels)
    return figure


def _said(row: Crossing) -> str:
    return (
        f"EO {row.engine_order}, {row.name}: {with_unit(row.worst.height)}{height_mark(row.worst)} "
        f"at {row.speed_rpm:g} rev/min"
    )


def _draw_modes(axes: Axes, result: CrossingsResult, top: float) -> None:
    """Bands from free to stuck contacts of the modes that have a row; lines that are the same are drawn once."""
    rows = {(row.engine_order, mode) for row in result.rows for mode in row.modes}
    speeds = np.linspace(result.speeds[0], result.speeds[-1], POINTS)
    drawn: set[str] = set()
    for line in result.lines:
        if (line.engine_order, line.mode) not in rows:
            continue
        free, stuck = (
            np.array([at_speed(result.speeds, hz, n) for n in speeds]) for hz in (line.free_hz, line.stuck_hz)
        )
        name = f"EO {line.engine_order}, {line.name}"
        band: dict[str, Any] = {"color": "#0072B2", "alpha": 0.10, "linewidth": 0.0, "zorder": 1.0}
        axes.fill_between(speeds, free, stuck, label="_nolegend_", **band)
        for hz, state, look in ((free, "free", (0, (1, 1.2))), (stuck, "stuck", "-")):
            known = f"{state} {hz[0]:.4g} {hz[-1]:.4g}"
            if known not in drawn and hz.min() <= top:
                first = not any(each.startswith(state) for each in drawn)
                label = f"contacts {state}" if first else f"_{name}, {state}"
                axes.plot(
                    speeds,
                    hz,
                    color="0.2" if state == "free" else "#D55E00",
                    linestyle=look,
                    linewidth=0.9,
                    label=label,
                )
            drawn.add(known)


def _draw_orders(axes: Axes, result: CrossingsResult, ends: tuple[float, float], top: float) -> None:
    """The line f = EO n / 60 of every engine order with its name at its end."""
    for order in sorted({line.engine_order for line in result.lines}):
        axes.plot([0.0, ends[1]], [0.0, order * ends[1] / 60.0], color="0.55", linewidth=0.8, label=f"_EO {order}")
        inside = order * ends[1] / 60.0 <= top
        end = (ends[1], order * ends[1] / 60.0) if inside else (60.0 * top / order, top)
        beside: dict[str, Any] = {"xytext": (3, 0), "va": "center"} if inside else {"xytext": (0, 3), "ha": "center"}
        axes.annotate(f"EO {order}", end, textcoords="offset points", fontsize=8, annotation_clip=False, **beside)


def _draw_crossings(axes: Axes, rows: tuple[Crossing, ...]) -> list[Annotation]:
    """A circle for each crossing, filled where its worst motion has no mark; returns their numbers."""
    from matplotlib.colors import LogNorm, Normalize

    heights = np.array([row.worst.height for row in rows])
    known = heights[np.isfinite(heights)]
    factor, unit = scale(known, "m")
    ratio = known.max() / known.min() if known.size and known.min() > 0.0 else 1.0
    norm = (LogNorm if ratio > LOG_FROM else Normalize)(*_limits(known * factor, ratio > LOG_FROM))
    speeds = [row.speed_rpm for row in rows]
    hertz = [row.engine_order * row.speed_rpm / 60.0 for row in rows]
    points = axes.scatter(
        speeds,
        hertz,
        c=heights * factor,
        cmap=COLOURS,
        norm=norm,
        s=70.0,
        edgecolor="0.1",
        zorder=4.0,
        label="_crossings",
    )
    marked = [k for k, row in enumerate(rows) if row.worst.worst_unresolved or height_mark(row.worst)]
    axes.scatter([speeds[k] for k in marked], [hertz[k] for k in marked], s=16.0, color="white", zorder=4.1)
    bar = axes.figure.colorbar(points, ax=axes)
    if ratio > LOG_FROM:
        plain_log_labels(bar.ax.yaxis)
    bar.set_label(f"worst motion [{unit}]")
    look: dict[str, Any] = {"xytext": (7, 6), "fontsize": 8, "textcoords": "offset points", "zorder": 5.0}
    look |= {"bbox": {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}}
    return [
        axes.annotate(str(k), place, arrowprops=dict(TO_POINT), **look)
        for k, place in enumerate(zip(speeds, hertz, strict=True), start=1)
    ]


def _limits(values: Any, logarithmic: bool) -> tuple[float, float]:
    """Ends of the colours."""
    if not values.size:
        return 0.0, 1.0
    high = float(values.max())
    return (float(values.min()), high) if logarithmic else (0.0, high or 1.0)
