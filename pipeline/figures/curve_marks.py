"""Marks on response curves, and what the legend says of marks and lines; open ones, so that a curve shows through."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.curve_line import DASHES, KINDS
from pipeline.figures.data import PlottedCurve

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARKS = {"branch point": "D", "Neimark-Sacker": "s", "period doubling": "^"}
END_OF_RANGE = "end of the range, no peak"
MARK_OF_END = 6  # of matplotlib: an arrow head up, its tip on the point
SAME_HEIGHT = 1e-3  # relative difference of a worst motion and a peak that are one point of the figure
THIN = 0.8  # width of a detached branch
OPEN: dict[str, Any] = {"linestyle": "none", "markerfacecolor": "none", "zorder": 4}


def mark_peak(axes: Axes, frequency_hz: float, height: float, colour: Any, at_end: bool = False) -> None:
    """A small circle on the peak; an arrow head up where the highest point lies at an end of the range."""
    look = OPEN | {"markersize": 5, "markeredgewidth": 1.0, "clip_on": not at_end}
    axes.plot(frequency_hz, height, MARK_OF_END if at_end else "o", color=colour, **look)


def mark_bifurcations(axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], factor: float) -> None:
    """Marks of bifurcations other than folds, with one entry for each kind in the legend."""
    for kind, marker in MARKS.items():
        label: str | None = kind
        for curve, colour in zip(curves, colours, strict=True):
            places = [item for item in curve.bifurcations if item["kind"] == kind]
            if places:
                x = [item["frequency_hz"] for item in places]
                y = [item["amplitude_m"] * factor for item in places]
                axes.plot(x, y, marker, color=colour, markersize=4, markeredgewidth=0.8, label=label, **OPEN)
                label = None


def mark_worst(axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], factor: float) -> None:
    """Stars at the worst motions that are not the peaks of their main branches, with one entry in the legend."""
    label: str | None = "worst motion"
    for curve, colour in zip(curves, colours, strict=True):
        frequency, height = curve.worst
        if np.isfinite(height) and not np.isclose(height, curve.peak[1], rtol=SAME_HEIGHT):
            look = OPEN | {"markersize": 10, "markeredgewidth": 1.1, "zorder": 5, "clip_on": False}
            axes.plot(frequency, height * factor, "*", color=colour, label=label, **look)
            label = None


def explain_lines(axes: Axes, curves: Sequence[PlottedCurve]) -> None:
    """Entries in the legend for what is drawn: unstable parts, isolated and detached branches, circles on peaks."""
    parts = [(curve.stable, curve.nodal_diameter) for curve in curves]
    parts += [(branch.stable, branch.nodal_diameter) for curve in curves for branch in curve.branches]
    grey: dict[str, Any] = {"color": "0.35"}
    for kind, shown in (
        (KINDS[1], any((~stable & (diameter == 0)).any() for stable, diameter in parts)),
        (KINDS[2], any((~stable & (diameter > 0)).any() for stable, diameter in parts)),
    ):
        if shown:
            axes.plot([], [], linestyle=DASHES[kind], label=kind, **grey)
    closed = [branch.closed for curve in curves for branch in curve.branches]
    for name, shown in (("isolated branch", any(closed)), ("detached branch", not all(closed))):
        if shown:
            axes.plot([], [], linewidth=THIN, label=f"{name} (thin)", **grey)
    if any(not curve.peak_at_end for curve in curves):
        axes.plot([], [], "o", markersize=5, label="peak", **OPEN, **grey)
    if any(curve.peak_at_end for curve in curves):
        axes.plot([], [], MARK_OF_END, markersize=5, label=END_OF_RANGE, **OPEN, **grey)


def grey_mark(handle: Any) -> Any:
    """An entry of the legend; one of a mark is grey, because it stands for all curves."""
    if getattr(handle, "get_linestyle", lambda: "-")() != "None":
        return handle
    from matplotlib.lines import Line2D

    look = {"markersize": handle.get_markersize(), "markeredgewidth": handle.get_markeredgewidth()}
    return Line2D([], [], marker=handle.get_marker(), color="0.35", **OPEN, **look)
