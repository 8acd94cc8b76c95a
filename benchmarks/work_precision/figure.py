"""The figure of a study: error over seconds, both logarithmic, one panel for each quantity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline import styled
from pipeline.figures.style import keep_apart, legend_columns, plain_log_labels
from work_precision.study import Measured, Study, fastest_within, pareto_front, shown_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")
WHOLE = "whole"  # the study with a Pareto front instead of lines
PRESET_SERIES = "accuracy ="
TOLERANCES = (0.05, 0.01, 0.001)
PANEL = (4.9, 3.9)  # inches
ROOM = 3.0  # times that the time axis begins before the fastest, for what is written beside the tolerances
LEAST = 1e-16  # relative error: zero has no place on a logarithmic axis


def work_precision_figure(study: Study) -> Figure:
    """Error over seconds of every quantity; the grey band is the uncertainty of the reference.

    The study of the whole pipeline has its Pareto front and the fastest setting for each of `TOLERANCES`.
    """
    from matplotlib import pyplot as plt

    count = len(study.uncertainty)
    columns = 2 if count in (2, 4) else min(count, 3)
    rows = math.ceil(count / columns)
    size = (PANEL[0] * columns, PANEL[1] * rows + 0.5)
    figure, axes = plt.subplots(rows, columns, figsize=size, sharex=True, layout="constrained", squeeze=False)
    names = [_panel(place, study, quantity) for place, quantity in zip(axes.flat, study.uncertainty, strict=False)]
    for place in list(axes.flat)[count:]:
        place.set_visible(False)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    columns = legend_columns(figure, labels, len(labels))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=9)
    figure.suptitle(study.title)
    for place, labels in zip(axes.flat, names, strict=False):
        keep_apart(place, labels)
    return figure


def _error(row: Measured, quantity: str) -> float:
    return max(row.errors[quantity], LEAST)


def _panel(axes: Axes, study: Study, quantity: str) -> list[Annotation]:
    """One quantity; returns the names of its points, not yet apart."""
    whole = study.name == WHOLE
    axes.set_xscale("log")
    axes.set_yscale("log")
    colours = _colours(study)
    for number, (name, rows) in enumerate(study.series().items()):
        look: dict[str, Any] = {"color": colours[name], "marker": MARKERS[number % len(MARKERS)], "markersize": 5}
        errors = [_error(row, quantity) for row in rows]
        axes.plot([row.seconds for row in rows], errors, label=name, linestyle="none" if whole else "-", **look)
        for row, error in zip(rows, errors, strict=True):
            if row.note:  # hollow
                axes.plot(row.seconds, error, zorder=3, markerfacecolor="white", **look)
    plain_log_labels(axes.xaxis)
    if whole:
        _draw_front(axes, study, quantity)
        axes.set_xlim(left=min(row.seconds for row in study.rows) / ROOM)
    uncertainty = max(study.uncertainty[quantity], LEAST)
    low, high = _limits(study.rows, quantity, uncertainty)
    axes.set_ylim(low, high)
    axes.axhspan(low, max(low, uncertainty), color="0.88", zorder=0, label="uncertainty of the reference")
    axes.set(xlabel="wall time [s]", ylabel="relative error")
    axes.set_title(f"{quantity} (reference ± {shown_error(study.uncertainty[quantity])})", fontsize=10)
    return _name_points(axes, study, quantity)


def _colours(study: Study) -> dict[str, str]:
    """The colour of each series."""
    return {name: f"C{number % 10}" for number, name in enumerate(study.series())}


def _name_points(axes: Axes, study: Study, quantity: str) -> list[Annotation]:
    """The settings beside their points, of the whole pipeline the presets only, where there is room."""
    labels = []
    colours = _colours(study)
    for row in study.rows:
        error = _error(row, quantity)
        if math.isfinite(error) and (study.name != WHOLE or row.series == PRESET_SERIES):
            look: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "color": colours[row.series]}
            labels.append(axes.annotate(row.setting, (row.seconds, error), (3, 3), **look))
    return labels


def _limits(rows: Sequence[Measured], quantity: str, uncertainty: float) -> tuple[float, float]:
    """Limits of the errors shown; the uncertainty of the reference is left out where it is far below them."""
    errors = [error for row in rows if math.isfinite(error := _error(row, quantity))] or [uncertainty]
    low = min(min(errors), max(uncertainty, 1e-3 * min(errors)))
    return 0.2 * low, 4.0 * max(*errors, uncertainty)


def _draw_front(axes: Axes, study: Study, quantity: str) -> None:
    """The Pareto front as a staircase, and a star on the fastest setting for each tolerance, named."""
    front = pareto_front(study.rows, quantity)
    seconds, errors = [row.seconds for row in front], [_error(row, quantity) for row in front]
    axes.step(seconds, errors, where="post", color="0.35", linewidth=1.0, zorder=1.5, label="Pareto front")
    label: str | None = "fastest within a tolerance"
    for tolerance in TOLERANCES:
        row = fastest_within(study, quantity, tolerance)
        axes.axhline(tolerance, color="0.6", linewidth=0.8, linestyle=(0, (4, 2)), zorder=1)
        found = "none" if row is None else f"{row.series} {row.setting}, {row.seconds:.2g} s"
        look: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "fontsize": 7}
        axes.annotate(f"{100.0 * tolerance:g} %: {found}", (0.01, tolerance), (0, 2), zorder=6, **look)
        if row is not None:
            axes.plot(row.seconds, _error(row, quantity), "k*", markersize=11, zorder=5, label=label)
            label = None


def save_figure(study: Study, path: Path) -> None:
    """Write the figure as PNG."""
    from matplotlib import pyplot as plt

    with styled():
        figure = work_precision_figure(study)
        figure.savefig(path, dpi=90, metadata={"Software": None})
        plt.close(figure)
