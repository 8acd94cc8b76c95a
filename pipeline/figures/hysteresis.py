"""Hysteresis loops of contact nodes at the peak of a curve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import Array, PlottedCurve
from pipeline.figures.style import DISTINCT, ordered_colours, scale, subplots, write_heading

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nonlinear import ContactCycle

_SAMPLES = 720
_MOST_CURVES = 6
_NEGLIGIBLE = 1e-6  # of the largest displacement or force: drawn as zero
PANELS = (
    (0, "along the contact segment", "$u_1$", "$T_1$"),
    (1, "along the radius", "$u_2$", "$T_2$"),
    (2, "normal", "$v$", "$N$"),
)


def node_figure(curve: PlottedCurve, title: str) -> Figure | None:
    """Loops of a few nodes of one curve at its peak: T1 and T2 against the relative displacement, N against v."""
    if curve.peak_displacement is None:
        return None
    cycle, pressed = _cycle(curve)
    nodes = _shown_nodes(cycle)
    figure, panels = subplots(1, 3, size=(10.5, 3.9))
    lines = [(f"node {node + 1}", cycle, pressed, node) for node in nodes]
    _draw(panels, lines, DISTINCT)
    for (_, heading, *_rest), axes in zip(PANELS, panels, strict=True):
        axes.set_title(heading)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(lines), fontsize=9)
    write_heading(figure, f"{title}: contact loops at the peak, {_peak_label(curve)}")
    return figure


def sweep_figure(curves: Sequence[PlottedCurve], title: str) -> Figure | None:
    """A column for each of a few curves of a sweep at its own peak: T1, T2 and N of the node that dissipates most."""
    chosen = [curve for curve in curves if curve.peak_displacement is not None]
    if len(chosen) > _MOST_CURVES:
        places = np.unique(np.linspace(0, len(chosen) - 1, _MOST_CURVES).round().astype(int))
        chosen = [chosen[place] for place in places]
    if len(chosen) < 2:
        return None
    cycles = [_cycle(curve) for curve in chosen]
    node = _shown_nodes(_cycle(most_damped(chosen) or chosen[0])[0])[0]
    shown = [panel for panel in PANELS if panel[0] == 2 or any(_slides(cycle, node, panel[0]) for cycle, _ in cycles)]
    size = (1.2 + 2.1 * len(chosen), 0.6 + 2.1 * len(shown))
    figure, rows = subplots(len(shown), len(chosen), size=size, squeeze=False)
    colours = ordered_colours(len(chosen))
    for curve, (cycle, v0), colour, column in zip(chosen, cycles, colours, rows.T, strict=True):
        _draw(column, [(curve.label, cycle, v0, node)], [colour], shown)
        column[0].set_title(curve.label.replace(", ", "\n"), fontsize=9)
    still = "" if len(shown) > 1 else " (nothing slides)"
    write_heading(figure, f"{title}: contact loops of node {node + 1}, each curve at its peak{still}")
    return figure


def most_damped(curves: Sequence[PlottedCurve]) -> PlottedCurve | None:
    """The curve with the largest friction damping at its peak: friction work over amplitude squared."""
    known = [curve for curve in curves if curve.peak_index >= 0 and curve.peak[1] > 0.0]
    return max(known, key=lambda c: c.dissipated_j[c.peak_index] / c.peak[1] ** 2, default=None)


def _cycle(curve: PlottedCurve) -> tuple[ContactCycle, Array]:
    """The contact cycle at the peak, closed, and v0 of each node, m, which v includes."""
    from nonlinear import contact_cycle

    assert curve.peak_displacement is not None
    contact = curve.contact_parameters(curve.peak_displacement.shape[1])
    return contact_cycle(curve.peak_displacement, contact, samples=_SAMPLES), contact.interference


def _shown_nodes(cycle: ContactCycle) -> list[int]:
    """Nodes by friction work: the one that dissipates most, the middle one and the least, without repeats."""
    velocity = np.roll(cycle.displacement, -1, axis=0) - np.roll(cycle.displacement, 1, axis=0)
    work = np.sum(cycle.force[:, :, :2] * velocity[:, :, :2] / 2.0, axis=(0, 2))
    order = np.argsort(-work, kind="stable").tolist()
    return list(dict.fromkeys([order[0], order[len(order) // 2], order[-1]]))


def _slides(cycle: ContactCycle, node: int, component: int) -> bool:
    """Whether the tangential force of a node along a direction exceeds round-off."""
    return bool(np.abs(cycle.force[:, node, component]).max() > _NEGLIGIBLE * np.abs(cycle.force).max())


def _draw(
    panels: Any,
    lines: Sequence[tuple[str, ContactCycle, Array, int]],
    colours: Sequence[Any],
    shown: Sequence[tuple[int, str, str, str]] = PANELS,
) -> None:
    """T1, T2 and N in a panel each, with suitable units; decreasing widths keep coinciding lines visible."""
    widths = np.linspace(1.2 + 1.0 * (len(lines) - 1), 1.2, len(lines))
    motion = max(float(np.abs(cycle.displacement).max()) for _, cycle, _, _ in lines)
    load = max(float(np.abs(cycle.force).max()) for _, cycle, _, _ in lines)
    for (component, _, abscissa, ordinate), axes in zip(shown, panels, strict=True):
        x, y = zip(*(_loop(cycle, v0, node, component) for _, cycle, v0, node in lines), strict=True)
        (length, length_unit), (force, force_unit) = _fit(x, motion, "m"), _fit(y, load, "N")
        for (label, *_), u, f, colour, width in zip(lines, x, y, colours, widths, strict=False):
            axes.plot(u * length, f * force, color=colour, linewidth=width, label=label)
        axes.set(xlabel=f"{abscissa} [{length_unit}]", ylabel=f"{ordinate} [{force_unit}]")
        if component < 2 and not any(_slides(cycle, node, component) for _, cycle, _, node in lines):
            axes.text(0.5, 0.6, "no force", transform=axes.transAxes, ha="center", color="0.4", fontsize=8)
        _finish(axes, motion * length, load * force)


def _loop(cycle: ContactCycle, v0: Array, node: int, component: int) -> tuple[Array, Array]:
    """Closed loop of one component: displacement, m (with v0 where it is the normal one), and force, N."""
    x = cycle.displacement[:, node, component] + (v0[node] if component == 2 else 0.0)
    y = cycle.force[:, node, component]
    return np.append(x, x[0]), np.append(y, y[0])


def _fit(values: Sequence[Array], reference: float, unit: str) -> tuple[float, str]:
    """Scale and unit for the values; round-off in comparison with the reference is shown as zero."""
    largest = max(float(np.abs(v).max()) for v in values)
    return scale([max(largest, _NEGLIGIBLE * reference)], unit)


def _finish(axes: Axes, motion: float, load: float) -> None:
    """Zero lines, and a margin around loops that degenerate to a point or a line."""
    axes.axhline(0.0, color="0.6", linewidth=0.6, zorder=1)
    axes.axvline(0.0, color="0.6", linewidth=0.6, zorder=1)
    axes.margins(0.08)
    for limits, set_limits, reference in (
        (axes.get_xlim, axes.set_xlim, motion),
        (axes.get_ylim, axes.set_ylim, load),
    ):
        low, high = limits()
        least = (_NEGLIGIBLE * reference) or 1.0
        if high - low < least:
            set_limits((low + high - least) / 2.0, (low + high + least) / 2.0)
    axes.locator_params(nbins=4)


def _peak_label(curve: PlottedCurve) -> str:
    frequency, amplitude = curve.peak
    factor, unit = scale([amplitude], "m")
    label = f"{curve.label}, " if curve.parameters else ""
    return f"{label}{frequency:.1f} Hz, {amplitude * factor:.3g} {unit}"
