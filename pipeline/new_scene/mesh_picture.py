"""A picture of a mesh with its contact faces and its root coloured, from two sides; needs no GL library."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.style import drawn, styled
from pipeline.render.ring import LEFT_DARK, RIGHT_COLOUR
from pipeline.report.viewer import triangles_of

if TYPE_CHECKING:
    from geometry import ElementBlock

Array = NDArray[np.float64]
ROOT_COLOUR, BODY = "#009E73", (0.78, 0.82, 0.86)
COLOURS = {"contact_right": RIGHT_COLOUR, "contact_left": LEFT_DARK, "root": ROOT_COLOUR}
NAMES = {"contact_right": "right contact face (+y)", "contact_left": "left contact face (-y)", "root": "clamped root"}
MOST_EDGES = 20_000  # triangles above which edges of elements are not drawn


def mesh_picture(
    points: Array, blocks: tuple[ElementBlock, ...], marked: Mapping[str, NDArray[np.int64]], title: str
) -> bytes:
    """PNG of the boundary of a mesh from both sides.

    Shapes: `points` (N, 3), `marked` (k,).
    """
    from matplotlib.figure import Figure

    triangles = triangles_of(blocks)
    rows: dict[str, NDArray[np.bool_]] = {}
    colours = np.tile(np.array(BODY), (len(triangles), 1))
    for role, nodes in marked.items():
        rows[role] = np.asarray(np.isin(triangles, nodes).all(axis=1))
        colours[rows[role]] = _rgb(COLOURS[role])
    with styled():
        figure: Any = Figure(figsize=(9.0, 5.6), layout="constrained")
        views = (("contact_right", 1.0, "from above"), ("contact_left", -1.0, "from below"))
        for axes, (role, side, where) in zip(figure.subplots(1, 2), views, strict=True):
            view = _towards(points, triangles[rows[role]]) if role in rows else np.array([-0.6, 0.8, 0.0]) * side
            view = view + np.array([0.45 * view[1], -0.45 * view[0], 0.45 * side])  # a little from the side
            _draw(axes, points, triangles, colours, view / np.linalg.norm(view))
            axes.set_title(f"{NAMES[role]}, {where}" if role in rows else where)
        _legend(figure, marked)
        figure.suptitle(title)
        return drawn(figure, "png")


def _towards(points: Array, triangles: NDArray[np.int64]) -> Array:
    """The horizontal direction (3,) that some triangles face on average."""
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0) * [1.0, 1.0, 0.0]
    return np.asarray(normal / max(float(np.linalg.norm(normal)), 1e-300))


def _draw(axes: Any, points: Array, triangles: NDArray[np.int64], colours: Array, view: Array) -> None:
    """The triangles that face the viewer, from back to front, shaded."""
    from matplotlib.collections import PolyCollection

    right = np.cross((0.0, 0.0, 1.0), view)
    right /= np.linalg.norm(right)
    screen = np.stack([right, np.cross(view, right)])
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = normal @ view / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    seen = np.flatnonzero(facing > 0.0)
    seen = seen[np.argsort((corners[seen] @ view).mean(axis=1), kind="stable")]
    shade = colours[seen] * (0.55 + 0.45 * facing[seen, None])
    edge = shade if len(triangles) > MOST_EDGES else 0.75 * shade
    axes.add_collection(
        PolyCollection(list(corners[seen] @ screen.T), facecolors=shade, edgecolors=edge, linewidths=0.25)
    )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()


def _legend(figure: Any, marked: Mapping[str, Any]) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(color=COLOURS[role], label=NAMES[role]) for role in COLOURS if role in marked]
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _rgb(colour: str) -> Array:
    from matplotlib.colors import to_rgb

    return np.array(to_rgb(colour))
