"""Normals of a curved contact face: a polynomial fit of the normals of its sides."""

from __future__ import annotations

import numpy as np

from geometry.frames import contact_frames
from geometry.own_mesh.side_quadrature import SidePoints
from geometry.sector import FloatArray

_HIGHEST = 4  # degree


def face_axes(points: SidePoints) -> FloatArray:
    """Coordinates of a face, rows (2, 3): t1 and t2 at its centre."""
    normal = points.mean_normal / np.linalg.norm(points.mean_normal)
    return contact_frames(points.centroid[None], normal[None])[0, :2]


def normals_at(at: FloatArray, points: SidePoints, n_sides: int) -> FloatArray:
    """Unit normals (k, 3) at points (k, 3) of a face, by least squares over its quadrature points.

    The degree of the polynomial in the coordinates of the face grows with the number of its sides.
    """
    degree = min(_HIGHEST, int(np.sqrt(n_sides)))
    axes, centre = face_axes(points), points.centroid
    scale = np.abs((points.position - centre) @ axes.T).max()

    def basis(position: FloatArray) -> FloatArray:
        s, r = ((position - centre) @ axes.T / scale).T
        return np.stack([s**i * r**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)

    root = np.sqrt(points.area / points.area.mean())[:, None]
    mean = points.mean_normal
    fit = np.linalg.lstsq(basis(points.position) * root, (points.normal - mean) * root, rcond=1e-10)[0]
    found = mean + basis(at) @ fit
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])
