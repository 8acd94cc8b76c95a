"""Limit cycles: damping of waves over amplitude, and the cycles over the swept value or the nodal diameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.style import give_data, ordered_colours, plain_log_labels, scale, subplots, write_heading
from pipeline.scene.labels import quantity
from pipeline.studies.backbone.figure import log_abscissa
from pipeline.studies.flutter.result import CurveFlutter, CycleFacts, FlutterResult, RingInTime, WaveCycles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 9  # waves drawn over amplitude, evenly chosen
SMALLEST = 1e4  # ratio of the largest amplitude of waves in time to the smallest that is told apart
BEYOND = 30.0  # amplitudes drawn, over the largest cycle or first slip
MARK: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 5.5, "zorder": 3}
KINDS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("lasts in the ring", {"markeredgecolor": "none"}),
    ("another wave grows on it", {"markerfacecolor": "none"}),
    ("larger motions grow for ever", {"marker": "x"}),
)


def flutter_figure(result: FlutterResult, title: str) -> Figure | None:
    """Damping over amplitude on the left, cycles on the right; None where no wave has a mode."""
    shown = [curve for curve in result.curves if any(wave.vibration_m.size for wave in curve.waves)]
    if not shown:
        return None
    curve, key = max(shown, key=_lasting), _swept(shown)
    waves = _chosen([wave for wave in curve.waves if wave.vibration_m.size])
    colours = dict(zip([wave.nodal_diameter for wave in waves], ordered_colours(len(waves)), strict=True))
    ring = next((each for each in shown if each.ring is not None and each.ring.periods.size), None)
    figure, axes = subplots(2 if ring else 1, 2, size=(12.0, 9.0 if ring else 4.6), squeeze=False)
    _draw_damping(axes[0, 0], waves, colours)
    _draw_cycles(axes[0, 1], shown, key, colours)
    if ring is not None and ring.ring is not None:
        _draw_ring(axes[1, 0], ring.ring, ring.label)
        _draw_end(axes[1, 1], ring, ring.ring)
    _legend(figure, colours)
    place = f"; {'upper left' if ring else 'left'}: {curve.label}" if key else ""
    write_heading(figure, f"{title}\nmode {result.mode} in the flow{place}")
    return figure


def _lasting(curve: CurveFlutter) -> tuple[int, int]:
    """Numbers of cycles that last, and of all."""
    cycles = [cycle for wave in curve.waves for cycle in wave.cycles]
    return sum(cycle.persists for cycle in cycles), len(cycles)


def _swept(curves: Sequence[CurveFlutter]) -> str | None:
    """The one key that is swept, where it has numbers."""
    keys = {key for curve in curves for key in curve.parameters}
    if len(keys) != 1 or len(curves) < 2:
        return None
    (key,) = keys
    return key if all(isinstance(curve.parameters[key], int | float) for curve in curves) else None


def _chosen(waves: Sequence[WaveCycles]) -> list[WaveCycles]:
    """A few of the waves, evenly."""
    places = np.unique(np.linspace(0, len(waves) - 1, min(MOST, len(waves))).round().astype(int))
    return [waves[place] for place in places]


def _draw_damping(axes: Axes, waves: Sequence[WaveCycles], colours: dict[int, Any]) -> None:
    sizes = [cycle.vibration_m for wave in waves for cycle in wave.cycles] + [wave.linear_limit_m for wave in waves]
    factor, unit = scale(sizes, "m")
    for wave in waves:
        colour, seen = colours[wave.nodal_diameter], wave.vibration_m < BEYOND * max(sizes)
        axes.plot(wave.vibration_m[seen] * factor, 100.0 * wave.mode_damping_ratio[seen], color=colour)
        for cycle in wave.cycles:
            axes.plot(cycle.vibration_m * factor, 0.0, color=colour, **(MARK | KINDS[_kind(cycle)][1]))
    low, high = axes.get_ylim()
    axes.axhspan(min(low, 0.0), 0.0, color="#D55E00", alpha=0.12, zorder=0, linewidth=0.0)
    axes.set_ylim(low, high)
    axes.axhline(0.0, color="0.3", linewidth=0.8)
    log_abscissa(axes, np.concatenate([wave.vibration_m[wave.vibration_m < BEYOND * max(sizes)] for wave in waves]))
    axes.set_xlabel(f"amplitude [{unit}]")
    axes.set_ylabel("damping ratio [%] (below 0: the wave grows)")


def _kind(cycle: CycleFacts) -> int:
    return 2 if not cycle.attracting else 0 if cycle.persists else 1


def _draw_cycles(axes: Axes, curves: Sequence[CurveFlutter], key: str | None, colours: dict[int, Any]) -> None:
    """Over the swept value, a colour for each wave; else all waves of all curves over the nodal diameter."""
    found: list[tuple[float, CycleFacts, Any]] = []
    shown = None if key is None else quantity(key)
    for curve in curves:
        place = 0.0 if shown is None or key is None else shown.factor * float(curve.parameters[key])
        for wave in curve.waves:
            if key is None:
                found += [(wave.nodal_diameter, cycle, "0.3") for cycle in wave.cycles]
            elif wave.nodal_diameter in colours:
                found += [(place, cycle, colours[wave.nodal_diameter]) for cycle in wave.cycles]
    factor, unit = scale([cycle.vibration_m for _, cycle, _ in found] or [1e-6], "m")
    for place, cycle, colour in found:
        axes.plot(place, cycle.vibration_m * factor, color=colour, **(MARK | KINDS[_kind(cycle)][1]))
    for colour in colours.values() if key is not None else ():
        held = sorted(
            (x, cycle.vibration_m * factor) for x, cycle, own in found if own == colour and cycle.attracting
        )
        axes.plot([x for x, _ in held], [y for _, y in held], color=colour, linewidth=0.8, zorder=2)
    heights = [cycle.vibration_m for _, cycle, _ in found]
    if heights and max(heights) > 20.0 * min(heights):
        axes.set_yscale("log")
        plain_log_labels(axes.yaxis)
    axes.set_xlabel("nodal diameter (below 0: forward waves)" if shown is None else shown.axis())
    axes.set_ylabel(f"amplitude of the cycle [{unit}]")


def _draw_ring(axes: Axes, ring: RingInTime, label: str) -> None:
    """Amplitudes of all waves over time, as colours."""
    from matplotlib.colors import LogNorm

    sizes = np.array(ring.amplitude_m)
    factor, unit = scale(sizes[np.isfinite(sizes)], "m")
    sizes = sizes * factor
    middles = 0.5 * (ring.periods[1:] + ring.periods[:-1])
    step = ring.periods[0] - (middles[0] if middles.size else 0.0)
    edges = np.concatenate([[max(ring.periods[0] + step, 0.0)], middles, [ring.periods[-1] - step]])
    waves = np.arange(len(sizes) + 1) + ring.nodal_diameter[0] - 0.5
    least = float(sizes.max()) / SMALLEST
    norm = LogNorm(least, float(sizes.max()), clip=True)
    drawn = axes.pcolormesh(edges, waves, np.maximum(sizes, least), norm=norm, cmap="cividis", rasterized=True)
    bar = axes.figure.colorbar(drawn, ax=axes, pad=0.01)
    bar.set_label(f"amplitude of the wave [{unit}]")
    plain_log_labels(bar.ax.yaxis)
    axes.set_xlabel(f"periods of {ring.frequency_hz:.4g} Hz")
    axes.set_ylabel("nodal diameter (below 0: forward waves)")
    axes.set_title(f"ring in time, {label}".rstrip(", "), fontsize=10)
    columns: dict[str, list[float]] = {"periods": [], "nodal diameter": [], f"amplitude of the wave [{unit}]": []}
    for n, row in zip(ring.nodal_diameter, sizes, strict=True):
        for values, new in zip(columns.values(), (ring.periods, np.full(len(row), n), row), strict=True):
            values += new.tolist()
    give_data(axes, columns)


def _draw_end(axes: Axes, curve: CurveFlutter, ring: RingInTime) -> None:
    """Amplitudes of all waves at the end, beside the cycles of each wave alone."""
    ends = np.array([values[-1] for values in ring.amplitude_m])
    cycles = [(wave.nodal_diameter, cycle) for wave in curve.waves for cycle in wave.cycles if cycle.attracting]
    factor, unit = scale([*ends, *(cycle.vibration_m for _, cycle in cycles)], "m")
    axes.bar(ring.nodal_diameter, ends * factor, width=0.7, color="#0072B2", label="at the end")
    for n, cycle in cycles:
        axes.plot(n, cycle.vibration_m * factor, color="0.2", **(MARK | KINDS[_kind(cycle)][1]))
    axes.set_xlabel("nodal diameter (below 0: forward waves)")
    axes.set_ylabel(f"amplitude [{unit}]")
    axes.locator_params(axis="x", integer=True)
    axes.set_title(f"after {ring.periods[-1]:.0f} periods (circles: each wave alone)", fontsize=10)


def _legend(figure: Figure, colours: dict[int, Any]) -> None:
    """An entry for each kind of cycle and each wave."""
    from matplotlib.lines import Line2D

    entries = [Line2D([], [], color="0.3", **(MARK | look)) for _, look in KINDS]
    entries += [Line2D([], [], color=colour) for colour in colours.values()]
    names = [*(name for name, _ in KINDS), *(f"nodal diameter {n}" for n in colours)]
    figure.legend(entries, names, loc="outside right center", fontsize=9)
