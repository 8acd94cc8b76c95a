"""The curve of a study: error over seconds, both logarithmic, one panel for each quantity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.style import DISTINCT, plain_log_labels, save, styled
from work_precision.study import Measured, Quantity, Study, cheapest, pareto_front

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
TOLERANCES = (0.05, 0.01, 0.001)
PANEL = (4.9, 3.9)  # inches
FEW = 9  # points of a line up to which each bears its setting
LEAST = 1e-16  # relative error: zero has no place on a logarithmic axis


def work_precision_figure(study: Study, front: bool = False) -> Figure:
    """Error over seconds of every quantity; a grey band is what the reference itself is not sure of.

    `front`: with the Pareto front, and the fastest setting for each of `TOLERANCES`, instead of a line a series.
    """
    from matplotlib import pyplot as plt

    count = len(study.quantities)
    columns = 2 if count in (2, 4) else min(count, 3)
    rows = math.ceil(count / columns)
    size = (PANEL[0] * columns, PANEL[1] * rows + 0.5)
    figure, axes = plt.subplots(rows, columns, figsize=size, sharex=True, layout="constrained", squeeze=False)
    for place, quantity in zip(axes.flat, study.quantities, strict=False):
        _panel(place, study, quantity, front)
    for place in list(axes.flat)[count:]:
        place.set_visible(False)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 4), fontsize=9)
    figure.suptitle(study.title)
    return figure


def _panel(axes: Axes, study: Study, quantity: Quantity, front: bool) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    floor = max(quantity.uncertainty, LEAST)
    for number, (name, rows) in enumerate(study.series().items()):
        look: dict[str, Any] = {"color": DISTINCT[number % len(DISTINCT)], "marker": MARKERS[number % len(MARKERS)]}
        _line(axes, rows, quantity, name, {**look, "linestyle": "none" if front else "-"})
        if not front:
            _name_points(axes, rows, quantity, look["color"])
    if front:
        _draw_front(axes, study.rows, quantity)
    _limits(axes, study.rows, quantity, floor)
    axes.axhspan(axes.get_ylim()[0], floor, color="0.88", zorder=0, label="uncertainty of the reference")
    axes.set(xlabel="wall time [s]", ylabel="relative error", title=quantity.name)
    plain_log_labels(axes.xaxis)
    axes.xaxis.grid(True, which="major")


def _line(axes: Axes, rows: Sequence[Measured], quantity: Quantity, label: str, look: dict[str, Any]) -> None:
    """The points of a line; hollow where something went otherwise than asked for."""
    x = np.array([row.seconds for row in rows])
    y = np.array([max(row.errors[quantity.name], LEAST) for row in rows])
    axes.plot(x, y, markersize=5, label=label, **look)
    odd = np.array([bool(row.note) for row in rows])
    if odd.any():
        axes.plot(
            x[odd], y[odd], look["marker"], color=look["color"], markerfacecolor="white", markersize=5, zorder=3
        )


def _name_points(axes: Axes, rows: Sequence[Measured], quantity: Quantity, colour: Any) -> None:
    """The settings beside their points: of all where they are few, else of the first, the last and some between."""
    step = max(1, math.ceil(len(rows) / FEW))
    for index, row in enumerate(rows):
        if index % step and index != len(rows) - 1:
            continue
        error = max(row.errors[quantity.name], LEAST)
        if math.isfinite(error):
            place = row.seconds, error
            axes.annotate(row.setting, place, (4, 3), textcoords="offset points", fontsize=7, color=colour)


def _draw_front(axes: Axes, rows: tuple[Measured, ...], quantity: Quantity) -> None:
    """The Pareto front as a staircase, and a star on the fastest setting for each tolerance, named."""
    front = pareto_front(rows, quantity.name)
    if front:
        x = [row.seconds for row in front]
        y = [max(row.errors[quantity.name], LEAST) for row in front]
        axes.step(x, y, where="post", color="0.35", linewidth=1.0, zorder=1.5, label="Pareto front")
    best = {tolerance: cheapest(rows, quantity, tolerance) for tolerance in TOLERANCES}
    label: str | None = "fastest within a tolerance"
    for tolerance, row in best.items():
        axes.axhline(tolerance, color="0.6", linewidth=0.8, linestyle=(0, (4, 2)), zorder=1)
        text = f"{100.0 * tolerance:g} %" + ("" if row is None else f": {row.setting}, {row.seconds:.2g} s")
        if row is None:
            text += ": none"
        axes.annotate(
            text,
            (0.99, tolerance),
            (0, 2),
            ("axes fraction", "data"),
            textcoords="offset points",
            ha="right",
            fontsize=7,
        )
        if row is not None:
            error = max(row.errors[quantity.name], LEAST)
            axes.plot(row.seconds, error, "*", color="#000000", markersize=11, zorder=5, label=label)
            label = None


def _limits(axes: Axes, rows: Sequence[Measured], quantity: Quantity, floor: float) -> None:
    errors = np.array([max(row.errors[quantity.name], LEAST) for row in rows])
    errors = errors[np.isfinite(errors)]
    seconds = np.array([row.seconds for row in rows])
    low = min(float(errors.min(initial=floor)), floor)
    axes.set_ylim(0.3 * low, 4.0 * float(errors.max(initial=floor)))
    axes.set_xlim(0.7 * seconds.min(), 1.9 * seconds.max())  # room for the last name on the right


def save_figure(study: Study, folder: Path) -> None:
    """Write NAME.png and NAME.svg; the study of the whole pipeline with its Pareto front."""
    with styled():
        save(work_precision_figure(study, front=study.name == "whole"), folder, study.name)
