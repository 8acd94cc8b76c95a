"""A response curve on given axes, drawn as in the figures of a run."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nonlinear import Peak

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
    line = draw_line(
        axes,
        curve.frequency_hz,
        curve.amplitude_m * UNITS[unit],
        curve.stable,
        label,
        curve.growth_nodal_diameter,
        **look,
    )
    if curve.peak is not None:
        colour = look.get("color") or (line.get_color() if line else None)
        height = curve.peak.amplitude_m * UNITS[unit]
        axes.plot(curve.peak.frequency_hz, height, "o", color=colour, markersize=5, markeredgecolor="white", zorder=4)


def draw_line(
    axes: Axes,
    frequency_hz: np.ndarray,
    height: np.ndarray,
    stable: np.ndarray,
    label: str | None,
    nodal_diameter: np.ndarray | None = None,
    **look: Any,
) -> Any:
    """Draw a line (P,), dashed where it is not `stable` (P,); returns its first segment, None without points.

    Long dashes where the perturbation that grows has another `nodal_diameter` (P,) than the wave, k > 0.
    """
    first = None
    for start, stop, kind in stability_segments(stable, nodal_diameter):
        part = slice(start, stop)
        (line,) = axes.plot(frequency_hz[part], height[part], linestyle=DASHES[kind], label=label, **look)
        first, label = first or line, None
        look = {"color": first.get_color()} | look
    return first


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
