"""The performance curve of a damper: amplitude per force and frequency over the static closure per force."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.linear_limits import linear_limit
from pipeline.figures.style import (
    DISTINCT,
    LIMIT_COLOUR,
    TO_POINT,
    keep_apart,
    plain_log_labels,
    scale,
    subplots,
    write_heading,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nonlinear.contact.parameters import ContactParameters
    from nonlinear.options import Excitation, SolverOptions
    from nonlinear.peak_curves.performance_curve import PerformanceCurve
    from rom.cyclic.reduced_model import ReducedModel
    from rom.cyclic.sector_modes import RingModes

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
KINDS = "free", "stuck"
_LIMITS = {"free": (0, (1, 1)), "stuck": (0, (6, 1.5, 1, 1.5))}
_MARK: dict[str, Any] = {
    "linestyle": "none",
    "markeredgecolor": "white",
    "markeredgewidth": 0.8,
    "zorder": 6,
    "clip_on": False,
}


def performance_figure(
    curve: PerformanceCurve,
    title: str,
    own: tuple[float, float] | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
) -> Figure:
    """Amplitude per force over interference or preload per force, beside it the frequency; one curve for every force.

    Parameters
    ----------
    curve : PerformanceCurve
        Result of `performance_curve`.
    title : str
        Heading.
    own : (float, float), optional
        Interference, m, or preload, N, and force, N, of a design. Multiples of the force are points too.
    limits : mapping of str to (float, float), optional
        Frequency, Hz, and amplitude per force, m/N, of the linear limits "free" and "stuck": `linear_peaks`.

    Returns
    -------
    matplotlib.figure.Figure
        The figure, not yet saved.

    Examples
    --------
    With the names of the example of `performance_curve`: the points of half, double, ... the force lie on the curve.

    >>> from pipeline import linear_peaks, performance_figure, styled
    >>> limits = linear_peaks(blade, (modal, contact, excitation, options))
    >>> print(f"free: {limits['free'][1]:.4g} m/N at {limits['free'][0]:.4g} Hz")
    free: 50 m/N at 0.1591 Hz
    >>> with styled():
    ...     figure = performance_figure(found, "Slider", own=(2.0, 1.0), limits=limits)
    >>> [text.get_text() for text in figure.axes[0].texts]
    ['0.5 N', '2 N', '4 N']
    """
    figure, (left, right) = subplots(1, 2, size=(10.4, 4.6), sharex=True)
    factor, unit = scale(curve.compliance, "m")
    wide, wide_unit = scale(curve.ratio, "m" if curve.name == "interference" else "N")
    for axes, name, size in ((left, "compliance", factor), (right, "frequency_hz", 1.0)):
        _draw_curve(axes, curve, name, wide, size)
        for kind, (frequency, compliance) in (limits or {}).items():
            look: dict[str, Any] = {"color": LIMIT_COLOUR, "linestyle": _LIMITS[kind], "linewidth": 1.0}
            height = compliance * factor if name == "compliance" else frequency
            axes.axhline(height, label=f"linear, {kind}", **look)
        best = {"compliance": curve.least_compliance * factor, "frequency_hz": curve.best_frequency_hz}
        said = f"optimum, {curve.best_ratio * wide:.4g} {wide_unit}/N"
        axes.plot(curve.best_ratio * wide, best[name], "*", markersize=15, color=DISTINCT[1], label=said, **_MARK)
        if own is not None:
            _draw_forces(axes, curve, own, name, (wide, size))
    _set_axes(left, right, curve, wide, factor)
    closure = "interference v0" if curve.name == "interference" else "preload N0"
    left.set(xlabel=f"{closure} / force [{wide_unit}/N]", ylabel=f"largest displacement / force [{unit}/N]")
    right.set(xlabel=f"{closure} / force [{wide_unit}/N]", ylabel="its frequency [Hz]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    write_heading(figure, title)
    for axes in (left, right):
        keep_apart(axes, axes.texts)
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


def _draw_forces(
    axes: Axes, curve: PerformanceCurve, own: tuple[float, float], name: str, factors: tuple[float, float]
) -> None:
    """The force of the design and multiples of it at its closure; at zero closure all forces are one point."""
    from matplotlib.patheffects import withStroke

    (wide, size), (closure, own_force) = factors, own
    known = np.isfinite(curve.compliance)
    ratios, values = curve.ratio[known], getattr(curve, name)[known] * size

    def height(ratio: float) -> float:
        return float(np.interp(ratio, ratios, values, left=np.nan, right=np.nan))

    ratio = closure / own_force
    label = f"the design: {own_force:.4g} N" if closure else "the design, at any force"
    axes.plot(ratio * wide, height(ratio), "D", markersize=7, color=DISTINCT[3], label=label, **_MARK)
    label = "the design with other forces"
    for multiple in MULTIPLES if closure else ():
        force = multiple * own_force
        place = closure / force
        if not np.isfinite(height(place)):
            continue
        axes.plot(place * wide, height(place), "o", markersize=6, color=DISTINCT[3], label=label, **_MARK)
        look: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8.5, "color": DISTINCT[3], "zorder": 7}
        look["arrowprops"] = TO_POINT
        text = axes.annotate(f"{force:.3g} N", (place * wide, height(place)), (6.0, 5.0), **look)
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
        label = "_the design with other forces"


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


def linear_peaks(
    model: ReducedModel, problem: tuple[RingModes, ContactParameters, Excitation, SolverOptions]
) -> dict[str, tuple[float, float]]:
    """Frequency, Hz, and amplitude per force, m/N, of the highest peak with free and with stuck contacts.

    Parameters
    ----------
    model : rom.ReducedModel
        The reduced model.
    problem : tuple
        Its modes, contact, excitation and options, as the arguments of `forced_response`.

    Returns
    -------
    dict of str to (float, float)
        "free": without contact; "stuck": with all contact springs. For `performance_figure`, see there.

    Examples
    --------
    A mass on a spring, 1 kg and 1 N/m, with a slider of 3 N/m: the stuck frequency is twice the free one.

    >>> import numpy as np
    >>> from nonlinear import ContactParameters, Excitation, SolverOptions
    >>> from pipeline import linear_peaks
    >>> from rom import ReducedModel, modal_model
    >>> one = np.ones(1)
    >>> parts = np.eye(1), np.eye(1), np.eye(3, 1), np.zeros((1, 3)), one, {"tip": one}
    >>> blade = ReducedModel(*parts, n_blades=12)
    >>> modal, wave = modal_model(blade, damping_ratio=0.01), Excitation(engine_order=3, force=1.0)
    >>> values = {"normal_stiffness": 0.0, "tangential_stiffness": 3.0, "friction": 0.5, "preload": 2.0}
    >>> problem = modal, ContactParameters.shared(1, **values), wave, SolverOptions((0.1, 0.4))
    >>> limits = linear_peaks(blade, problem)
    >>> [f"{limits[kind][0]:.3f} Hz" for kind in ("free", "stuck")]
    ['0.159 Hz', '0.318 Hz']
    """
    modal, contact, wave, options = problem
    found = {}
    for kind in KINDS:
        frequency, amplitude = linear_limit(kind, model, (modal, contact, wave), options.frequency_hz)
        top = int(np.argmax(amplitude))
        found[kind] = float(frequency[top]), float(amplitude[top]) / wave.force
    return found
