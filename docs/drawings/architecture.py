"""Drawing of the program: its four packages, the files between them, and what exists once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from docs.drawings.lines import arrow, drawing_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, HEIGHT, PITCH = 27.0, 21.0, 34.0  # of the box of a package
PACKAGES = (  # name, what it does, what of it exists once
    ("geometry", "blade, disk, shroud;\nmeshes of other programs", ("mesh of one sector", "contact frames, areas")),
    ("rom", "K and M, Craig-Bampton,\nstress on the mesh", ("reduced model", "structure: G, modes")),
    (
        "nonlinear",
        "contact, harmonic balance,\nbranches, worst motion",
        ("contact element", "balance R(x, p) = 0", "follower over p", "eigenproblem T z = 0"),
    ),
    ("pipeline", "scene, stages, store,\nfigures, report, commands", ("scene", "record of a curve", "study")),
)
FILES = ("sector", "rom.h5", "curves")
COLOURS = ("#0072B2", "#009E73", "#D55E00", "#CC79A7")


def draw_package(axes: Axes, left: float, colour: str, package: tuple[str, str, tuple[str, ...]]) -> None:
    """A box with the name of a package, what it does, and the things in it that exist once."""
    name, task, ideas = package
    axes.fill(
        [left, left + WIDTH, left + WIDTH, left], [0, 0, HEIGHT, HEIGHT], facecolor="0.97", edgecolor=colour, lw=1.6
    )
    axes.text(
        left + WIDTH / 2, HEIGHT - 2.2, name, ha="center", va="center", color=colour, fontsize=11, weight="bold"
    )
    axes.text(left + WIDTH / 2, HEIGHT - 6.0, task, ha="center", va="center", fontsize=8)
    for row, idea in enumerate(ideas):
        axes.text(
            left + WIDTH / 2,
            HEIGHT - 10.2 - 2.9 * row,
            idea,
            ha="center",
            va="center",
            fontsize=8,
            bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": colour, "linewidth": 0.8},
        )


def architecture_figure(_: Path) -> Figure:
    """The drawing: data from left to right, imports from right to left."""
    from matplotlib.figure import Figure

    with drawing_style():
        figure = Figure(figsize=(10.0, 2.9), layout="constrained")
        axes = figure.add_subplot()
        axes.axis("off")
        for place, (colour, package) in enumerate(zip(COLOURS, PACKAGES, strict=True)):
            draw_package(axes, place * PITCH, colour, package)
        for place, name in enumerate(FILES):
            start = place * PITCH + WIDTH
            arrow(axes, (start + 0.4, HEIGHT / 2), (start + PITCH - WIDTH - 0.4, HEIGHT / 2))
            axes.text(start + (PITCH - WIDTH) / 2, HEIGHT / 2 + 1.2, name, ha="center", va="bottom", fontsize=7.5)
        end = 3 * PITCH
        arrow(axes, (end, -3.2), (0, -3.2), color="0.45", linewidth=0.9)
        axes.text(end / 2, -4.2, "imports, one way", ha="center", va="top", color="0.35", fontsize=8)
        arrow(axes, (end + WIDTH / 2, HEIGHT + 4.2), (end + WIDTH / 2, HEIGHT + 0.3))
        axes.text(end + WIDTH / 2, HEIGHT + 4.6, "scene.toml", ha="center", va="bottom", fontsize=8.5)
        arrow(axes, (end + WIDTH / 2, -0.3), (end + WIDTH / 2, -4.0))
        axes.text(end + WIDTH / 2, -4.4, "curves, figures, report", ha="center", va="top", fontsize=8.5)
        axes.set(xlim=(-1, 3 * PITCH + WIDTH + 1), ylim=(-7, HEIGHT + 8))
    return figure
