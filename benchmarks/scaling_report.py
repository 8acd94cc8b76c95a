"""Scaling in words and pictures: tables with fitted exponents, the figure, where each size stops being practical."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import machine
from markdown_table import markdown_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from scaling_limits import Limit

MODEL, MS_A_POINT, MEMORY = "model s", "ms a point", "memory GB"
MEASURED = {
    MODEL: "mesh to reduced model, s",
    MS_A_POINT: "a point of the curve, ms",
    MEMORY: "largest memory, GB",
}
NODES, H = "contact nodes", "harmonics"
FITTED = {NODES: tuple(MEASURED), H: (MS_A_POINT,)}  # what depends on which; memory is that of the reduction


def power_law(sizes: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """Factor and exponent of values = factor size^exponent by least squares, over the larger half of the sizes."""
    import numpy as np

    first = (len(sizes) - 1) // 2 if len(sizes) > 2 else 0
    if len(sizes) - first < 2:
        return math.nan, math.nan
    exponent, logarithm = np.polyfit(np.log(sizes[first:]), np.log(values[first:]), 1)
    return float(np.exp(logarithm)), float(exponent)


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Exponent of `power_law`."""
    return power_law(sizes, values)[1]


def report(
    by_nodes: Sequence[dict[str, Any]], by_harmonics: Sequence[dict[str, Any]], limits: Sequence[Limit]
) -> str:
    """The tables in Markdown, with the exponents and the machine."""
    parts = ["# Time and memory against sizes"]
    facts = machine.this_machine(1).facts()
    parts.append("; ".join(f"{name}: {text}" for name, text in facts.items()) + ".")
    for rows, key in ((by_nodes, NODES), (by_harmonics, H)):
        fitted = [f"{name}: {exponent([r[key] for r in rows], [r[name] for r in rows]):.2f}" for name in FITTED[key]]
        parts.append(f"## Against {key}")
        parts.append(markdown_table(list(rows[0]), [list(row.values()) for row in rows]))
        parts.append(f"Exponents over the larger half: {', '.join(fitted)}.")
    parts.append("## Where it stops being practical, and what to do then")
    parts.append(
        "By the fitted laws, for two cores and 24 GB. Beyond what was measured it is extrapolated "
        "(a grid has 225 nodes at most)."
    )
    head = ("growing", "what it costs", "measured to", "exponent", "practical", "reached at", "then")
    parts.append(markdown_table(head, [limit.row() for limit in limits]))
    return "\n\n".join(parts) + "\n"


def draw(folder: Path, by_nodes: Sequence[dict[str, Any]], by_harmonics: Sequence[dict[str, Any]]) -> None:
    """Time and memory over both sizes, with the fitted exponents in the legends."""
    from matplotlib import pyplot as plt

    from pipeline.figures.style import save, styled

    with styled():
        figure, axes = plt.subplots(1, 2, figsize=(9.6, 4.2), layout="constrained", sharey=True)
        _panel(axes[0], by_nodes, NODES)
        _panel(axes[1], by_harmonics, H)
        axes[0].set_ylabel("seconds; milliseconds; GB")
        save(figure, folder, "scaling")


def _panel(axes: Axes, rows: Sequence[dict[str, Any]], key: str) -> None:
    from pipeline.figures.style import DISTINCT, plain_log_labels

    sizes = [row[key] for row in rows]
    for colour, marker, name in zip(DISTINCT, "os^", MEASURED, strict=False):
        if name not in FITTED[key]:
            continue
        values = [row[name] for row in rows]
        label = f"{MEASURED[name]}: exponent {exponent(sizes, values):.2f}"
        axes.loglog(sizes, values, color=colour, marker=marker, markersize=5, label=label)
    axes.set_xlabel(f"{key} of a face" if key == NODES else key)
    plain_log_labels(axes.xaxis)
    plain_log_labels(axes.yaxis)
    axes.legend(fontsize=8)
