"""Nonlinear modes: frequency, damping ratio and resonant force over the amplitude, with the traced peaks.

The lines are broken at internal resonances, and marked where the contact state changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.style import ordered_colours, plain_log_labels, scale, subplots, write_heading
from pipeline.studies.backbone.result import BackboneResult, CurveBackbones, ModeBackbone

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)))  # by the number of the mode


def pieces(mode: ModeBackbone) -> Iterator[slice]:
    """Parts of a mode between internal resonances."""
    edges = [0, *(np.flatnonzero(np.diff(mode.piece)) + 1).tolist(), len(mode.piece)]
    for start, stop in pairwise(edges):
        if stop > start:
            yield slice(start, stop)


def broken(mode: ModeBackbone, values: np.ndarray) -> np.ndarray:
    """Values (P,) with NaN between the pieces, (P + pieces - 1,): one line that is not joined across them."""
    parts: list[np.ndarray] = []
    for part in pieces(mode):
        parts += [np.array([np.nan]), values[part]] if parts else [values[part]]
    return np.concatenate(parts) if parts else np.empty(0)


def mode_numbers(result: BackboneResult) -> list[tuple[int, int]]:
    """Number and nodal diameter of every mode with points, in their order; -1 stands for the engine order."""
    found = [own_number(curve, mode) for curve in result.curves for mode in curve.modes if len(mode.amplitude_m)]
    return list(dict.fromkeys(found))


def own_number(curve: CurveBackbones, mode: ModeBackbone) -> tuple[int, int]:
    """Number and nodal diameter of a mode; -1 for the engine order of the curve."""
    return mode.number, -1 if mode.nodal_diameter == curve.engine_order else mode.nodal_diameter


def mode_name(number: int, nodal_diameter: int) -> str:
    """`mode 1`, `mode 1, nodal diameter 3`."""
    return f"mode {number}" + ("" if nodal_diameter < 0 else f", nodal diameter {nodal_diameter}")


def contact_changes(mode: ModeBackbone) -> Iterator[tuple[str, int]]:
    """Last points before the first slip and before the first lift-off, where the mode starts in another state."""
    found = {}
    for kind, mask in (("first slip", mode.slipping > 0), ("first lift-off", mode.separating > 0)):
        if len(mask) and not mask[0] and mask.any():
            found[int(np.argmax(mask)) - 1] = kind  # where both begin together: the lift-off
    for at, kind in found.items():
        yield kind, at


MANY_DECADES = 200.0
MARKS = {"first slip": "|", "first lift-off": "^"}
COLUMNS = (
    ("frequency [Hz]", "frequency_hz"),
    ("damping ratio", "damping_ratio"),
    ("resonant force [N]", "force_n"),
)


def backbone_figure(result: BackboneResult, title: str, colours: Sequence[Any] = ()) -> Figure:
    """Amplitude over frequency, damping ratio and resonant force: a row for each mode, a colour for each curve.

    Thin vertical lines are the linear limits, free and stuck; circles are traced peaks, crosses resonances under the
    force of the curve. The three columns share the amplitude: one motion lies at one height. `colours` are those of
    all curves of the run.
    """
    numbers = mode_numbers(result)
    if not numbers:
        return _empty(title)
    size = (10.6, 0.9 + 3.4 * len(numbers))
    figure, places = subplots(len(numbers), 3, size=size, sharey="row", squeeze=False)
    shades = dict(enumerate(colours or ordered_colours(1 + max(curve.curve for curve in result.curves))))
    shown = [mode for curve in result.curves for mode in curve.modes if len(mode.amplitude_m)]
    factor, unit = scale(np.concatenate([mode.amplitude_m for mode in shown]), "m")
    for row, (number, diameter) in zip(places, numbers, strict=True):
        of_row = [
            (curve, mode)
            for curve in result.curves
            for mode in curve.modes
            if own_number(curve, mode) == (number, diameter) and len(mode.amplitude_m)
        ]
        for axes, (label, name) in zip(row, COLUMNS, strict=True):
            _draw_column(axes, of_row, name, shades, factor)
            axes.set_xlabel(label)
        _draw_linear(row[0], of_row, shades)
        _draw_peaks(row, of_row, shades, factor)
        _scale_axes(row, of_row, factor)
        row[0].set_ylabel(f"{mode_name(number, diameter)}: amplitude [{unit}]")
    _legend(figure, places[0], result.curves)
    write_heading(figure, f"{title}\nnonlinear modes, {result.definition}")
    return figure


def _empty(title: str) -> Figure:
    """A figure that says that there is no mode."""
    figure, axes = subplots(size=(6.0, 2.0))
    axes.axis("off")
    axes.text(0.5, 0.5, "no nonlinear mode could be computed", ha="center", va="center")
    write_heading(figure, title)
    return figure


Row = Sequence[tuple[CurveBackbones, ModeBackbone]]


def _draw_column(axes: Axes, row: Row, name: str, colours: dict[int, Any], factor: float) -> None:
    """The modes of a row over one quantity."""
    for curve, mode in row:
        values, colour = getattr(mode, name), colours[curve.curve]
        axes.plot(broken(mode, values), broken(mode, mode.amplitude_m) * factor, color=colour, label=curve.label)
        for kind, at in contact_changes(mode):
            axes.plot(values[at], mode.amplitude_m[at] * factor, MARKS[kind], color=colour, markersize=6, label=kind)


def _draw_linear(axes: Axes, row: Row, colours: dict[int, Any]) -> None:
    """Linear limits of the frequency."""
    for kind, dash in (("free", DASHES[2]), ("stuck", DASHES[3])):
        values = {round(getattr(mode, f"{kind}_hz"), 6): colours[curve.curve] for curve, mode in row}
        for value, colour in values.items():
            if np.isfinite(value):
                shade = "black" if len(values) == 1 else colour
                axes.axvline(value, color=shade, linestyle=dash, linewidth=0.8, zorder=1.5, label=f"linear, {kind}")


def _draw_peaks(row: Sequence[Axes], modes: Row, colours: dict[int, Any], factor: float) -> None:
    """Resonances under the force of the curve and the traced peaks that belong to them."""
    look: dict[str, Any] = {"linestyle": "none", "zorder": 4}
    for curve, mode in modes:
        colour = colours[curve.curve]
        for each in mode.resonances:
            height, places = each.amplitude_m * factor, (each.frequency_hz, each.damping_ratio, curve.force_n)
            for axes, value in zip(row, places, strict=True):
                axes.plot(value, height, "x", color=colour, markersize=6, label="resonance", **look)
            if each.peak is not None:
                peak = {"color": colour, "markerfacecolor": "none", "markersize": 8, "label": "traced peak", **look}
                row[0].plot(each.peak.frequency_hz, each.peak.amplitude_m * factor, "o", **peak)
                row[2].plot(curve.force_n, each.peak.amplitude_m * factor, "o", **peak)


def _scale_axes(row: Sequence[Axes], modes: Row, factor: float) -> None:
    """Amplitude and force on logarithmic axes, and the damping ratio where it varies by more than ten."""
    values = np.concatenate([mode.damping_ratio for _, mode in modes])
    values = values[values > 0.0]
    row[0].set_yscale("log")
    plain_log_labels(row[0].yaxis)
    log_abscissa(row[2], np.concatenate([mode.force_n for _, mode in modes]))
    if values.size and values.max() > 10.0 * values.min():
        log_abscissa(row[1], values)


def log_abscissa(axes: Axes, values: np.ndarray) -> None:
    """A logarithmic abscissa with plain labels: of decades alone where there are many."""
    from matplotlib.ticker import LogLocator

    axes.set_xscale("log")
    plain_log_labels(axes.xaxis)
    if values.max() > MANY_DECADES * values.min():
        axes.xaxis.set_major_locator(LogLocator(10.0, (1.0,), numticks=20))


def _legend(figure: Figure, row: Sequence[Axes], curves: Sequence[CurveBackbones]) -> None:
    """One entry for each curve and each kind of mark."""
    from pipeline.figures.curve_line import grey_mark

    found: dict[str, Any] = {}
    names = [curve.label for curve in curves]
    for axes in row:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle if label in names else grey_mark(handle))
    order = [*[name for name in names if name in found], *[name for name in found if name not in names]]
    figure.legend([found[name] for name in order], order, loc="outside right center", fontsize=9)
