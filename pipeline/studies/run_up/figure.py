"""Envelopes of the sweeps beside the steady curve, and the states of the contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.figures.style import ordered_colours, scale, subplots, write_heading
from pipeline.studies.run_up.result import CurveRunUps, RunUpResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_CURVES = 4  # drawn side by side


def run_up_figure(result: RunUpResult, title: str) -> Figure | None:
    """A column for each of the first curves: envelopes above, shares of slipping and open contacts below."""
    shown = [curve for curve in result.curves if any(sweep.frequency_hz.size for sweep in curve.sweeps)][:MOST_CURVES]
    if not shown:
        return None
    width = 4.2 + 4.6 * len(shown)
    figure, axes = subplots(2, len(shown), size=(width, 7.2), squeeze=False, sharex="col")
    factor, unit = scale(
        [sweep.peak_m for curve in shown for sweep in curve.sweeps if sweep.frequency_hz.size], shown[0].unit
    )
    for column, curve in enumerate(shown):
        _draw_envelopes(axes[0, column], curve, factor)
        _draw_contacts(axes[1, column], curve)
        axes[0, column].set_title(curve.label, fontsize=10)
        axes[1, column].set_xlabel("excitation frequency [Hz]")
    axes[0, 0].set_ylabel(f"{shown[0].output or 'largest displacement'} [{unit}]")
    axes[1, 0].set_ylabel("share of contacts and time [%]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside right upper", fontsize=9)
    figure.legend(*axes[1, 0].get_legend_handles_labels(), loc="outside right lower", fontsize=9)
    write_heading(figure, f"{title}\nsweeps of the excitation frequency")
    return figure


def _draw_envelopes(axes: Axes, curve: CurveRunUps, factor: float) -> None:
    ends = np.concatenate([sweep.frequency_hz for sweep in curve.sweeps])
    shown = (curve.branch_hz >= ends.min()) & (curve.branch_hz <= ends.max())
    steady: dict[str, Any] = {"color": "0.6", "linewidth": 2.2, "label": "steady, main branch"}
    axes.plot(curve.branch_hz[shown], curve.branch_m[shown] * factor, **steady)
    rates = sorted({abs(sweep.rate_hz_per_s) for sweep in curve.sweeps})
    colours = dict(zip(rates, ordered_colours(len(rates)), strict=True))
    for sweep in curve.sweeps:
        rate = abs(sweep.rate_hz_per_s)
        look = "-" if sweep.rate_hz_per_s > 0.0 else "--"
        label = f"{rate:.3g} Hz/s {sweep.direction}"
        axes.plot(
            sweep.frequency_hz, sweep.envelope_m * factor, look, color=colours[rate], linewidth=1.1, label=label
        )
        if sweep.read_m.size:
            style = {"markersize": 2.5, "color": colours[rate], "label": f"{label}, by probes"}
            axes.plot(sweep.read_hz, sweep.read_m * factor, ".", **style)
    axes.set_xlim(float(ends.min()), float(ends.max()))
    axes.set_ylim(bottom=0.0)


def _draw_contacts(axes: Axes, curve: CurveRunUps) -> None:
    """Of the slowest sweep up, or down where there is none."""
    known = [sweep for sweep in curve.sweeps if sweep.frequency_hz.size]
    sweep = min(known, key=lambda sweep: (sweep.rate_hz_per_s < 0.0, abs(sweep.rate_hz_per_s)))
    axes.plot(sweep.place_hz, 100.0 * sweep.slip_share, ".-", color="#D55E00", label="slip")
    axes.plot(sweep.place_hz, 100.0 * sweep.open_share, ".-", color="#0072B2", label="are open")
    axes.set_ylim(-2.0, 102.0)
    axes.set_title(f"{abs(sweep.rate_hz_per_s):.3g} Hz/s {sweep.direction}", fontsize=9)
