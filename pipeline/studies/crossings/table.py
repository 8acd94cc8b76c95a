"""The table of crossings for a terminal, the page and crossings.csv."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from pipeline.codec import plain
from pipeline.results.worst import share, worst_cells
from pipeline.scene.labels import prefixed
from pipeline.store.fingerprints import fingerprint
from pipeline.studies.crossings.result import Crossing, CrossingsResult

NOTHING = "-"
Cell = Callable[[Crossing], str]
CERTAIN = 1e-4  # probability that is as good as none
LEFT = ("mode",)  # columns of words


def table_cells(result: CrossingsResult) -> tuple[list[str], list[list[str]]]:
    """Headings and rows; a column of which no row knows anything is left out."""
    columns = dict(_columns(result))
    kept = {name: cell for name, cell in columns.items() if any(cell(row) != NOTHING for row in result.rows)}
    rows = [[str(number), *(cell(row) for cell in kept.values())] for number, row in enumerate(result.rows, start=1)]
    return ["no.", *kept], rows


def _columns(result: CrossingsResult) -> Iterator[tuple[str, Cell]]:
    """Heading and cells of every column but the first."""
    highest = max((row.worst.height for row in result.rows if math.isfinite(row.worst.height)), default=0.0)
    factor, unit = prefixed(highest, "m")
    yield "EO", lambda row: str(row.engine_order)
    yield "mode", lambda row: row.name
    yield "ND", lambda row: str(row.nodal_diameter)
    yield "speed [rev/min]", lambda row: f"{row.speed_rpm:g}"
    yield "distance [%]", lambda row: _number(100.0 * row.distance, "+.1f")
    yield "f [Hz]", lambda row: worst_cells(row.worst, factor)[0]
    yield f"worst motion [{unit}]", lambda row: worst_cells(row.worst, factor)[1]
    yield "branch", lambda row: worst_cells(row.worst, factor)[2]
    yield "v [µm]", lambda row: _span([1e6 * v for v in row.overlap_m])
    yield "normal force [N]", lambda row: _number(row.normal_force_n, ".4g")
    yield "temperature", lambda row: NOTHING if row.temperature is None else _span(row.temperature)
    yield "stress amplitude [MPa]", lambda row: _number(1e-6 * row.stress_pa, ".4g")
    yield "margin", lambda row: _number(row.margin, ".3g")
    yield "tolerances [%]", lambda row: _change(row)
    yield "above limit [%]", lambda row: _probability(row)
    yield "mistuned", lambda row: _number(row.amplification, ".3g")


def _change(row: Crossing) -> str:
    """Change of the worst motion within the tolerances, percent."""
    found = None if row.scatter is None else row.scatter.tolerance
    return NOTHING if found is None else " to ".join(f"{round(100.0 * end, 1) + 0.0:+.1f}" for end in found)


def _probability(row: Crossing) -> str:
    """Probability that the limit is exceeded with its interval, percent."""
    found = None if row.scatter is None else row.scatter.exceedance
    if found is None:
        return NOTHING
    if found.high < CERTAIN or found.low > 1.0 - CERTAIN:
        return f"< {100.0 * CERTAIN:g}" if found.high < CERTAIN else f"> {100.0 - 100.0 * CERTAIN:g}"
    return f"{100.0 * found.probability:.3g} ({100.0 * found.low:.3g} to {100.0 * found.high:.3g})"


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else NOTHING


def _span(ends: Sequence[float]) -> str:
    """Two numbers, or one where both are the same with three digits."""
    said = list(dict.fromkeys(_number(end, ".3g") for end in ends))
    return " to ".join(said)


def table_lines(result: CrossingsResult) -> list[str]:
    """The table for a terminal, remarks, what has no row, and a line to sign."""
    headings, rows = table_cells(result)
    lines = [f"crossings: {headline(result)}"]
    if rows:
        lines += _aligned([headings, *rows], [name in LEFT for name in headings])
    return [*lines, *remarks(result), signature(result)]


def _aligned(rows: Sequence[Sequence[str]], left: Sequence[bool]) -> list[str]:
    """Rows of cells with columns of one width; units of the headings in a line of their own."""
    parts = [name.partition(" [") for name in rows[0]]
    shown = [[name for name, _, _ in parts], [f"[{unit}" if unit else "" for _, _, unit in parts], *rows[1:]]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    sides = [str.ljust if at_left else str.rjust for at_left in left]
    return ["  ".join(map(lambda put, cell, width: put(cell, width), sides, row, widths)).rstrip() for row in shown]


def headline(result: CrossingsResult) -> str:
    """Number of rows, and the highest."""
    low, high = result.speed_rpm
    orders = sorted({line.engine_order for line in result.lines})
    said = f"{len(result.rows)} of engine orders {', '.join(map(str, orders))}, {low:g} to {high:g} rev/min"
    known = [row for row in result.rows if math.isfinite(row.worst.height)]
    if not known:
        return said
    top = max(known, key=lambda row: row.worst.height)
    factor, unit = prefixed(top.worst.height, "m")
    return (
        f"{said}; highest worst motion {worst_cells(top.worst, factor)[1]} {unit} at {top.speed_rpm:g} rev/min, "
        f"EO {top.engine_order}, {top.name}"
    )


def remarks(result: CrossingsResult) -> list[str]:
    """What qualifies rows, by their numbers, and what has none."""
    lines = [] if result.complete else ["stopped: the rows so far"]
    lines += _notes(result)
    lines += [f"{number}: {said}" for number, row in enumerate(result.rows, start=1) for said in row.remarks]
    return [*lines, *(f"no row: {said}" for said in result.left_out)]


def _notes(result: CrossingsResult) -> Iterator[str]:
    """What the headings mean, a line each."""
    steady = ", ".join(f"{speed:g}" for speed in result.steady_rpm)
    yield f"distance: of the speed from the nearest of {steady} rev/min; v: overlap under static load, negative: gap"
    yield from result.asked
    found = [row.scatter.exceedance for row in result.rows if row.scatter is not None and row.scatter.exceedance]
    if found:
        compared, most = sum(each.curves for each in found), max(each.curve_error for each in found)
        beside = f"; {compared} whole curves differ by up to {share(most)}" if compared else ""
        yield f"above limit: probability with its 95 % interval, of followed peaks{beside}"
    if any(math.isfinite(row.amplification) for row in result.rows):
        yield "mistuned: highest motion of any blade of the mistuned rings over the tuned peak"


def signature(result: CrossingsResult) -> str:
    """The line to sign: the table by its hash, which its numbers alone make."""
    name = fingerprint({"rows": plain([_values(row) for row in result.rows])})[:12]
    return f"table {name}   checked by ____________________   date ____________"


def csv_text(result: CrossingsResult) -> str:
    """crossings.csv: a row for each crossing in SI units; a cell is empty where a number is not known."""
    stream = io.StringIO()
    rows = [{"number": number, **_values(row)} for number, row in enumerate(result.rows, start=1)]
    names = list(dict.fromkeys(name for row in rows for name in row)) or ["number"]
    table = csv.DictWriter(stream, names, lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: value for name, value in plain(row).items() if value is not None})
    return stream.getvalue()


def _values(row: Crossing) -> dict[str, Any]:
    """The numbers of a row by name, SI units."""
    facts = row.worst
    unknown = math.nan, math.nan
    low, high = row.temperature or unknown
    lowest, highest = (None if row.scatter is None else row.scatter.tolerance) or unknown
    drawn = None if row.scatter is None else row.scatter.exceedance
    return {
        "engine_order": row.engine_order,
        "mode": row.name,
        "nodal_diameter": row.nodal_diameter,
        "wave": row.wave,
        "speed_rpm": row.speed_rpm,
        "distance": row.distance,
        "force_n": row.parameters["excitation.force"],
        "from_hz": row.parameters["response.frequency"][0],
        "to_hz": row.parameters["response.frequency"][1],
        "worst_frequency_hz": facts.worst_frequency_hz,
        "worst_amplitude_m": facts.worst_amplitude_m,
        "worst_motion": facts.worst_motion,
        "worst_branch": facts.worst_branch,
        "worst_at_end": facts.worst_at_end,
        "worst_unresolved": facts.worst_unresolved,
        "peak_amplitude_m": facts.peak_amplitude_m,
        "overlap_lowest_m": row.overlap_m[0],
        "overlap_highest_m": row.overlap_m[1],
        "normal_force_n": row.normal_force_n,
        "temperature_lowest": low,
        "temperature_highest": high,
        "stress_amplitude_pa": row.stress_pa,
        "margin": row.margin,
        "tolerance_lowest": lowest,
        "tolerance_highest": highest,
        "probability": math.nan if drawn is None else drawn.probability,
        "probability_low": math.nan if drawn is None else drawn.low,
        "probability_high": math.nan if drawn is None else drawn.high,
        "amplification": row.amplification,
        "remarks": "; ".join(row.remarks),
    }
