"""Figure of the study `mistuning`: envelope of the ring, amplitudes by blade, amplification factors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pipeline.figures.curve_line import mark_followed, mark_worst
from pipeline.figures.style import (
    CURVES_LOG_FROM,
    DISTINCT,
    scale,
    set_height_axis,
    subplots,
    write_heading,
)
from pipeline.stages.curve.curve_summary import CurveSummary
from pipeline.studies.mistuning.result import MistuningResult, Numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


TUNED, MISTUNED, LINEAR, BOUND = "black", DISTINCT[0], DISTINCT[1], "0.35"
MANY_BLADES = 200  # above, stems would merge
FAR = 2.0  # bound over the largest factor, above which the factors would be squeezed together


class RingInNumbers(NamedTuple):
    """A mistuned ring as the marks of worst motions see a curve."""

    facts: CurveSummary
    label: str


def mistuning_figure(result: MistuningResult, title: str) -> Figure:
    """The response of mistuned rings."""
    figure, axes = subplots(2, 2, size=(11.0, 7.0))
    factor, unit = scale([*result.highest.envelope_m, result.tuned.peak_m], "m")
    _draw_curves(axes[0, 0], result, factor, unit)
    _draw_blades(axes[1, 0], result, factor, unit)
    _draw_factors(axes[0, 1], result)
    _draw_deviations(axes[1, 1], result)
    which = f"{len(result.rings)} rings" if len(result.rings) > 1 else "one ring"
    write_heading(figure, f"{title}: {which} of {result.n_blades} blades, engine order {result.engine_order}")
    return figure


def _draw_curves(axes: Axes, result: MistuningResult, factor: float, unit: str) -> None:
    """Tuned curve, and the largest amplitude of any blade."""
    tuned, ring = result.tuned, result.highest
    name = f"mistuned, any blade (seed {ring.seed})" if result.drawn else "mistuned, any blade"
    axes.plot(tuned.frequency_hz, tuned.amplitude_m * factor, color=TUNED, label="tuned")
    axes.plot(ring.frequency_hz, ring.envelope_m * factor, color=MISTUNED, label=name)
    heights = np.concatenate([tuned.amplitude_m, ring.envelope_m]) * factor
    followed = np.array(result.worst.worst_followed_m) * factor
    worst = np.nan_to_num(np.array([result.worst.worst_amplitude_m])) * factor
    set_height_axis(axes, np.concatenate([heights, followed, worst]), CURVES_LOG_FROM)
    whole = [RingInNumbers(result.worst, "mistuned")]
    mark_worst(axes, whole, [MISTUNED], factor)
    mark_followed(axes, whole, [MISTUNED], factor)
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"amplitude [{unit}]")
    axes.legend(fontsize=9)


def _draw_blades(axes: Axes, result: MistuningResult, factor: float, unit: str) -> None:
    """Amplitudes of the blades at the highest peak."""
    ring, number = result.highest, np.arange(result.n_blades)
    at_peak = ring.blade_amplitude_m * factor
    if result.n_blades <= MANY_BLADES:
        axes.vlines(number, 0.0, at_peak, color=MISTUNED, linewidth=1.2)
    axes.plot(number, at_peak, "o", color=MISTUNED, markersize=4, label="at the highest peak")
    look: dict[str, Any] = {"markersize": 5, "linestyle": "none"}
    axes.plot(number, ring.peak_m * factor, "_", color="0.45", label="largest at any frequency", **look)
    axes.axhline(result.tuned.peak_m * factor, color=TUNED, linewidth=1.0, label="tuned peak")
    axes.set_ylim(bottom=0.0, top=1.35 * float(ring.peak_m.max()) * factor)
    axes.set_xlabel("blade")
    axes.set_ylabel(f"amplitude [{unit}]")
    axes.legend(fontsize=9, ncols=2, loc="upper left")


def _draw_factors(axes: Axes, result: MistuningResult) -> None:
    """Distribution functions of the amplification factor."""
    factors = np.array([ring.factor for ring in result.rings])
    _draw_distribution(axes, factors, MISTUNED, "nonlinear contacts")
    if result.linear is not None:
        _draw_distribution(axes, result.linear.factor, LINEAR, f"{result.linear.state} contacts")
    axes.axvline(1.0, color=TUNED, linewidth=1.0, label="tuned")
    known = [*factors, *(() if result.linear is None else result.linear.factor)]
    bound = f"Whitehead's bound, {result.bound:.3g}"
    look: dict[str, Any] = {"color": BOUND, "linestyle": "--", "linewidth": 1.0}
    if result.bound < FAR * np.nanmax(known):
        axes.axvline(result.bound, label=bound, **look)
    else:
        axes.plot([], [], label=f"{bound}, is off the scale", **look)
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel("amplification factor")
    axes.set_ylabel("share of rings below")
    axes.legend(fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def _draw_distribution(axes: Axes, values: Numbers, colour: Any, label: str) -> None:
    """The empirical distribution function; a mark where there is one value."""
    known = np.sort(values[np.isfinite(values)])
    share = (np.arange(known.size) + 0.5) / max(known.size, 1)
    marker = "o" if known.size < 30 else ""
    axes.plot(known, share, color=colour, marker=marker, markersize=3.5, drawstyle="steps-mid", label=label)


def _draw_deviations(axes: Axes, result: MistuningResult) -> None:
    """Deviations of the frequencies of the blades of the ring with the highest peak."""
    ring, number = result.highest, np.arange(result.n_blades)
    percent = 100.0 * ring.frequency_deviation
    if result.n_blades <= MANY_BLADES:
        axes.vlines(number, 0.0, percent, color="0.45", linewidth=1.2)
    axes.plot(number, percent, "o", color="0.45", markersize=4)
    top = int(np.argmax(ring.blade_amplitude_m))
    axes.plot(top, percent[top], "o", color=MISTUNED, markersize=6, label="blade with the highest peak")
    axes.axhline(0.0, color=TUNED, linewidth=0.8)
    axes.set_xlabel("blade")
    axes.set_ylabel("deviation of its frequencies [%]")
    axes.legend(fontsize=9)
