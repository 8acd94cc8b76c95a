"""Drawings for the page only: the undeformed ring, and the hysteresis loops of every curve shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.figures.data import PlottedCurve
from pipeline.figures.hysteresis import node_figure
from pipeline.figures.style import drawn, styled, subplots
from pipeline.render.ring import LEFT_DARK, RIGHT_COLOUR, VIEW, blades_of, turned
from pipeline.report.surface import Surface, outer_surface
from pipeline.stages.build_mesh import SECTOR
from pipeline.stages.model_chain import BuiltModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from geometry import SectorMesh

Array = NDArray[np.float64]
BLADE, NEIGHBOUR = np.array([0.45, 0.60, 0.74]), np.array([0.82, 0.85, 0.88])


def loops_drawing(curve: PlottedCurve, title: str) -> bytes | None:
    """Hysteresis loops of a few nodes at the peak of a curve, SVG."""
    with styled():
        figure = node_figure(curve, title)
        if figure is None:
            return None
        return drawn(figure, "svg")


def ring_drawing(model: BuiltModel, blades: int) -> bytes:
    """The undeformed blade between its neighbours with its contact nodes, PNG; needs no GL library."""
    from matplotlib.collections import PolyCollection

    from rom import load_sector, read_reduced_model

    assert model.mesh is not None
    sector = load_sector(model.mesh.parent / SECTOR)
    surface = outer_surface(sector)
    nodes = read_reduced_model(model.rom, with_basis=False).contact_position
    flat, colours, contacts = _projected(sector, surface, blades, nodes)
    with styled():
        figure, axes = subplots(size=(7.6, 5.6))
        axes.add_collection(PolyCollection(list(flat), facecolors=colours, edgecolors=colours, linewidths=0.3))
        for face in contacts:
            if face.in_view:
                axes.plot(*face.places.T, "o", color=face.colour, markersize=4, markeredgecolor="white")
            _label(axes, face, beside=-1.0 if "right" in face.name else 1.0)
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.set_axis_off()
        return drawn(figure, "png")


@dataclass(frozen=True)
class Face:
    """The contact nodes of a face on the picture, its colour and name, and whether they are in view."""

    places: Array
    colour: str
    name: str
    in_view: bool


def _label(axes: Axes, face: Face, beside: float) -> None:
    """The name of a face above the ring, on the side where the face is, with a line to its middle."""
    look = {"arrowstyle": "-", "color": face.colour, "linewidth": 1.0}
    where: dict[str, Any] = {"ha": "right" if beside < 0.0 else "left", "color": face.colour, "fontsize": 10}
    place = face.places.mean(axis=0)
    hidden = "" if face.in_view else ", behind the shroud"
    axes.annotate(
        face.name + hidden, place, (45.0 * beside, 75.0), textcoords="offset points", arrowprops=look, **where
    )


def _projected(sector: SectorMesh, surface: Surface, blades: int, nodes: Array) -> tuple[Array, Array, list[Face]]:
    """Triangles (t, 3, 2) from back to front, their colours (t, 3), and the blade's contact faces.

    `nodes` (n_c, 3): the right contact nodes; the left ones are those turned back by one pitch.
    """
    view = np.asarray(VIEW) / np.linalg.norm(VIEW)
    right = np.cross((0.0, 0.0, 1.0), view)
    right /= np.linalg.norm(right)
    screen = np.stack([right, np.cross(view, right)])
    triangles, shades = [], []
    for blade in blades_of(blades):
        corners = turned(sector.points[surface.vertices], blade * 2.0 * np.pi / sector.n_blades)[surface.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = normal @ view / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
        seen = facing > 0.0
        triangles.append(corners[seen])
        base = BLADE if blade == 0 else NEIGHBOUR
        shades.append(base * (0.55 + 0.45 * facing[seen, None]))
    corners, colours = np.concatenate(triangles), np.concatenate(shades)
    order = np.argsort((corners @ view).mean(axis=1), kind="stable")
    # both faces have the right one's frame: its normal points out of the right one and into the left one
    back = turned(nodes, -2.0 * np.pi / sector.n_blades)
    faces = (
        (sector.right, nodes, RIGHT_COLOUR, "right contact face (+y)", 1.0),
        (sector.left, back, LEFT_DARK, "left contact face (-y)", -1.0),
    )
    contacts = [
        Face(places @ screen.T, colour, name, outward * float(face.frame[:, 2].mean(axis=0) @ view) > 0.0)
        for face, places, colour, name, outward in faces
    ]
    return (corners @ screen.T)[order], colours[order], contacts
