"""Marks of resonance crossings in the nodal diameter diagram, numbered, with a list of them below the diagram."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pipeline.figures.data import PlottedCurve
from pipeline.figures.spectra import spectrum
from pipeline.stages.engine_orders import COUNT, excited_orders

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from rom import ModeFamilies, ReducedModel, ResonanceCrossing

COLOUR = "#CC79A7"
TITLE = "Resonance crossings: from free to stuck shrouds; speed = 60 f / EO"
LISTED = 16  # crossings that the list names; of more the numbers are those of the table in the report
COLUMNS = 2
BOX = 0.045  # of the height of the diagram: numbers nearer than this share a box
ROW = 0.17  # height of a row of the list, inches


@dataclass(frozen=True)
class NumberedCrossing:
    """A crossing in the frequency range with its number in diagram and table, and the part of the mode's frequencies
    between free and stuck contacts that is in the range, Hz."""

    number: int
    crossing: ResonanceCrossing
    name: str
    low_hz: float
    high_hz: float

    @property
    def text(self) -> str:
        """Engine order, wave, mode, frequencies and speeds."""
        each = self.crossing
        parts = [f"EO {each.engine_order}, {each.wave}, {self.name}: {_span(each.free_hz, each.stuck_hz)} Hz"]
        if each.speeds_rpm is not None:
            parts.append(f"{_span(*each.speeds_rpm)} rev/min")
        return ", ".join(parts)


def numbered_crossings(
    curve: PlottedCurve, model: ReducedModel, families: ModeFamilies | None, orders: Collection[int]
) -> list[NumberedCrossing]:
    """The crossings of engine orders and their multiples in the frequency range, as in the table of the report."""
    from rom import inter_blade_phase, resonance_crossings

    ranges = sorted({item for order in orders for item in excited_orders(curve.scene, order)})
    found: list[NumberedCrossing] = []
    for order, (low, high) in ranges:
        hz = spectrum(model, curve, order, ("free", "stuck"), COUNT)
        names = [f"mode {mode}" for mode in range(1, len(hz["free"]) + 1)]
        if families is not None:
            names = families.modes(model, inter_blade_phase(order, model.n_blades), count=len(names))[1]
        for each in resonance_crossings(order, model.n_blades, hz["free"], hz["stuck"], (low, high)):
            if each.in_range:
                part = max(each.free_hz, low), min(each.stuck_hz, high)
                found.append(NumberedCrossing(len(found) + 1, each, names[each.mode - 1], *part))
    return found


def list_height(count: int) -> float:
    """Height, inches, that the list of so many crossings takes below the diagram."""
    rows = -(-count // COLUMNS) if count <= LISTED else 0
    return ROW * (1 + rows) if count else 0.0


def draw_crossings(axes: Axes, crossings: Sequence[NumberedCrossing], last: int, top: float) -> None:
    """A bar with its numbers for each mode, and the list; `last` diameter and `top` frequency of the diagram."""
    shown = [each for each in crossings if each.low_hz <= top]
    for diameter, low, high in {(each.crossing.nodal_diameter, each.low_hz, each.high_hz) for each in shown}:
        axes.vlines(diameter, low, min(high, top), color=COLOUR, linewidth=6.0, alpha=0.45, zorder=2.5)
    for diameter in sorted({each.crossing.nodal_diameter for each in shown}):
        here = [each for each in shown if each.crossing.nodal_diameter == diameter]
        _write_numbers(
            axes, diameter, [(0.5 * (e.low_hz + min(e.high_hz, top)), e.number) for e in here], (last, top)
        )
    draw_list(axes, TITLE, [each.text for each in crossings])


def draw_list(axes: Axes, title: str, texts: Sequence[str]) -> None:
    """Numbered texts below the diagram; of too many their number alone."""
    from matplotlib.lines import Line2D

    if not texts:
        return
    listed = list(texts) if len(texts) <= LISTED else []
    handles = [
        Line2D([], [], linestyle="", marker=f"${number}$", color="black", markersize=6.0 if number < 10 else 9.0)
        for number in range(1, len(listed) + 1)
    ]
    for handle in handles:
        handle.set_markeredgewidth(0.0)
    figure: Any = axes.figure
    figure.legend(
        handles,
        listed,
        title=title if listed else f"{len(texts)} resonance crossings, numbered as in the report",
        title_fontsize=8,
        loc="outside lower center",
        ncols=COLUMNS,
        fontsize=7.0,
        handletextpad=0.2,
        columnspacing=1.0,
        borderpad=0.0,
    )


def _write_numbers(axes: Axes, diameter: int, places: list[tuple[float, int]], end: tuple[int, float]) -> None:
    """Numbers at their heights beside the line of a nodal diameter; those that would overlap in one box.

    `end`: last nodal diameter and top of the diagram.
    """
    boxes: list[list[tuple[float, int]]] = []
    for place in sorted(places):
        if boxes and place[0] - boxes[-1][-1][0] < BOX * end[1]:
            boxes[-1].append(place)
        else:
            boxes.append([place])
    offset, align = (5, "left") if diameter < end[0] else (-6, "right")
    look: dict[str, Any] = {"xytext": (offset, 0), "ha": align, "va": "center", "fontsize": 8, "zorder": 5.0}
    frame = {"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": COLOUR, "linewidth": 0.7}
    for box in boxes:
        height = sum(place for place, _ in box) / len(box)
        text = ", ".join(str(number) for number in sorted(number for _, number in box))
        axes.annotate(text, (diameter, height), textcoords="offset points", bbox=frame, **look)


def _span(first: float, last: float) -> str:
    """Two numbers, or one where both are the same with four digits."""
    ends = list(dict.fromkeys(f"{value:.0f}" if value >= 1e3 else f"{value:.4g}" for value in (first, last)))
    return "–".join(ends)
