"""The comparison with the peer as Markdown, from the dictionary that `peers.json` holds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from tables import markdown_table

Row = dict[str, Any]


def report(results: dict[str, Any]) -> str:
    """Speed, response and peaks of every row, and what stands behind the numbers."""
    parts = [
        "# Beside pyHarm: the peers' problem and one of the size of a shrouded blade",
        _preamble(results),
        "## Speed",
        _speed(results),
        "## Response: |q^(1)| of the loaded node",
        _response(results),
        "## Peak",
        _peaks(results),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _preamble(results: dict[str, Any]) -> str:
    versions = "; ".join(
        f"{program}: {', '.join(f'{name} {number}' for name, number in found.items())}"
        for program, found in results["versions"].items()
    )
    load = results["load"]
    missing = results.get("without_peer")
    parts = [
        f"{results['when']}, {results['machine']}, one thread each, load of the machine {load[0]:.1f} before and "
        f"{load[1]:.1f} after. {versions}.",
        "A and V: 36 dofs, 9 friction nodes against ground, with constant and with variable normal load, w from 0.5 "
        "to 1.6. S: the default blade (81 dofs, 9 contact nodes) at engine order N_b / 2 in relative coordinates, "
        f"variable normal load. Tolerance of Newton's method {results['tolerance']:g}; the step of pyHarm fitted so "
        "that it takes as many points as the first row of the case. shroud without what pyHarm does not do: "
        "exponents, detached branches, the truncation error. Times are medians of the curves timed; the first "
        "curve of a process is not among them, nor is setting the problem up. *First use*: import and compilation "
        "with empty caches; *each start*: the same when the caches are full.",
        f"**Without pyHarm: {missing}.**" if missing else "",
        *(f"**Failed: {failure}.**" for failure in results["failures"]),
    ]
    return "\n\n".join(part for part in parts if part)


def _speed(results: dict[str, Any]) -> str:
    times = ("s a curve", "ms a point", "ms an iteration", "first use, s", "each start, s", "times faster")
    header = ("case", "program", "points", "iterations", "curves", *times)
    rows: list[tuple[object, ...]] = []
    for row in results["rows"]:
        curve = row["curve"]
        iterations = curve["iterations"]
        rows.append(
            (
                row["case"],
                name(row),
                f"{curve['points']}{'' if curve['complete'] else ' (incomplete)'}",
                iterations or "-",
                len(row["timed"]),
                _both(row["seconds"], ".3f"),
                _both(row["ms_a_point"], ".2f"),
                _both([1e3 * value / iterations for value in row["seconds"]] if iterations else None, ".2f"),
                _both(row["first_use"], ".1f"),
                _both(row["each_start"], ".1f"),
                _both(row["faster"], ".1f"),
            )
        )
    note = (
        "Every time twice: of the processor / on the clock; the clock counts what others do on a busy machine. "
        "*Times faster*: time a point of the fastest pyHarm row of the case against that of the row."
    )
    return f"{markdown_table(header, rows)}\n\n{note}"


def _both(times: Sequence[float] | None, form: str) -> str:
    """CPU / wall, of [wall, CPU]."""
    return "-" if times is None else f"{times[1]:{form}} / {times[0]:{form}}"


def _response(results: dict[str, Any]) -> str:
    """A table for the cases of each set of frequencies."""
    sets: dict[tuple[float, ...], list[str]] = {}
    for case, frequencies in results["frequencies"].items():
        sets.setdefault(tuple(frequencies), []).append(case)
    return "\n\n".join(_response_of(results, cases, frequencies) for frequencies, cases in sets.items())


def _response_of(results: dict[str, Any], cases: Sequence[str], frequencies: Sequence[float]) -> str:
    lines: list[tuple[object, ...]] = []
    for case in cases:
        reference = results["references"][case]
        exact, agreed = reference["response"], reference["agreed"]
        lines.append((case, "reference: exact, to 1e-13", *_nine(exact), "-", "-"))
        check = reference["check"]
        lines.append((case, f"{results['check_samples']} samples", *_nine(check), _off(check, exact), "-"))
        if agreed:
            lines.append((case, "published, 128 samples", *_nine(agreed), _off(agreed, exact), "-"))
        for row in results["rows"]:
            if row["case"] == case:
                found = row["response"]
                published = _off(found, agreed) if agreed and row["variant"] != "exact" else "-"
                lines.append((case, name(row), *_nine(found), _off(found, exact), published))
    heads = (f"w = {w:.2f}" for w in frequencies)
    return markdown_table(("case", "program", *heads, "off the reference", "off the published"), lines)


def _nine(values: Iterable[float]) -> list[str]:
    return [f"{value:.9f}" for value in values]


def _off(values: Sequence[float], truth: Sequence[float]) -> str:
    """Largest relative deviation."""
    pairs = zip(values, truth, strict=True)
    return f"{max(abs(value / true - 1.0) if math.isfinite(value) else math.inf for value, true in pairs):.1e}"


def _peaks(results: dict[str, Any]) -> str:
    rows: list[tuple[object, ...]] = []
    for case, reference in results["references"].items():
        height = reference["peak"]
        rows.append((case, "reference: exact, to 1e-13", f"{reference['peak_frequency']:.6f}", f"{height:.9f}", "-"))
        check = reference["check_peak"]
        label = f"{results['check_samples']} samples at that w"
        rows.append(
            (case, label, f"{reference['peak_frequency']:.6f}", f"{check:.9f}", f"{check / height - 1.0:+.1e}")
        )
        for row in results["rows"]:
            if row["case"] == case:
                curve = row["curve"]
                error = f"{curve['peak'] / height - 1.0:+.1e}"
                rows.append((case, name(row), f"{curve['peak_frequency']:.6f}", f"{curve['peak']:.9f}", error))
    note = "The peak of pyHarm is the highest of its points: it does not look for it."
    return f"{markdown_table(('case', 'program', 'w', 'height', 'error'), rows)}\n\n{note}"


def name(row: Row) -> str:
    """Program and variant."""
    samples = "" if row["variant"] == "exact" else f", {row['samples']} samples"
    return f"{row['program']}, {row['variant']}{samples}"
