"""Tables that stay readable with many curves: quantiles, the best and the worst curves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.figures.data import SweepPoint
from pipeline.results.overview import MOST_ROWS
from pipeline.results.tables import amplitude_scale
from pipeline.results.worst import share
from pipeline.stages.curve_summary import CurveSummary
from pipeline.stages.respond import CurveResult

ENDS = 8  # rows of the lowest and of the highest worst motions, and of curves that failed, where there are more
MOST_NOTES = 12
LEVELS = (0.0, 0.1, 0.5, 0.9, 1.0)


@dataclass(frozen=True)
class QuantileRow:
    """A quantity and its quantiles over the curves, at `LEVELS`, as text."""

    name: str
    values: tuple[str, ...]


def shown_rows(points: Sequence[SweepPoint], curves: Sequence[CurveResult]) -> list[int]:
    """Numbers of the curves with a row: all, or the lowest and the highest worst motions and those that failed."""
    if len(curves) <= MOST_ROWS:
        return list(range(len(curves)))
    order = sorted((p for p in points if math.isfinite(p.height)), key=lambda p: p.height)
    failed = [number for number, curve in enumerate(curves) if not curve.complete]
    return [*dict.fromkeys([*(p.index for p in [*order[:ENDS], *order[-ENDS:]]), *failed[:ENDS]])]


def quantile_rows(curves: Sequence[CurveResult]) -> list[QuantileRow]:
    """Quantiles over all curves; none where every curve has a row."""
    if len(curves) <= MOST_ROWS:
        return []
    facts = [curve.facts for curve in curves if curve.facts is not None]
    factor, unit = amplitude_scale(curves)
    columns: list[tuple[str, Callable[[CurveSummary], float], Callable[[float], str]]] = [
        (f"worst motion [{unit}]", lambda f: f.worst_amplitude_m * factor, "{:.4g}".format),
        ("worst motion [Hz]", lambda f: f.worst_frequency_hz, "{:.5g}".format),
        (f"peak of main branch [{unit}]", lambda f: f.peak_amplitude_m * factor, "{:.4g}".format),
        ("peak of main branch [Hz]", lambda f: f.peak_frequency_hz, "{:.5g}".format),
        ("truncation error", lambda f: f.truncation_error, share),
        ("energy error", lambda f: f.energy_error, "{:.0e}".format),
        ("seconds", lambda f: f.seconds, "{:.2f}".format),
    ]
    rows = []
    for name, value, text in columns:
        known = np.array([value(each) for each in facts])
        known = known[np.isfinite(known)]
        if known.size:
            rows.append(QuantileRow(name, tuple(text(float(q)) for q in np.quantile(known, LEVELS))))
    return rows


def first_few(lines: Sequence[str], most: int = MOST_NOTES) -> list[str]:
    """The first lines, and how many more there are."""
    rest = len(lines) - most
    return list(lines) if rest <= 0 else [*lines[:most], f"and {rest} more"]


def listed(numbers: Sequence[Any], most: int = 12) -> str:
    """Numbers in a sentence, at most a dozen."""
    shown = ", ".join(map(str, numbers[:most]))
    return shown if len(numbers) <= most else f"{shown} and {len(numbers) - most} more"
