"""Where a size stops being practical: the fitted law of what it costs, taken to what people put up with."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scaling_report import MEMORY, MODEL, MS_A_POINT, NODES, H, power_law

_MINUTES_10, _MEMORY, _A_POINT = 600.0, 24.0, 600.0  # s; GB; ms a point: a curve of 100 points in a minute
_GROWS = 0.1  # exponents below this are noise
_COARSER = (
    "a coarser mesh: 20-node elements with `mesh.grading` are right to 0.05 % with 8000 dofs; `shroud verify` says it"
)
_FEWER_NODES = 'a coarser `mesh.contact_grid`, with `rom.contact_dofs = "patch"` where the stuck frequencies matter'
_FEWER_HARMONICS = (
    '`harmonics = "auto"` with the tolerance that is needed; a `tolerance` of 5 % rarely takes more than 9'
)
_MORE_CORES = "`--jobs` on a machine with more cores; in several evenings: the same command goes on where it was"


@dataclass(frozen=True)
class Limit:
    """A cost that grows with a size by a power law, and how much of it is practical."""

    size: str
    cost: str
    largest: float
    factor: float
    exponent: float
    practical: str
    most: float
    then: str

    @property
    def reached_at(self) -> float:
        """Size at which the cost is at its practical limit; infinite where it hardly grows."""
        if math.isnan(self.exponent) or self.exponent < _GROWS:
            return math.inf
        return float((self.most / self.factor) ** (1.0 / self.exponent))

    def row(self) -> tuple[str, ...]:
        """Cells of its table."""
        reached = f"{_rounded(self.reached_at)} {self.size}" if math.isfinite(self.reached_at) else "not in sight"
        return (
            self.size,
            self.cost,
            f"{self.largest:.0f}",
            f"{self.exponent:.2f}",
            self.practical,
            reached,
            self.then,
        )


def measured_limits(
    bench: Path, by_nodes: Sequence[dict[str, Any]], by_harmonics: Sequence[dict[str, Any]]
) -> list[Limit]:
    """Limits of contact nodes and harmonics; of dofs and curves where their tables are in the folder `bench`."""
    dofs = _rows(bench / "reduction" / "reduction.csv")
    curves = _rows(bench / "parallel" / "parallel.csv")
    most_jobs = max((row["processes"] for row in curves), default=0)
    together = [row for row in curves if row["processes"] == most_jobs]
    minute = "100 points a minute"
    wanted = [
        (dofs, "dofs", "total", "seconds to the reduced model", "10 minutes", _MINUTES_10, _COARSER),
        (dofs, "dofs", "memory_gb", "memory, GB", "24 GB", _MEMORY, _COARSER),
        (by_nodes, NODES, MODEL, "seconds to the reduced model", "10 minutes", _MINUTES_10, _FEWER_NODES),
        (by_nodes, NODES, MEMORY, "memory, GB", "24 GB", _MEMORY, _FEWER_NODES),
        (by_nodes, NODES, MS_A_POINT, "ms a point, H = 1", minute, _A_POINT, _FEWER_NODES),
        (
            by_harmonics,
            H,
            MS_A_POINT,
            f"ms a point, {by_harmonics[0][NODES]} nodes",
            minute,
            _A_POINT,
            _FEWER_HARMONICS,
        ),
        (
            together,
            "curves",
            "seconds",
            f"seconds in {most_jobs:.0f} processes",
            "10 minutes",
            _MINUTES_10,
            _MORE_CORES,
        ),
    ]
    return [_limit(*each) for each in wanted if len(each[0]) > 1]


def _limit(
    rows: Sequence[dict[str, Any]], size: str, column: str, cost: str, practical: str, most: float, then: str
) -> Limit:
    sizes = [float(row[size]) for row in rows]
    factor, exponent = power_law(sizes, [float(row[column]) for row in rows])
    return Limit(size, cost, max(sizes), factor, exponent, practical, most, then)


def _rows(file: Path) -> list[dict[str, Any]]:
    """Rows of a table with its numbers as numbers; none where it was not measured."""
    if not file.exists():
        return []
    with file.open(encoding="utf-8") as source:
        return [{key: _number(value) for key, value in row.items()} for row in csv.DictReader(source)]


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def _rounded(value: float) -> str:
    """A number to two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):,.0f}".replace(",", " ")
