"""The blade of a scene in 10-node tetrahedra, as an Abaqus input file of another program would hold it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from geometry.elements import ELEMENT_KINDS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from geometry import SectorMesh
    from rom import Material

SETS = {"root": "ROOT", "face_right": "RIGHT", "face_left": "LEFT", "tip_surface": "TIP"}
_PER_LINE = 16


def tetrahedra(points: NDArray[np.float64], hexahedra: NDArray[np.int64]) -> NDArray[np.int64]:
    """Corners (12 E, 4) of the tetrahedra between the centres of hexahedra and their sides.

    The centres are numbered after the points. Each side is cut from its lowest node, so neighbours agree.
    """
    centre = len(points) + np.arange(len(hexahedra))
    parts = []
    for side in ELEMENT_KINDS["hex8"].sides:
        quad = hexahedra[:, side]
        start = np.argmin(quad, axis=1)[:, None]
        turned = np.take_along_axis(quad, (start + np.arange(4)) % 4, axis=1)
        parts += [np.column_stack([turned[:, loop], centre]) for loop in ([0, 2, 1], [0, 3, 2])]
    return np.concatenate(parts)


def write_tetrahedra(file: Path, sector: SectorMesh, material: Material) -> int:
    """Write the blade in tet10 with straight edges, in m, with the sets `SETS`; the number of its nodes."""
    hexahedra = sector.hexahedra
    corners = tetrahedra(sector.points, hexahedra)
    points = np.vstack([sector.points, sector.points[hexahedra].mean(axis=1)])
    ends = np.sort(corners[:, np.array(ELEMENT_KINDS["tet10"].edges)], axis=-1).reshape(-1, 2)
    edges, place = np.unique(ends, axis=0, return_inverse=True)
    elements = np.hstack([corners, len(points) + place.reshape(len(corners), -1)])
    corner_count = len(points)
    points = np.vstack([points, points[edges].mean(axis=1)])
    with file.open("w", encoding="utf-8") as target:
        target.write("*NODE\n")
        np.savetxt(target, np.column_stack([np.arange(1, len(points) + 1), points]), "%d, %.12e, %.12e, %.12e")
        target.write("*ELEMENT, TYPE=C3D10, ELSET=BLADE\n")
        np.savetxt(target, np.column_stack([np.arange(1, len(elements) + 1), elements + 1]), "%d", delimiter=", ")
        for name, label in SETS.items():
            on = np.isin(np.arange(corner_count), sector.node_sets[name])
            nodes = np.concatenate([np.flatnonzero(on), corner_count + np.flatnonzero(on[edges].all(axis=1))]) + 1
            target.write(f"*NSET, NSET={label}\n")
            rows = (nodes[k : k + _PER_LINE] for k in range(0, len(nodes), _PER_LINE))
            target.writelines(", ".join(map(str, row)) + ",\n" for row in rows)
        target.write("*MATERIAL, NAME=SOLID\n*ELASTIC\n")
        target.write(f"{material.young_modulus!r}, {material.poisson_ratio!r}\n*DENSITY\n{material.density!r}\n")
        target.write("*SOLID SECTION, ELSET=BLADE, MATERIAL=SOLID\n")
    return len(points)
