"""Blades of the ring in a pyvista plot: meshes, edges, contact nodes, camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from geometry import SectorMesh

Array = NDArray[np.float64]
HEXAHEDRON = 12  # VTK's cell type
RIGHT_COLOUR, LEFT_COLOUR = "#D55E00", "#56B4E9"
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


def grid(sector: SectorMesh, motion: Array, deformation: float, angle: float) -> Any:
    """The deformed mesh of one blade, with the displacement relative to the largest as point data."""
    import pyvista as pv

    cells = np.column_stack([np.full(len(sector.hexahedra), 8), sector.hexahedra]).ravel()
    kinds = np.full(len(sector.hexahedra), HEXAHEDRON, dtype=np.uint8)
    points = turned(sector.points + deformation * motion, angle)
    mesh = pv.UnstructuredGrid(cells, kinds, points)
    mesh.point_data["displacement"] = np.linalg.norm(motion, axis=1)
    return mesh


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

    for face, colour in ((sector.right, RIGHT_COLOUR), (sector.left, LEFT_COLOUR)):
        radius = 0.25 * float(np.sqrt(np.min(face.area)))
        spheres = pv.PolyData(points[face.nodes]).glyph(geom=pv.Sphere(radius=radius), scale=False, orient=False)
        plotter.add_mesh(spheres, color=colour, ambient=0.3)


def add_outline(plotter: Any, sector: SectorMesh) -> None:
    """Sharp edges of the undeformed blade, as a reference for the deformation."""
    rest = grid(sector, np.zeros_like(sector.points), 0.0, 0.0)
    plotter.add_mesh(edges(rest.extract_surface(algorithm="dataset_surface")), color="#808080", line_width=1.0)


def aim_from_side(plotter: Any, sector: SectorMesh) -> None:
    """Camera at the side and above, where both the airfoil and the Z of the shroud are visible."""
    low, high = sector.points.min(axis=0), sector.points.max(axis=0)
    middle = (low + high) / 2.0
    plotter.camera_position = [middle + np.asarray(VIEW), middle, (0.0, 0.0, 1.0)]
    plotter.camera.view_angle = 15.0
    plotter.reset_camera()
    plotter.camera.zoom(0.97)


def scalar_bar(title: str, labels: str = "%.1f") -> dict[str, Any]:
    """Settings of the colour bar: title, place and number format."""
    return {
        "title": f"{title}\n",
        "color": "black",
        "vertical": False,
        "position_x": 0.2,
        "position_y": 0.03,
        "height": 0.1,
        "width": 0.6,
        "title_font_size": 20,
        "label_font_size": 18,
        "n_labels": 6,
        "fmt": labels,
    }
