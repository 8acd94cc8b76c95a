"""The results of the matrix as a table of cases and as a summary in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np
from markdown_table import markdown_table
from stress_cases import FACTORS, LEVELS, StressCase
from stress_solving import StressResult

SHOWN = 10
ENERGY_LIMIT = 1e-8
COLUMNS = ("alpha", "EO/N_b", "kn N/m", "v0/F m/N", "mu", "zeta", "H")


def print_summary(results: Sequence[StressResult]) -> None:
    """The summary on standard output."""
    print(summary_text(results))


def summary_text(results: Sequence[StressResult]) -> str:
    """Counts by outcome and by level, times, slowest cases, worst energy errors, every incomplete case in full."""
    incomplete = [result for result in results if not result.complete]
    parts = [
        _title(results[0].case),
        f"{len(results)} curves, {len(results) - len(incomplete)} complete, {len(incomplete)} incomplete; "
        f"{sum(r.seconds for r in results):.0f} s of solving, {sum(r.points for r in results)} points; "
        f"{sum(r.detached > 0 for r in results)} curves with detached branches.",
        _outcomes(results),
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


def _title(case: StressCase) -> str:
    hard = ", hard corner" if case.hard else ""
    return f"# Stability matrix, seed {case.seed}{hard}{', cone law' if case.law == 'cone' else ''}"


def _outcomes(results: Sequence[StressResult]) -> str:
    counts = Counter(result.ending for result in results)
    return markdown_table(("outcome", "curves"), ((ending, count) for ending, count in counts.most_common()))


def _by_harmonics(results: Sequence[StressResult]) -> str:
    header = (
        "H",
        "curves",
        "incomplete",
        "median points",
        "median s",
        "largest s",
        "median ms a point",
        "its a point",
    )
    rows = []
    for level in LEVELS["harmonics"]:
        chosen = [result for result in results if result.case.harmonics == level and result.points]
        if not chosen:
            continue
        points, seconds = [r.points for r in chosen], [r.seconds for r in chosen]
        rows.append(
            (
                level,
                len(chosen),
                sum(not r.complete for r in chosen),
                f"{np.median(points):.0f}",
                f"{np.median(seconds):.2f}",
                f"{max(seconds):.1f}",
                f"{np.median([r.milliseconds_a_point for r in chosen]):.2f}",
                f"{sum(r.iterations for r in chosen) / sum(points):.2f}",
            )
        )
    return markdown_table(header, rows)


def _by_level(results: Sequence[StressResult]) -> str:
    rows = []
    for factor in FACTORS:
        by_value = sorted(results, key=lambda result: getattr(result.case, factor))
        for level in dict.fromkeys(result.case.level(factor) for result in by_value):
            chosen = [result for result in results if result.case.level(factor) == level]
            points, seconds = [r.points for r in chosen], [r.seconds for r in chosen]
            failed = sum(not r.complete for r in chosen)
            turning = sum(r.turning_points > 0 for r in chosen)
            row = (
                factor,
                level,
                len(chosen),
                failed,
                turning,
                f"{np.median(points):.0f}",
                f"{np.median(seconds):.2f}",
            )
            rows.append(row)
    header = ("factor", "level", "curves", "incomplete", "with turning points", "median points", "median s")
    return markdown_table(header, rows)


def _ranked(results: Sequence[StressResult], key: Callable[[StressResult], float]) -> str:
    header = ("case", *COLUMNS, "points", "iterations", "seconds", "energy error", "turning points", "outcome")
    chosen = sorted(results, key=key, reverse=True)[:SHOWN]
    return markdown_table(header, (_line(result) for result in chosen))


def _line(result: StressResult) -> tuple[object, ...]:
    return (
        result.case.index,
        *_parameters(result.case),
        result.points,
        result.iterations,
        f"{result.seconds:.2f}",
        f"{result.energy_error:.1e}",
        result.turning_points,
        result.ending,
    )


def _parameters(case: StressCase) -> tuple[object, ...]:
    return (
        f"{case.angle:g}",
        f"{case.order_ratio:.3g}",
        f"{case.normal_stiffness:.4g}",
        f"{case.interference:.4g}",
        f"{case.friction:g}",
        f"{case.damping_ratio:g}",
        case.harmonics,
    )


def _in_full(result: StressResult) -> str:
    case = result.case
    named = ", ".join(f"{name} {value}" for name, value in zip(COLUMNS, _parameters(case), strict=True))
    return (
        f"Case {case.index}: {named}; {result.low_hz:.2f} to {result.high_hz:.2f} Hz.\n"
        f"{result.ending}: {result.message} ({result.points} points, {result.turning_points} turning points, "
        f"{result.seconds:.1f} s).\n"
        f"`{case.replay}`"
    )
