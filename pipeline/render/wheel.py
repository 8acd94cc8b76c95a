"""The whole wheel in a pyvista plot: the sectors of a bladed disk side by side all around."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.render import ring
from pipeline.stages.joined_sectors import CUTS

if TYPE_CHECKING:
    from geometry import SectorMesh

Array = NDArray[np.float64]
VIEW = (0.62, -0.28, 0.52)  # from the middle of the wheel to the camera
MARGIN = 1.06
ENLARGED = 3.0  # motion of the wheel, which is drawn smaller than a blade


def wheel(sector: SectorMesh, motion: Callable[[int], Array], deformation: float) -> Any:
    """Surface of all sectors, moved by `deformation` times their motion, with its length as point data.

    `motion` gives the displacement (N, 3) of a sector, in its own axes, by its number.
    """
    import pyvista as pv

    faces, used = _outside(sector)
    size, points, lengths, cells = len(used), [], [], []
    pitch = 2.0 * np.pi / sector.n_blades
    for number in range(sector.n_blades):
        moved = motion(number)[used]
        points.append(ring.turned(sector.points[used] + deformation * moved, number * pitch))
        lengths.append(np.linalg.norm(moved, axis=1))
        shifted = faces + number * size
        cells.append(np.column_stack([np.full(len(faces), faces.shape[1]), shifted]))
    surface = pv.PolyData(np.concatenate(points), np.concatenate(cells).ravel())
    surface.point_data["displacement"] = np.concatenate(lengths)
    return surface


def _outside(sector: SectorMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles (t, 3) of the surface of a sector but for its cut faces, and the vertices (v,) that they number."""
    rest = ring.grid(sector, np.zeros_like(sector.points), 0.0, 0.0)
    rest.point_data["vertex"] = np.arange(len(sector.points))
    surface = ring.surface_of(rest).triangulate()
    corners = np.asarray(surface.point_data["vertex"])[surface.faces.reshape(-1, 4)[:, 1:]]
    cut = np.zeros(len(corners), dtype=bool)
    for name in CUTS:
        cut |= np.isin(corners, sector.node_sets[name]).all(axis=1)
    used, numbered = np.unique(corners[~cut], return_inverse=True)
    return numbered.reshape(-1, 3), used


def aim(plotter: Any, sector: SectorMesh) -> None:
    """Camera before the wheel and above its axis."""
    radius = float(np.hypot(sector.points[:, 1], sector.points[:, 2]).max())
    low, high = float(sector.points[:, 0].min()), float(sector.points[:, 0].max())
    middle = np.array([(low + high) / 2.0, 0.0, 0.0])
    plotter.camera_position = [middle + np.asarray(VIEW), middle, (0.0, 0.0, 1.0)]
    plotter.camera.view_angle = 15.0
    outer = MARGIN * radius
    plotter.reset_camera(bounds=[low, high, -outer, outer, -outer, outer])
    plotter.camera.zoom(1.48)
