"""Curves and peaks of results on the axes of a script or notebook: what `Results.plot` and its like draw."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.errors import input_error
from pipeline.figures.curve_line import UNITS, plot_curve
from pipeline.figures.data import SweepKey, curve_colours, sweep_keys
from pipeline.figures.style import CURVES_LOG_FROM, set_height_axis
from pipeline.scene.labels import value_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from pipeline.results.curves import Curve

NAMED = 12  # curves up to which the legend names each


def own_axes(axes: Axes | None) -> Axes:
    """The axes given, or new ones of pyplot, which a notebook shows."""
    if axes is not None:
        return axes
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]


def plot_curves(curves: Sequence[Curve], axes: Axes | None, unit: str, look: dict[str, Any]) -> Axes:
    """Response curves with the colours of a run's figures, their swept values in the legend."""
    axes = own_axes(axes)
    empty = not axes.has_data()
    for curve, colour in zip(curves, curve_colours(curves), strict=True):
        label = ", ".join(value_label(key, value) for key, value in curve.parameters.items())
        plot_curve(axes, curve, unit=unit, **({"color": colour, "label": label or None} | look))
    motions = [motion for curve in curves for motion in (curve.peak, curve.worst) if motion is not None]
    if empty and motions:
        set_height_axis(axes, UNITS[unit] * np.array([each.amplitude_m for each in motions]), CURVES_LOG_FROM)
    axes.set(xlabel="excitation frequency [Hz]", ylabel=f"largest displacement over a period [{unit}]")
    if 1 < len(axes.get_legend_handles_labels()[0]) <= NAMED:
        axes.legend(fontsize=8)
    return axes


def plot_peaks(curves: Sequence[Curve], over: str | None, axes: Axes | None, unit: str) -> Axes:
    """Peaks (circles) and worst motions (stars) over a swept key; nothing is drawn between the values computed."""
    key = _abscissa(curves, over)
    axes = own_axes(axes)
    x = np.array([key.position(curve.parameters[key.name]) for curve in curves])
    for label, marker, motions in (
        ("peak of the main branch", "o", [curve.peak for curve in curves]),
        ("worst motion", "*", [curve.worst for curve in curves]),
    ):
        heights = [np.nan if motion is None else UNITS[unit] * motion.amplitude_m for motion in motions]
        axes.plot(x, heights, marker, fillstyle="none", markersize=5 if marker == "o" else 9, label=label)
    if not key.numeric:
        axes.set_xticks(range(len(key.values)), [key.text(value) for value in key.values])
    axes.set(xlabel=key.axis, ylabel=f"largest displacement over a period [{unit}]")
    axes.legend(fontsize=8)
    return axes


def _abscissa(curves: Sequence[Curve], over: str | None) -> SweepKey:
    """The swept key asked for, or that with the most values."""
    keys = {key.name: key for key in sweep_keys(curves)}
    if not keys or (over is not None and over not in keys):
        allowed = ", ".join(keys) if keys else "nothing: the run sweeps no key"
        raise input_error("over", "", repr(over), allowed)
    return keys[over] if over is not None else next(iter(keys.values()))
