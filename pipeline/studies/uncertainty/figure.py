"""Figure of the study `uncertainty`: distributions of the worst motion, sensitivities, convergence of quantiles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.data import Array
from pipeline.figures.style import DISTINCT, scale, subplots, write_heading
from pipeline.scene.labels import quantity
from pipeline.studies.uncertainty.quantiles import LEVELS, PERCENTILES, Estimate
from pipeline.studies.uncertainty.remarks import percent
from pipeline.studies.uncertainty.result import Spread, UncertaintyResult
from pipeline.studies.uncertainty.sensitivities import linear_values

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SAMPLED, LINEAR, RESIDUAL, OTHER, FITTED = DISTINCT[0], DISTINCT[1], DISTINCT[2], DISTINCT[3], DISTINCT[5]
LIGHT = "#B3D4EA"
BAR = 0.36  # height of a bar; two lie beside each other


def uncertainty_figure(result: UncertaintyResult, title: str) -> Figure:
    """The distribution of the worst motion."""
    converges = len(result.convergence) > 1
    known = bool(result.sobol or result.polynomial is not None or result.first_order is not None)
    rows = 3 if converges else 2
    figure, places = subplots(rows, 2, size=(8.4, 0.8 + 3.2 * rows))
    axes, below = places[0], places[1]
    over, sensitivities = (places[-1, 1], places[-1, 0]) if known else (places[-1, 0], None)
    factor, unit = scale(result.amplitude_m, "m")
    labels = f"worst amplitude [{unit}]", "its frequency [Hz]"
    linear = _linear(result)
    for column, (values, spread, number) in enumerate(
        ((result.amplitude_m, result.amplitude, factor), (result.frequency_hz, result.frequency, 1.0))
    ):
        _draw_distribution(axes[column], values * number, spread, number, result.levels)
        _draw_beside(axes[column], result, column, number, linear)
        axes[column].set_xlabel(labels[column])
        axes[column].set_ylabel("share of samples below")
        if converges:
            found = [row.amplitude if column == 0 else row.frequency for row in result.convergence]
            _draw_convergence(below[column], [row.samples for row in result.convergence], found, number)
            below[column].set_ylabel(labels[column])
    if sensitivities is not None:
        _draw_sensitivities(sensitivities, result)
    _draw_over_parameter(over, result, factor)
    over.set_ylabel(labels[0])
    if sensitivities is None:
        places[-1, 1].remove()
    figure.legend(*_handles(axes), loc="outside lower center", ncols=3, fontsize=9)
    write_heading(figure, f"{title}: {result.samples} samples of {len(result.marginals)} uncertain parameters")
    return figure


def _linear(result: UncertaintyResult) -> Array | None:
    """Values of the linear model, in ascending order of each quantity; None without one."""
    if result.first_order is None or result.centre is None:
        return None
    peak = result.centre.amplitude_m, result.centre.frequency_hz
    terms = result.first_order.terms
    return np.sort(linear_values(result.marginals, terms, peak, result.seed, result.correlation), axis=0)


def _draw_distribution(axes: Axes, values: Array, spread: Spread, factor: float, levels: Sequence[float]) -> None:
    """The empirical distribution function with quantiles and their confidence intervals."""
    known = np.sort(values[np.isfinite(values)])
    axes.step(known, (np.arange(known.size) + 0.5) / known.size, where="mid", color=SAMPLED, label="samples")
    for level, estimate in zip(levels, spread.quantiles, strict=True):
        low, high = (
            end * factor if end is not None else bound
            for end, bound in zip((estimate.low, estimate.high), (known[0], known[-1]), strict=True)
        )
        look: dict[str, Any] = {"color": "0.0", "linewidth": 1.2, "zorder": 3.0}
        axes.plot([low, high], [level, level], label="95 % confidence of a quantile", **look)
        axes.plot([estimate.value * factor], [level], "o", color="0.0", markersize=4, label="quantile")
        axes.annotate(
            percent(level), (high, level), xytext=(4, 0), textcoords="offset points", fontsize=8, va="center"
        )
    axes.set_ylim(0.0, 1.0)


def _draw_beside(axes: Axes, result: UncertaintyResult, column: int, factor: float, linear: Array | None) -> None:
    """Distributions of the linear model and of the polynomial, residual tractions, centre and limit."""
    if linear is not None:
        probability = (np.arange(len(linear)) + 0.5) / len(linear)
        inside = (probability > 1e-3) & (probability < 1.0 - 1e-3)
        axes.plot(
            linear[inside, column] * factor,
            probability[inside],
            "--",
            color=LINEAR,
            label="first order (derivatives)",
        )
    fitted = result.polynomial if column == 0 else result.frequency_polynomial
    if fitted is not None:
        axes.plot(np.array(fitted.percentiles) * factor, PERCENTILES, color=FITTED, label="polynomial through them")
    if result.residual is not None:
        band = result.residual
        ends = (band.lowest_m, band.highest_m) if column == 0 else (band.lowest_hz, band.highest_hz)
        low, high = sorted(end * factor for end in ends)
        look: dict[str, Any] = {"color": RESIDUAL, "alpha": 0.25, "linewidth": 0.0}
        axes.axvspan(low, high, label="residual tractions, at the centre", zorder=0.5, **look)
        for end in (low, high):
            axes.axvline(end, color=RESIDUAL, linewidth=0.8)
    if result.centre is not None:
        at = result.centre.amplitude_m if column == 0 else result.centre.frequency_hz
        axes.axvline(at * factor, color="0.4", linestyle=":", linewidth=1.2, label="centre of the distributions")
    if column == 0 and result.limit_m is not None:
        axes.axvline(result.limit_m * factor, color=OTHER, linestyle="-.", label="limit")


def _draw_convergence(axes: Axes, counts: Sequence[int], rows: Sequence[Sequence[Estimate]], factor: float) -> None:
    """Quantiles over the number of samples, with their confidence intervals."""
    for place, level in enumerate(LEVELS):
        colour = DISTINCT[place]
        values = np.array([row[place].value for row in rows]) * factor
        ends = [(row[place].low, row[place].high) for row in rows]
        lows, highs = (
            np.array([np.nan if pair[k] is None else pair[k] for pair in ends], dtype=float) * factor for k in (0, 1)
        )
        axes.plot(counts, values, "o-", color=colour, markersize=4)
        beside: dict[str, Any] = {
            "xytext": (8, 0),
            "textcoords": "offset points",
            "fontsize": 8,
            "va": "center",
            "color": colour,
        }
        axes.annotate(percent(level), (counts[-1], values[-1]), **beside)
        bars = np.nan_to_num(np.array([values - lows, highs - values]), nan=0.0)
        axes.errorbar(counts, values, yerr=np.maximum(bars, 0.0), fmt="none", color=colour, capsize=3, linewidth=1.0)
        open_ends = np.isnan(lows) | np.isnan(highs)
        axes.plot(
            np.array(counts)[open_ends], values[open_ends], "o", color=colour, markerfacecolor="w", markersize=6
        )
    axes.set_xscale("log", base=2)
    axes.set_xticks(list(counts), [str(count) for count in counts])
    axes.set_xlabel("samples (open: no full interval)")
    axes.margins(x=0.12)


def _draw_sensitivities(axes: Axes, result: UncertaintyResult) -> None:
    """First-order and total Sobol indices of the amplitude, sampled where there are any, else of the polynomial."""
    keys = [marginal.key for marginal in result.marginals]
    place = np.arange(len(keys), dtype=float)[::-1]
    polynomial = result.polynomial
    found = result.sobol or (() if polynomial is None else polynomial.indices)
    source = "sampled" if result.sobol else "polynomial"
    if found:
        for indices, intervals, shift, colour, name in (
            ([i.first for i in found], [i.first_interval for i in found], 0.5 * BAR, SAMPLED, "alone"),
            ([i.total for i in found], [i.total_interval for i in found], -0.5 * BAR, LIGHT, "with all others"),
        ):
            axes.barh(place + shift, indices, BAR, color=colour, label=f"{name} ({source})")
            for y, interval in zip(place + shift, intervals, strict=True):
                if interval is not None:
                    axes.plot(interval, [y, y], color="0.0", linewidth=1.2)
    if result.sobol and polynomial is not None:
        totals = [index.total for index in polynomial.indices]
        axes.plot(
            totals, place - 0.5 * BAR, "o", color="0.3", markerfacecolor="w", label="with all others (polynomial)"
        )
    if result.first_order is not None:
        parts = np.array([term.amplitude_deviation for term in result.first_order.terms]) ** 2
        if parts.sum() > 0.0:
            axes.plot(parts / parts.sum(), place, "D", color=LINEAR, markersize=5, label="first order")
    axes.set_yticks(place, [quantity(key).symbol for key in keys])
    axes.set_xlim(left=min(0.0, *axes.get_xlim()))
    missed = "" if polynomial is None else f"\n(polynomial misses {100.0 * polynomial.leave_one_out:.2g} % of it)"
    axes.set_xlabel(f"share of the variance of the amplitude{missed}")
    axes.grid(axis="y", visible=False)
    if found or result.first_order is not None:
        axes.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)  # bars may be anywhere


def _draw_over_parameter(axes: Axes, result: UncertaintyResult, factor: float) -> None:
    """The worst amplitude of each sample over the parameter with the largest total index."""
    indices = result.sobol or (() if result.polynomial is None else result.polynomial.indices)
    key = max(indices, key=lambda index: index.total).key if indices else result.marginals[0].key
    named = quantity(key)
    x, y = np.array(result.values[key]) * named.factor, result.amplitude_m * factor
    groups = (
        (result.periodic & (result.branch == 0), "o", SAMPLED, "main branch"),
        (result.periodic & (result.branch != 0), "^", OTHER, "detached branch"),
        (~result.periodic, "s", LINEAR, "quasi-periodic"),
    )
    for chosen, marker, colour, name in groups:
        if chosen.any():
            axes.plot(x[chosen], y[chosen], marker, color=colour, markersize=3.5, markeredgewidth=0.0, label=name)
    if result.lower_bound.any():
        at = result.lower_bound
        axes.plot(x[at], y[at], "o", color="0.0", markerfacecolor="none", markersize=6, label="not settled")
    terms = {} if result.first_order is None else {term.key: term for term in result.first_order.terms}
    if key in terms and result.centre is not None:
        ends = np.array([np.nanmin(x), np.nanmax(x)])
        moved = ends / named.factor - result.centre.values[key]
        line = (result.centre.amplitude_m + terms[key].amplitude_rate * moved) * factor
        axes.plot(ends, line, "--", color=LINEAR, label="first order, others at the centre")
    axes.set_xlabel(named.axis())
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)


def _handles(axes: Sequence[Axes]) -> tuple[list[Any], list[str]]:
    """Handles and labels of the legends of some axes, each label once."""
    found: dict[str, Any] = {}
    for each in axes:
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return list(found.values()), list(found)
