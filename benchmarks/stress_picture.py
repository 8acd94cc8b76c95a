"""Pictures of the matrix: all cases at a glance, and one curve."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from stress_cases import LEVELS, STIFFNESS_RANGE
from stress_solving import StressResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from nonlinear import ResponseCurve

MARKERS = {1: "o", 3: "s", 7: "D"}


def draw_matrix(path: Path, results: Sequence[StressResult]) -> None:
    """Cases over stiffness and interference, coloured by points and by time; a red cross is an incomplete curve."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 5.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for place, name, values in (
        (axes[0], "solved points", [result.points for result in results]),
        (axes[1], "seconds", [result.seconds for result in results]),
    ):
        _scatter(place, results, np.maximum(np.asarray(values, dtype=float), 1e-3), name)
    axes[0].set_ylabel("interference v0 / F  [m/N]   (gap below 0)")
    failed = sum(not result.complete for result in results)
    figure.suptitle(f"Stability matrix, seed {results[0].case.seed}: {len(results)} curves, {failed} incomplete")
    figure.savefig(path, dpi=110)


def _scatter(axes: Axes, results: Sequence[StressResult], values: np.ndarray, name: str) -> None:
    from matplotlib.colors import LogNorm

    height = {value: place for place, value in enumerate(LEVELS["interference"])}
    x = np.array([result.case.normal_stiffness for result in results])
    # The levels stand at equal distances; moved a little, so that cases of like stiffness do not hide each other.
    y = np.array([height[r.case.interference] + 0.25 * (r.case.index % 3 - 1) for r in results])
    norm = LogNorm(values.min(), max(values.max(), 1.01 * values.min()))
    for harmonics, marker in MARKERS.items():
        chosen = np.array([result.case.harmonics == harmonics for result in results])
        points = axes.scatter(
            x[chosen], y[chosen], c=values[chosen], norm=norm, marker=marker, s=34, label=f"H = {harmonics}"
        )
    failed = np.array([not result.complete for result in results])
    axes.scatter(x[failed], y[failed], marker="x", color="red", s=110, linewidths=2.0, label="incomplete")
    axes.figure.colorbar(points, ax=axes, label=name)
    axes.set_xscale("log")
    axes.set_xlim(0.8 * STIFFNESS_RANGE[0], 1.25 * STIFFNESS_RANGE[1])
    axes.set_yticks(range(len(height)), [f"{value:.1e}" if value else "0" for value in height])
    axes.axhline(height[0.0], color="0.8", zorder=0)
    axes.set_xlabel("normal contact stiffness of the face [N/m]")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.08), ncols=4, frameon=False)


def draw_curve(path: Path, curve: ResponseCurve, result: StressResult) -> None:
    """Amplitude over frequency of one case, unstable points hollow, and where the whole curve lies along its arc."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.semilogy(curve.frequency_hz, curve.amplitude_m, "-", color="0.7", linewidth=0.8)
    left.semilogy(curve.frequency_hz[curve.stable], curve.amplitude_m[curve.stable], ".", color="C0", label="stable")
    unstable = ~curve.stable
    left.semilogy(
        curve.frequency_hz[unstable], curve.amplitude_m[unstable], ".", color="C1", mfc="none", label="unstable"
    )
    left.set(xlabel="frequency [Hz]", ylabel="amplitude [m]", xlim=(result.low_hz, result.high_hz))
    left.legend()
    right.plot(curve.arc, curve.frequency_hz, ".-", markersize=3)
    right.set(xlabel="arc", ylabel="frequency [Hz]")
    figure.suptitle(f"case {result.case.index}, seed {result.case.seed}: {result.ending}", fontsize=10)
    figure.savefig(path, dpi=110)
