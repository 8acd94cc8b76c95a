"""Response curves of a sweep with their linear limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.curve_line import DASHES, KINDS, draw_line
from pipeline.figures.data import Array, PlottedCurve
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

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKS = {"branch point": "D", "Neimark-Sacker": "s", "period doubling": "^"}
SAME_HEIGHT = 1e-3  # relative difference of a worst motion and a peak that are one point of the figure
_DEPTH = 0.15  # lower end of a logarithmic axis over the lowest peak


def response_figure(curves: Sequence[PlottedCurve], limits: Sequence[Limit], title: str) -> Figure:
    """Amplitude over frequency: a line for each curve, dashed where unstable, with a circle on its peak.

    Long dashes: unstable against another nodal diameter.

    A pale band shows the amplitudes that residual tractions allow, where asked for. A star marks the worst motion of
    a curve where that is not its peak. Detached branches are thin lines of the same colour; bifurcations other than
    folds have marks (`MARKS`).
    """
    figure, axes = subplots(size=(8.4, 4.8))
    factor, unit = scale(np.concatenate([curve.amplitude_m for curve in curves]), "m")
    colours = ordered_colours(len(curves))
    for curve, colour in zip(curves, colours, strict=True):
        _draw_curve(axes, curve, colour, factor)
    _explain_dashes(axes, curves)
    _draw_residual_bands(axes, curves, colours, factor)
    _mark_bifurcations(axes, curves, colours, factor)
    mark_worst(axes, curves, colours, factor)
    _draw_limits(axes, limits, colours, factor)
    _set_range(axes, curves, limits, factor)
    write_heading(axes, title)
    axes.set(xlabel="excitation frequency [Hz]", ylabel=f"largest displacement over a period [{unit}]")
    if len(curves) > 1 or limits or axes.get_legend_handles_labels()[0]:
        columns = 1 if len(curves) <= 16 else 2
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9, ncols=columns)
    return figure


def _draw_curve(axes: Axes, curve: PlottedCurve, colour: Any, factor: float) -> None:
    height, pattern = curve.amplitude_m * factor, curve.nodal_diameter
    draw_line(axes, curve.frequency_hz, height, curve.stable, curve.label, pattern, color=colour)
    for branch in curve.branches:
        heights = branch.amplitude_m * factor
        look = {"color": colour, "linewidth": 0.8}
        draw_line(axes, branch.frequency_hz, heights, branch.stable, None, branch.nodal_diameter, **look)
    frequency, top = curve.peak
    axes.plot(frequency, top * factor, "o", color=colour, markersize=5, markeredgecolor="white", zorder=4)


def _explain_dashes(axes: Axes, curves: Sequence[PlottedCurve]) -> None:
    """Entries in the legend for both kinds of dashes, where perturbations of other nodal diameters grow."""
    lines = [(curve.stable, curve.nodal_diameter) for curve in curves]
    lines += [(branch.stable, branch.nodal_diameter) for curve in curves for branch in curve.branches]
    if any((~stable & (nodal_diameter > 0)).any() for stable, nodal_diameter in lines):
        for kind in KINDS[1:]:
            axes.plot([], [], color="0.4", linestyle=DASHES[kind], label=kind)


def _draw_residual_bands(axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], factor: float) -> None:
    """Bands of the amplitudes that residual tractions allow, with bars at the lowest and the highest peak."""
    label: str | None = "residual tractions"
    for curve, colour in zip(curves, colours, strict=True):
        if curve.residual is None:
            continue
        band, look = curve.residual, {"color": colour, "linewidth": 0.0, "alpha": 0.25, "zorder": 1.2}
        axes.fill_between(curve.frequency_hz, band.lowest * factor, band.highest * factor, label=label, **look)
        frequency, height = np.transpose(band.peaks)
        axes.plot(frequency, height * factor, "_", color=colour, markersize=9, zorder=4)
        label = None


def _mark_bifurcations(axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], factor: float) -> None:
    """Marks of bifurcations other than folds, with one entry for each kind in the legend."""
    for kind, marker in MARKS.items():
        label: str | None = kind
        for curve, colour in zip(curves, colours, strict=True):
            places = [item for item in curve.bifurcations if item["kind"] == kind]
            if places:
                x = [item["frequency_hz"] for item in places]
                y = [item["amplitude_m"] * factor for item in places]
                axes.plot(x, y, marker, color=colour, markersize=5, markerfacecolor="white", zorder=4, label=label)
                label = None


def mark_worst(axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], factor: float) -> None:
    """Stars at the worst motions that are not the peaks of their main branches, with one entry in the legend."""
    label: str | None = "worst motion"
    for curve, colour in zip(curves, colours, strict=True):
        frequency, height = curve.worst
        if np.isfinite(height) and not np.isclose(height, curve.peak[1], rtol=SAME_HEIGHT):
            look: dict[str, Any] = {"markersize": 11, "markeredgecolor": "0.1", "markeredgewidth": 0.6, "zorder": 5}
            axes.plot(frequency, height * factor, "*", color=colour, label=label, clip_on=False, **look)
            label = None


def _draw_limits(axes: Axes, limits: Sequence[Limit], colours: Sequence[Any], factor: float) -> None:
    """Linear limits: black where there is one of a kind, otherwise pale in the colours of their curves."""
    for kind, style in (("free", (0, (1, 1.2))), ("stuck", (0, (4, 1.5, 1, 1.5)))):
        chosen = [limit for limit in limits if limit.kind == kind]
        for number, limit in enumerate(chosen):
            alone = len(chosen) == 1
            axes.plot(
                limit.frequency_hz,
                limit.amplitude_m * factor,
                color=LIMIT_COLOUR if alone else colours[limit.curves[0]],
                linestyle=style,
                linewidth=1.0 if alone else 0.8,
                alpha=1.0 if alone else 0.45,
                label=f"linear, {kind}" if number == 0 else None,
                zorder=3 if alone else 1.5,
            )


def _set_range(axes: Axes, curves: Sequence[PlottedCurve], limits: Sequence[Limit], factor: float) -> None:
    low = min(curve.scene.response.frequency[0] for curve in curves)
    high = max(curve.scene.response.frequency[1] for curve in curves)
    axes.set_xlim(low, high)
    tops = [height for curve in curves for height in (curve.peak[1], curve.worst[1])]
    tops += [curve.residual.peaks[1][1] for curve in curves if curve.residual is not None]
    peaks = np.array(tops + [limit.peak[1] for limit in limits])
    peaks = peaks[np.isfinite(peaks) & (peaks > 0.0)] * factor
    if peaks.size == 0:
        return
    if peaks.max() > LOG_FROM * peaks.min():
        axes.set_yscale("log")
        plain_log_labels(axes.yaxis)
        axes.set_ylim(_floor(curves, factor, peaks), 1.6 * peaks.max())
    else:
        axes.set_ylim(0.0, 1.06 * peaks.max())


def _floor(curves: Sequence[PlottedCurve], factor: float, peaks: Array) -> float:
    lines = [curve.amplitude_m for curve in curves] + [
        branch.amplitude_m for curve in curves for branch in curve.branches
    ]
    lowest = min(float(np.min(line)) for line in lines) * factor
    return max(_DEPTH * float(peaks.min()), 0.7 * lowest)
