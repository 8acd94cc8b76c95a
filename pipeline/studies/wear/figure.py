"""Figure of the study `wear`: motion, load, interference over the life, worn depth over the face."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.style import (
    CURVES_LOG_FROM,
    DISTINCT,
    give_data,
    scale,
    set_height_axis,
    subplots,
    write_heading,
)
from pipeline.studies.wear.result import Numbers, WearResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOAD, POWER, SPAN, BAND, EVENT = DISTINCT[0], DISTINCT[1], DISTINCT[2], "#B3D4EA", "0.6"
DRAWN = ("limit", "jump", "higher peak", "stick", "separation", "lost")  # events with a line
LEVELS = 11  # ends of colours of worn depth
SHARES = (0.1, 0.25, 0.5, 1.0)  # of the life, at which the worn face is drawn
FLAT = 1e-3  # size of a face along a direction, relative to the other, that is none


def wear_figure(result: WearResult, title: str) -> Figure:
    """The life of the contact faces."""
    figure, axes = subplots(2, 2, size=(11.0, 7.2))
    _draw_motion(axes[0, 0], result)
    _draw_load(axes[0, 1], result)
    _draw_interference(axes[1, 0], result)
    for place in (axes[0, 0], axes[0, 1], axes[1, 0]):
        for event in result.events:
            if event.kind in DRAWN:
                place.axvline(event.hours, color=EVENT, linewidth=0.8, linestyle=":", zorder=1.0)
        place.set_xlabel("time [h]")
        place.set_xlim(0.0, float(result.hours[-1]))
    _draw_face(figure, axes[1, 1], result)
    write_heading(figure, f"{title}: wear over {result.hours[-1]:.5g} h, {result.cycles[-1]:.3g} cycles")
    return figure


def _draw_motion(axes: Axes, result: WearResult) -> None:
    """Amplitudes of the operating points, and worst motions."""
    worst = np.array([each.worst_m for each in result.responses])
    factor, unit = scale(np.append(result.highest_m, worst[np.isfinite(worst)]), "m")
    for number, point in enumerate(result.points):
        colour = DISTINCT[number % len(DISTINCT)]
        axes.plot(result.hours, point.amplitude_m * factor, color=colour, label=f"followed, {point.label}")
    hours = [each.hours for each in result.responses]
    axes.plot(hours, worst * factor, "o", color="black", markersize=4.5, label="worst motion", zorder=4)
    heights = np.concatenate([*(point.amplitude_m for point in result.points), worst[np.isfinite(worst)]])
    set_height_axis(axes, heights * factor, CURVES_LOG_FROM)
    known = [each for each in (() if result.lives is None else result.lives.quantiles) if each.known]
    if len(known) > 1:
        said = f"limit, {100.0 * known[0].level:g} to {100.0 * known[-1].level:g} % of the lives"
        axes.axvspan(known[0].hours, known[-1].hours, color=SPAN, alpha=0.25, linewidth=0.0, zorder=0.5, label=said)
    axes.set_ylabel(f"amplitude [{unit}]")
    axes.legend(fontsize=9)


def _draw_load(axes: Axes, result: WearResult) -> None:
    """Normal load of each operating point, and the power of friction."""
    for number, point in enumerate(result.points):
        style: dict[str, Any] = {"color": LOAD, "alpha": 1.0 - 0.6 * number / max(len(result.points), 1)}
        axes.plot(result.hours, point.load_n, **style)
    axes.set_ylabel("normal load [N]", color=LOAD)
    axes.set_ylim(bottom=0.0)
    power = axes.twinx()
    factor, unit = scale(result.power_w, "W")
    power.plot(result.hours, result.power_w * factor, color=POWER)
    power.set_ylabel(f"power of friction [{unit}]", color=POWER)
    power.set_ylim(bottom=0.0)


def _draw_interference(axes: Axes, result: WearResult) -> None:
    """Interference left, from the least to the most worn node."""
    left = np.array(result.interference_m)
    factor, unit = scale(left.ravel(), "m")
    axes.fill_between(result.hours, left.min(axis=0) * factor, left.max(axis=0) * factor, color=BAND)
    for each in left:
        axes.plot(result.hours, each * factor, color=LOAD, linewidth=0.7)
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_ylabel(f"interference left [{unit}], gap below 0")


def _draw_face(figure: Figure, axes: Axes, result: WearResult) -> None:
    """Worn depth over the most worn interface, a map for each of some times; bars at the end where it is no face."""
    from matplotlib.ticker import MaxNLocator

    name, places = _most_worn(result)
    nodes = result.of_interface(name)
    depth = np.array([result.depth_m[node] for node in nodes])
    factor, unit = scale(depth[:, -1], "m")
    if places is None:
        axes.bar(np.arange(len(depth)), depth[:, -1] * factor, color=LOAD)
        axes.set_xlabel(f"contact node of {name}")
        axes.set_ylabel(f"worn depth [{unit}]")
        return
    spot: Any = axes.get_subplotspec()
    axes.remove()
    maps = spot.subgridspec(2, 2).subplots(sharex=True, sharey=True)
    levels = np.linspace(0.0, float(depth.max()) * factor or 1.0, LEVELS)
    for share, place in zip(SHARES, maps.flat, strict=True):
        hours = share * float(result.hours[-1])
        worn = factor * np.array([np.interp(hours, result.hours, each) for each in depth])
        drawn = place.tricontourf(*(places * 1e3).T, worn, levels=levels, cmap="viridis")
        place.plot(*(places * 1e3).T, ".", color="black", markersize=3.0, clip_on=False)
        place.set_title(f"after {hours:.5g} h", fontsize=9)
        place.grid(visible=False)
        place.tick_params(labelsize=8)
        columns: dict[str, Any] = {"along t1 [mm]": places[:, 0] * 1e3, "along t2 [mm]": places[:, 1] * 1e3}
        give_data(place, columns | {f"worn depth of {name} [{unit}]": worn})
    for place in maps[1]:
        place.set_xlabel("along t1 [mm]", fontsize=9)
    for place in maps[:, 0]:
        place.set_ylabel("along t2 [mm]", fontsize=9)
    bar = figure.colorbar(drawn, ax=list(maps.flat))
    bar.set_label(f"worn depth of {name} [{unit}]")
    bar.ax.yaxis.set_major_locator(MaxNLocator(6))


def _most_worn(result: WearResult) -> tuple[str, Numbers | None]:
    """The interface with the deepest wear, and its nodes along t1 and t2, (n, 2), m; None: no face."""
    deepest = max(range(len(result.depth_m)), key=lambda node: float(result.depth_m[node][-1]))
    name = result.interface[deepest]
    nodes = result.of_interface(name)
    if not result.frame or len(nodes) < 4:
        return name, None
    position = np.array([result.position_m[node] for node in nodes])
    frame = result.frame[deepest].reshape(3, 3)
    places = (position - position.mean(axis=0)) @ frame[:2].T
    size = np.ptp(places, axis=0)
    return name, places if size.min() > FLAT * size.max() else None
