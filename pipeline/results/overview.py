"""Many curves on a screen: quantiles, best and worst curve, best and worst value of each swept key."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from pipeline.results.statistics import statistics
from pipeline.results.tables import short_value
from pipeline.results.worst import with_unit
from pipeline.scene.labels import prefixed, quantity, value_label
from pipeline.stages.curve_table import CurveTable

if TYPE_CHECKING:
    from rich.table import Table

MOST_ROWS = 40  # curves that have a row each
FIRST_ROWS = 10  # rows of more curves than that
MOST_NOTES = 10  # lines about single curves
ROWS = "curves.csv has all curves"


def quantile_table(found: Mapping[str, Any]) -> Table:
    """Quantiles over the curves, a row for each quantity."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(header_style="bold", pad_edge=False)
    table.add_column("quantile")
    for level in found["levels"]:
        table.add_column(f"{100 * level:g} %", justify="right")
    names = {"worst_amplitude_m": "worst motion", "worst_frequency_hz": "its frequency [Hz]"}
    names |= {"peak_amplitude_m": "main peak", "peak_frequency_hz": "its frequency [Hz]"}
    for name, heading in names.items():
        values = found["quantiles"][name]
        if None in values:
            continue
        factor, unit = prefixed(values[-1], "m") if name.endswith("_m") else (1.0, "")
        digits = ".4g" if unit else ".6g"
        table.add_row(
            escape(f"{heading} [{unit}]" if unit else heading), *(f"{value * factor:{digits}}" for value in values)
        )
    return table


def key_table(found: Mapping[str, Any]) -> Table:
    """Best and worst value of each swept key, with the median and the highest of the curves that have it."""
    from rich.table import Table

    table = Table(header_style="bold", pad_edge=False)
    for heading in ("swept key", "best value", "median", "highest", "worst value", "median", "highest"):
        table.add_column(heading, justify="left" if heading.endswith(("key", "value")) else "right")
    for key, ends in found["keys"].items():
        cells = []
        for end in (ends["best"], ends["worst"]):
            if end is None:
                cells += ["not known", "-", "-"]
                continue
            cells += [_value(key, end["value"]), with_unit(end["median_m"]), with_unit(end["highest_m"])]
        table.add_row(quantity(key).symbol, *cells)
    return table


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
    for name, word in (("best", "lowest"), ("worst", "highest")):
        if found is not None and (curve := found[name]) is not None:
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
        single += note.startswith("curve ")
        if not note.startswith("curve ") or single <= MOST_NOTES:
            kept.append(note)
    left = single - MOST_NOTES
    return kept if left <= 0 else [*kept, f"{left} more lines on single curves; {ROWS}"]


def _value(key: str, value: Any) -> str:
    """A value, or a range of values, of a swept key."""
    if not (isinstance(value, list) and len(value) == 2):
        return quantity(key).value(value)
    low, high = (short_value(key, end) for end in value)
    return f"{low} to {high} {quantity(key).unit}".rstrip()
