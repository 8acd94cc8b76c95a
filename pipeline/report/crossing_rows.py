"""Tables of resonance crossings: of each reduced model over its range, and over the speeds of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.report.report_source import ReportSource

MOST_ROWS = 60
_NAMES = ("no.", "engine order", "nodal diameters", "wave", "mode", "free [Hz]", "stuck [Hz]", "speed [rev/min]")


@dataclass(frozen=True)
class CrossingTable:
    """Crossings of one reduced model, as texts; `left_out` of them stand in summary.json only."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left_out: int = 0


def crossing_tables(source: ReportSource) -> list[CrossingTable]:
    """One table for every entry of `models` in summary.json, with the numbers of the nodal diameter diagram."""
    return [_table(row.get("crossings", ())) for row in source.model_rows]


def campbell_table(entries: Sequence[dict[str, Any]]) -> CrossingTable | None:
    """Crossings over the speeds of a sweep; None without any."""
    headings = ("engine order", "mode", "shrouds", "frequency [Hz]", "speed [rev/min]")
    rows = tuple(
        (str(e["engine_order"]), str(e["mode"]), e["contact"], f"{e['frequency_hz']:.6g}", f"{e['speed_rpm']:.6g}")
        for e in entries[:MOST_ROWS]
    )
    return CrossingTable(headings, rows, max(len(entries) - MOST_ROWS, 0)) if rows else None


def _table(crossings: Sequence[dict[str, Any]]) -> CrossingTable:
    ordered = sorted(crossings, key=lambda each: (each["engine_order"], each["mode"]))
    at_speed = any(each["margin"] is not None for each in ordered)
    headings = (*_NAMES, "from the range", *(("margin at the steady speed",) if at_speed else ()))
    rows, number = [], 0
    for each in ordered:
        inside = each["range_distance"] == 0.0
        number += inside
        speeds = "-" if each["free_rpm"] is None else f"{_speed(each['free_rpm'])} to {_speed(each['stuck_rpm'])}"
        rows.append(
            (
                str(number) if inside else "-",
                str(each["engine_order"]),
                str(each["nodal_diameter"]),
                each["wave"],
                f"{each['mode']}{': ' * bool(each['name'])}{each['name']}",
                f"{each['free_hz']:.6g}",
                f"{each['stuck_hz']:.6g}",
                speeds,
                "inside" if inside else _percent(each["range_distance"]),
                *(("-" if each["margin"] is None else _percent(each["margin"]),) if at_speed else ()),
            )
        )
    return CrossingTable(headings, tuple(rows[:MOST_ROWS]), max(len(rows) - MOST_ROWS, 0))


def _speed(value: float) -> str:
    """A speed with five digits, or all before the point."""
    return f"{value:.0f}" if value >= 1e4 else f"{value:.5g}"


def _percent(distance: float) -> str:
    """A signed relative distance; 0: resonance."""
    return "resonance" if distance == 0.0 else f"{100.0 * distance:+.3g} %"
