"""Hysteresis loops of contact nodes at the peak of a curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from pipeline.figures.data import Array, PlottedCurve
from pipeline.figures.style import DISTINCT, scale, subplots, write_heading

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nonlinear.contact.element_choice import ContactCycle

T = TypeVar("T")
Units = tuple[tuple[float, str], tuple[float, str]]  # factor and name, of displacement and of force
_SAMPLES = 720
_MOST_CURVES, _MOST_LOOKED_AT = 4, 48
_NEGLIGIBLE = 1e-6  # of the largest displacement or force: drawn as zero
PANELS = (
    (0, "along the contact segment", "$u_1$", "$T_1$"),
    (1, "along the radius", "$u_2$", "$T_2$"),
    (2, "normal", "$v$", "$N$"),
)


def node_figure(curve: PlottedCurve, title: str) -> Figure | None:
    """Loops of a few nodes of one curve at its peak: T1 and T2 against the relative displacement, N against v.

    None without contact; a direction without a force has no panel. The legend has the nodes by friction work, of
    several interfaces one node of each.
    """
    cycle, pressed = _cycle(curve)
    if not _touches(cycle):
        return None
    nodes = _shown_nodes(curve, cycle)
    shown = [panel for panel in PANELS if any(_acts(cycle, node, panel[0]) for node in nodes)]
    figure, panels = subplots(1, len(shown), size=(max(0.6 + 3.3 * len(shown), 6.6), 3.9), squeeze=False)
    lines = [(name, cycle, pressed, node) for node, name in nodes.items()]
    _draw(panels[0], lines, DISTINCT, shown)
    for (component, heading, *_rest), axes in zip(shown, panels[0], strict=True):
        along = len(curve.contacts) > 1 and component < 2  # which is another direction on each interface
        axes.set_title(f"along $t_{component + 1}$" if along else heading)
    handles, names = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=len(lines), fontsize=9)
    write_heading(figure, f"{title}: contact loops at the peak, {_peak_label(curve)}")
    return figure


def sweep_figure(curves: Sequence[PlottedCurve], colours: Mapping[int, Any], title: str) -> Figure | None:
    """A column for each of a few curves of a sweep at its own peak: T1, T2 and N of the node that dissipates most.

    Curves without contact are left out. A row has one unit, so that its numbers can be compared.
    """
    known = spread(curves, _MOST_LOOKED_AT)
    touching = [(curve, cycle) for curve, cycle in ((curve, _cycle(curve)) for curve in known) if _touches(cycle[0])]
    chosen = spread(touching, _MOST_CURVES)
    if len(chosen) < 2:
        return None
    damped = most_damped([curve for curve, _ in chosen])
    first, (cycle, _) = next(each for each in chosen if each[0] is damped or damped is None)
    node = _by_work(cycle)[0]
    # of several interfaces another one may touch
    chosen = [each for each in chosen if any(_acts(each[1][0], node, panel[0]) for panel in PANELS)]
    if len(chosen) < 2:
        return None
    cycles = [cycle for _, (cycle, _) in chosen]
    shown = [panel for panel in PANELS if panel[0] == 2 or any(_acts(cycle, node, panel[0]) for cycle in cycles)]
    size = (1.2 + 2.4 * len(chosen), 0.6 + 2.1 * len(shown))
    figure, rows = subplots(len(shown), len(chosen), size=size, squeeze=False)
    units = {component: _units(cycles, node, component) for component, *_ in shown}
    for number, ((curve, (cycle, v0)), column) in enumerate(zip(chosen, rows.T, strict=True)):
        _draw(column, [(curve.label, cycle, v0, node)], [colours[curve.index]], shown, units)
        for axes in column:
            axes.yaxis.label.set_visible(number == 0)  # one for the row
        top = next(axes for axes in column if axes.figure is not None)
        top.set_title(curve.label.replace(", ", "\n"), fontsize=9)
    still = "" if len(shown) > 1 else " (nothing slides)"
    apart = len(known) - len(touching)
    without = f"; {apart} without contact" if apart else ""
    heading = f"{title}: contact loops of {first.node_name(node)}, each curve at its peak{still}{without}"
    write_heading(figure, heading)
    return figure


def spread(items: Sequence[T], most: int) -> list[T]:
    """At most `most` of the items, evenly spread with both ends."""
    if len(items) <= most:
        return list(items)
    return [items[place] for place in np.unique(np.linspace(0, len(items) - 1, most).round().astype(int))]


def most_damped(curves: Sequence[PlottedCurve]) -> PlottedCurve | None:
    """The curve with the largest friction damping at its peak: friction work over amplitude squared."""
    known = [curve for curve in curves if curve.peak[1] > 0.0]
    return max(known, key=lambda c: c.response.dissipated_j[c.facts.peak_index] / c.peak[1] ** 2, default=None)


WIDEST = 3.0  # points, of the first of several loops


def _cycle(curve: PlottedCurve) -> tuple[ContactCycle, Array]:
    """The contact cycle at the peak, closed, and v0 of each node, m, which v includes."""
    from nonlinear.contact.element_choice import contact_cycle

    contact = curve.contact_parameters
    return contact_cycle(curve.peak_displacement, contact, samples=_SAMPLES), contact.interference


def _by_work(cycle: ContactCycle) -> list[int]:
    """The nodes by friction work, the largest first."""
    velocity = np.roll(cycle.displacement, -1, axis=0) - np.roll(cycle.displacement, 1, axis=0)
    work = np.sum(cycle.force[:, :, :2] * velocity[:, :, :2] / 2.0, axis=(0, 2))
    order: list[int] = np.argsort(-work, kind="stable").tolist()
    return order


def _shown_nodes(curve: PlottedCurve, cycle: ContactCycle) -> dict[int, str]:
    """Nodes and their names, by friction work: the largest, the median and the smallest, without repeats.

    Of several interfaces the one with the largest of each that touches.
    """
    order, found = _by_work(cycle), {}
    if len(curve.contacts) > 1:
        for nodes in curve.interfaces.values():
            node = next(each for each in order if each in nodes)
            if np.abs(cycle.force[:, nodes]).max() > 0.0:
                found[node] = f"{curve.node_name(node)}, largest friction work"
        return {node: found[node] for node in order if node in found}
    places = (0, "largest friction work"), (len(order) // 2, "median"), (len(order) - 1, "smallest")
    for place, name in places:
        found.setdefault(order[place], f"{curve.node_name(order[place])}, {name}")
    return found


def _touches(cycle: ContactCycle) -> bool:
    """Whether any contact force acts."""
    return bool(np.abs(cycle.force).max() > 0.0)


def _acts(cycle: ContactCycle, node: int, component: int) -> bool:
    """Whether the force of a node along a direction exceeds round-off."""
    return bool(np.abs(cycle.force[:, node, component]).max() > _NEGLIGIBLE * np.abs(cycle.force).max())


def _draw(
    panels: Any,
    lines: Sequence[tuple[str, ContactCycle, Array, int]],
    colours: Sequence[Any],
    shown: Sequence[tuple[int, str, str, str]] = PANELS,
    units: Mapping[int, Units] | None = None,
) -> None:
    """T1, T2 and N in a panel each, with these or suitable units; decreasing widths keep coinciding lines visible."""
    widths = np.linspace(WIDEST if len(lines) > 1 else 1.2, 1.2, len(lines))
    motion = max(float(np.abs(cycle.displacement).max()) for _, cycle, _, _ in lines)
    load = max(float(np.abs(cycle.force).max()) for _, cycle, _, _ in lines)
    for (component, _, abscissa, ordinate), axes in zip(shown, panels, strict=True):
        if not any(_acts(cycle, node, component) for _, cycle, _, node in lines):
            axes.remove()
            continue
        x, y = zip(*(_loop(cycle, v0, node, component) for _, cycle, v0, node in lines), strict=True)
        suitable = _fit(x, motion, "m"), _fit(y, load, "N")
        (length, length_unit), (force, force_unit) = units[component] if units else suitable
        for (label, *_), u, f, colour, width in zip(lines, x, y, colours, widths, strict=False):
            axes.plot(u * length, f * force, color=colour, linewidth=width, label=label)
        axes.set(xlabel=f"{abscissa} [{length_unit}]", ylabel=f"{ordinate} [{force_unit}]")
        _finish(axes, motion * length, load * force)


def _loop(cycle: ContactCycle, v0: Array, node: int, component: int) -> tuple[Array, Array]:
    """Closed loop of one component: displacement, m (with v0 where it is the normal one), and force, N."""
    x = cycle.displacement[:, node, component] + (v0[node] if component == 2 else 0.0)
    y = cycle.force[:, node, component]
    return np.append(x, x[0]), np.append(y, y[0])


def _units(cycles: Sequence[ContactCycle], node: int, component: int) -> Units:
    """Units of displacement and force that suit most of some curves."""

    def most(arrays: Sequence[Array], unit: str) -> tuple[float, str]:
        return scale([float(np.median([np.abs(each[:, node, component]).max() for each in arrays]))], unit)

    return most([cycle.displacement for cycle in cycles], "m"), most([cycle.force for cycle in cycles], "N")


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
