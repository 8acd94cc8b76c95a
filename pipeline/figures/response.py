"""Response curves of a sweep with their linear limits, and the further outputs over the frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.curve_line import (
    THIN,
    draw_line,
    explain_lines,
    grey_mark,
    mark_bifurcations,
    mark_followed,
    mark_peak,
    mark_worst,
)
from pipeline.figures.data import Array, PlottedCurve, SweepKey, groups, panel_keys, residual_band, sweep_keys
from pipeline.figures.linear_limits import Limit
from pipeline.figures.style import (
    BEHIND,
    CURVES_LOG_FROM,
    LIMIT_COLOUR,
    legend_columns,
    scale,
    set_height_axis,
    subplots,
    write_heading,
)
from pipeline.scene.labels import prefixed, value_label
from pipeline.studies.backbone.figure import broken

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pipeline.studies.backbone.result import BackboneResult


MOST_OUTPUTS = 12
MOST_NAMED = 8  # curves with an entry in the legend
STRAIN = 1e6, "µm/m"  # factor and unit
Colours = Mapping[int, Any]  # of the curves of a run, by their numbers


def outputs_figure(curves: Sequence[PlottedCurve], colours: Colours, title: str) -> Figure | None:
    """Largest value over a period of every further output; None where none is recorded."""
    units = {output.name: output.unit for curve in curves for output in curve.scene.output}
    found = dict.fromkeys([*units, *(name for curve in curves for name in curve.outputs[0])])
    names = [name for name in found if any(name in curve.outputs[0] for curve in curves)][:MOST_OUTPUTS]
    if not names:
        return None
    columns = min(len(names), 2)
    rows = -(-len(names) // columns)
    figure, places = subplots(rows, columns, size=(1.6 + 4.2 * columns, 0.9 + 2.8 * rows), sharex=True, squeeze=False)
    for axes in places.flat[len(names) :]:
        axes.remove()
    for axes, name in zip(places.flat, names, strict=False):
        highest = max(float(np.max(curve.outputs[0].get(name, 0.0), initial=0.0)) for curve in curves)
        factor, unit = prefixed(highest, "m") if units.get(name, "m") == "m" else STRAIN
        for curve in curves:
            look: dict[str, Any] = {"color": colours[curve.index]}
            label = curve.label if len(curves) <= MOST_NAMED else f"_{curve.label}"
            for branch, outputs in zip((curve.response, *curve.response.detached), curve.outputs, strict=True):
                if name in outputs:
                    draw_line(axes, branch, outputs[name] * factor, label, **look)
                label, look = f"_{curve.label}, detached branch", look | {"linewidth": THIN}
        axes.set_ylabel(f"{name} [{unit}]")
        axes.set_ylim(0.0, 1.08 * highest * factor or 1.0)
    for axes in places[-1]:
        if axes.figure is not None:
            axes.set_xlabel("excitation frequency [Hz]")
    write_heading(figure, f"{title}: largest values over a period")
    handles, labels = places.flat[0].get_legend_handles_labels()
    if len(curves) > 1 and handles:
        figure.legend(handles, labels, loc="outside lower center", fontsize=9, ncols=2)
    return figure


MOST_LINES = 24  # in one panel
MOST_COLUMNS, LEGEND_ROW = 4, 0.19  # of the legend; inches
WIDTHS = 2.4, 1.1  # points, of the first and the last curve of a panel: those that coincide stay visible
_DEPTH = 0.15  # lower end of a logarithmic axis over the lowest peak


def has_lines(points: Sequence[Any]) -> bool:
    """Whether a figure has room for a line a curve."""
    return len(points) <= MOST_LINES or panel_keys(sweep_keys(points)) is not None


def response_figure(
    curves: Sequence[PlottedCurve],
    limits: Sequence[Limit],
    colours: Colours,
    title: str,
    backbones: BackboneResult | None = None,
    bifurcations: bool = False,
) -> Figure:
    """Amplitude over frequency: a line for each curve, dashed where unstable, with a circle on its peak.

    Where two keys are swept, the colour tells one and the panel the other. Long dashes: unstable against another
    nodal diameter. A pale band shows the amplitudes that residual tractions allow, where asked for. A star marks the
    worst motion of a curve where that is not its peak, dots where it was followed in time. Detached branches are thin
    lines of the same colour; `bifurcations` other than folds have marks (`MARKS`) where asked for. Dark lines are
    nonlinear modes, where they were computed, and crosses their resonances.
    """
    factor, unit = scale(np.concatenate([curve.response.amplitude_m for curve in curves]), "m")
    keys = panel_keys(sweep_keys(curves))
    if keys is None:
        figure, axes = subplots(size=(7.6, 4.6))
        panels = [(axes, "", list(curves))]
        names = {curve.index: curve.label for curve in curves}
    else:
        figure, panels = _panels(curves, keys[1])
        names = {curve.index: value_label(keys[0].name, curve.parameters[keys[0].name]) for curve in curves}
    place = {curve.index: number for number, curve in enumerate(curves)}
    for axes, heading, members in panels:
        of_members = [colours[curve.index] for curve in members]
        _draw_panel(axes, members, of_members, names, factor)
        if bifurcations:
            mark_bifurcations(axes, members, of_members, factor)
        shown = {place[curve.index] for curve in members}
        of_panel = [limit for limit in limits if shown & set(limit.curves)]
        note = ", without the mean" * any(curve.facts.mean for curve in curves)
        _draw_limits(axes, of_panel, [colours[curve.index] for curve in curves], factor, note)
        if backbones is not None:
            _draw_backbones(axes, backbones, {curve.index for curve in members}, factor)
        if heading:
            axes.set_title(heading, fontsize=10)
    _set_range(panels[0][0], curves, limits, factor)
    _write_labels(figure, panels, title, unit)
    return figure


def _panels(
    curves: Sequence[PlottedCurve], key: SweepKey
) -> tuple[Figure, list[tuple[Axes, str, list[PlottedCurve]]]]:
    """A panel for each value of a key: axes, heading and curves."""
    parts = groups(curves, key)
    columns = len(parts) if len(parts) <= 3 else -(-len(parts) // 2)
    rows = -(-len(parts) // columns)
    size = (1.6 + 3.4 * columns, 0.9 + 3.3 * rows)
    figure, places = subplots(rows, columns, size=size, sharex=True, sharey=True, squeeze=False)
    for axes in places.flat[len(parts) :]:
        axes.remove()
    return figure, [
        (axes, value_label(key.name, value), members)
        for axes, (value, members) in zip(places.flat, parts, strict=False)
    ]


def _draw_panel(
    axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], names: dict[int, str], factor: float
) -> None:
    widths = np.linspace(*WIDTHS, len(curves)) if len(curves) > 1 else [1.5]
    for curve, colour, width in zip(curves, colours, widths, strict=True):
        name = names[curve.index]
        draw_line(axes, curve.response, curve.response.amplitude_m * factor, name, color=colour, linewidth=width)
        for branch in curve.response.detached:
            label = f"_{name}, detached branch"
            draw_line(axes, branch, branch.amplitude_m * factor, label, color=colour, linewidth=THIN)
        mark_peak(axes, curve.facts, factor, colour, name)
    explain_lines(axes, curves)
    _draw_residual_bands(axes, curves, colours, factor)
    mark_followed(axes, curves, colours, factor)
    mark_worst(axes, curves, colours, factor)


def _write_labels(figure: Figure, panels: Sequence[tuple[Axes, str, Any]], title: str, unit: str) -> None:
    """Heading, names of the axes, and one legend below with every entry once."""
    found: dict[str, Any] = {}
    for axes, *_ in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, grey_mark(handle))
    ordinate, abscissa = f"largest displacement over a period [{unit}]", "excitation frequency [Hz]"
    if len(panels) == 1:
        axes = panels[0][0]
        write_heading(axes, title)
        axes.set(xlabel=abscissa, ylabel=ordinate)
    else:
        write_heading(figure, title)
        for axes, *_ in panels:  # a label of the figure would lie on the legend
            if axes.get_subplotspec().is_last_row():  # type: ignore[union-attr]
                axes.set_xlabel(abscissa)
        figure.supylabel(ordinate, fontsize=10)
    columns = legend_columns(figure, list(found), MOST_COLUMNS)
    figure.set_figheight(figure.get_figheight() + LEGEND_ROW * -(-len(found) // columns))
    figure.legend(list(found.values()), list(found), loc="outside lower center", fontsize=9, ncols=columns)


def _draw_residual_bands(axes: Axes, curves: Sequence[PlottedCurve], colours: Sequence[Any], factor: float) -> None:
    """Bands of the displacements that residual tractions allow, with bars at the lowest and the highest peak."""
    label: str | None = "residual tractions (mean included)"
    for curve, colour in zip(curves, colours, strict=True):
        bounds, band = curve.response.residual_bounds, residual_band(curve.response)
        if bounds is None or band is None:
            continue
        look: dict[str, Any] = {"color": colour, "linewidth": 0.0, "alpha": 0.25, "zorder": 1.2}
        axes.fill_between(curve.response.frequency_hz, band[0] * factor, band[1] * factor, label=label, **look)
        for peak in (bounds.lowest, bounds.highest):
            axes.plot(peak.frequency_hz, peak.amplitude_m * factor, "_", color=colour, markersize=9, zorder=4)
        label = None


def _draw_limits(axes: Axes, limits: Sequence[Limit], colours: Sequence[Any], factor: float, note: str) -> None:
    """Linear limits behind the curves: grey where there is one of a kind, else in the colours of their curves."""
    for kind, style in (("free", (0, (1, 1.2))), ("stuck", (0, (4, 1.5, 1, 1.5)))):
        chosen = [limit for limit in limits if limit.kind == kind]
        for number, limit in enumerate(chosen):
            alone = len(chosen) == 1
            axes.plot(
                limit.frequency_hz,
                limit.amplitude_m * factor,
                color=LIMIT_COLOUR if alone else colours[limit.curves[0]],
                linestyle=style,
                linewidth=2.2 if alone else 0.8,
                alpha=1.0 if alone else 0.45,
                label=f"linear, {kind}{note}" if number == 0 else f"_linear, {kind}",
                zorder=BEHIND,
            )


def _draw_backbones(axes: Axes, backbones: BackboneResult, members: set[int], factor: float) -> None:
    """Nonlinear modes of the nodal diameter of the excitation, and their resonances under its force."""
    look: dict[str, Any] = {"color": "black", "zorder": 3.5}
    line: str | None = "nonlinear mode (black)"
    mark: str | None = "its resonance"
    for curve in backbones.curves:
        for mode in curve.modes if curve.curve in members else ():
            other = mode.nodal_diameter != curve.engine_order and not mode.resonances
            if other or not len(mode.amplitude_m):
                continue
            heights = broken(mode, mode.amplitude_m) * factor
            axes.plot(broken(mode, mode.frequency_hz), heights, linewidth=0.9, label=line, **look)
            line = None
            for each in mode.resonances:
                height = each.amplitude_m * factor
                axes.plot(each.frequency_hz, height, "x", markersize=6, linestyle="none", label=mark, **look)
                mark = None


def _set_range(axes: Axes, curves: Sequence[PlottedCurve], limits: Sequence[Limit], factor: float) -> None:
    low = min(curve.scene.response.frequency[0] for curve in curves)
    high = max(curve.scene.response.frequency[1] for curve in curves)
    axes.set_xlim(low, high)
    tops = [height for curve in curves for height in (curve.peak[1], curve.worst[1])]
    bounds = [curve.response.residual_bounds for curve in curves]
    tops += [each.highest.amplitude_m for each in bounds if each is not None]
    if not any(curve.facts.mean for curve in curves):  # limits without it are no heights of this axis
        tops += [limit.peak[1] for limit in limits]
    peaks = np.array(tops)
    peaks = peaks[np.isfinite(peaks) & (peaks > 0.0)] * factor
    if peaks.size == 0:
        return
    if set_height_axis(axes, peaks, CURVES_LOG_FROM):
        axes.set_ylim(_floor(curves, factor, peaks), 1.6 * peaks.max())
    else:
        axes.set_ylim(0.0, 1.06 * peaks.max())


def _floor(curves: Sequence[PlottedCurve], factor: float, peaks: Array) -> float:
    branches = [branch for curve in curves for branch in (curve.response, *curve.response.detached)]
    lowest = min(float(np.min(branch.amplitude_m)) for branch in branches) * factor
    return max(_DEPTH * float(peaks.min()), 0.7 * lowest)
