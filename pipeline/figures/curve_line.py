"""One response curve on somebody's own axes, drawn as in the figures of a run."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nonlinear import Peak

UNITS = {"m": 1.0, "mm": 1e3, "µm": 1e6, "um": 1e6, "nm": 1e9}


class _Curve(Protocol):
    """What is drawn: a `ResponseCurve`, or a `Curve` of a run."""

    @property
    def frequency_hz(self) -> np.ndarray: ...
    @property
    def amplitude_m(self) -> np.ndarray: ...
    @property
    def stable(self) -> np.ndarray: ...
    @property
    def peak(self) -> Peak | None: ...


def plot_curve(axes: Axes, curve: _Curve, *, label: str | None = None, unit: str = "µm", **look: Any) -> None:
    """Draw a curve on matplotlib axes: dashed where it is unstable, a dot on its peak.

    Parameters
    ----------
    axes : where to draw; frequencies in Hz along x.
    curve : of `forced_response` or of a run.
    label : of the legend.
    unit : of the amplitude: "m", "mm", "µm" or "nm".
    look : what `axes.plot` takes besides, `color` above all.

    Raises
    ------
    ValueError : an unknown unit.
    """
    if unit not in UNITS:
        raise ValueError(f"unit = {unit!r}: must be one of {', '.join(UNITS)}")
    line = draw_line(axes, curve.frequency_hz, curve.amplitude_m * UNITS[unit], curve.stable, label, **look)
    if curve.peak is not None:
        colour = look.get("color") or (line.get_color() if line else None)
        height = curve.peak.amplitude_m * UNITS[unit]
        axes.plot(curve.peak.frequency_hz, height, "o", color=colour, markersize=5, markeredgecolor="white", zorder=4)


def draw_line(
    axes: Axes, frequency_hz: np.ndarray, height: np.ndarray, stable: np.ndarray, label: str | None, **look: Any
) -> Any:
    """The line (P,), dashed where it is not `stable` (P,); the first of its pieces, None without points."""
    first = None
    for start, stop, is_stable in stretches(stable):
        part = slice(start, stop)
        style = "-" if is_stable else (0, (3, 1.5))
        (line,) = axes.plot(frequency_hz[part], height[part], linestyle=style, label=label, **look)
        first, label = first or line, None
        look = {"color": first.get_color()} | look
    return first


def stretches(stable: np.ndarray) -> list[tuple[int, int, bool]]:
    """(start, stop, stable) of the parts of equal stability; unstable ones reach to the stable points beside them."""
    if len(stable) == 0:
        return []
    changes = np.flatnonzero(np.diff(stable.astype(int))) + 1
    edges = [0, *changes.tolist(), len(stable)]
    reach = [0 if stable[start] else 1 for start in edges[:-1]]
    return [
        (max(start - more, 0), min(stop + more, len(stable)), bool(stable[start]))
        for (start, stop), more in zip(pairwise(edges), reach, strict=True)
    ]
