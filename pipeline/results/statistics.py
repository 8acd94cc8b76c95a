"""Many curves in a few numbers: quantiles, best and worst curve, best and worst value of each swept key."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.stages.curve_table import CurveTable, plain_value

Array = NDArray[Any]
LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
QUANTITIES = ("worst_amplitude_m", "worst_frequency_hz", "peak_amplitude_m", "peak_frequency_hz")
MOST_VALUES = 50  # different numbers of a key that are compared one by one; more are put into PARTS ranges
PARTS = 5


def statistics(table: CurveTable) -> dict[str, Any]:
    """Statistics of the curves, as in summary.json.

    The height of a curve is its worst motion, or the peak of its main branch where that is not known. Of a swept key
    the best value is the one with the lowest height of its highest curve. What may be higher than found, an end of
    the frequency range for example, is never best; `lower_bounds` is the number of such curves.
    """
    heights = table.heights
    found: dict[str, Any] = {"curves": len(table), "complete": int(np.sum(table.columns["complete"]))}
    found["lower_bounds"] = int(np.sum(table.lower_bounds & np.isfinite(heights)))
    found |= {"levels": list(LEVELS), "quantiles": {name: _quantiles(table.columns[name]) for name in QUANTITIES}}
    known = np.flatnonzero(np.isfinite(heights))
    if known.size == 0:
        return found | {"best": None, "worst": None, "keys": {}}
    closed = known[~table.lower_bounds[known]]
    worst = int(known[np.argmax(heights[known])])
    best = None if closed.size == 0 else _curve(table, int(closed[np.argmin(heights[closed])]))
    open_above = table.lower_bounds[known]
    keys = {key: _by_value(values[known], heights[known], open_above) for key, values in table.parameters.items()}
    return found | {"best": best, "worst": _curve(table, worst), "keys": keys}


def _quantiles(values: Array) -> list[float | None]:
    finite = values[np.isfinite(values)]
    return [None] * len(LEVELS) if finite.size == 0 else [float(q) for q in np.quantile(finite, LEVELS)]


def _curve(table: CurveTable, number: int) -> dict[str, Any]:
    """A curve: its number, swept values, height and frequency."""
    columns = table.columns
    kind = "worst" if math.isfinite(columns["worst_amplitude_m"][number]) else "peak"
    return {
        "curve": number,
        "parameters": table.parameters_of(number),
        "amplitude_m": float(columns[f"{kind}_amplitude_m"][number]),
        "frequency_hz": float(columns[f"{kind}_frequency_hz"][number]),
        "lower_bound": bool(table.lower_bounds[number]),
    }


def _by_value(values: Array, heights: Array, open_above: Array) -> dict[str, Any]:
    """Best and worst value of a key, or range [low, high] of values where there are many numbers."""
    groups = _groups(values)
    rows = [
        {"value": value, "median_m": float(np.median(heights[rows])), "highest_m": float(np.max(heights[rows]))}
        for value, rows in groups
    ]
    order = sorted(range(len(rows)), key=lambda number: rows[number]["highest_m"])
    closed = [number for number in order if not open_above[groups[number][1]].any()]
    return {"best": rows[closed[0]] if closed else None, "worst": rows[order[-1]]}


def _groups(values: Array) -> list[tuple[Any, Array]]:
    """Each value, or range of values, with the curves that have it."""
    different, which = np.unique(values, return_inverse=True)
    rows = np.split(np.argsort(which, kind="stable"), np.cumsum(np.bincount(which))[:-1])
    if values.dtype == object or different.size <= MOST_VALUES:
        return [(plain_value(value), group) for value, group in zip(different, rows, strict=True)]
    parts = np.array_split(np.arange(different.size), PARTS)
    return [
        ([float(different[part[0]]), float(different[part[-1]])], np.concatenate([rows[place] for place in part]))
        for part in parts
    ]
