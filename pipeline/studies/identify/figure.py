"""Measured and computed motions together, and the posterior of each pair of keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.style import DISTINCT, ordered_colours, plain_log_labels, scale, write_heading
from pipeline.scene.labels import quantity
from pipeline.studies.identify.result import Identification, IdentifiedKey

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ELLIPSES = (2.4477, 1.1774)  # of 95 % and 50 % of a normal distribution of two parameters, in standard deviations
MOST_PAIRED = 4  # keys whose pairs are drawn


def identify_figure(result: Identification, title: str) -> Figure | None:
    """On the left response curves with the measured motions, on the right pairs of keys."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    outputs = list(dict.fromkeys(item.output for item in result.compared))
    paired = sorted(range(len(result.keys)), key=lambda k: result.keys[k].deviation)[:MOST_PAIRED]
    paired.sort()
    figure = Figure(figsize=(13.5, 3.2 + 3.0 * max(len(outputs), 1)), layout="constrained")
    FigureCanvasAgg(figure)
    parts: Any = figure.subfigures(1, 2, width_ratios=(1.15, 1.0))
    left, right = parts
    axes = left.subplots(len(outputs), 1, squeeze=False)[:, 0]
    for place, output in zip(axes, outputs, strict=True):
        _draw_motions(place, result, output)
    axes[-1].set_xlabel("excitation frequency [Hz]")
    side = max(len(paired) - 1, 1)
    pairs = right.subplots(side, side, squeeze=False)
    for row in range(side):
        for column in range(side):
            if column > row:
                pairs[row, column].remove()
            elif len(paired) == 1:
                _draw_single(pairs[row, column], result.keys[paired[0]])
            else:
                _draw_pair(
                    pairs[row, column], result, (paired[column], paired[row + 1]), (row == side - 1, column == 0)
                )
    right.suptitle("posterior: 50 % and 95 % of the probability, best values", fontsize=10)
    write_heading(figure, f"{title}\nmeasured and computed motions")
    return figure


def _draw_motions(axes: Axes, result: Identification, output: str) -> None:
    compared = [item for item in result.compared if item.output == output]
    labels = list(dict.fromkeys(item.label for item in compared))
    colours = dict(zip(labels, ordered_colours(len(labels)), strict=True))
    factor, unit = scale([item.amplitude for item in compared], compared[0].unit)
    if unit.endswith("m/m"):
        factor, unit = 1e6, "µm/m"
    for curve in result.curves:
        if curve.output == output and curve.label in colours:
            axes.plot(curve.frequency_hz, curve.amplitude * factor, color=colours[curve.label], linewidth=1.0)
    for item in compared:
        size = 1.96 * item.amplitude_deviation
        heights = item.amplitude * factor
        low, high = heights * (1.0 - np.exp(-size)), heights * (np.exp(size) - 1.0)
        across = 0.0 if item.curve else 1.96 * item.frequency_deviation_hz
        style = {"fmt": "." if item.curve else "o", "ms": 4, "capsize": 2, "color": colours[item.label]}
        axes.errorbar(item.frequency_hz, heights, [[low], [high]], across, **style)
        if item.rate_hz_per_s:
            axes.plot(item.computed_hz, item.computed_amplitude * factor, "x", color=colours[item.label])
    low = min(min(item.amplitude, item.computed_amplitude) for item in compared)
    high = max(max(item.amplitude, item.computed_amplitude) for item in compared)
    if high > 20.0 * low:
        axes.set_yscale("log")
        plain_log_labels(axes.yaxis)
        axes.set_ylim(0.2 * low * factor, 3.0 * high * factor)
    else:
        axes.set_ylim(0.0, 1.25 * high * factor)
    axes.set_ylabel(f"vibration of {output or 'the default output'} [{unit}]")
    handles = [axes.plot([], [], color=colours[label], marker="o", ms=4, label=label)[0] for label in labels]
    axes.legend(handles=handles, fontsize=8, loc="best", title="measured (95 %) and computed", title_fontsize=8)


def _draw_pair(axes: Axes, result: Identification, pair: tuple[int, int], outer: tuple[bool, bool]) -> None:
    """Ellipses of the posterior in the values of two keys, within their ranges."""
    one, other = (result.keys[k] for k in pair)
    rho = result.correlation[pair[0]][pair[1]]
    angles = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = np.stack([np.cos(angles), rho * np.cos(angles) + np.sqrt(1.0 - rho**2) * np.sin(angles)])
    for size, alpha in zip(ELLIPSES, (0.25, 0.5), strict=True):
        x = _values(one, np.clip(one.share + size * one.deviation * circle[0], 0.0, 1.0))
        y = _values(other, np.clip(other.share + size * other.deviation * circle[1], 0.0, 1.0))
        axes.fill(x, y, color=DISTINCT[0], alpha=alpha, linewidth=0.0)
    axes.plot(*(_values(item, np.array([item.share])) for item in (one, other)), "o", color="black", ms=4)
    for values in result.others:
        place = [values.values[item.key] * quantity(item.key).factor for item in (one, other)]
        axes.plot(*place, "s", color=DISTINCT[1], ms=5)
    axes.tick_params(labelsize=8)
    if outer[0]:
        axes.set_xlabel(quantity(one.key).axis(), fontsize=9)
    if outer[1]:
        axes.set_ylabel(quantity(other.key).axis(), fontsize=9)


def _draw_single(axes: Axes, item: IdentifiedKey) -> None:
    shares = np.linspace(max(item.share - 4 * item.deviation, 0.0), min(item.share + 4 * item.deviation, 1.0), 200)
    density = np.exp(-0.5 * ((shares - item.share) / item.deviation) ** 2)
    axes.fill_between(_values(item, shares), density, color=DISTINCT[0], alpha=0.4)
    axes.set_yticks([])
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(quantity(item.key).axis(), fontsize=9)


def _values(item: IdentifiedKey, shares: np.ndarray) -> np.ndarray:
    """Values of a key at shares of its range, as they are shown."""
    low, high = item.range_low, item.range_high
    values = low * (high / low) ** shares if item.logarithmic else low + shares * (high - low)
    return np.asarray(values * quantity(item.key).factor)
