"""The further outputs of the curves over the frequency: a panel for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pipeline.figures.curve_line import draw_line
from pipeline.figures.curve_marks import THIN
from pipeline.figures.data import PlottedCurve
from pipeline.figures.style import ordered_colours, subplots
from pipeline.scene.labels import prefixed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PANELS = 12
MOST_NAMED = 8  # curves with an entry in the legend
STRAIN = 1e6, "µm/m"  # factor and unit


def outputs_figure(curves: Sequence[PlottedCurve], title: str) -> Figure | None:
    """Largest value over a period of every further output; None where none is recorded."""
    units = {output.name: output.unit for curve in curves for output in curve.scene.output}
    found = dict.fromkeys([*units, *(name for curve in curves for name in curve.outputs)])
    names = [name for name in found if any(name in curve.outputs for curve in curves)][:MOST_PANELS]
    if not names:
        return None
    columns = min(len(names), 2)
    rows = -(-len(names) // columns)
    figure, places = subplots(rows, columns, size=(1.6 + 4.2 * columns, 0.9 + 2.8 * rows), sharex=True, squeeze=False)
    for axes in places.flat[len(names) :]:
        axes.remove()
    colours = ordered_colours(len(curves))
    for axes, name in zip(places.flat, names, strict=False):
        shown = [curve for curve in curves if name in curve.outputs]
        highest = max(float(np.max(curve.outputs[name], initial=0.0)) for curve in shown)
        factor, unit = prefixed(highest, "m") if units.get(name, "m") == "m" else STRAIN
        for curve, colour in zip(curves, colours, strict=True):
            if name not in curve.outputs:
                continue
            label = curve.label if len(curves) <= MOST_NAMED else None
            height = curve.outputs[name] * factor
            draw_line(axes, curve.frequency_hz, height, curve.stable, label, curve.nodal_diameter, color=colour)
            for branch in curve.branches:
                if name in branch.outputs:
                    look = {"color": colour, "linewidth": THIN}
                    heights = branch.outputs[name] * factor
                    draw_line(axes, branch.frequency_hz, heights, branch.stable, None, branch.nodal_diameter, **look)
        axes.set_ylabel(f"{name} [{unit}]")
        axes.set_ylim(0.0, 1.08 * highest * factor or 1.0)
    for axes in places[-1]:
        if axes.figure is not None:
            axes.set_xlabel("excitation frequency [Hz]")
    figure.suptitle(f"{title}: largest values over a period")
    handles, labels = places.flat[0].get_legend_handles_labels()
    if len(curves) > 1 and handles:
        figure.legend(handles, labels, loc="outside lower center", fontsize=9, ncols=2)
    return figure
