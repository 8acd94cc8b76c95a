"""Texts of the files that the page saves: points of a response as a table, the response as a figure."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

from pipeline.figures.curve_line import draw_line, mark_peak
from pipeline.figures.style import (
    DISTINCT,
    LIMIT_COLOUR,
    drawn,
    plain_log_labels,
    scale,
    styled,
    subplots,
    write_heading,
)
from pipeline.results.frames import csv_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pipeline.explore.views import LiveView

Named = tuple[str, "LiveView"]  # of a curve in the legend


def table_text(view: LiveView) -> str:
    """The points of all branches as CSV, with the names of columns of response.csv that a curve has."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    names = {name: column for name, column in csv_names(0).items() if hasattr(view.response, name)}
    writer.writerow(["branch", *names.values()])
    for number, branch in enumerate(view.branches):
        columns = [getattr(branch, name).tolist() for name in names]
        writer.writerows([number, *row] for row in zip(*columns, strict=True))
    return stream.getvalue()


def figure_text(title: str, view: LiveView, pins: Sequence[Named], log: bool) -> str:
    """The response with its linear limits and pinned curves as SVG."""
    curves = [("response", view), *pins]
    heights = [branch.amplitude_m for _, each in curves for branch in each.branches]
    with styled():
        figure, axes = subplots(size=(8.4, 4.8))
        factor, unit = scale([float(height.max()) for height in heights if len(height)], "m")
        for limit, dashes in zip(view.limits, ("dotted", "dashdot"), strict=False):
            look: dict[str, Any] = {"color": LIMIT_COLOUR, "linestyle": dashes, "label": f"linear, {limit.kind}"}
            axes.plot(limit.frequency_hz, limit.amplitude_m * factor, **look)
        for (name, each), colour in zip(curves, DISTINCT, strict=False):
            for number, branch in enumerate(each.branches):
                label = name if number == 0 else f"_{name}, detached branch {number}"
                draw_line(axes, branch, branch.amplitude_m * factor, label, color=colour)
            facts = each.facts
            if facts.points:
                mark_peak(axes, facts, factor, colour)
        axes.set_xlim(*view.solved.response.frequency)
        if log:
            axes.set_yscale("log")
            plain_log_labels(axes.yaxis)
        else:
            axes.set_ylim(0.0, 1.05 * factor * max(float(height.max()) for height in heights if len(height)))
        axes.set_xlabel("frequency [Hz]")
        axes.set_ylabel(f"amplitude [{unit}]")
        figure.legend(loc="outside lower center", ncols=4, fontsize=9)
        write_heading(figure, f"{title}\n{view.certainty}")
        return drawn(figure, "svg").decode("utf-8")
