"""A response curve on given axes, drawn as in the figures of a run, with its marks and what the legend says of them.

Marks are open, so that a curve shows through.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

from pipeline.figures.data import PlottedCurve, is_isolated
from pipeline.results.worst import peak_is_unstable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nonlinear.response_curve import Peak
    from pipeline.stages.curve.curve_summary import CurveSummary


StabilityKind = Literal["stable", "unstable", "unstable, other nodal diameter"]
KINDS: tuple[StabilityKind, ...] = ("stable", "unstable", "unstable, other nodal diameter")
DASHES: dict[StabilityKind, Any] = {KINDS[0]: "-", KINDS[1]: (0, (3, 1.5)), KINDS[2]: (0, (8, 1.5))}
UNITS = {"m": 1.0, "mm": 1e3, "µm": 1e6, "um": 1e6, "nm": 1e9}


class _Curve(Protocol):
    """The common part of `ResponseCurve` and `Curve`."""

    @property
    def frequency_hz(self) -> np.ndarray: ...
    @property
    def amplitude_m(self) -> np.ndarray: ...
    @property
    def stable(self) -> np.ndarray: ...
    @property
    def growth_nodal_diameter(self) -> np.ndarray: ...
    @property
    def peak(self) -> Peak | None: ...


def plot_curve(axes: Axes, curve: _Curve, *, label: str | None = None, unit: str = "µm", **look: Any) -> None:
    """Draw a response curve: amplitude over frequency (Hz), dashed where unstable, a dot on the peak.

    Long dashes: the perturbation that grows has another nodal diameter than the wave.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to draw on.
    curve : ResponseCurve or Curve
        Result of `forced_response`, or a curve of `read_results`.
    label : str, optional
        Name in the legend.
    unit : str
        Unit of the amplitude: "m", "mm", "µm" or "nm".
    look : Any
        Further keywords of `axes.plot`, such as `color`.

    Raises
    ------
    ValueError
        The unit is none of these.

    Examples
    --------
    With the names of the example of `Results`:

    >>> from matplotlib.figure import Figure
    >>> from pipeline import plot_curve
    >>> axes = Figure().subplots()
    >>> plot_curve(axes, results.curves[0], unit="m")
    >>> round(float(max(line.get_ydata().max() for line in axes.lines)), 2)
    1.38
    """
    if unit not in UNITS:
        raise ValueError(f"unit = {unit!r}: must be one of {', '.join(UNITS)}")
    line = draw_line(axes, curve, curve.amplitude_m * UNITS[unit], label, **look)
    if curve.peak is not None:
        colour = look.get("color") or (line.get_color() if line else None)
        height = curve.peak.amplitude_m * UNITS[unit]
        axes.plot(curve.peak.frequency_hz, height, "o", color=colour, markersize=5, markeredgecolor="white", zorder=4)


def draw_line(axes: Axes, curve: _Curve, height: np.ndarray, label: str | None = None, **look: Any) -> Any:
    """Draw heights (P,) over the frequency of a curve, dashed where it is unstable; its first segment, or None.

    Long dashes where the perturbation that grows has another nodal diameter than the wave, k > 0.
    """
    first = None
    for start, stop, kind in stability_segments(curve.stable, curve.growth_nodal_diameter):
        part = slice(start, stop)
        name = label if label is None or kind == KINDS[0] else f"{label}, {kind}"
        (line,) = axes.plot(
            curve.frequency_hz[part], height[part], linestyle=DASHES[kind], label=_unlisted(name), **look
        )
        first = first or line
        look = {"color": first.get_color()} | look
    if first is not None and label and not label.startswith("_"):
        axes.plot([], [], label=label, **look)  # a full line in the legend
    return first


def _unlisted(name: str | None) -> str | None:
    """A label that the table of the figure has, but not the legend."""
    return name if name is None or name.startswith("_") else f"_{name}"


def stability_segments(
    stable: np.ndarray, nodal_diameter: np.ndarray | None = None
) -> list[tuple[int, int, StabilityKind]]:
    """Segments (start, stop, kind) of equal stability; unstable ones include the adjacent points of other kinds."""
    if len(stable) == 0:
        return []
    kind = np.where(stable, 0, 1)
    if nodal_diameter is not None:
        kind[~stable & (nodal_diameter > 0)] = 2
    edges = [0, *(np.flatnonzero(np.diff(kind)) + 1).tolist(), len(stable)]
    overlap = [0 if stable[start] else 1 for start in edges[:-1]]
    return [
        (max(start - more, 0), min(stop + more, len(stable)), KINDS[kind[start]])
        for (start, stop), more in zip(pairwise(edges), overlap, strict=True)
    ]


MARKS = {"branch point": "D", "Neimark-Sacker": "s", "period doubling": "^"}
END_OF_RANGE = "end of the range, no peak"
MARK_OF_END = 6  # of matplotlib: an arrow head up, its tip on the point
PEAK, UNSTABLE_PEAK = "peak", "unstable peak"
PEAKS: dict[str, Any] = {PEAK: "o", UNSTABLE_PEAK: "X", END_OF_RANGE: MARK_OF_END}
SAME_HEIGHT = 1e-3  # relative difference of a worst motion and a peak that are one point of the figure
FOLLOWED = "worst motion by time integration"
THIN = 0.8  # width of a detached branch
OPEN: dict[str, Any] = {"linestyle": "none", "markerfacecolor": "none", "zorder": 4}


def mark_peak(axes: Axes, facts: CurveSummary, factor: float, colour: Any, name: str = "") -> None:
    """A small circle on the peak, a cross where it is unstable, an arrow head up at an end of the range."""
    look = OPEN | {"markersize": 5, "markeredgewidth": 1.0, "clip_on": not facts.peak_at_end}
    what = peak_kind(facts)
    height = facts.peak_amplitude_m * factor
    axes.plot(facts.peak_frequency_hz, height, PEAKS[what], color=colour, label=f"_{name}, {what}", **look)


def peak_kind(facts: CurveSummary) -> str:
    """What the highest point of a main branch is, a key of `PEAKS`."""
    return END_OF_RANGE if facts.peak_at_end else UNSTABLE_PEAK if peak_is_unstable(facts) else PEAK


def mark_bifurcations(axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], factor: float) -> None:
    """Marks of bifurcations other than folds, with one entry for each kind in the legend."""
    for kind, marker in MARKS.items():
        look: dict[str, Any] = {"markersize": 4, "markeredgewidth": 0.8, **OPEN}
        found = False
        for curve, colour in zip(curves, colours, strict=True):
            places = [item for item in curve.response.bifurcations if item.kind.value == kind]
            if places:
                x = [item.frequency_hz for item in places]
                y = [item.amplitude_m * factor for item in places]
                axes.plot(x, y, marker, color=colour, label=f"_{curve.label}, {kind}", **look)
                found = True
        if found:
            axes.plot([], [], marker, label=kind, color="0.35", **look)


class CurveInNumbers(Protocol):
    """What marks of worst motions need of a curve: its numbers and its name."""

    @property
    def facts(self) -> CurveSummary: ...
    @property
    def label(self) -> str: ...


def mark_worst(axes: Axes, curves: Sequence[CurveInNumbers], colours: Sequence[Any], factor: float) -> None:
    """Stars at the worst motions that are not the peaks of their main branches, with one entry in the legend."""
    look = OPEN | {"markersize": 10, "markeredgewidth": 1.1, "zorder": 5, "clip_on": False}
    found = False
    for curve, colour in zip(curves, colours, strict=True):
        frequency, height = curve.facts.worst_frequency_hz, curve.facts.worst_amplitude_m
        if np.isfinite(height) and not np.isclose(height, curve.facts.peak_amplitude_m, rtol=SAME_HEIGHT):
            axes.plot(frequency, height * factor, "*", color=colour, label=f"_{curve.label}, worst motion", **look)
            found = True
    if found:
        look["clip_on"] = True  # the layout would make room for a mark without a place
        axes.plot([], [], "*", label="worst motion", color="0.35", **look)


def mark_followed(axes: Axes, curves: Sequence[CurveInNumbers], colours: Sequence[Any], factor: float) -> None:
    """Worst motions on no branch over the frequencies at which they were integrated in time."""
    look: dict[str, Any] = {"linewidth": 0.6, "marker": ".", "markersize": 3.5, "zorder": 3}
    chosen = [pair for pair in zip(curves, colours, strict=True) if pair[0].facts.worst_followed_hz]
    for curve, colour in chosen:
        heights = np.array(curve.facts.worst_followed_m) * factor
        axes.plot(curve.facts.worst_followed_hz, heights, color=colour, label=f"_{curve.label}, {FOLLOWED}", **look)
    if chosen:
        axes.plot([], [], color="0.35", label=FOLLOWED, **look)


def explain_lines(axes: Axes, curves: Sequence[PlottedCurve]) -> None:
    """Entries in the legend for what is drawn: unstable parts, isolated and detached branches, circles on peaks."""
    detached = [branch for curve in curves for branch in curve.response.detached]
    parts = [(each.stable, each.growth_nodal_diameter) for each in (*(curve.response for curve in curves), *detached)]
    grey: dict[str, Any] = {"color": "0.35"}
    for kind, shown in (
        (KINDS[1], any((~stable & (diameter == 0)).any() for stable, diameter in parts)),
        (KINDS[2], any((~stable & (diameter > 0)).any() for stable, diameter in parts)),
    ):
        if shown:
            axes.plot([], [], linestyle=DASHES[kind], label=kind, **grey)
    closed = [is_isolated(branch) for branch in detached]
    for name, shown in (("isolated branch", any(closed)), ("detached branch", not all(closed))):
        if shown:
            axes.plot([], [], linewidth=THIN, label=f"{name} (thin)", **grey)
    there = {peak_kind(curve.facts) for curve in curves}
    for name, mark in PEAKS.items():
        if name in there:
            axes.plot([], [], mark, markersize=5, label=name, **OPEN, **grey)


def grey_mark(handle: Any) -> Any:
    """An entry of the legend; one of a mark is grey, because it stands for all curves."""
    if getattr(handle, "get_linestyle", lambda: "-")() != "None":
        return handle
    from matplotlib.lines import Line2D

    look = {"markersize": handle.get_markersize(), "markeredgewidth": handle.get_markeredgewidth()}
    return Line2D([], [], marker=handle.get_marker(), color="0.35", **OPEN, **look)
