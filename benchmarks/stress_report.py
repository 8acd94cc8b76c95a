"""The results of the test matrix: a summary in Markdown, and a picture of one curve."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from stress_cases import FACTORS, LEVELS
from stress_solving import StressResult
from tables import markdown_table

if TYPE_CHECKING:
    from nonlinear import ResponseCurve

SHOWN = 10
ENERGY_LIMIT = 1e-8
PARAMETERS = ("alpha", "EO/N_b", "kn N/m", "v0/F m/N", "mu", "zeta", "H")
Results = Sequence[StressResult]


def summary_text(results: Results) -> str:
    """Counts by termination and by level, times, slowest cases, worst energy errors, every incomplete case."""
    case = results[0].case
    hard = ", hard corner" if case.hard else ""
    incomplete = [result for result in results if not result.complete]
    by_reason = Counter(result.ending for result in results).most_common()
    parts = [
        f"# Hard cases, seed {case.seed}{hard}{', cone law' if case.law == 'cone' else ''}",
        f"{len(results)} curves, {len(results) - len(incomplete)} complete, {len(incomplete)} incomplete; "
        f"{sum(r.seconds for r in results):.0f} s of solving, {sum(r.points for r in results)} points; "
        f"{sum(r.detached > 0 for r in results)} curves with detached branches.",
        markdown_table(("termination", "curves"), by_reason),
        "## By harmonics",
        _by_harmonics(results),
        "## By level of each factor",
        _by_level(results),
        f"## The {SHOWN} slowest",
        _ranked(results, lambda result: result.seconds),
        f"## The {SHOWN} worst energy errors",
        f"{sum(r.energy_error > ENERGY_LIMIT for r in results)} cases above {ENERGY_LIMIT:g}.",
        _ranked(results, lambda result: float(np.nan_to_num(result.energy_error, nan=-1.0))),
        "## Incomplete",
        "\n\n".join(_in_full(result) for result in incomplete) or "None.",
    ]
    return "\n\n".join(parts) + "\n"


def interfaces_text(results: Results) -> str:
    """Counts, times and every incomplete case of random blades with several interfaces."""
    incomplete = [result for result in results if not result.complete]
    by_number: dict[int, list[StressResult]] = {}
    for result in results:
        by_number.setdefault(len(result.case.drawn().interfaces), []).append(result)
    rows = [
        (number, len(found), sum(r.complete for r in found), f"{np.median([r.seconds for r in found]):.2f}")
        for number, found in sorted(by_number.items())
    ]
    told = (f"`{r.case.replay}`: {r.ending}: {r.message} ({r.points} points, {r.seconds:.1f} s)" for r in incomplete)
    parts = [
        f"# Random contact interfaces, seed {results[0].case.seed}",
        f"{len(results)} curves, {len(results) - len(incomplete)} complete; {sum(r.seconds for r in results):.0f} s "
        f"of solving, {sum(r.points for r in results)} points.",
        markdown_table(("interfaces", "curves", "complete", "median s"), rows),
        "## Incomplete",
        "\n\n".join(told) or "None.",
    ]
    return "\n\n".join(parts) + "\n"


def _by_harmonics(results: Results) -> str:
    times = ("median points", "median s", "largest s", "median ms a point", "iterations a point")
    rows = []
    for level in LEVELS["harmonics"]:
        chosen = [result for result in results if result.case.harmonics == level and result.points]
        if not chosen:
            continue
        points, seconds = [r.points for r in chosen], [r.seconds for r in chosen]
        shown = [f"{np.median(points):.0f}", f"{np.median(seconds):.2f}", f"{max(seconds):.1f}"]
        shown.append(f"{1e3 * np.median([r.seconds / r.points for r in chosen]):.2f}")
        shown.append(f"{sum(r.iterations for r in chosen) / sum(points):.2f}")
        rows.append((level, len(chosen), sum(not r.complete for r in chosen), *shown))
    return markdown_table(("H", "curves", "incomplete", *times), rows)


def _by_level(results: Results) -> str:
    rows = []
    for factor in FACTORS:
        by_value = sorted(results, key=lambda result: getattr(result.case, factor))
        for level in dict.fromkeys(result.case.level(factor) for result in by_value):
            chosen = [result for result in results if result.case.level(factor) == level]
            counts = (sum(not r.complete for r in chosen), sum(r.turning_points > 0 for r in chosen))
            points, seconds = (np.median([getattr(r, name) for r in chosen]) for name in ("points", "seconds"))
            rows.append((factor, level, len(chosen), *counts, f"{points:.0f}", f"{seconds:.2f}"))
    header = ("factor", "level", "curves", "incomplete", "with turning points", "median points", "median s")
    return markdown_table(header, rows)


def _ranked(results: Results, key: Callable[[StressResult], float]) -> str:
    columns = ("points", "iterations", "seconds", "energy error", "turning points", "termination")
    rows = []
    for r in sorted(results, key=key, reverse=True)[:SHOWN]:
        values = (r.points, r.iterations, f"{r.seconds:.2f}", f"{r.energy_error:.1e}", r.turning_points, r.ending)
        rows.append((r.case.index, *r.case.shown(), *values))
    return markdown_table(("case", *PARAMETERS, *columns), rows)


def _in_full(result: StressResult) -> str:
    case = result.case
    named = ", ".join(f"{name} {value}" for name, value in zip(PARAMETERS, case.shown(), strict=True))
    return (
        f"Case {case.index}: {named}; {result.low_hz:.2f} to {result.high_hz:.2f} Hz.\n"
        f"{result.ending}: {result.message} ({result.points} points, {result.turning_points} turning points, "
        f"{result.seconds:.1f} s).\n`{case.replay}`"
    )


def draw_curve(path: Path, curve: ResponseCurve, result: StressResult) -> None:
    """Amplitude over frequency of one case, unstable points hollow, and frequency over the arc length."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.semilogy(curve.frequency_hz, curve.amplitude_m, "-", color="0.7", linewidth=0.8)
    for name, at, colour, fill in (("stable", curve.stable, "C0", "C0"), ("unstable", ~curve.stable, "C1", "none")):
        left.semilogy(curve.frequency_hz[at], curve.amplitude_m[at], ".", color=colour, mfc=fill, label=name)
    left.set(xlabel="frequency [Hz]", ylabel="amplitude [m]", xlim=(result.low_hz, result.high_hz))
    left.legend()
    right.plot(curve.arc, curve.frequency_hz, ".-", markersize=3)
    right.set(xlabel="arc length", ylabel="frequency [Hz]")
    figure.suptitle(f"case {result.case.index}, seed {result.case.seed}: {result.ending}", fontsize=10)
    figure.savefig(path, dpi=110)
