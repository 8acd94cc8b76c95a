"""Engine axis and number of blades of a mesh whose contact faces nobody has named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.frames import NAMED_AXES, axes_through
from geometry.imported_mesh import ImportedMesh
from geometry.own_mesh.body import boundary, face_sides
from geometry.own_mesh.face_pairing import axis_between
from geometry.own_mesh.pitch_pairs import fitting_number, matched_pairs
from geometry.own_mesh.side_quadrature import quadrature, side_tables

_WIDEST = 2.2  # rad: a sector of a ring of three blades or more


@dataclass(frozen=True)
class SectorRing:
    """A ring that a mesh makes, turned about an axis of its file."""

    axis: str  # engine axis in the file: "x", "y" or "z"
    n_blades: int  # number of blades with which surfaces of the mesh are one pitch apart
    pairs: int  # number of pairs of such surfaces
    axis_point: tuple[float, float, float] = (0.0, 0.0, 0.0)  # a point of the engine axis, in the unit of the file


def fitting_ring(mesh: ImportedMesh, axis: str | None = None) -> SectorRing | None:
    """The ring in which most element sides of a mesh are one pitch from another one, node by node.

    Returns the ring; None where no surfaces match under the pitch of any number of blades.
    """
    if mesh.n_elements == 0:
        return None
    outside = boundary(mesh.blocks)
    found: list[tuple[int, SectorRing]] = []
    for name in "xyz" if axis is None else (axis,):
        direction = NAMED_AXES[name]
        middle = mesh.points.mean(axis=0)
        if np.linalg.norm(np.cross(middle, direction)) <= 1e-9 * np.ptp(mesh.points):
            continue
        points = mesh.points @ axes_through(direction, middle).T
        if np.ptp(np.arctan2(points[:, 1], points[:, 2])) > _WIDEST:
            continue
        number = fitting_number(points, mesh.blocks, outside)
        if number is not None and number >= 3:
            pairs = matched_pairs(points, mesh.blocks, outside, 2.0 * np.pi / number)
            found.append((sum(len(pair.right) for pair in pairs), SectorRing(name, number, len(pairs))))
    return max(found, key=lambda each: each[0])[1] if found else None


def ring_of_faces(mesh: ImportedMesh, right: str, left: str, axis: str | None = None) -> SectorRing | None:
    """The ring in which two named faces lie opposite each other, wherever in the file its axis is.

    Returns the ring; None where no axis along x, y or z turns one face into the other.
    """
    outside = boundary(mesh.blocks)
    faces = [face_sides(mesh, "contact_right", name, outside) for name in (right, left)]
    at = [quadrature(mesh.points, side_tables(mesh.blocks, face)) for face in faces]
    for name in "xyz" if axis is None else (axis,):
        found = axis_between(at[0], at[1], NAMED_AXES[name])
        if found is not None:
            number, point = found
            size = float(np.ptp(mesh.points, axis=0).max())
            rounded = [float(f"{value:.6g}") if abs(value) > 1e-7 * size else 0.0 for value in point]
            return SectorRing(name, number, 1, (rounded[0], rounded[1], rounded[2]))
    return None
