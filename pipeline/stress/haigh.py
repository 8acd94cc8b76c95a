"""Haigh diagram of the stress cycles of a curve, and the fatigue margin over the swept value.

In the diagram a margin n is the distance from the origin to the limit line over that to the point. The line of the
required factor is the limit line shrunk by it: what lies below has a larger margin.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import Array, SweepKey, sweep_keys
from pipeline.figures.peaks import SHAPES, set_abscissa
from pipeline.figures.style import (
    BEHIND,
    DISTINCT,
    TO_POINT,
    group_colours,
    keep_apart,
    legend_columns,
    plain_log_labels,
    subplots,
    write_heading,
)
from pipeline.scene.labels import value_label
from pipeline.stress.job import COLOURS, MARGINS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation

    from pipeline.scene.material_section import Fatigue
    from pipeline.scene.reading import Member

MEGA = 1e-6
REQUIRED, LIMIT = DISTINCT[1], "0.0"
LOWER = "margin may be lower, as the motion higher"
TRIANGLE: dict[str, Any] = {"marker": "v", "markerfacecolor": "none", "markersize": 14, "linestyle": "none"}
CLOSE = 0.4  # largest amplitude over the endurance limit below which a second panel shows the places enlarged
_DASHES = ("-", (0, (6, 2)), (0, (1, 1)), (0, (6, 2, 1, 2)))  # of the materials


def allowed_amplitude(limits: tuple[float, float, float | None], mean: Array, factor: float = 1.0) -> Array:
    """Amplitude, Pa, at which the margin at these means, Pa, is `factor`; below 0 where none is allowed."""
    endurance, tensile, strength = limits
    goodman = endurance * (1.0 - factor * np.maximum(mean, 0.0) / tensile) / factor
    return goodman if strength is None else np.minimum(goodman, strength / factor - np.abs(mean))


def haigh_figure(entry: Mapping[str, Any], cycles: Array, fatigue: Fatigue, title: str) -> Figure:
    """Amplitude over mean of the places on the surface, with the hot spots numbered as in the table and the limits.

    Parameters: an entry of `stress` in summary.json; `cycles` (s, 4): mean and amplitude, Pa, margin, and whether the
    place is singular, of each place on the surface.
    """
    singular, heights = cycles[:, 3] > 0.0, cycles[:, 1] * MEGA
    limits = _limits_by_material(entry, fatigue)
    top = max(each[0] for each in limits.values()) * MEGA
    largest = max(float(heights[~singular].max(initial=0.0)), *(s["amplitude_pa"] * MEGA for s in entry["hot_spots"]))
    close = largest < CLOSE * top
    figure, places = subplots(1, 1 + close, size=(8.0 + 4.6 * close, 5.4), squeeze=False)
    for axes in places[0]:
        shown = _draw_cycles(axes, cycles, fatigue.factor)
        low, right = _mean_range(entry, cycles, limits)
        for dash, (name, each) in zip(_DASHES, limits.items(), strict=False):
            _draw_limits(axes, each, (low, right), fatigue.factor, (dash, f" ({name})" * (len(limits) > 1)))
        axes.set(xlim=(low, 1.02 * right), ylim=(0.0, 1.08 * max(top, largest)), xlabel="mean stress [MPa]")
        axes.set_ylabel("stress amplitude [MPa]")
        labels = _draw_spots(axes, entry["hot_spots"])
    if close:
        for label in places[0, 0].texts:
            label.set_visible(False)
        inside = cycles[~singular, 0] * MEGA
        margin = 0.06 * float(np.ptp(inside))
        axes.set(xlim=(inside.min() - margin, inside.max() + margin), ylim=(0.0, 1.3 * largest), title="enlarged")
        places[0, 0].set_title("whole diagram")
    bar = figure.colorbar(shown, ax=list(places[0]), label=f"margin (required {fatigue.factor:g})", extend="both")
    plain_log_labels(bar.ax.yaxis)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2 + close, fontsize=8.5)
    write_heading(figure, title)
    keep_apart(axes, labels)
    return figure


def _limits_by_material(entry: Mapping[str, Any], fatigue: Fatigue) -> dict[str, tuple[float, float, float | None]]:
    """Limits of the materials of the hot spots, at the temperature of the first one of each."""
    places = {spot["material"]: spot.get("temperature") for spot in reversed(entry["hot_spots"])}
    return {name: limits for name, at in places.items() if (limits := fatigue.limits_of(name, at)) is not None}


def _mean_range(
    entry: Mapping[str, Any], cycles: Array, limits: Mapping[str, tuple[float, float, float | None]]
) -> tuple[float, float]:
    """Ends of the axis of the mean, MPa."""
    means = [*(spot["mean_pa"] for spot in entry["hot_spots"]), *cycles[cycles[:, 3] == 0.0, 0]]
    return 1.05 * MEGA * min(0.0, *means), MEGA * max(*(each[1] for each in limits.values()), *means)


def _draw_cycles(axes: Axes, cycles: Array, required: float) -> Any:
    """The places on the surface, in the colours of their margins."""
    mean, amplitude, margin = cycles[:, 0] * MEGA, cycles[:, 1] * MEGA, cycles[:, 2]
    singular = cycles[:, 3] > 0.0
    if singular.any():
        look: dict[str, Any] = {"linestyle": "none", "markersize": 3.0, "color": "0.8", "zorder": 1.2}
        axes.plot(mean[singular], amplitude[singular], "x", label="surface, at singular places", **look)
    known = ~singular & np.isfinite(margin)
    dots: dict[str, Any] = {"s": 7.0, "linewidths": 0.0, "zorder": 2.0, "rasterized": True}
    dots |= margin_colours(required)
    return axes.scatter(mean[known], amplitude[known], c=margin[known], label="surface", **dots)


def margin_colours(required: float) -> dict[str, Any]:
    """Colours of margins, the required one in the middle of them."""
    from matplotlib.colors import LogNorm

    return {"cmap": COLOURS, "norm": LogNorm(required / MARGINS, required * MARGINS)}


def _draw_limits(
    axes: Axes,
    limits: tuple[float, float, float | None],
    ends: tuple[float, float],
    factor: float,
    look: tuple[Any, str],
) -> None:
    """Goodman line, yield line, and both shrunk by the required factor."""
    dash, of = look
    mean = np.unique([*np.linspace(*ends, 400), 0.0]) / MEGA
    lines: list[tuple[Array, dict[str, Any]]] = [
        (
            allowed_amplitude((limits[0], limits[1], None), mean),
            {"color": LIMIT, "linewidth": 1.2, "zorder": BEHIND + 0.1, "label": f"Goodman line{of}"},
        ),
        (
            allowed_amplitude(limits, mean, factor),
            {"color": REQUIRED, "linewidth": 3.0, "label": f"required factor {factor:g}{of}"},
        ),
    ]
    if limits[2] is not None:
        langer = limits[2] - np.abs(mean)
        lines.insert(1, (langer, {"color": "0.45", "linewidth": 1.0, "label": f"yield line{of}"}))
    for height, line in lines:
        inside = height >= 0.0
        axes.plot(mean[inside] * MEGA, height[inside] * MEGA, linestyle=dash, **{"zorder": BEHIND, **line})


def _draw_spots(axes: Axes, spots: Sequence[Mapping[str, Any]]) -> list[Annotation]:
    """The hot spots, a line of the legend for each, and their numbers."""
    look: dict[str, Any] = {"textcoords": "offset points", "fontsize": 9, "zorder": 6, "arrowprops": TO_POINT}
    look["bbox"] = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
    labels = [
        axes.annotate(str(number), (spot["mean_pa"] * MEGA, spot["amplitude_pa"] * MEGA), (6, 6), **look)
        for number, spot in enumerate(spots, 1)
    ]
    for number, spot in enumerate(spots, 1):
        x, y, z = (f"{1e3 * at:.0f}" for at in spot["position_m"])
        margin = "no limits" if spot["margin"] is None else f"margin {spot['margin']:.3g}"
        label = f"{number}: {margin}, at ({x}, {y}, {z}) mm"
        place = [spot["mean_pa"] * MEGA], [spot["amplitude_pa"] * MEGA]
        axes.plot(*place, "o", color="0.0", markerfacecolor="none", markersize=6, zorder=5, label=label)
    return labels


def margin_figure(
    entries: Sequence[Mapping[str, Any]],
    members: Sequence[Member],
    colours: Mapping[int, Any],
    title: str,
    unsure: Collection[int] = (),
) -> Figure | None:
    """Least margin outside of singular places over the swept key with the most values; a mark for each curve.

    Circles: along a line from the origin of the Haigh diagram; open: of the amplitude at its mean. None for one curve
    or without limits. `members`: of the curves of the entries; `unsure`: curves whose motion may be higher than the
    one that the stress is of, which have triangles around their circles.
    """
    known = [(e, m) for e, m in zip(entries, members, strict=True) if e["least_margin"] is not None]
    keys: list[SweepKey] = sweep_keys([member for _, member in known])
    if len(known) < 2 or not keys:
        return None
    key, required = keys[0], float(known[0][0]["required_margin"])
    figure, axes = subplots(size=(7.2, 4.4))
    others = [_others(member, key.name) for _, member in known]
    names = list(dict.fromkeys(others))
    shapes = dict(zip(names, SHAPES * (1 + len(names) // len(SHAPES)), strict=False))
    shades = dict(zip(names, group_colours(len(names)), strict=True))
    heights = [required]
    for (entry, member), other in zip(known, others, strict=True):
        colour = colours[member.index] if len(names) == 1 else shades[other]
        of_amplitude = entry["least_amplitude_margin"]
        look: dict[str, Any] = {"color": colour, "marker": shapes[other], "linestyle": "none"}
        x, said = key.position(member.parameters[key.name]), f"{other}, " if other else ""
        axes.plot(x, entry["least_margin"], label=f"_{said}margin", markersize=7, **look)
        heights.append(entry["least_margin"])
        if of_amplitude is not None:
            open_look = look | {"markerfacecolor": "none", "markersize": 9}
            axes.plot(x, of_amplitude, label=f"_{said}margin at fixed mean stress", **open_look)
            heights.append(of_amplitude)
        if entry["curve"] in unsure:
            axes.plot(x, entry["least_margin"], color=colour, label=f"_{said}{LOWER}", **TRIANGLE)
    for name in names:
        look = {"marker": shapes[name], "color": shades[name] if len(names) > 1 else "0.35", "linestyle": "none"}
        axes.plot([], [], label=f"{name}, margin" if name else "margin", **look)
    look = {"marker": "o", "color": "0.35", "markerfacecolor": "none", "markersize": 9, "linestyle": "none"}
    axes.plot([], [], label="margin at fixed mean stress", **look)
    if any(entry["curve"] in unsure for entry, _ in known):
        axes.plot([], [], color="0.35", label=LOWER, **TRIANGLE)
    axes.axhline(required, color=REQUIRED, linewidth=2.0, zorder=BEHIND, label=f"required factor {required:g}")
    above = [height for height in heights if height > 0.0]
    axes.set_yscale("log")
    axes.set_ylim(min(above) / 1.4, max(above) * 1.4)
    plain_log_labels(axes.yaxis)
    set_abscissa(axes, key)
    axes.set(xlabel=key.axis, ylabel="least fatigue margin")
    handles, shown = axes.get_legend_handles_labels()
    columns = legend_columns(figure, shown, 2)
    figure.legend(handles, shown, loc="outside lower center", ncols=columns, fontsize=9)
    write_heading(axes, title)
    return figure


def _others(member: Member, key: str) -> str:
    """The swept values of a member but that of one key."""
    return ", ".join(value_label(name, value) for name, value in member.parameters.items() if name != key)
