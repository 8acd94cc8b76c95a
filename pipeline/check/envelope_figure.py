"""Figure of a check: the envelope of every blade over the periods beside the amplitude of the solution."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from pipeline.check.answer import verdict
from pipeline.check.check_point import Check
from pipeline.figures.style import ordered_colours, scale, subplots, write_heading

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHARACTERS = 90  # in a line below the axis
MOST_NAMED = 8  # blades with a name in the legend


def envelope_figure(check: Check, title: str) -> Figure:
    """Largest displacement of each period and blade, and the amplitude of the solution that the ring started from."""
    motion, stored = check.motion, check.checked.amplitude_m
    figure, axes = subplots(size=(8.4, 4.2))
    factor, unit = scale(np.append(motion.envelope_m.max(axis=1), stored), "m")
    periods = np.arange(1, len(motion.envelope_m) + 1)
    for blade, colour in enumerate(ordered_colours(motion.n_blades)):
        name = f"blade {blade + 1}" if motion.n_blades <= MOST_NAMED else None
        axes.plot(periods, motion.envelope_m[:, blade] * factor, color=colour, linewidth=0.9, label=name)
    axes.axhline(
        stored * factor, color="0.0", linestyle=(0, (5, 2)), linewidth=1.0, label="amplitude of the solution"
    )
    others = [each.amplitude_m for n, each in enumerate(check.solutions, 1) if n != check.point.solution]
    for number, amplitude in enumerate(others):
        label = "other solutions" if number == 0 else None
        axes.axhline(amplitude * factor, color="0.6", linestyle=(0, (1, 1.5)), linewidth=1.0, label=label)
    write_heading(axes, title)
    said = fill(verdict(check), CHARACTERS, break_on_hyphens=False)
    axes.set(xlabel=f"period\n{said}", ylabel=f"largest displacement of a period [{unit}]")
    axes.set_xlim(0, len(periods))
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    return figure
