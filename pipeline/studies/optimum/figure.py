"""The worst motion over a parameter: peaks, envelope, frequency, the optimum; derivatives by all parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import mul
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.peak_curves.optimum_result import KINDS
from pipeline.figures.data import SweepKey
from pipeline.figures.style import (
    DISTINCT,
    LOG_FROM,
    ordered_colours,
    plain_log_labels,
    scale,
    set_height_axis,
    subplots,
    write_heading,
)
from pipeline.scene.dotted_keys import of_contact
from pipeline.scene.labels import quantity
from pipeline.scene.schema import meaning_of
from pipeline.studies.optimum.checks import KEYS, SOLVER_KEYS
from pipeline.studies.optimum.result import OptimumResult, Robust, Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nonlinear.peak_curves.optimum_result import Optimum, PeakCurve, SolvedResponse, WorstEnvelope


def elasticities_of(result: OptimumResult) -> dict[str, float]:
    """Relative derivatives of the worst motion by dotted keys, in % per %, without parameters that are 0."""
    found = result.followed
    return {} if found is None else {KEYS[name]: size for name, size in found.elasticities.items() if size != 0.0}


Array = NDArray[np.float64]

DECADES_FROM = 20.0  # ratio of the ends of the range above which the parameter has a logarithmic axis
HEADROOM = 1.35  # of a logarithmic axis above the highest worst motion
JUMP, VISIBLE = 5.0, 0.004  # a jump of the frequency: beside its neighbours, and beside the frequency
SMALL = 5e-3  # a logarithmic derivative that counts as none
_PEAKS: dict[str, dict[str, Any]] = {
    "followed peak, stable": {"color": "0.45", "linewidth": 0.9},
    "followed peak, unstable": {"color": "0.45", "linewidth": 0.9, "linestyle": (0, (4, 2))},
    "followed peak, stability not computed": {"color": "0.7", "linewidth": 0.9, "linestyle": (0, (1, 1.5))},
}
_ENVELOPE: dict[str, dict[str, Any]] = {
    "followed": {"color": DISTINCT[0], "linewidth": 2.6, "zorder": 3, "label": "worst motion"},
    "responses": {
        "color": DISTINCT[4],
        "linewidth": 2.6,
        "zorder": 3,
        "label": "worst motion, between responses",
    },
    "open": {
        "color": DISTINCT[4],
        "linewidth": 2.2,
        "linestyle": (0, (1, 0.8)),
        "zorder": 3,
        "label": "left open: highest solution",
    },
}
_RESPONSE: dict[str, Any] = {
    "color": DISTINCT[0],
    "markerfacecolor": "white",
    "markersize": 5,
    "linestyle": "none",
    "zorder": 4,
    "clip_on": False,
}
_MARK: dict[str, Any] = {"markeredgecolor": "white", "markeredgewidth": 0.8, "linestyle": "none", "zorder": 6}
_OPTIMUM: dict[str, Any] = {**_MARK, "marker": "*", "markersize": 15, "color": DISTINCT[1], "clip_on": False}
_OWN: dict[str, Any] = {**_MARK, "marker": "D", "markersize": 7, "color": DISTINCT[3], "clip_on": False}
_WITHIN: dict[str, Any] = {"color": DISTINCT[0], "linewidth": 2.6, "zorder": 3}
_PATH: dict[str, Any] = {
    "color": DISTINCT[1],
    "linewidth": 0.8,
    "marker": "o",
    "markersize": 9,
    "markerfacecolor": "none",
    "zorder": 4,
}
_BEST: dict[str, Any] = {
    "marker": "o",
    "markersize": 8,
    "markerfacecolor": "white",
    "linestyle": "none",
    "zorder": 4,
}
COUNTED = "counted by the highest solution"  # what was left open
FEWEST_FOR_MAP = 4  # curves over two keys that are drawn as a map
NEAR = 2.0  # top of the panel of these lines, by the highest of their best
MOST_LINES = 12  # values of a key that are a line each
_RANGE: dict[str, Any] = {"color": DISTINCT[2], "alpha": 0.13, "linewidth": 0.0, "zorder": 0}


def optimum_figure(result: OptimumResult, title: str) -> Figure | None:
    """The figure of the study: the worst motion over one key, with its envelope, or the values tried of several."""
    if len(result.ranges) == 2 and len(result.solved) >= FEWEST_FOR_MAP:
        return (joint_figure if has_lines(result) else search_figure)(result, title)
    if result.robust is not None and result.robust.key:
        return robust_figure(result, result.robust, title)
    if result.over_one_key is not None:
        return curves_figure(result, result.over_one_key, title)
    return trials_figure(result, title) if result.trials else None


def heights_of(result: OptimumResult, values: Sequence[float]) -> tuple[Callable[[Any], Any], str]:
    """How values of what is made low are drawn, and the label of their axis."""
    if result.objective == "margin":
        return lambda value: 1.0 / value, result.named
    factor, unit = scale(values, "Pa" if result.objective == "stress" else "m")
    return lambda value: value * factor, f"{result.named} [{unit}]"


def robust_figure(result: OptimumResult, robust: Robust, title: str) -> Figure:
    """The worst motion over one key, the worst within the tolerance as a second line, and the tolerance shaded."""
    figure, axes = subplots(size=(8.6, 5.4))
    key, named = robust.key, quantity(robust.key)
    at, best, half = named.factor, result.values[robust.key], robust.tolerance[robust.key]
    computed = [trial for trial in robust.computed if math.isfinite(trial.value)]
    shown, label_of_heights = heights_of(result, [trial.value for trial in computed])
    places = np.array([trial.values[key] for trial in computed]) * at
    heights = shown(np.array([trial.value for trial in computed]))
    is_open = np.array([bool(trial.unresolved) or trial.at_end for trial in computed])
    axes.plot(places, heights, color="0.45", linewidth=0.9, zorder=2)
    for mask, marker, label in ((~is_open, "o", "curve computed"), (is_open, "^", COUNTED)):
        if mask.any():
            axes.plot(places[mask], heights[mask], marker=marker, label=label, **_RESPONSE)
    width = f"±{named.value(float(f'{half:.4g}'))}"
    by_law = math.isfinite(robust.quantile)
    side, most = ("above", "lowest") if result.objective == "margin" else ("below", "highest")
    line = f"{100.0 * robust.quantile:g} % {side}, with the distribution" if by_law else f"{most} within {width}"
    axes.plot(robust.value * at, shown(robust.worst), label=line, **_WITHIN)
    shade = "95 % of the distribution" if by_law else f"tolerance, {width}"
    axes.axvspan((best - half) * at, (best + half) * at, label=f"{shade} around the optimum", **_RANGE)
    own = result.base.values.get(key, math.nan)
    if places.min() <= own * at <= places.max() and math.isfinite(result.base.value):
        label = f"the scene's value, {named.value(_rounded(own))}"
        axes.plot(own * at, shown(result.base.value), label=label, **_OWN)
    label = f"optimum, {named.value(_rounded(best))} ({KINDS[result.kind].said})"
    axes.plot(best * at, shown(result.value), label=label, **_OPTIMUM)
    axes.set(xlabel=SweepKey(key, ()).axis, ylabel=label_of_heights)
    if result.objective != "margin":
        set_height_axis(axes, heights)
    axes.margins(x=0.02)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=9)
    write_heading(figure, title)
    return figure


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def has_lines(result: OptimumResult) -> bool:
    """Whether one of two keys has so few values that each is a line over the other."""
    return len({trial.values[_inner_and_outer(result)[1]] for trial in result.solved}) <= MOST_LINES


def _inner_and_outer(result: OptimumResult) -> tuple[str, str]:
    """Of two keys the one over which there is an optimum at each value of the other."""
    first, second = sorted(result.ranges, key=lambda key: of_contact(key) in SOLVER_KEYS)
    inner = result.robust.key if result.robust is not None and result.robust.key else second
    return inner, first if inner == second else second


def joint_figure(result: OptimumResult, title: str) -> Figure:
    """Curves over one key, a line for each value of another; beside them the best of each value, and its place."""
    figure, axes = subplots(2, 2, size=(11.0, 5.8))
    left, upper, lower = axes[0, 0], axes[0, 1], axes[1, 1]
    grid = left.get_gridspec()
    grid.set_width_ratios((1.35, 1.0))
    axes[1, 0].remove()
    left.set_subplotspec(grid[:, 0])
    inner, outer = _inner_and_outer(result)
    robust, at = result.robust, (quantity(inner).factor, quantity(outer).factor)
    half = robust.tolerance.get(inner, 0.0) * at[0] if robust is not None else 0.0
    solved = [trial for trial in result.solved if math.isfinite(trial.value)]
    shown, named = heights_of(result, [trial.value for trial in solved])
    values = sorted({trial.values[outer] for trial in solved})
    best = {trial.values[outer]: trial for trial in result.trials if math.isfinite(trial.value)}
    for value, colour in zip(values, ordered_colours(len(values)), strict=True):
        line = sorted((t.values[inner], t.value) for t in solved if t.values[outer] == value)
        x, y = np.array(line).T
        label = quantity(outer).value(_rounded(value))
        left.plot(x * at[0], shown(y), color=colour, label=label, marker=".", markersize=4, linewidth=0.9)
        if value in best:
            trial, look = best[value], {**_BEST, "color": colour}
            place, height = trial.values[inner] * at[0], shown(trial.value)
            left.errorbar(place, height, xerr=half or None, capsize=3, elinewidth=1.6, **look)
            upper.plot(value * at[1], height, **look)
            lower.errorbar(value * at[1], place, yerr=half or None, capsize=3, elinewidth=1.6, **look)
    order = sorted(best)
    behind: dict[str, Any] = {"color": "0.6", "linewidth": 0.8, "zorder": 1}
    upper.plot([value * at[1] for value in order], [shown(best[value].value) for value in order], **behind)
    lower.plot([value * at[1] for value in order], [best[value].values[inner] * at[0] for value in order], **behind)
    said = ", ".join(quantity(key).value(_rounded(value)) for key, value in result.values.items())
    places = (result.values[inner] * at[0], result.values[outer] * at[1])
    star: dict[str, Any] = {**_OPTIMUM, "label": f"optimum, {said}"}
    left.plot(places[0], shown(result.value), **star)
    upper.plot(places[1], shown(result.value), **star)
    lower.plot(places[1], places[0], **star)
    heights = shown(np.array([trial.value for trial in solved]))
    if result.objective == "margin":
        set_height_axis(left, heights)
    else:  # curves of bad values leave the panel
        top = NEAR * max((shown(trial.value) for trial in best.values()), default=heights.max())
        left.set_ylim(0.9 * heights.min(), min(top, 1.05 * heights.max()))
    within = f"highest within ±{quantity(inner).value(_rounded(half / at[0]))}" if half else "best"
    left.set(xlabel=SweepKey(inner, ()).axis, ylabel=named)
    upper.set_ylabel(f"{within}\n{named}")
    lower.set(xlabel=SweepKey(outer, ()).axis, ylabel=f"best {quantity(inner).axis()}")
    upper.sharex(lower)
    upper.tick_params(labelbottom=False)
    ncols = min(len(values) + 1, 8)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=ncols, fontsize=9)
    write_heading(figure, title)
    return figure


def search_figure(result: OptimumResult, title: str) -> Figure:
    """All curves of a search over two keys by their worst motion; below the best of each value tried."""
    figure, (axes, lower) = subplots(2, 1, size=(8.6, 7.4), sharex="col")
    axes.get_gridspec().set_height_ratios((2.0, 1.0))
    first, second = sorted(result.ranges, key=lambda key: of_contact(key) in SOLVER_KEYS)
    solved = [trial for trial in result.solved if math.isfinite(trial.value)]
    shown, named = heights_of(result, [trial.value for trial in solved])
    drawn = _draw_solved(axes, solved, (first, second), shown(np.array([trial.value for trial in solved])))
    tried = [trial for trial in result.trials if math.isfinite(trial.value)]
    tried.sort(key=lambda trial: trial.values[first])
    path = _places(tried, (first, second))
    if len(path):
        axes.plot(*path.T, label=f"best {quantity(second).symbol} of each value tried", **_PATH)
        heights = shown(np.array([trial.value for trial in tried]))
        lower.plot(path[:, 0], heights, **_PATH)
        if not set_height_axis(lower, heights):
            lower.set_ylim(0.0, 1.1 * heights.max())
    if set(result.ranges) <= set(result.base.values):
        axes.plot(*_places([result.base], (first, second)).T, label="the scene's values", **_OWN)
    said = ", ".join(quantity(key).value(_rounded(value)) for key, value in result.values.items())
    best = _places([result], (first, second))[0]
    axes.plot(*best, label=f"optimum, {said}", **_OPTIMUM)
    lower.plot(best[0], shown(result.value), **_OPTIMUM)
    bar = figure.colorbar(drawn, ax=axes, label=named)
    if bar.ax.get_yscale() == "log":
        plain_log_labels(bar.ax.yaxis)
    within = " within the tolerance" if result.robust is not None else ""
    axes.set_ylabel(SweepKey(second, ()).axis)
    lower.set(xlabel=SweepKey(first, ()).axis, ylabel=f"best{within}\n{named}")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=9)
    write_heading(figure, title)
    return figure


def _places(trials: Sequence[Trial | OptimumResult], keys: tuple[str, str]) -> Array:
    """Values of two keys in the units of the figure, (n, 2)."""
    factors = [quantity(key).factor for key in keys]
    return np.array(
        [[trial.values[key] * factor for key, factor in zip(keys, factors, strict=True)] for trial in trials]
    ).reshape(-1, 2)


def _draw_solved(axes: Axes, solved: Sequence[Trial], keys: tuple[str, str], heights: Array) -> Any:
    """A coloured dot for each curve."""
    from matplotlib.colors import LogNorm, Normalize

    spans = heights.max() > LOG_FROM * heights.min() > 0.0
    norm = (LogNorm if spans else Normalize)(heights.min(), heights.max())
    x, y = _places(solved, keys).T
    return axes.scatter(x, y, 30, heights, norm=norm, cmap="viridis", label="a curve", linewidths=0.0, zorder=2)


def curves_figure(result: OptimumResult, found: Optimum, title: str) -> Figure:
    """Amplitude and frequency of the worst motion over a key; beside them the logarithmic derivatives."""
    figure, axes = subplots(2, 2, size=(10.4, 6.2), sharex="col")
    upper, lower, grid = axes[0, 0], axes[1, 0], axes[0, 0].get_gridspec()
    grid.set_width_ratios((2.5, 1.0))
    grid.set_height_ratios((1.7, 1.0))
    for unused in axes[:, 1]:
        unused.remove()
    factor, unit = scale(found.envelope.amplitude_m, "m")
    key = KEYS[found.name]
    at, elasticities = quantity(key).factor * result.per_unit, elasticities_of(result)
    for panel, name, size in ((upper, "amplitude_m", factor), (lower, "frequency_hz", 1.0)):
        _draw_peaks(panel, found.curves, name, at, size)
        _draw_envelope(panel, found.envelope, name, at, size)
        _draw_responses(panel, found.responses, name, at, size)
        draw_marks(panel, result, key, name, partial(mul, size))
    _set_axes(upper, lower, found.envelope, at, factor)
    upper.set_ylabel(f"{result.named} [{unit}]")
    lower.set(xlabel=SweepKey(key, ()).axis, ylabel="its frequency [Hz]")
    if elasticities:
        draw_elasticities(figure.add_subplot(grid[:, 1]), elasticities)
    else:
        grid.set_width_ratios((1.0, 1e-3))
    figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    write_heading(figure, title)
    return figure


def _draw_peaks(axes: Axes, curves: Sequence[PeakCurve], name: str, at: float, size: float) -> None:
    """Thin lines of the followed peaks by their stability."""
    for curve in curves:
        known = np.isfinite(curve.growth_rate)
        masks = (known & curve.stable, known & ~curve.stable, ~known)
        for (label, look), mask in zip(_PEAKS.items(), masks, strict=True):
            if mask.any():
                shown = np.where(_with_neighbours(mask), getattr(curve, name), np.nan)
                axes.plot(curve.value * at, shown * size, **look, label=_new(axes, label))


def _with_neighbours(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Points of a mask and the next one after each stretch, so that lines have no gaps."""
    return mask | np.r_[False, mask[:-1]]


def _new(axes: Axes, label: str) -> str | None:
    return None if label in axes.get_legend_handles_labels()[1] else label


def _draw_envelope(axes: Axes, envelope: WorstEnvelope, name: str, at: float, size: float) -> None:
    """Thick lines of the worst motion by where it comes from, open at its jumps."""
    values = getattr(envelope, name).astype(float) * size
    for source, look in _ENVELOPE.items():
        mask = envelope.source == source
        if mask.any() and (source, name) != ("open", "frequency_hz"):  # the frequency is that of the motion found
            heights = _without_jumps(envelope, np.where(_with_neighbours(mask), values, np.nan), name)
            axes.plot(envelope.value * at, heights, **look, solid_capstyle="butt")


def _without_jumps(envelope: WorstEnvelope, values: Array, name: str) -> Array:
    """A gap where the worst motion jumps; in the frequency also where two peaks exchange."""
    jumps = np.diff(envelope.value) == 0.0
    if name == "frequency_hz":
        steps = np.abs(np.diff(values))
        beside = np.fmax(np.r_[0.0, steps[:-1]], np.r_[steps[1:], 0.0])
        with np.errstate(invalid="ignore"):
            jumps |= steps > np.fmax(JUMP * beside, VISIBLE * float(np.nanmax(values, initial=0.0)))
    places = np.flatnonzero(jumps)
    drawn = values.copy()
    drawn[places + 1] = np.nan
    return drawn


def _draw_responses(axes: Axes, responses: Sequence[SolvedResponse], name: str, at: float, size: float) -> None:
    """Dots; triangles where something was left open, at the highest solution."""
    for is_open, marker, label in ((False, "o", "response solved"), (True, "^", f"response solved, {COUNTED}")):
        chosen = [each for each in responses if bool(each.unresolved) == is_open]
        if chosen:
            heights = [getattr(each, name) * size for each in chosen]
            axes.plot([each.value * at for each in chosen], heights, marker=marker, label=label, **_RESPONSE)


def draw_marks(
    axes: Axes, result: OptimumResult, key: str, name: str, shown: Callable[[Any], Any], others: bool = True
) -> None:
    """The range within 10 %, the scene's own value and the optimum."""
    named = quantity(key)
    at = named.factor
    if key in result.within:
        low, high = (edge * at for edge in result.within[key])
        said = f"at most 10 % higher: {low:.4g} to {high:.4g} {named.unit}".rstrip()
        axes.axvspan(low, high, label=said, **_RANGE)
    own, (low, high) = result.base.values.get(key, math.nan), result.ranges[key]
    if low <= own <= high and math.isfinite(result.base.amplitude_m) and not (others and len(result.values) > 1):
        label = f"the scene's value, {own * at:.4g} {named.unit}".rstrip()
        axes.plot(own * at, shown(getattr(result.base, name)), label=label, **_OWN)
    value = f"{result.values[key] * at:.4g} {named.unit}".rstrip()
    label = f"optimum, {value} ({KINDS[result.kind].said})"
    axes.plot(result.values[key] * at, shown(getattr(result, name)), label=label, **_OPTIMUM)


def _set_axes(upper: Axes, lower: Axes, envelope: WorstEnvelope, at: float, factor: float) -> None:
    low, high = float(envelope.value[0]) * at, float(envelope.value[-1]) * at
    if low > 0.0 and high > DECADES_FROM * low:
        lower.set_xscale("log")
        plain_log_labels(lower.xaxis)
    lower.set_xlim(low, high)
    least, largest = (float(edge(envelope.amplitude_m)) * factor for edge in (np.nanmin, np.nanmax))
    if largest > LOG_FROM * least > 0.0:
        upper.set_yscale("log")
        plain_log_labels(upper.yaxis)
        upper.set_ylim(least / HEADROOM**2, largest * HEADROOM)
    else:
        upper.set_ylim(0.0, 1.08 * largest)
    first, last = (float(edge(envelope.frequency_hz)) for edge in (np.nanmin, np.nanmax))
    room = max(0.08 * (last - first), VISIBLE * last)
    lower.set_ylim(first - room, last + room)


def draw_elasticities(axes: Axes, elasticities: Mapping[str, float]) -> None:
    """Horizontal bars of the logarithmic derivatives, the largest on top, with their sizes beside them."""
    ranked = sorted(elasticities.items(), key=lambda item: abs(item[1]))
    sizes = np.array([size for _, size in ranked])
    keys = [key for key, _ in ranked]
    axes.barh(range(len(ranked)), sizes, color=[DISTINCT[1] if size > 0.0 else DISTINCT[0] for size in sizes])
    axes.set_yticks(range(len(ranked)), [meaning_of(key).solver.replace("_", "\n") for key in keys])
    axes.tick_params(axis="y", length=0.0)
    axes.spines["left"].set_visible(False)
    axes.axvline(0.0, color="0.0", linewidth=0.8)
    axes.grid(visible=False, axis="y")
    for place, size in enumerate(sizes):
        side = 1.0 if size >= 0.0 else -1.0
        look: dict[str, Any] = {"va": "center", "ha": "left" if side > 0.0 else "right", "fontsize": 8.5}
        text = f"{size:+.2f}".replace("-", "\u2212") if abs(size) >= SMALL else "0"
        axes.annotate(text, (size, place), (4.0 * side, 0.0), textcoords="offset points", **look)
    largest = float(np.abs(sizes).max(initial=SMALL))
    below, above = ((1.5 if side.any() else 0.15) * largest for side in (sizes < -SMALL, sizes > SMALL))
    axes.set_xlim(-below, above)
    axes.set_xlabel("change of the worst motion in %\nper % of each parameter")


def trials_figure(result: OptimumResult, title: str) -> Figure:
    """The worst motion with the values that were tried, over each of the keys."""
    keys = list(result.values)
    figure, axes = subplots(1, len(keys), size=(4.6 * len(keys) + 1.4, 4.6), sharey="row", squeeze=False)
    known = [trial for trial in result.trials if math.isfinite(trial.value)]
    shown, named_heights = heights_of(result, [trial.value for trial in known])
    heights = shown(np.array([trial.value for trial in known]))
    for key, panel in zip(keys, axes[0], strict=True):
        at, named = quantity(key).factor, quantity(key)
        places = np.array([trial.values[key] for trial in known]) * at
        is_open = np.array([bool(trial.unresolved) or trial.motion == "peak" for trial in known])
        for mask, marker, label in ((~is_open, "o", "values tried"), (is_open, "^", f"values tried, {COUNTED}")):
            if mask.any():
                panel.plot(places[mask], heights[mask], marker=marker, label=label, **_RESPONSE)
        draw_marks(panel, result, key, "value", shown, others=False)
        panel.set_xlabel(named.axis() if len(keys) > 1 else SweepKey(key, ()).axis)
        panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=8.5)
    first = axes[0, 0]
    first.set_ylabel(named_heights)
    set_height_axis(first, heights)
    write_heading(figure, title)
    return figure
