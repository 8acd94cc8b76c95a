"""Blades of the ring and the whole wheel of a bladed disk in an offscreen window of pyvista."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.stages.model.model_files import CUTS

if TYPE_CHECKING:
    from geometry.sector import FacePair, SectorMesh


Array = NDArray[np.float64]
RIGHT_COLOUR, LEFT_COLOUR = "#D55E00", "#56B4E9"
LEFT_DARK, ROTATION_COLOUR = "#1f78b4", "#7a1fa2"  # of text: light blue is hard to read on white
_SLIM: dict[str, Any] = {"shaft_radius": 0.02, "tip_radius": 0.06, "tip_length": 0.2}
TEXT = 20  # pixels of all text of a picture
OVERLAP = 0.25  # of the pitch of the tips: most that neighbours are drawn into each other or apart
VIEW = (-0.62, -0.38, 0.68)  # from the fundamental blade to the camera
_NEIGHBOUR: dict[str, Any] = {"color": "#9aa7b5", "opacity": 0.25}
_NEIGHBOUR_EDGES: dict[str, Any] = {"color": "#708090", "line_width": 1.5}


def blades_of(count: int) -> range:
    """Numbers of `count` blades side by side around the fundamental one, 0; one more on the +y side if even."""
    first = -((count - 1) // 2)
    return range(first, first + count)


def turned(vectors: Array, angle: float) -> Array:
    """Vectors (..., 3) turned about the engine axis x by `angle` rad from z (radial) towards +y."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([x, y * cosine + z * sine, z * cosine - y * sine], axis=-1)


def drawn_length(sector: SectorMesh, phase: float, wanted: float) -> float:
    """Largest drawn displacement, m: as `wanted`, or less where neighbours would be drawn through each other."""
    pitch = 2.0 * np.pi / sector.n_blades * float(np.hypot(sector.points[:, 1], sector.points[:, 2]).max())
    apart = 2.0 * abs(np.sin(0.5 * phase))  # of neighbours, relative to the displacement
    return float(min(wanted, OVERLAP * pitch / max(apart, 1e-9)))


def grid(sector: SectorMesh, motion: Array, deformation: float, angle: float) -> Any:
    """The deformed mesh of one blade, with the displacement relative to the largest as point data."""
    import pyvista as pv

    parts = [np.column_stack([np.full(len(block), block.nodes.shape[1]), block.nodes]) for block in sector.blocks]
    cells = np.concatenate([part.ravel() for part in parts])
    kinds = np.concatenate([np.full(len(block), block.topology.cell_type, dtype=np.uint8) for block in sector.blocks])
    points = turned(sector.points + deformation * motion, angle)
    mesh = pv.UnstructuredGrid(cells, kinds, points)
    mesh.point_data["displacement"] = np.linalg.norm(motion, axis=1)
    return mesh


def surface_of(mesh: Any) -> Any:
    """The boundary of a mesh by the corners of its elements, so that edges drawn on it are those of elements."""
    return mesh.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0)


def edges(surface: Any) -> Any:
    """Sharp edges of a surface."""
    return surface.extract_feature_edges(feature_angle=40.0, boundary_edges=False, manifold_edges=False)


def add_neighbour(plotter: Any, surface: Any) -> None:
    """A neighbour of the fundamental blade, pale so that it hides nothing."""
    plotter.add_mesh(surface, **_NEIGHBOUR)
    plotter.add_mesh(edges(surface), **_NEIGHBOUR_EDGES)


def add_contacts(plotter: Any, sector: SectorMesh, points: Array) -> None:
    """Spheres on the contact nodes, sized to stay apart from each other."""
    import pyvista as pv

    pairs: list[SectorMesh | FacePair] = [sector, *sector.pairs.values()]
    faces = [(pair.right, RIGHT_COLOUR) for pair in pairs]
    faces += [(pair.left, LEFT_COLOUR) for pair in pairs if pair.kind != "ground"]  # whose left face is the right one
    for face, colour in faces:
        radius = 0.25 * float(np.sqrt(np.min(face.area)))
        spheres = pv.PolyData(points[face.nodes]).glyph(geom=pv.Sphere(radius=radius), scale=False, orient=False)
        plotter.add_mesh(spheres, color=colour, ambient=0.3)


def write(plotter: Any, text: str, at: tuple[float, float], small: float = 1.0, color: str = "black") -> None:
    """Text from its upper left corner on, as shares of a view; of one size in views of any width."""
    label = plotter.add_text(text, position=at, viewport=True, font_size=1, color=color)
    label.prop.font_size = round(TEXT * small)
    label.prop.justification_vertical = "top"


def write_heading(plotter: Any, text: str, small: float = 1.0) -> None:
    """Text at the top of a view."""
    write(plotter, text, (0.015, 0.99), small)


def name_faces(plotter: Any, sector: SectorMesh, bottom: float, small: float = 1.0) -> None:
    """Names of both contact faces in the colours of their nodes, at the left from this share of the height upwards:
    beside the faces they would lie on the neighbours."""
    if not len(sector.right.nodes):
        return
    sides = (" (-y)", " (+y)") if sector.kind == "neighbours" else ("", "")
    names = ((f"left face{sides[0]}", LEFT_DARK), (f"right face{sides[1]}", RIGHT_COLOUR))
    for line, (name, colour) in enumerate(names):
        write(plotter, name, (0.05, bottom + 0.035 * (line + 1)), small, colour)


def add_axes(plotter: Any, sector: SectorMesh, small: float = 1.0) -> None:
    """Axes x (axial), y, z (radial) beside the root; an arrow at the tip: the sense of rotation, towards +y."""
    import pyvista as pv

    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    length = 0.2 * float(high[2] - low[2])
    corner = np.array([low[0] - 0.6 * length, low[1] - 2.5 * length, low[2] + 0.6 * length])
    look: dict[str, Any] = {"shape": None, "always_visible": True, "show_points": False, "text_color": "black"}
    look |= {"font_size": round(TEXT * small), "bold": False}
    for direction, name in zip(np.eye(3), "xyz", strict=True):
        plotter.add_mesh(pv.Arrow(start=corner, direction=direction, scale=length, **_SLIM), color="#303030")
        plotter.add_point_labels([corner + 1.15 * length * direction], [name], **look)
    radius = high[2] + 0.16 * length
    angles = np.linspace(-0.9, 0.9, 25) * length / radius
    arc = np.column_stack([np.full(25, high[0] + 0.3 * length), radius * np.sin(angles), radius * np.cos(angles)])
    plotter.add_mesh(pv.lines_from_points(arc), color=ROTATION_COLOUR, line_width=3.0)
    head = arc[-1] - arc[-2]
    tip = pv.Cone(center=arc[-1], direction=head, height=0.25 * length, radius=0.08 * length)
    plotter.add_mesh(tip, color=ROTATION_COLOUR)
    plotter.add_point_labels(
        [arc[-1] + [0.0, 0.2 * length, 0.0]], ["rotation"], **look | {"text_color": ROTATION_COLOUR}
    )


def add_outline(plotter: Any, sector: SectorMesh) -> None:
    """Sharp edges of the undeformed blade, as a reference for the deformation."""
    rest = grid(sector, np.zeros_like(sector.points), 0.0, 0.0)
    plotter.add_mesh(edges(surface_of(rest)), color="#808080", line_width=1.0)


def aim_from_side(plotter: Any, sector: SectorMesh) -> None:
    """Camera at the side and above, where both the airfoil and the Z of the shroud are visible."""
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    middle = (low + high) / 2.0
    plotter.camera_position = [middle + np.asarray(VIEW), middle, (0.0, 0.0, 1.0)]
    plotter.camera.view_angle = 15.0
    plotter.reset_camera()
    plotter.camera.zoom(0.97)


def scalar_bar(title: str, labels: str = "%.1f", small: float = 1.0) -> dict[str, Any]:
    """Settings of the colour bar: title, place and number format."""
    return {
        "title": f"{title}\n",
        "color": "black",
        "vertical": False,
        "position_x": 0.05,
        "position_y": 0.03,
        "height": 0.1,
        "width": 0.55,
        "title_font_size": round(TEXT * small),
        "label_font_size": round(TEXT * small),
        "unconstrained_font_size": True,
        "n_labels": 6,
        "fmt": labels,
    }


WHEEL_VIEW = (0.8, -0.2, 0.4)  # from the middle of the wheel to the camera
WHEEL_MARGIN = 1.06
ENLARGED = 3.0  # motion of the wheel, which is drawn smaller than a blade


def wheel(sector: SectorMesh, motion: Callable[[int], Array], deformation: float) -> Any:
    """Surface of all sectors, moved by `deformation` times their motion, with this and its length as point data.

    `motion` gives the displacement (N, 3) of a sector, in its own axes, by its number. `signed`: the part of it along
    the largest displacement, whose sign changes at the nodal diameters.
    """
    import pyvista as pv

    faces, used = _outside(sector)
    size, points, vectors, own, cells = len(used), [], [], [], []
    pitch = 2.0 * np.pi / sector.n_blades
    for number in range(sector.n_blades):
        moved = motion(number)[used]
        points.append(turned(sector.points[used] + deformation * moved, number * pitch))
        vectors.append(turned(moved, number * pitch))
        own.append(moved)
        shifted = faces + number * size
        cells.append(np.column_stack([np.full(len(faces), faces.shape[1]), shifted]))
    surface = pv.PolyData(np.concatenate(points), np.concatenate(cells).ravel())
    surface.point_data["motion"] = np.concatenate(vectors)
    lengths = np.linalg.norm(surface.point_data["motion"], axis=1)
    surface.point_data["displacement"], moved = lengths, np.concatenate(own)
    surface.point_data["signed"] = moved @ moved[np.argmax(lengths)] / (lengths.max() or 1.0)
    return surface


def _outside(sector: SectorMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles (t, 3) of the surface of a sector but for its cut faces, and the vertices (v,) that they number."""
    rest = grid(sector, np.zeros_like(sector.points), 0.0, 0.0)
    rest.point_data["vertex"] = np.arange(len(sector.points))
    surface = surface_of(rest).triangulate()
    corners = np.asarray(surface.point_data["vertex"])[surface.faces.reshape(-1, 4)[:, 1:]]
    cut = np.zeros(len(corners), dtype=bool)
    for name in CUTS:
        cut |= np.isin(corners, sector.node_sets.get(name, ())).all(axis=1)
    used, numbered = np.unique(corners[~cut], return_inverse=True)
    return numbered.reshape(-1, 3), used


def aim(plotter: Any, sector: SectorMesh) -> None:
    """Camera before the wheel and above its axis."""
    radius = float(np.hypot(sector.points[:, 1], sector.points[:, 2]).max())
    low, high = float(sector.points[:, 0].min()), float(sector.points[:, 0].max())
    middle = np.array([(low + high) / 2.0, 0.0, 0.0])
    plotter.camera_position = [middle + np.asarray(WHEEL_VIEW), middle, (0.0, 0.0, 1.0)]
    plotter.camera.view_angle = 15.0
    outer = WHEEL_MARGIN * radius
    plotter.reset_camera(bounds=[low, high, -outer, outer, -outer, outer])
    plotter.camera.zoom(1.4)


class Window:
    """A window with views side by side, white and smoothed."""

    def __init__(self, size: tuple[int, int], widths: Sequence[float]) -> None:
        from pyvista import Plotter

        make: Any = Plotter  # the stubs of pyvista ask for whole numbers as proportions
        # where a picture is composed; it is empty but for the lights after each
        self.plotter = make(
            off_screen=True, window_size=list(size), shape=(1, len(widths)), col_weights=tuple(widths), border=False
        )
        self.plotter.set_background("white", all_renderers=True)
        self.plotter.enable_anti_aliasing("ssaa", all_renderers=True)
        self.plotter.suppress_rendering = True  # once it has drawn, it would draw anew at each change

    def picture(self) -> Any:
        """The picture composed, (height, width, 3) of bytes; the window is emptied for the next."""
        self.plotter.suppress_rendering = False
        self.plotter.render()
        image = self.plotter.screenshot(return_img=True)
        self.plotter.suppress_rendering = True
        self.plotter.scalar_bars.clear()
        for renderer in self.plotter.renderers:
            renderer.clear_actors()
        return image

    def close(self) -> None:
        """Free the window."""
        self.plotter.close()


def save_png(image: Any, path: Path) -> None:
    """Write a picture (height, width, 3) of bytes."""
    from PIL import Image

    Image.fromarray(image).save(path)
