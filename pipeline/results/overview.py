"""Many curves on a screen: quantiles, best and worst curve, best and worst value of each swept key."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.results.best_design import DesignPoint, best_design, compares_designs, condition_keys
from pipeline.results.tables import screen_table, short_value
from pipeline.results.worst import with_unit
from pipeline.scene.labels import prefixed, quantity, value_label
from pipeline.scene.schema import has_role
from pipeline.stages.curve.curve_table import CurveTable, plain_value

if TYPE_CHECKING:
    from rich.table import Table


Array = NDArray[Any]
LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
QUANTITIES = ("worst_amplitude_m", "worst_frequency_hz", "peak_amplitude_m", "peak_frequency_hz")
MOST_VALUES = 50  # different numbers of a key that are compared one by one; more are put into PARTS ranges
PARTS = 5


def statistics(table: CurveTable) -> dict[str, Any]:
    """Statistics of the curves, as in summary.json.

    The height of a curve is its worst motion, or the peak of its main branch where that is not known. `best` is the
    highest curve of the best design, `design` its values, `lowest` the lowest curve of all. Of a swept key the best
    value is the one with the lowest height of its highest curve; a condition has none. What may be higher than found,
    an end of the frequency range for example, is never best; `lower_bounds` counts such curves.
    """
    heights = table.heights
    found: dict[str, Any] = {"curves": len(table), "complete": int(np.sum(table.columns["complete"]))}
    found["lower_bounds"] = int(np.sum(table.lower_bounds & np.isfinite(heights)))
    found |= {"levels": list(LEVELS), "quantiles": {name: _quantiles(table.columns[name]) for name in QUANTITIES}}
    known = np.flatnonzero(np.isfinite(heights))
    if known.size == 0:
        return found | {"best": None, "design": None, "lowest": None, "worst": None, "keys": {}}
    worst = int(known[np.argmax(heights[known])])
    open_above = table.lower_bounds[known]
    keys = {key: _by_value(values[known], heights[known], open_above) for key, values in table.parameters.items()}
    for key in condition_keys(keys):
        keys[key]["best"] = None
    return found | _best(table) | {"worst": _curve(table, worst), "keys": keys}


def _best(table: CurveTable) -> dict[str, Any]:
    """The best design, its highest curve, and the lowest curve of all; null where they are not known."""
    heights, closed = table.heights, ~table.lower_bounds
    settled = np.flatnonzero(closed & np.isfinite(heights))
    lowest = _curve(table, int(settled[np.argmin(heights[settled])])) if settled.size else None
    points = [
        DesignPoint(table.parameters_of(k), float(heights[k]), bool(closed[k])) for k in range(len(table))
    ] * compares_designs(table.parameters)
    best = best_design(points) if points else ""
    if isinstance(best, str):
        return {"best": None, "design": None, "lowest": lowest}
    return {"best": _curve(table, best.highest), "design": dict(best.design), "lowest": lowest}


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


MOST_ROWS = 40  # curves that have a row each
FEW_ROWS = 10  # rows of more curves than that: half of them the lowest, half the highest
MOST_NOTES = 40  # lines about single curves
ROWS = "curves.csv has all curves"


def quantile_table(found: Mapping[str, Any]) -> Table:
    """Quantiles over the curves, a row for each quantity."""
    names = {"worst_amplitude_m": "worst motion", "worst_frequency_hz": "its frequency [Hz]"}
    names |= {"peak_amplitude_m": "main peak", "peak_frequency_hz": "its frequency [Hz]"}
    rows = []
    for name, heading in names.items():
        values = found["quantiles"][name]
        if None in values:
            continue
        factor, unit = prefixed(values[-1], "m") if name.endswith("_m") else (1.0, "")
        digits = ".4g" if unit else ".6g"
        rows.append([f"{heading} [{unit}]" if unit else heading, *(f"{value * factor:{digits}}" for value in values)])
    return screen_table(["quantile", *(f"{100 * level:g} %" for level in found["levels"])], rows, ("quantile",))


def key_table(found: Mapping[str, Any]) -> Table:
    """Best and worst value of each swept key, with the median and the highest of the curves that have it."""
    left, rows = ("swept key", "best value", "worst value"), []
    for key, ends in found["keys"].items():
        cells = []
        for end in (ends["best"], ends["worst"]):
            if end is None:
                cells += ["not known" if has_role(key, "design") else "a condition", "-", "-"]
                continue
            cells += [_value(key, end["value"]), with_unit(end["median_m"]), with_unit(end["highest_m"])]
        rows.append([quantity(key).symbol, *cells])
    headings = [*left[:2], "median", "highest", left[2], "median", "highest"]
    return screen_table(headings, rows, left)


def overview_lines(table: CurveTable) -> tuple[list[str], dict[str, Any]]:
    """Lines on the number of curves, the best and the worst one; and the statistics behind."""
    found = statistics(table)
    lines = [f"{found['curves']} curves, {found['complete']} complete; {ROWS}"]
    if found["lower_bounds"]:
        lines.append(f"{found['lower_bounds']} of them may be higher than found: quantiles are lower bounds")
    return [*lines, *end_lines(found)], found


def end_lines(found: Mapping[str, Any] | None) -> list[str]:
    """Lines on the lowest and the highest curve of the statistics `found`; none without them."""
    lines = []
    best = "highest of the best design" if found is not None and condition_keys(found["keys"]) else "lowest"
    rows = {best: "best", "lowest": "lowest", "highest": "worst"}
    for word, name in rows.items():
        if found is not None and (curve := found.get(name)) is not None:
            swept = ", ".join(value_label(key, value) for key, value in curve["parameters"].items())
            least = ">= " * curve.get("lower_bound", False)
            height = f"{least}{with_unit(curve['amplitude_m'])} at {curve['frequency_hz']:.6g} Hz"
            lines.append(f"{word}: {height}, curve {curve['curve']} ({swept})")
    return lines


def abbreviated(notes: Iterable[str]) -> list[str]:
    """The notes, with no more than `MOST_NOTES` on single curves."""
    kept: list[str] = []
    single = 0
    for note in notes:
        single += note.startswith("Curve ")
        if not note.startswith("Curve ") or single <= MOST_NOTES:
            kept.append(note)
    left = single - MOST_NOTES
    return kept if left <= 0 else [*kept, f"{left} more lines on single curves; {ROWS}"]


def _value(key: str, value: Any) -> str:
    """A value, or a range of values, of a swept key."""
    if not (isinstance(value, list) and len(value) == 2):
        return quantity(key).value(value)
    low, high = (short_value(key, end) for end in value)
    return f"{low} to {high} {quantity(key).unit}".rstrip()
