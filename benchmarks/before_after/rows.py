"""The rows of the table: what each reads from the answers of the cases, and its target."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Cases = Mapping[str, Mapping[str, Any]]  # name of a case -> its answer
ALL, ALONE = "time integration", "alone"  # the last and the first variant of the extras


@dataclass(frozen=True)
class Figure:
    """A number of one state; `processors`: its seconds of all processors; `at_least`: a limit ended the case."""

    value: float
    processors: float | None = None
    at_least: bool = False

    def text(self) -> str:
        """The number with three digits, seconds of the processors in brackets."""
        shown = f"{'>= ' if self.at_least else ''}{self.value:.3g}"
        return shown if self.processors is None else f"{shown} ({self.processors:.3g})"


@dataclass(frozen=True)
class Row:
    """A line of the table: what, its unit, the worst value that is good enough, and how it is read.

    `larger`: better the larger it is.
    """

    what: str
    unit: str
    target: float | None
    read: Callable[[Cases], Figure]
    larger: bool = False

    def reached(self, found: Figure, limit: float) -> bool:
        """Whether a number is good enough."""
        if self.larger:
            return found.value >= limit
        return found.value <= limit and not found.at_least

    def gain(self, before: Figure, after: Figure) -> str:
        """How many times better it is after; by the seconds of the processors in brackets."""
        if before.value <= 0.0 or after.value <= 0.0:
            return "-"
        times = after.value / before.value if self.larger else before.value / after.value
        if before.processors is None or after.processors is None:
            return f"{times:.3g}"
        return f"{times:.3g} ({before.processors / after.processors:.3g})"

    def figure(self, cases: Cases) -> Figure | None:
        """The number, None where its case was not measured."""
        try:
            return self.read(cases)
        except (KeyError, ValueError, ZeroDivisionError, TypeError):
            return None


def command(*path: str) -> Callable[[Cases], Figure]:
    """Seconds of a command on the clock, with those of the processors."""

    def read(cases: Cases) -> Figure:
        used: Any = cases
        for name in path:
            used = used[name]
        return Figure(used["wall"], used["cpu"])

    return read


def extras(scene: str) -> Callable[[Cases], Figure]:
    """Seconds of curves with all extras over those of the curves alone."""

    def read(cases: Cases) -> Figure:
        seconds = cases[f"extras {scene}"]["seconds"]
        return Figure(seconds[ALL] / seconds[ALONE])

    return read


def ratios_of_auto(cases: Cases) -> list[float]:
    """Seconds of "auto" over those of the cheapest fixed number of harmonics as accurate, for every curve."""
    curves = [curve for name, case in cases.items() if name.startswith("auto ") for curve in case["curves"].values()]
    return [curve["auto"] / curve["fixed"]["seconds"] for curve in curves if curve["fixed"]]


def a_point(nodes: int, harmonics: int) -> Callable[[Cases], Figure]:
    """Milliseconds a point."""

    def read(cases: Cases) -> Figure:
        rows = cases["growth"]["rows"]
        (found,) = (row for row in rows if (row["nodes"], row["harmonics"]) == (nodes, harmonics))
        return Figure(found["ms"])

    return read


def peers(*names: str) -> Callable[[Cases], Figure]:
    """The largest of the milliseconds a point of some of the peers' problems."""
    return lambda cases: Figure(max(cases["peers"]["cases"][name]["ms"] for name in names))


def times_faster(cases: Cases) -> Figure:
    """Time a point of pyHarm over ours, the least of the peers' problems."""
    ours, theirs = cases["peers"]["cases"], cases["pyharm"]
    return Figure(min(ms / ours[name]["ms"] for name, ms in theirs.items()))


def seconds_a_curve(cases: Cases) -> Figure:
    """Mean of the hard corner."""
    rows = cases["hard"]["rows"]
    return Figure(statistics.fmean(row["seconds"] for row in rows), at_least=any(row["limited"] for row in rows))


def hard_point(cases: Cases) -> Figure:
    """Median milliseconds a point of the hard corner with 7 harmonics."""
    rows = [row for row in cases["hard"]["rows"] if row["harmonics"] == 7 and row["points"]]
    return Figure(statistics.median(1e3 * row["seconds"] / row["points"] for row in rows))


def slowest(case: str) -> Callable[[Cases], Figure]:
    """Seconds of the slowest curve of a case."""

    def read(cases: Cases) -> Figure:
        row = max(cases[case]["rows"], key=lambda one: one["seconds"])
        return Figure(row["seconds"], at_least=row["limited"])

    return read


def reduction(case: str) -> Callable[[Cases], Figure]:
    """Seconds from the blade to the reduced model, the largest mesh of a case."""
    return lambda cases: Figure(cases[case]["rows"][-1]["wall"], cases[case]["rows"][-1]["cpu"])


ROWS = (
    Row("default scene from nothing", "s", 8.0, command("default", "whole")),
    Row("the same on a fresh clone, after `make setup`", "s", 9.0, command("fresh", "whole")),
    Row("compiling all kernels on a fresh clone (`make setup`)", "s", None, command("fresh", "setup")),
    Row("kernels that the run on the fresh clone compiled", "", 0.0, lambda c: Figure(c["fresh"]["compiled"])),
    Row("figure 5 scene from nothing", "s", 4.0, command("figure5", "whole")),
    Row("last-stage blade, `scenes/machine.toml`, from nothing", "s", 60.0, command("machine", "whole")),
    *(Row(f"all extras over curves alone, {scene}", "times", 2.0, extras(scene)) for scene in ("dummy", "figure5")),
    *(Row(f"all extras over curves alone, {scene}", "times", 2.0, extras(scene)) for scene in ("figure6", "figure7")),
    Row(
        '"auto" over the cheapest fixed H, median',
        "times",
        1.3,
        lambda c: Figure(statistics.median(ratios_of_auto(c))),
    ),
    Row('"auto" over the cheapest fixed H, largest', "times", 1.3, lambda c: Figure(max(ratios_of_auto(c)))),
    Row("peers' problem, a point, H = 1", "ms", 0.25, peers("A1", "V1")),
    Row("peers' problem, a point, H = 5", "ms", 0.8, peers("A5", "V5")),
    Row("the same beside pyHarm, the least of five problems", "times faster", 100.0, times_faster, larger=True),
    Row("a point with 225 contact nodes, H = 1", "ms", 100.0, a_point(225, 1)),
    Row("a point with 9 nodes, H = 31", "ms", 50.0, a_point(9, 31)),
    Row("case 189 of `--hard --seed 1`", "s", 20.0, slowest("case 189")),
    Row('"auto" on stiff contacts with a gap, the slowest curve', "s", 15.0, slowest("stiff")),
    Row("the hard corner, a curve", "s", 3.0, seconds_a_curve),
    Row("the hard corner, H = 7, median point", "ms", 8.0, hard_point),
    Row("142 000 dofs to reduced model", "s", None, reduction("dofs")),
    Row("484 000 dofs to reduced model", "s", 75.0, reduction("large")),
    Row("`shroud run`, nothing changed", "s", 0.3, command("default", "unchanged")),
    Row("`shroud validate`", "s", 0.2, command("default", "validate")),
    Row("a sweep of 8 on 2 cores, lost to the pool", "%", 15.0, lambda c: Figure(100.0 * c["workers"]["loss"])),
    Row("largest memory of a run, default scene", "GB", None, lambda c: Figure(c["default"]["whole"]["memory"])),
)


def exponents(cases: Cases) -> Iterator[tuple[str, float]]:
    """Exponents of the power laws: what grows with what, over the larger half of the sizes."""
    from scaling import power_law

    if "growth" in cases:
        rows = cases["growth"]["rows"]
        by_nodes = [row for row in rows if row["harmonics"] == 1]
        by_harmonics = [row for row in rows if row["nodes"] == 9]
        for name, size, chosen in (
            ("ms a point over contact nodes, H = 1", "nodes", by_nodes),
            ("ms a point over harmonics, 9 nodes", "harmonics", by_harmonics),
            ("ms a point over unknowns, all of these", "unknowns", rows),
        ):
            pairs = sorted({row[size]: row["ms"] for row in chosen}.items())
            yield name, power_law(*(list(column) for column in zip(*pairs, strict=True)))[1]
    dofs = [row for case in ("dofs", "large") if case in cases for row in cases[case].get("rows", ())]
    if len(dofs) > 1:
        small, large = dofs[0], dofs[-1]
        slope = math.log(large["cpu"] / small["cpu"]) / math.log(large["dofs"] / small["dofs"])
        yield "processor seconds to the reduced model over dofs", slope
