"""The temperature of a mesh: uniform, linear over the radius, of a CSV file or of the mesh file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.scene.loads_section import NodalTable, temperature_table

if TYPE_CHECKING:
    from geometry.sector import SectorMesh
    from pipeline.scene.schema import Scene


def temperature_of_mesh(scene: Scene, sector: SectorMesh) -> float | NDArray[np.float64]:
    """Temperature of a scene that has one, uniform or at the points (V,) of the mesh."""
    given = scene.load.temperature
    assert given is not None
    if given.uniform is not None:
        field: Any = given.uniform
    elif given.linear is not None:
        radius = np.hypot(sector.points[:, 1], sector.points[:, 2])
        field = np.interp(radius, [radius.min(), radius.max()], given.linear)
    elif given.of_mesh:
        field = _temperature_of_file(sector)
    else:
        field = _nearest_temperature(sector, temperature_table(str(given.file), scene.contents))
    found: float | NDArray[np.float64] = given.reference + scene.load.temperature_factor * (field - given.reference)
    return found


def _temperature_of_file(sector: SectorMesh) -> NDArray[np.float64]:
    """The temperatures that a mesh file gives to all its nodes."""
    from rom.errors import RomParameterError

    given = sector.temperature
    if given is None or np.isnan(given).any():
        found = "no temperatures" if given is None else f"none at {int(np.isnan(given).sum())} of {len(given)} nodes"
        raise RomParameterError(
            "load", "temperature.of_mesh", found, "a mesh file with temperatures of all its nodes"
        )
    return given


def temperature_rise(scene: Scene, sector: SectorMesh) -> float | NDArray[np.float64] | None:
    """Temperature above the stress-free one, K, uniform or at the points (V,) of the mesh; None: no load."""
    given = scene.load.temperature
    return None if given is None else temperature_of_mesh(scene, sector) - given.reference


def _nearest_temperature(sector: SectorMesh, table: NodalTable) -> NDArray[np.float64]:
    """Temperatures at all points of the mesh: of the nearest point of the file."""
    from scipy.spatial import cKDTree

    values = np.asarray(table.values)
    given = sector.points[points_of(sector, table)] if table.positions is None else table.positions
    _, nearest = cKDTree(given).query(sector.points)
    return np.asarray(values[nearest])


def points_of(sector: SectorMesh, table: NodalTable) -> NDArray[np.int64]:
    """Rows of the points of a mesh that a table names by number."""
    from rom.errors import RomParameterError

    assert table.nodes is not None
    count = len(sector.points)
    if table.nodes.max() >= count:
        raise RomParameterError(
            "loads", "file", table.path, f"numbers of nodes from 0 to {count - 1}, as the points of mesh.vtu"
        )
    return table.nodes
