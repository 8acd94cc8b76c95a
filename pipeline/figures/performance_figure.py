"""The performance curve of a damper: amplitude per force and frequency over the static closure per force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.linear_limits import Limit
from pipeline.figures.style import DISTINCT, LIMIT_COLOUR, plain_log_labels, scale, subplots, write_heading

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nonlinear import PerformanceCurve

MULTIPLES = (0.25, 0.5, 2.0, 4.0)  # of the scene's force, shown as points
NEAR_ZERO = 0.02  # of the largest ratio: an axis of both signs is nearly linear up to there at least
SPREAD = 2.0  # ratio of the ends above which an axis is logarithmic
_LOOKS: dict[str, dict[str, Any]] = {
    "followed": {"color": DISTINCT[0], "linewidth": 2.4},
    "responses": {"color": DISTINCT[4], "linewidth": 2.4},
    "open": {"color": DISTINCT[4], "linewidth": 2.2, "linestyle": (0, (1, 0.8))},
}
_NAMES = {
    "followed": "worst motion",
    "responses": "worst motion, between responses",
    "open": "left open: highest solution",
}
_PEAK: dict[str, Any] = {"color": "0.6", "linewidth": 0.8, "zorder": 1}
_LIMITS = {"free": (0, (1, 1)), "stuck": (0, (6, 1.5, 1, 1.5))}
_MARK: dict[str, Any] = {
    "linestyle": "none",
    "markeredgecolor": "white",
    "markeredgewidth": 0.8,
    "zorder": 6,
    "clip_on": False,
}


@dataclass(frozen=True)
class OperatingPoint:
    """A static closure and a force: a point of the curve.

    Attributes
    ----------
    closure : float
        Interference, m, or preload, N.
    force : float
        Force, N.
    """

    closure: float
    force: float


def performance_figure(
    curve: PerformanceCurve, title: str, own: OperatingPoint | None = None, limits: Sequence[Limit] = ()
) -> Figure:
    """Amplitude per force over interference or preload per force, beside it the frequency; one curve for every force.

    Parameters
    ----------
    curve : PerformanceCurve
        The performance curve.
    title : str
        Title of the scene.
    own : OperatingPoint or None
        That of the scene; multiples of its force at the same closure are points of the curve.
    limits : sequence of Limit
        Linear limits at the force at which the curve was computed.

    Returns
    -------
    Figure
        The figure.
    """
    figure, (left, right) = subplots(1, 2, size=(10.4, 4.6), sharex=True)
    factor, unit = scale(curve.compliance, "m")
    wide, wide_unit = scale(curve.ratio, "m" if curve.name == "interference" else "N")
    for axes, name, size in ((left, "compliance", factor), (right, "frequency_hz", 1.0)):
        _draw_curve(axes, curve, name, wide, size)
        for limit in limits:
            _draw_limit(axes, limit, factor / curve.force if name == "compliance" else None)
        best = {"compliance": curve.least_compliance * factor, "frequency_hz": curve.best_frequency_hz}
        said = f"optimum, {curve.best_ratio * wide:.4g} {wide_unit}/N"
        axes.plot(curve.best_ratio * wide, best[name], "*", markersize=15, color=DISTINCT[1], label=said, **_MARK)
        if own is not None:
            _draw_forces(axes, curve, own, name, (wide, size))
    _set_axes(left, right, curve, wide, factor)
    symbol = "interference v0" if curve.name == "interference" else "preload N0"
    for axes in (left, right):
        axes.set_xlabel(f"{symbol} / force [{wide_unit}/N]")
    left.set_ylabel(f"largest displacement / force [{unit}/N]")
    right.set_ylabel("its frequency [Hz]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    write_heading(figure, title)
    return figure


def _draw_curve(axes: Axes, curve: PerformanceCurve, name: str, wide: float, size: float) -> None:
    """The worst motion by where it comes from, and the followed peaks as thin lines."""
    jumps = np.flatnonzero(np.diff(curve.ratio) == 0.0) + 1
    places = np.insert(curve.ratio * wide, jumps, np.nan)
    heights = np.insert(getattr(curve, name) * size, jumps, np.nan)
    sources = np.insert(curve.source, jumps, "")
    for source, look in _LOOKS.items():
        mask = sources == source
        if mask.any() and (source, name) != ("open", "frequency_hz"):  # the frequency is that of the motion found
            shown = np.where(mask | np.r_[False, mask[:-1]], heights, np.nan)
            axes.plot(places, shown, label=_NAMES[source], **look)
    for number, peak in enumerate(curve.curves):
        values = peak.frequency_hz if name == "frequency_hz" else peak.amplitude_m
        axes.plot(peak.value * wide, values * size, label=None if number else "followed peaks", **_PEAK)


def _draw_limit(axes: Axes, limit: Limit, factor: float | None) -> None:
    frequency, amplitude = limit.peak
    look: dict[str, Any] = {"color": LIMIT_COLOUR, "linestyle": _LIMITS[limit.kind], "linewidth": 1.0}
    axes.axhline(frequency if factor is None else amplitude * factor, label=f"linear, {limit.kind}", **look)


def _draw_forces(
    axes: Axes, curve: PerformanceCurve, own: OperatingPoint, name: str, factors: tuple[float, float]
) -> None:
    """The scene's own force and multiples of it at its closure; at zero closure all forces are one point."""
    from matplotlib.patheffects import withStroke

    wide, size = factors
    known = np.isfinite(curve.compliance)
    ratios, values = curve.ratio[known], getattr(curve, name)[known] * size

    def height(ratio: float) -> float:
        return float(np.interp(ratio, ratios, values, left=np.nan, right=np.nan))

    ratio = own.closure / own.force
    label = f"the scene: {own.force:.4g} N" if own.closure else "the scene, at any force"
    axes.plot(ratio * wide, height(ratio), "D", markersize=7, color=DISTINCT[3], label=label, **_MARK)
    label = "the scene with other forces"
    for multiple in MULTIPLES if own.closure else ():
        force = multiple * own.force
        place = own.closure / force
        if not np.isfinite(height(place)):
            continue
        axes.plot(place * wide, height(place), "o", markersize=6, color=DISTINCT[3], label=label, **_MARK)
        look: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8.5, "color": DISTINCT[3], "zorder": 7}
        rises = height(place) > height(0.98 * place)
        look |= {"ha": "right" if rises else "left", "xytext": (-6.0 if rises else 6.0, 5.0)}
        text = axes.annotate(f"{force:.3g} N", (place * wide, height(place)), **look)
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
        label = "_nolegend_"


def _set_axes(left: Axes, right: Axes, curve: PerformanceCurve, wide: float, factor: float) -> None:
    low, high = curve.ratio[0] * wide, curve.ratio[-1] * wide
    if low > 0.0 and high > SPREAD * low:
        right.set_xscale("log")
        for axes in (left, right):
            plain_log_labels(axes.xaxis)
    elif low < 0.0 < high:
        width = max(abs(curve.best_ratio) * wide, NEAR_ZERO * max(-low, high))
        right.set_xscale("asinh", linear_width=width)  # smooth, so that the axis bends no curve
        ticks = np.outer(10.0 ** np.arange(-9, 10), (1.0, 2.0, 5.0)).ravel()
        ticks = ticks[(ticks > 0.4 * width) & (ticks <= max(-low, high))]
        places = np.r_[-ticks[::-1], 0.0, ticks]
        right.set_xticks(places, [f"{place:g}" for place in places])
        right.set_xticks([], minor=True)
    right.set_xlim(low, high)
    heights = curve.compliance * factor
    if np.nanmax(heights) > SPREAD * np.nanmin(heights):
        left.set_yscale("log")
        plain_log_labels(left.yaxis)
    else:
        left.set_ylim(0.0, 1.1 * float(np.nanmax(heights)))
    for axes in (left, right):
        axes.grid(visible=True, which="major")
