"""The curve of a study: error over seconds, both logarithmic, one panel for each quantity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.style import DISTINCT, plain_log_labels, save, styled
from work_precision.study import Measured, Quantity, Study, cheapest, pareto_front
from work_precision.tables import shown_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")  # one more or less than colours: no look comes twice
PRESET_LINE = "accuracy ="  # the line there whose points bear names
FRONT = "whole"  # the study with a Pareto front
TOLERANCES = (0.05, 0.01, 0.001)
PANEL = (4.9, 3.9)  # inches
OFFSETS = ((3.0, 2.0), (-3.0, -2.0), (3.0, 2.0), (-3.0, -2.0))  # of names from their points, line by line
LETTERS_AN_INCH = 12.0  # of the legend
APART = np.array([24.0, 8.0])  # pixels between names
DEEPEST = 1e-3  # of the smallest error: how far down an axis goes for the uncertainty of the reference
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
    across = int(size[0] * LETTERS_AN_INCH / (max(len(label) for label in labels) + 6))  # 6: the sample of the line
    figure.legend(handles, labels, loc="outside lower center", ncols=max(1, min(len(labels), across)), fontsize=9)
    figure.suptitle(study.title)
    return figure


def _panel(axes: Axes, study: Study, quantity: Quantity, front: bool) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    floor = max(quantity.uncertainty, LEAST)
    for number, (name, rows) in enumerate(study.series().items()):
        look: dict[str, Any] = {"color": DISTINCT[number % len(DISTINCT)], "marker": MARKERS[number % len(MARKERS)]}
        _line(axes, rows, quantity, name, {**look, "linestyle": "none" if front else "-"})
    if front:
        _draw_front(axes, study.rows, quantity)
    _limits(axes, study.rows, quantity, floor)
    bottom = axes.get_ylim()[0]
    axes.axhspan(bottom, max(bottom, floor), color="0.88", zorder=0, label="uncertainty of the reference")
    axes.set(xlabel="wall time [s]", ylabel="relative error")
    axes.set_title(f"{quantity.name} (reference ± {shown_error(quantity.uncertainty)})", fontsize=10)
    plain_log_labels(axes.xaxis)
    axes.xaxis.grid(True, which="major")
    _name_points(axes, study, quantity, {PRESET_LINE} if front else set(study.series()))


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


def _name_points(axes: Axes, study: Study, quantity: Quantity, named: set[str]) -> None:
    """The settings of the lines `named` beside their points, where none hides another; needs the final limits."""
    taken: list[np.ndarray] = []
    for number, (name, rows) in enumerate(study.series().items()):
        if name not in named:
            continue
        offset = OFFSETS[number % len(OFFSETS)]
        look: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "zorder": 4}
        look |= {"ha": "left" if offset[0] > 0 else "right", "va": "bottom" if offset[1] > 0 else "top"}
        look |= {"color": DISTINCT[number % len(DISTINCT)]}
        for row in rows:
            place = row.seconds, max(row.errors[quantity.name], LEAST)
            if not math.isfinite(place[1]):
                continue
            middle = axes.transData.transform(place) + np.array(offset) * (4.0 + len(row.setting) / 3.0, 3.0)
            if all(np.any(np.abs(middle - other) > APART) for other in taken):
                taken.append(middle)
                axes.annotate(row.setting, place, offset, path_effects=[_halo()], **look)


def _halo() -> AbstractPathEffect:
    """White around letters that lie over lines."""
    from matplotlib.patheffects import withStroke

    return withStroke(linewidth=1.5, foreground="white")


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
        found = "none" if row is None else f"{row.series} {row.setting}, {row.seconds:.2g} s"
        text = f"{100.0 * tolerance:g} %: {found}"
        look: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "fontsize": 7}
        axes.annotate(text, (0.01, tolerance), (0, 2), zorder=6, path_effects=[_halo()], **look)
        if row is not None:
            error = max(row.errors[quantity.name], LEAST)
            axes.plot(row.seconds, error, "*", color="#000000", markersize=11, zorder=5, label=label)
            label = None


def _limits(axes: Axes, rows: Sequence[Measured], quantity: Quantity, floor: float) -> None:
    errors = np.array([max(row.errors[quantity.name], LEAST) for row in rows])
    errors = errors[np.isfinite(errors)]
    seconds = np.array([row.seconds for row in rows])
    smallest = float(errors.min(initial=np.inf)) if errors.size else floor
    low = min(smallest, max(floor, DEEPEST * smallest))
    axes.set_ylim(0.2 * low, 4.0 * float(errors.max(initial=floor)))
    axes.set_xlim(0.5 * seconds.min(), 2.0 * seconds.max())  # room for the names of the first and the last


def save_figure(study: Study, folder: Path) -> None:
    """Write NAME.png and NAME.svg; the study of the whole pipeline with its Pareto front."""
    with styled():
        save(work_precision_figure(study, front=study.name == FRONT), folder, study.name)


def save_picture(study: Study, path: Path) -> None:
    """The figure as a PNG of moderate size, for a document."""
    from matplotlib import pyplot as plt

    with styled():
        figure = work_precision_figure(study, front=study.name == FRONT)
        figure.savefig(path, dpi=90, metadata={"Software": None})
        plt.close(figure)
