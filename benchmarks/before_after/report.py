"""The table of two states in Markdown, and its rows for a CSV file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from tables import markdown_table

from before_after.rows import ALONE, ROWS, Cases, exponents

Stored = Mapping[str, Any]  # a state as its JSON file holds it
NOTHING = "-"
STAGES = ("mesh", "assemble", "reduce", "respond", "render", "figures")
SHOWN_EXTRAS = ("truncation", "detached", "ring stability", "time integration")
NOTE = (
    "Seconds on the clock, those of all processors in brackets; of single curves processor time on one thread. Every "
    "case in a process of its own, kernels compiled before, medians where it is short. `>=`: ended at its limit."
)
SAME = 1e-6  # relative differences of answers below it are those of round-off


def report(before: Stored, after: Stored) -> str:
    """All tables, and what the two states are."""
    old, new = cases_of(before, after)
    head = ("what", "unit", "before", "after", "times better", "target", "reached")
    parts = [
        "# Run times, before and after",
        NOTE,
        markdown_table(head, ([row[name] for name in head] for row in table(before, after))),
        "## Stages of a run",
        "Seconds on the clock.",
        markdown_table(("scene", "state", *STAGES), _stages(old, new)),
        "## What each extra costs, over the curves alone",
        "Seconds of all curves of the scene alone, and what each extra adds to them, divided by these seconds.",
        markdown_table(("scene", "state", f"{ALONE}, s", *SHOWN_EXTRAS, "all", "all, s"), _extras(old, new)),
        '## "auto" beside the cheapest fixed number of harmonics as accurate',
        markdown_table(("curve", "state", "H", "error", "s", "fixed H", "s", "times"), _automatic(old, new)),
        "## Beside pyHarm",
        "Milliseconds of processor time a point; times as fast as pyHarm, which solved the same problems in the run "
        "of the state after.",
        markdown_table(("case", "pyHarm", "before", "after", "times, before", "times, after"), _peers(old, new)),
        "## Exponents of growth",
        markdown_table(("what", "before", "after"), _exponents(old, new)),
        "## Answers",
        _identity(old, new),
        markdown_table(
            ("curves", "compared", "peak, largest change", "worst motion, largest change", "other branches"),
            _answers(old, new),
        ),
        "## Where",
        "\n".join(f"* {name}: {_where(state)}" for name, state in (("before", before), ("after", after))),
        *_failures(before, after),
    ]
    return "\n\n".join(parts) + "\n"


def page(before: Stored, after: Stored) -> str:
    """What the page of the documents shows: the state after alone."""
    _, cases = cases_of(before, after)
    head = ("what", "unit", "measured", "target", "reached")
    rows = [{**row, "measured": row["after"]} for row in table(before, after)]
    parts = [
        "# Run times",
        NOTE,
        markdown_table(head, ([row[name] for name in head] for row in rows)),
        "## Beside pyHarm",
        "Milliseconds of processor time a point.",
        markdown_table(
            ("case", "pyHarm", "this program", "times faster"),
            ((name, theirs, ours, times) for name, theirs, _, ours, _, times in _peers({}, cases)),
        ),
        f"Measured: {_where(after)}.",
    ]
    return "\n\n".join(parts) + "\n"


def cases_of(before: Stored, after: Stored) -> tuple[Cases, Cases]:
    """The answers of both, of the hard corner those cases that both have; pyHarm's stand with the state after."""
    old, new = dict(before["cases"]), dict(after["cases"])
    if new.get("pyharm"):
        old["pyharm"] = new["pyharm"]
    if "hard" in old and "hard" in new:
        both = {row["case"] for row in old["hard"]["rows"]} & {row["case"] for row in new["hard"]["rows"]}
        for state in (old, new):
            state["hard"] = {"rows": [row for row in state["hard"]["rows"] if row["case"] in both]}
    return old, new


def table(before: Stored, after: Stored) -> list[dict[str, Any]]:
    """The rows: texts, and "-" for what was not measured."""
    old, new = cases_of(before, after)
    rows = []
    for row in ROWS:
        first, second = row.figure(old), row.figure(new)
        gain = row.gain(first, second) if first and second else NOTHING
        limit = row.target if row.target is not None else first.value if first else None
        reached = NOTHING
        if second is not None and limit is not None:
            reached = "yes" if row.reached(second, limit) else "no"
        said = NOTHING if limit is None else f"{row.target:g}" if row.target is not None else "no more"
        rows.append(
            {
                "what": row.what,
                "unit": row.unit,
                "before": first.text() if first else NOTHING,
                "after": second.text() if second else NOTHING,
                "times better": gain,
                "target": said,
                "reached": reached,
            }
        )
    return rows


def _stages(old: Cases, new: Cases) -> Iterator[Sequence[str]]:
    for scene in ("default", "figure5"):
        for label, cases in (("before", old), ("after", new)):
            stages = cases.get(scene, {}).get("stages", {})
            if stages:
                yield scene, label, *(f"{stages.get(name, 0.0):.2f}" for name in STAGES)


def _automatic(old: Cases, new: Cases) -> Iterator[Sequence[str]]:
    for case in dict.fromkeys(name for name in [*new, *old] if name.startswith("auto ")):
        for label, cases in (("before", old), ("after", new)):
            for curve, row in cases.get(case, {}).get("curves", {}).items():
                found = (str(row["harmonics"]), f"{row['error']:.1e}", f"{row['auto']:.3g}")
                fixed = row["fixed"] or {"harmonics": NOTHING, "seconds": math.nan}
                times = f"{fixed['seconds']:.3g}", f"{row['auto'] / fixed['seconds']:.3g}"
                yield f"{case.split()[1]}, {curve}", label, *found, str(fixed["harmonics"]), *times


def _extras(old: Cases, new: Cases) -> Iterator[Sequence[str]]:
    for case in dict.fromkeys(name for name in [*new, *old] if name.startswith("extras ")):
        for label, cases in (("before", old), ("after", new)):
            seconds = cases.get(case, {}).get("seconds")
            if seconds:
                values = list(seconds.values())
                shares = [f"{(more - less) / values[0]:.2f}" for less, more in pairwise(values)]
                added = dict(zip(list(seconds)[1:], shares, strict=True))
                columns = [added.get(name, "in the next") for name in SHOWN_EXTRAS]
                totals = f"{values[-1] / values[0]:.3g}", f"{values[-1]:.3g}"
                yield case.split()[1], label, f"{values[0]:.3g}", *columns, *totals


def _peers(old: Cases, new: Cases) -> Iterator[Sequence[str]]:
    theirs = new.get("pyharm", {})
    names = (new.get("peers") or old.get("peers") or {}).get("cases", {})
    for name in names:
        ms = theirs.get(name)
        ours = [cases.get("peers", {}).get("cases", {}).get(name, {}).get("ms") for cases in (old, new)]
        shown = [NOTHING if value is None else f"{value:.3g}" for value in (ms, *ours)]
        yield name, *shown, *(NOTHING if ms is None or value is None else f"{ms / value:.0f}" for value in ours)


def _exponents(old: Cases, new: Cases) -> Iterator[Sequence[str]]:
    first, second = dict(exponents(old)), dict(exponents(new))
    for name in first | second:
        yield name, *(f"{found[name]:.2f}" if name in found else NOTHING for found in (first, second))


def _identity(old: Cases, new: Cases) -> str:
    words = {True: "identical bit by bit", False: "NOT identical", None: "not measured"}
    found = [words[cases.get("workers", {}).get("identical")] for cases in (old, new)]
    return f"Results with 1 and with 2 worker processes: before {found[0]}, after {found[1]}."


def _answers(old: Cases, new: Cases) -> Iterator[Sequence[str]]:
    """Relative changes of peaks and worst motions of curves that both states have solved with all extras."""
    first, second = _found(old), _found(new)
    for group in dict.fromkeys(name for name, _ in second):
        pairs = [(first[key], found) for key, found in second.items() if key[0] == group and key in first]
        if pairs:
            changes = [_largest(pairs, "peak"), _largest(pairs, "worst")]
            others = sum(one["detached"] != other["detached"] for one, other in pairs)
            yield group, str(len(pairs)), *changes, str(others)


def _found(cases: Cases) -> dict[tuple[str, str], Mapping[str, Any]]:
    found = {
        (name, label): answer
        for name, case in cases.items()
        if name.startswith("extras ")
        for label, answer in case.get("found", {}).items()
    }
    for name in ("hard", "case 189", "stiff"):
        for row in cases.get(name, {}).get("rows", ()):
            if row.get("found"):
                found[name, str([row.get(key) for key in ("case", "kn", "v0")])] = row["found"]
    return found


def _largest(pairs: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]], quantity: str) -> str:
    changes = [
        abs(new[quantity] / old[quantity] - 1.0) if old[quantity] and new[quantity] else math.inf
        for old, new in pairs
        if old[quantity] != new[quantity]
    ]
    return f"{max(changes, default=0.0):.1e}"


def _where(state: Stored) -> str:
    """Commits and dates of all cases, the machine, and the largest load of it before a case."""
    measured = state.get("measured", {}).values()
    parts = [f"{name} {', '.join(sorted({case[name] for case in measured}))}" for name in ("commit", "date")]
    loads = [case["load"] for case in measured]
    return "; ".join([*parts, state.get("machine", NOTHING), f"load at most {max(loads, default=0.0):.1f}"])


def _failures(before: Stored, after: Stored) -> Iterator[str]:
    for label, state in (("before", before), ("after", after)):
        for name, reason in state.get("failures", {}).items():
            yield f"**Not measured {label}: {name}: {reason}**"
