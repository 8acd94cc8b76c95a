"""Lines of an engineering drawing: dimensions with extension lines, angles, springs, hatching, notes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline import styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OUTLINE = {"color": "0.1", "linewidth": 1.3, "solid_joinstyle": "round"}
THIN = {"color": "0.35", "linewidth": 0.7}
CENTRE = {"color": "0.45", "linewidth": 0.7, "dashes": (14, 3, 2, 3)}
RIGHT, LEFT = "#D55E00", "#0072B2"  # colours of the right and of the left contact face
_ARROW = {"arrowstyle": "-|>,head_width=0.12,head_length=0.35", "shrinkA": 0, "shrinkB": 0, "mutation_scale": 14}


@contextmanager
def drawing_style() -> Iterator[None]:
    """The style of the figures, with upright letters in formulas as in the text beside them."""
    import matplotlib as mpl

    with styled():
        mpl.rcParams.update({"font.size": 9.0, "axes.grid": False, "mathtext.fontset": "dejavusans"})
        yield


def bare(axes: Axes, title: str) -> None:
    """No frame and no ticks, equal scales."""
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(title, loc="left", fontsize=10, fontweight="bold")


def arrow(axes: Axes, start: Sequence[float], end: Sequence[float], **look: Any) -> None:
    """A filled arrow from `start` to `end`."""
    style = _ARROW | {"color": "0.1", "linewidth": 1.2} | look
    axes.annotate("", xy=end, xytext=start, arrowprops=style)


def dimension(
    axes: Axes, start: Sequence[float], end: Sequence[float], offset: Sequence[float], text: str, **place: Any
) -> None:
    """The distance of two points, drawn `offset` away from them, between extension lines; the text along the line."""
    a, b, away = np.asarray(start, float), np.asarray(end, float), np.asarray(offset, float)
    gap = away / np.hypot(*away)
    for point in (a, b):
        ends = np.array([point + 1.0 * gap, point + away + 1.5 * gap])
        axes.plot(*ends.T, **THIN)
    for tail, head in ((a, b), (b, a)):
        arrow(axes, tail + away, head + away, color="0.35", linewidth=0.7)
    turn = np.rad2deg(np.arctan2(*(b - a)[::-1]))
    turn = turn - 180.0 if turn > 90.0 else turn + 180.0 if turn <= -90.0 else turn
    where = {"ha": "center", "va": "center", "rotation": turn, "rotation_mode": "anchor"} | place
    middle = where.pop("at", (a + b) / 2 + away)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.2}
    axes.text(*middle, text, bbox=box, **where)


def angle_arc(axes: Axes, centre: Sequence[float], radius: float, degrees: tuple[float, float], text: str) -> None:
    """An arc with arrows between two directions (degrees from the axis to the right), the text outside its middle."""
    turns = np.deg2rad(np.linspace(*degrees, 60))
    points = np.asarray(centre, float) + radius * np.column_stack([np.cos(turns), np.sin(turns)])
    axes.plot(*points[2:-2].T, **THIN)
    arrow(axes, points[4], points[0], color="0.35", linewidth=0.7)
    arrow(axes, points[-5], points[-1], color="0.35", linewidth=0.7)
    middle = np.asarray(centre, float) + 1.3 * (points[30] - np.asarray(centre, float))
    axes.text(*middle, text, ha="center", va="center", bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8})


def leader(axes: Axes, point: Sequence[float], place: Sequence[float], text: str, **look: Any) -> None:
    """A note with a thin line that ends in a dot on what it is about."""
    axes.plot(*np.array([point, place]).T, **THIN)
    axes.plot(*point, "o", color="0.35", markersize=2.5)
    axes.text(*place, text, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.2}, **look)


def spring(axes: Axes, start: Sequence[float], end: Sequence[float], width: float, **look: Any) -> None:
    """A spring between two points, with straight ends."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    along = b - a
    across = np.array([-along[1], along[0]]) / np.hypot(*along) * width
    places = np.concatenate([[0.0], np.linspace(0.22, 0.78, 9), [1.0]])
    sides = np.array([0, 0, 1, -1, 1, -1, 1, -1, 1, 0, 0]) / 2
    sides[1] = sides[-2] = 0.0
    points = a + places[:, None] * along + sides[:, None] * across
    axes.plot(*points.T, **(OUTLINE | look))


def ground(axes: Axes, start: Sequence[float], end: Sequence[float], depth: float) -> None:
    """A clamped line: hatched on its left side, seen from `start` to `end`."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    axes.plot(*np.array([a, b]).T, **OUTLINE)
    normal = np.array([-(b - a)[1], (b - a)[0]]) / np.hypot(*(b - a))
    for k in np.linspace(0.04, 1.0, 18):
        foot = a + k * (b - a)
        axes.plot(*np.array([foot, foot + depth * (normal - (b - a) / np.hypot(*(b - a)))]).T, **THIN)
