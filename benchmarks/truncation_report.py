"""What is written down of a validated case, and the cases as a table, a summary in Markdown and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from markdown_table import markdown_table
from stress_cases import StressCase

FACTOR, MUCH = 3.0, 10.0
FLOOR = 1e-6  # errors below it are those of the peak's location
ENOUGH_TRUTH = 0.1  # last change of the truth, relative to the true error, that does not matter
NAN = float("nan")
HEADER = ("case", "alpha", "EO/N_b", "kn N/m", "v0/F m/N", "mu", "zeta", "H", "peak m", "true m", "error", "estimate")


@dataclass(frozen=True)
class Validation:
    """One case: the peak (Hz, m), its estimated error, the truth, seconds, and why it was left out, if it was."""

    case: StressCase
    left_out: str
    frequency_hz: float = NAN
    height: float = NAN
    estimate: float = NAN
    truth: float = NAN
    truth_harmonics: int = 0
    truth_before: float = NAN
    truth_of_curve: float = NAN
    reference: int = 0
    curve_seconds: float = NAN
    estimate_seconds: float = NAN
    truth_seconds: float = NAN

    @property
    def error(self) -> float:
        """True relative error of the peak amplitude."""
        return abs(self.height / self.truth - 1.0)

    @property
    def error_of_curve(self) -> float:
        """The same against the main curve alone."""
        return abs(self.height / self.truth_of_curve - 1.0)

    @property
    def known(self) -> bool:
        """Whether the estimate is a number."""
        return bool(np.isfinite(self.estimate))

    @property
    def bounded(self) -> bool:
        """Whether the true error is at most three times the estimate; unknown is no bound."""
        return self.known and self.error <= FACTOR * self.estimate + FLOOR

    @property
    def far_over(self) -> bool:
        """Whether the estimate is more than ten times the true error."""
        return self.known and self.estimate > MUCH * (self.error + FLOOR)

    def row(self) -> dict[str, Any]:
        """Column -> value, the parameters first."""
        values = {name: value for name, value in asdict(self).items() if name != "case"}
        return self.case.values() | values | {"error": self.error, "bounded": self.bounded}


def share_bounded(results: Sequence[Validation]) -> float:
    """Part of the cases with a truth whose error is bounded."""
    return float(np.mean([result.bounded for result in results if not result.left_out]))


def report_text(results: Sequence[Validation]) -> str:
    """Counts by H, convergence of the truth, cost, and every case that is not bounded, far over or left out."""
    judged = [result for result in results if not result.left_out]
    odd = [result for result in judged if not result.bounded or result.far_over]
    left_out = [f"* case {r.case.index}, H = {r.case.harmonics}: {r.left_out}" for r in results if r.left_out]
    parts = [
        f"# Truncation error, hard cases of seed {results[0].case.seed}",
        f"{len(results)} cases, {len(judged)} with a truth. True error at most {FACTOR:g} times the estimate in "
        f"{sum(r.bounded for r in judged)} of {len(judged)}; estimate over {MUCH:g} times the true error in "
        f"{sum(r.far_over for r in judged)}; unknown in {sum(not r.known for r in judged)}.",
        _by_harmonics(judged),
        _about_the_truth(judged),
        _cost(judged),
        "## Not bounded, unknown or far over",
        markdown_table(HEADER, (_line(result) for result in odd)) if odd else "None.",
        "## Left out",
        "\n".join(left_out) or "None.",
    ]
    return "\n\n".join(parts) + "\n"


def _by_harmonics(judged: Sequence[Validation]) -> str:
    header = ("H", "cases", "bounded", "far over", "unknown", "median true error", "median estimate / true error")
    rows = []
    for harmonics in sorted({result.case.harmonics for result in judged}):
        chosen = [result for result in judged if result.case.harmonics == harmonics]
        ratios = [r.estimate / r.error for r in chosen if r.known and r.error > FLOOR]
        row = (
            harmonics,
            len(chosen),
            sum(r.bounded for r in chosen),
            sum(r.far_over for r in chosen),
            sum(not r.known for r in chosen),
            f"{np.median([r.error for r in chosen]):.1e}",
            f"{np.median(ratios):.2f}" if ratios else "",
        )
        rows.append(row)
    return markdown_table(header, rows)


def _about_the_truth(judged: Sequence[Validation]) -> str:
    steps = sorted({r.truth_harmonics for r in judged}, reverse=True)
    solved = ", ".join(f"{sum(r.truth_harmonics == n for r in judged)} with {n}" for n in steps)
    moved = [abs(r.truth_before / r.truth - 1.0) / r.error for r in judged if r.error > FLOOR]
    off = sum(r.truth_of_curve < (1.0 - FLOOR) * r.truth for r in judged)
    strict = sum(r.known and r.error_of_curve <= FACTOR * r.estimate + FLOOR for r in judged)
    settled = sum(value <= ENOUGH_TRUTH for value in moved)
    return (
        f"Harmonics of the truth: {solved}. Its last change is below {ENOUGH_TRUTH:g} of the true error in {settled} "
        f"of {len(moved)} cases (median {np.median(moved):.1e}; errors below {FLOOR:g} not counted). "
        f"In {off} cases the branch of the peak comes off the curve with more harmonics and is higher than what is "
        f"left of it; against the curve alone {strict} of {len(judged)} are bounded."
    )


def _cost(judged: Sequence[Validation]) -> str:
    shares = np.array([result.estimate_seconds / result.curve_seconds for result in judged])
    return (
        f"Cost: median {np.median(shares):.0%} of the time of the curve, at most {np.quantile(shares, 0.9):.0%} in "
        f"90 % of the cases; {sum(r.estimate_seconds for r in judged):.0f} s for curves of "
        f"{sum(r.curve_seconds for r in judged):.0f} s in all."
    )


def _line(result: Validation) -> tuple[object, ...]:
    case = result.case
    return (
        case.index,
        f"{case.angle:g}",
        f"{case.order_ratio:.3g}",
        f"{case.normal_stiffness:.3g}",
        f"{case.interference:.3g}",
        f"{case.friction:g}",
        f"{case.damping_ratio:g}",
        case.harmonics,
        f"{result.height:.4g}",
        f"{result.truth:.4g}",
        f"{result.error:.2g}",
        f"{result.estimate:.2g}",
    )


def draw(path: Path, judged: Sequence[Validation]) -> None:
    """Estimate over true error with the band asked for; unknown ones at the upper edge."""
    from matplotlib.figure import Figure

    low, high = FLOOR, 1e3
    figure = Figure(figsize=(6.4, 5.6), layout="constrained")
    axes = figure.subplots()
    line = np.array([low, high])
    axes.fill_between(line, line / FACTOR, line * MUCH, color="0.92", zorder=0)
    axes.plot(line, line, color="0.6", linewidth=0.8, zorder=1)
    for harmonics, marker in zip(sorted({r.case.harmonics for r in judged}), "osD^", strict=False):
        chosen = [result for result in judged if result.case.harmonics == harmonics]
        x = np.clip([result.error for result in chosen], low, high)
        y = np.clip([result.estimate if result.known else high for result in chosen], low, high)
        axes.loglog(x, y, marker, markersize=5, label=f"H = {harmonics}")
    axes.set(xlim=(low, high), ylim=(low, high), xlabel="true relative error of the peak", ylabel="estimate")
    axes.legend(title=f"band: 1/{FACTOR:g} to {MUCH:g}")
    figure.savefig(path, dpi=110)
